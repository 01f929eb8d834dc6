/* See aim.h.
 *
 * Error. e(q) is the difference between the pixels at the quality q and at one at least four times
 * as fine; between two trials it is taken as a power of q, and the setting found that way is tried
 * itself before it is used. The goal is what the model error leaves, less a sixth, since few pixels
 * stand for all.
 *
 * Time. Drawing n of E blocks at q takes a + n (b + c q): three trials (one block; a share at two
 * qualities) give the three, and the whole picture takes a + E (b + c q). */
#include "renderer/aim.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
    TRIAL_EVERY = 32,       /* of how many blocks one is drawn in a trial */
    TRIAL_PIXELS_MIN = 512, /* at the least, if there are as many */
    TRIES_MAX = 12,         /* trials before what is known has to do */
    AGAIN_MAX = 2,          /* pictures that are drawn again */
    PACE_ROUNDS = 3         /* tries of what the pace gives */
};

static const double MARGIN = 5.0 / 6, ORDER_MIN = 0.5, ORDER_MAX = 2.5;

/* Trials end where an object takes more steps than any scene may ask for, or a single one. */
static const double FACTOR_MAX = 64, FACTOR_MIN = 1.0 / 64;

/* Past this many times the default a deadline buys nothing that can be seen: an error of second
 * order is a hundredth of the default's. */
static const double DEADLINE_FACTOR_MAX = 8;

static const double DEADLINE_MARGIN = 0.85;

/* Of what is left, trials may take about this. */
static const double TRIALS_SHARE = 0.2;

/* Of a target the model error is worth more than of an estimate: what it hides breaks a promise. */
static const double MODEL_MS_MIN = 60;

/* A trial that takes this long is timed once: clocks and other work on the machine disturb it by
 * tenths of a millisecond. */
static const double TRIAL_LONG_MS = 10;

static bool is_free(const struct measure *measure, size_t i) {
    const struct path_object *object = &measure->drawing->picture->objects[i];
    return object->shell && object->quality_free;
}

bool aim_is_free(const struct measure *measure) {
    for (size_t i = 0; i < measure->drawing->picture->object_count; i++)
        if (is_free(measure, i))
            return true;
    return false;
}

static const struct path *path_of(const struct measure *measure) {
    return measure->drawing->plan->path;
}

/* What the objects' own defaults are, so that factors are always on those. */
struct defaults {
    int quality[SCENE_OBJECTS_MAX];
};

static void set_factor(const struct measure *measure, const struct defaults *defaults,
                       double factor) {
    struct picture *picture = measure->drawing->picture;
    for (size_t i = 0; i < picture->object_count; i++) {
        struct path_object *object = &picture->objects[i];
        if (is_free(measure, i))
            object->quality = (int)fmin(path_of(measure)->quality_max,
                                        fmax(1, ceil(defaults->quality[i] * factor - 1e-9)));
    }
}

static bool all_at(const struct measure *measure, int quality) {
    const struct picture *picture = measure->drawing->picture;
    for (size_t i = 0; i < picture->object_count; i++)
        if (is_free(measure, i) && picture->objects[i].quality != quality)
            return false;
    return true;
}

struct trials {
    const struct aim *aim;
    struct report *report;
    struct defaults defaults;
    float (*fine)[4]; /* the pixels at fine_factor */
    double fine_factor;
    uint8_t *met_pixels;
    double trial_ms; /* of the last one */
};

static enum status try_factor(struct trials *trials, double factor, struct error *err) {
    const struct measure *measure = trials->aim->measure;
    struct picture *picture = measure->drawing->picture;
    struct report_drawn drawn;
    report_keep_drawn(picture->report, &drawn);
    set_factor(measure, &trials->defaults, factor);
    enum status status = probe_draw(measure->probe, measure->drawing,
                                    measure->scene->image.background, 1, &trials->trial_ms, err);
    report_restore_drawn(picture->report, &drawn);
    trials->report->target.trials++;
    return status;
}

/* Draws the pixels as finely as `factor` and keeps them to compare with. */
static enum status refine(struct trials *trials, double factor, struct error *err) {
    const struct probe *probe = trials->aim->measure->probe;
    enum status status = try_factor(trials, factor, err);
    if (status != STATUS_OK)
        return status;
    if (!trials->fine)
        trials->fine = malloc((probe->count + 1) * sizeof *trials->fine);
    if (!trials->fine)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for trials");
    memcpy(trials->fine, probe->pixels, probe->count * sizeof *trials->fine);
    trials->fine_factor = factor;
    return STATUS_OK;
}

/* *error: the discretisation error of the trial pixels at `factor`. */
static enum status error_at(struct trials *trials, double factor, double *error,
                            struct error *err) {
    const struct probe *probe = trials->aim->measure->probe;
    enum status status = try_factor(trials, factor, err);
    double sum = 0, count = 0;
    for (size_t n = 0; n < probe->count && status == STATUS_OK; n++) {
        double square = 0;
        for (int i = 0; i < 4; i++) {
            double difference = (double)probe->pixels[n][i] - (double)trials->fine[n][i];
            square += difference * difference / 4;
        }
        if (!trials->met_pixels[probe->index[n]] || !isfinite(square))
            continue;
        sum += square;
        count++;
    }
    double ratio = trials->fine_factor / factor;
    *error = count > 0 ? sqrt(sum / count) / (1 - pow(ratio, -1.7)) : 0;
    return status;
}

static double clamp(double x, double low, double high) {
    return fmin(fmax(x, low), high);
}

/* The factor at which a power law through (q0, e0) and (q1, e1) is `goal`. */
static double solve(double q0, double e0, double q1, double e1, double goal) {
    if (!(e0 > 0 && e1 > 0))
        return q1;
    double order = clamp(log(e0 / e1) / log(q1 / q0), ORDER_MIN, ORDER_MAX);
    return q1 * pow(e1 / goal, 1 / order);
}

/* The least factor whose error is at most `goal`; *error: what it was found to be. */
static enum status find_factor(struct trials *trials, double goal, double *factor, double *error,
                               struct error *err) {
    double q = 1, e, q_before = 0, e_before = 0;
    enum status status = error_at(trials, q, &e, err);
    /* A bracket: the goal lies between q_before and q, a factor of four apart. */
    bool down = e <= goal;
    while (status == STATUS_OK && trials->report->target.trials < TRIES_MAX &&
           (down ? e <= goal : e > goal)) {
        q_before = q;
        e_before = e;
        double next = down ? q / 4 : q * 4;
        if (next > FACTOR_MAX || next < FACTOR_MIN)
            break;
        if (next * 4 > trials->fine_factor)
            status = refine(trials, next * 4, err);
        if (status == STATUS_OK)
            status = error_at(trials, next, &e, err);
        q = next;
        if (all_at(trials->aim->measure, down ? 1 : path_of(trials->aim->measure)->quality_max))
            break;
    }
    *factor = q;
    *error = e;
    if (status != STATUS_OK || q_before == 0 || (down ? e <= goal : e > goal))
        return status; /* the end of what may be chosen */
    double good = down ? q_before : q, e_good = down ? e_before : e;
    double bad = down ? q : q_before, e_bad = down ? e : e_before;
    /* Within it, by the secant of the logarithms; twice is within some per cent. */
    for (int round = 0; round < 2 && status == STATUS_OK && good / bad > 1.1; round++) {
        q = clamp(solve(bad, e_bad, good, e_good, goal * 0.97), bad * 1.03, good);
        if (q * 1.03 >= good)
            break;
        status = error_at(trials, q, &e, err);
        if (e <= goal) {
            good = q;
            e_good = e;
        } else {
            bad = q;
            e_bad = e;
        }
    }
    *factor = good;
    *error = e_good;
    return status;
}

static enum status choose_for_error(struct trials *trials, double asked, struct error *err) {
    const struct aim *aim = trials->aim;
    struct report_target *target = &trials->report->target;
    enum status status = refine(trials, 4, err);
    if (status != STATUS_OK)
        return status;
    /* What no quality can mend. */
    struct model_error model;
    status = estimate_model(aim->measure, trials->fine, trials->met_pixels, NULL,
                            fmax(MODEL_MS_MIN, 8 * trials->trial_ms), &model, err);
    if (status != STATUS_OK)
        return status;
    double model_rmse = isnan(model.rmse) ? 0 : model.rmse, factor, error;
    target->model = model.rmse;
    bool within_reach = model_rmse < asked;
    double left = within_reach ? sqrt(asked * asked - model_rmse * model_rmse) : 0;
    /* Where the model error is nearly all that may be, or more, finer steps than a third of it are
     * wasted. */
    double goal = fmax(MARGIN * left, model_rmse / 3);
    status = find_factor(trials, goal, &factor, &error, err);
    set_factor(aim->measure, &trials->defaults, factor);
    target->reached = hypot(error, model_rmse);
    snprintf(target->why, sizeof target->why,
             within_reach ? "%.3g times the default %s: discretisation about %.2g, model %.2g"
                          : "%.3g times the default %s: discretisation about %.2g; the path's "
                            "own model error, %.2g, is more than was asked",
             factor, path_of(aim->measure)->quality_name, error, model_rmse);
    return status;
}

/* Time, as trials tell it. Drawing n blocks at the factor q takes fixed + n (each + slope (q -
 * low)).
 */
struct pace {
    double low, fixed, each, slope;
    double eligible; /* blocks of the whole picture, in blocks of a trial */
};

static double pace_ms(const struct pace *pace, double q) {
    return pace->fixed + pace->eligible * (pace->each + pace->slope * (q - pace->low));
}

/* Whether a trial costs as much as the picture: cells whose shaders write depth, or discard, are
 * shaded before the mask is looked at. */
static bool trials_cost_all(const struct picture *picture) {
    for (size_t i = 0; i < picture->object_count; i++) {
        const struct path_object *object = &picture->objects[i];
        if (object->shell && volume_has_solid(object->volume) &&
            (!object->walk || object->solid_cells))
            return true;
    }
    return false;
}

/* How long the trial pixels take at `factor`: the median of three; one, where it is long enough for
 * noise not to matter, or where three would take more than `most_ms`. */
static enum status time_of(struct trials *trials, double factor, double most_ms, double *ms,
                           struct error *err) {
    double took[3];
    for (int n = 0; n < 3; n++) {
        enum status status = try_factor(trials, factor, err);
        took[n] = *ms = trials->trial_ms;
        if (status != STATUS_OK || took[n] > TRIAL_LONG_MS || 3 * took[n] > most_ms)
            return status;
    }
    *ms = fmax(fmin(took[0], took[1]), fmin(fmax(took[0], took[1]), took[2]));
    return STATUS_OK;
}

/* The trials that tell the pace. */
static enum status find_pace(struct trials *trials, double every, struct pace *pace,
                             struct error *err) {
    const struct measure *measure = trials->aim->measure;
    const struct scene_image *image = &measure->scene->image;
    struct probe *probe = measure->probe;
    int k = measure->drawing->plan->k;
    double low = 0.25, high = 1, low_ms = 0, high_ms = 0, fixed = 0;
    double most_ms = TRIALS_SHARE * trials->aim->left_ms / 4;
    double blocks = probe->blocks.count;
    double eligible = (double)probe_eligible(image->width, image->height, k, 0, measure->met);
    *pace = (struct pace){.low = low, .eligible = 1};
    /* The first trial of a process pays for compiling. */
    enum status status = try_factor(trials, low, err);
    if (status == STATUS_OK)
        status = time_of(trials, low, most_ms, &low_ms, err);
    bool dear = low_ms > most_ms;
    if (status == STATUS_OK && !dear)
        status = time_of(trials, high, most_ms, &high_ms, err);
    if (status != STATUS_OK)
        return status;
    if (trials_cost_all(measure->drawing->picture)) {
        pace->each = low_ms;
        pace->slope = dear ? low_ms : fmax(0.25 * high_ms, high_ms - low_ms) / (high - low);
        return STATUS_OK;
    }
    pace->eligible = eligible;
    if (!dear)
        status = probe_choose(probe, image->width, image->height, k, 0, measure->met, NULL,
                              fmax(eligible, 1), err);
    if (status == STATUS_OK && !dear)
        status = time_of(trials, low, most_ms, &fixed, err);
    fixed = fmin(fixed, low_ms);
    double more = fmax(1, blocks - (dear ? 0 : probe->blocks.count));
    pace->fixed = fixed;
    pace->each = fmax(0, low_ms - fixed) / more;
    /* Whatever noise says, steps take time: at the default a quarter of what is not fixed, or more.
     */
    pace->slope = fmax(high_ms - low_ms, 0.25 * fmax(0, high_ms - fixed)) / (more * (high - low));
    if (dear)
        pace->slope = pace->each / low;
    return status == STATUS_OK && !dear ? probe_choose(probe, image->width, image->height, k, 0,
                                                       measure->met, NULL, every, err)
                                        : status;
}

static enum status choose_for_time(struct trials *trials, double every, struct error *err) {
    const struct aim *aim = trials->aim;
    const struct measure *measure = aim->measure;
    struct pace pace;
    double began = clock_now_ms(), left = 0, q = FACTOR_MIN;
    enum status status = find_pace(trials, every, &pace, err);
    /* A line through two trials is too cheap far beyond them, where rays end late and no segment
     * has but one step: what it gives is tried itself, as long as that is a small part of what is
     * left.
     */
    for (int round = 0; status == STATUS_OK && round < PACE_ROUNDS; round++) {
        double spent = clock_now_ms() - began;
        left = DEADLINE_MARGIN * (aim->left_ms - spent);
        double base = pace.fixed + pace.eligible * pace.each;
        q = pace.slope > 0 ? pace.low + (left - base) / (pace.eligible * pace.slope)
                           : DEADLINE_FACTOR_MAX;
        q = left <= pace.fixed ? FACTOR_MIN : clamp(q, FACTOR_MIN, DEADLINE_FACTOR_MAX);
        double blocks =
            trials_cost_all(measure->drawing->picture) ? 1 : measure->probe->blocks.count;
        double trial = pace.fixed + blocks * (pace.each + pace.slope * (q - pace.low));
        if (q <= 1 || round == PACE_ROUNDS - 1 || trial > TRIALS_SHARE * left)
            break;
        status = try_factor(trials, q, err);
        double found = fmax(0, trials->trial_ms - pace.fixed) / fmax(blocks, 1);
        double slope = (found - pace.each) / (q - pace.low);
        if (slope <= pace.slope * 1.03)
            break;
        pace.slope = slope;
    }
    if (status != STATUS_OK)
        return status;
    set_factor(measure, &trials->defaults, q);
    double expected = pace_ms(&pace, q);
    snprintf(trials->report->target.why, sizeof trials->report->target.why,
             expected <= aim->left_ms
                 ? "%.3g times the default %s: drawing was expected to take %.0f ms of %.0f"
                 : "%.3g times the default %s, the least there are: drawing was expected to "
                   "take %.0f ms, and %.0f were left",
             q, path_of(measure)->quality_name, fmax(expected, 0), fmax(left, 0));
    return STATUS_OK;
}

enum status aim_choose(const struct aim *aim, struct report *report, struct error *err) {
    const struct measure *measure = aim->measure;
    const struct scene *scene = measure->scene;
    const struct scene_image *image = &scene->image;
    struct picture *picture = measure->drawing->picture;
    int k = measure->drawing->plan->k;
    struct trials trials = {.aim = aim, .report = report};
    for (size_t i = 0; i < picture->object_count; i++)
        trials.defaults.quality[i] = picture->objects[i].quality;
    trials.met_pixels = measure_met_pixels(measure->met, image->width, image->height, k);
    if (!trials.met_pixels)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for trials");
    int side = probe_block_side(image->width, image->height, k);
    double eligible =
        (double)probe_eligible(image->width, image->height, k, side, measure->met) * side * side;
    double every = clamp(eligible / TRIAL_PIXELS_MIN, 1, TRIAL_EVERY);
    enum status status = probe_choose(measure->probe, image->width, image->height, k, side,
                                      measure->met, NULL, every, err);
    if (status == STATUS_OK)
        status = scene->target.has_max_error
                     ? choose_for_error(&trials, scene->target.max_error, err)
                     : choose_for_time(&trials, every, err);
    free(trials.fine);
    free(trials.met_pixels);
    return status;
}

bool aim_again(const struct aim *aim, struct report *report) {
    struct report_target *target = &report->target;
    const struct report_error *error = &report->error;
    const struct path *path = path_of(aim->measure);
    double model = isnan(error->model) ? target->model : error->model;
    model = isnan(model) ? 0 : model;
    /* With what the pixels not looked at may add. */
    target->reached =
        isnan(error->rmse)
            ? hypot(model, error->discretisation + 2 * error->discretisation_standard_error)
            : error->rmse + 2 * error->rmse_standard_error;
    target->met = target->reached <= target->asked;
    struct picture *picture = aim->measure->drawing->picture;
    if (target->met || model >= target->asked || !aim_is_free(aim->measure) ||
        all_at(aim->measure, path->quality_max) || target->redrawn == AGAIN_MAX)
        return false;
    double left = sqrt(target->asked * target->asked - model * model);
    /* By the least order there may be: one picture more is dearer than a few samples. */
    double factor = clamp(error->discretisation / (MARGIN * left), 1.1, 4);
    for (size_t i = 0; i < picture->object_count; i++)
        if (is_free(aim->measure, i))
            picture->objects[i].quality =
                (int)fmin(path->quality_max, ceil(picture->objects[i].quality * factor));
    target->redrawn++;
    return true;
}
