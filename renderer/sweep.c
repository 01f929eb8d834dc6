/* See sweep.h. The stages of a sweep, in order:
 *
 *   prepare     the reference is opened, which frames the camera for all; copies of the scene
 *   rounds      the first drawings, kept as pictures; then the repeats, which are timed
 *   reference   all pixels or a sample
 *   judge       point by point, and the limit of each series, one at a time
 *   conclude    order of convergence, Pareto front */
#include "renderer/sweep.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/clock.h"
#include "renderer/measure.h"
#include "renderer/truth.h"

enum { LIMIT_FACTOR = 4, TRIAL_PIXELS = 1024 };

/* What rounding leaves of a difference between two pictures: 2^-26 for each step across the
 * thickness of the finer one. Sums in fp32 were measured to be off by 1.2e-5 after 4,500 layers,
 * 2^-28.5 a layer. A line through points below would fit noise. */
static const double ROUNDING_PER_STEP = 1.0 / (1 << 26);

static const struct error_figures unknown = {
    .rmse = NAN, .rmse_standard_error = NAN, .max_abs = NAN, .p99 = NAN};

struct work {
    struct renderer *renderer;
    const struct asset_source *assets;
    const struct sweep_options *options;
    struct sweep *sweep;
    struct scene scene;           /* what all series draw but for path and quality */
    struct scene_object *objects; /* one series' own */
    struct scene truth_scene;     /* what the reference draws */
    struct truth_source *truth;
    double **times; /* of each point: totals, then draws, then each stage, `repeats` of each */
    size_t point_count;
};

/* ---- prepare ---- */

static enum status out_of_memory(struct error *err) {
    return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the sweep");
}

static enum status make_series(struct work *work, const struct sweep_row *row, struct error *err) {
    const struct sweep_options *options = work->options;
    struct sweep_series *series = &work->sweep->series[work->sweep->series_count++];
    series->row = row;
    series->model = unknown;
    series->fit = (struct sweep_fit){
        .order = NAN, .constant = NAN, .standard_error = NAN, .finest_order = NAN, .floor = NAN};
    series->point_count = options->quality_count ? options->quality_count : SWEEP_LADDER_DEFAULT;
    series->points = calloc(series->point_count, sizeof *series->points);
    if (!series->points)
        return out_of_memory(err);
    for (size_t i = 0; i < series->point_count; i++) {
        series->points[i].quality = options->quality_count ? options->qualities[i] : row->ladder[i];
        series->points[i].discretisation = unknown;
    }
    if (!sweep_row_concerns(row, &work->scene))
        snprintf(series->refused, sizeof series->refused, "%s",
                 row->shadow && !sweep_casts(&work->scene) ? "/lights: none throws a shadow"
                 : row->kind == SCENE_OBJECT_SKELETON      ? "/objects: none is a skeleton"
                                                           : "/objects: none is a shell");
    else
        work->point_count += series->point_count;
    return STATUS_OK;
}

static enum status prepare(struct work *work, const struct scene *scene, struct error *err) {
    struct sweep *sweep = work->sweep;
    work->scene = *scene;
    work->scene.target = (struct scene_target){0};
    work->scene.error_mode = SCENE_ERROR_NONE;
    sweep->width = scene->image.width;
    sweep->height = scene->image.height;
    sweep->repeats = work->options->repeats ? work->options->repeats : SWEEP_REPEATS;
    memcpy(sweep->background, scene->image.background, sizeof sweep->background);
    size_t rows = 0;
    while (sweep_rows[rows].name)
        rows++;
    sweep->series = calloc(rows, sizeof *sweep->series);
    work->objects = calloc(scene->object_count + 1, sizeof *work->objects);
    if (!sweep->series || !work->objects)
        return out_of_memory(err);
    for (const struct sweep_row *row = sweep_rows; row->name; row++) {
        /* Of shadows and filters nobody speaks unless there are some, or they are asked for. */
        bool silent = !work->options->series_count && ((row->shadow && !sweep_casts(scene)) ||
                                                       (row->filter && !sweep_filters(scene)));
        enum status status =
            sweep_wants(work->options, row) && !silent ? make_series(work, row, err) : STATUS_OK;
        if (status != STATUS_OK)
            return status;
    }
    if (work->point_count == 0)
        return error_fault(err, STATUS_INVALID_SCENE, "/objects",
                           "nothing to sweep: no object is of the kind that these series draw");
    size_t pixels = (size_t)sweep->width * (size_t)sweep->height;
    if (pixels * work->point_count > SWEEP_PIXELS_MAX)
        return error_fault(err, STATUS_TOO_COMPLEX, "/image",
                           "%zu pictures of %d x %d pixels: a sweep keeps at most %d pixels",
                           work->point_count, sweep->width, sweep->height, SWEEP_PIXELS_MAX);
    size_t numbers = (size_t)sweep->repeats * (2 + REPORT_STAGE_COUNT);
    work->times = calloc(work->point_count, sizeof *work->times);
    if (!work->times)
        return out_of_memory(err);
    for (size_t i = 0; i < work->point_count; i++)
        if (!(work->times[i] = calloc(numbers, sizeof **work->times)))
            return out_of_memory(err);
    work->truth_scene = *scene;
    for (size_t s = 0; s < sweep->series_count; s++)
        if (sweep->series[s].row->filter && !*sweep->series[s].refused &&
            work->truth_scene.image.samples < MEASURE_SAMPLES)
            work->truth_scene.image.samples = MEASURE_SAMPLES;
    sweep->reference_samples = work->truth_scene.image.samples;
    enum status status = truth_create(&work->truth_scene, work->assets, &work->truth, err);
    if (status != STATUS_OK)
        return status;
    work->scene.camera = *truth_camera(work->truth);
    sweep->scene = scene_write(&work->scene);
    return sweep->scene ? STATUS_OK : out_of_memory(err);
}

/* ---- rounds ---- */

static bool is_cancelled(const struct work *work) {
    return work->options->cancel && atomic_load(work->options->cancel);
}

static void tell(const struct work *work, size_t done, size_t total, const char *what) {
    if (work->options->progress)
        work->options->progress(work->options->user, done, total, what);
}

/* A refusal is what the scene or the version is at fault for: it concerns one series or point. */
static bool is_refusal(enum status status) {
    return status == STATUS_NOT_IMPLEMENTED || status == STATUS_TOO_COMPLEX ||
           status == STATUS_INVALID_SCENE;
}

static void keep_reason(const struct error *refusal, char reason[SWEEP_REASON_BYTES]) {
    const struct fault *fault = refusal->fault_count ? refusal->faults : NULL;
    bool pointer = fault && fault->pointer && *fault->pointer;
    snprintf(reason, SWEEP_REASON_BYTES, "%s%s%s", pointer ? fault->pointer : "",
             pointer ? ": " : "",
             fault && fault->message ? fault->message : status_title(refusal->status));
}

static void keep_warnings(struct sweep *sweep, const struct report *from, size_t from_first) {
    struct report *to = &sweep->report;
    for (size_t i = from_first; i < from->warning_count; i++) {
        const struct report_warning *warning = &from->warnings[i];
        bool known = false;
        for (size_t k = 0; k < to->warning_count && !known; k++)
            known = strcmp(to->warnings[k].code, warning->code) == 0 &&
                    strcmp(to->warnings[k].pointer, warning->pointer) == 0 &&
                    to->warnings[k].count == warning->count;
        if (!known)
            report_warn(to, warning->code, warning->pointer, warning->count, warning->first, "%s",
                        warning->message);
    }
}

/* Keeps what drew the picture, and the warnings of all. */
static void keep_report(struct sweep *sweep, const struct report *report) {
    struct report *kept = &sweep->report;
    struct report_warning warnings[REPORT_WARNINGS_MAX];
    size_t count = kept->warning_count;
    uint64_t left_out = kept->warnings_left_out;
    memcpy(warnings, kept->warnings, sizeof warnings);
    *kept = *report;
    kept->resolved = (struct scene){0};
    memcpy(kept->warnings, warnings, sizeof warnings);
    kept->warning_count = count;
    kept->warnings_left_out = left_out;
    keep_warnings(sweep, report, 0);
}

/* Draws one picture of a series. A refusal is put into `refused` and is no failure. */
static enum status draw(struct work *work, const struct sweep_row *row, int quality,
                        struct render_result *result, char refused[SWEEP_REASON_BYTES],
                        struct error *err) {
    if (is_cancelled(work))
        return error_fault(err, STATUS_CANCELLED, NULL, "the sweep was cancelled");
    struct scene scene = work->scene;
    memcpy(work->objects, scene.objects, scene.object_count * sizeof *work->objects);
    scene.objects = work->objects;
    sweep_row_apply(row, quality, scene.objects, scene.object_count);
    if (row->shadow)
        scene.shadow.size = quality;
    struct error found = {0};
    enum status status = scene_check_implemented(&scene, &found);
    if (status == STATUS_OK)
        status = renderer_render(work->renderer, &scene, work->assets, result, &found);
    if (is_refusal(status)) {
        *result = (struct render_result){0};
        keep_reason(&found, refused);
        error_clear(&found);
        return STATUS_OK;
    }
    error_move(err, &found);
    return status;
}

static enum status first_drawing(struct work *work, struct sweep_series *series,
                                 struct sweep_point *point, struct error *err) {
    struct render_result result;
    enum status status = draw(work, series->row, point->quality, &result, point->refused, err);
    if (status != STATUS_OK || *point->refused)
        return status;
    point->cold_ms = result.report.total_ms;
    point->cold = result.report.cold;
    point->work = result.report.work;
    point->pixels = result.pixels;
    result.pixels = NULL;
    keep_report(work->sweep, &result.report);
    render_result_finish(&result);
    return STATUS_OK;
}

static enum status timed_drawing(struct work *work, struct sweep_series *series,
                                 struct sweep_point *point, double *times, int repeat,
                                 struct error *err) {
    struct render_result result;
    char refused[SWEEP_REASON_BYTES] = "";
    enum status status = draw(work, series->row, point->quality, &result, refused, err);
    if (status != STATUS_OK)
        return status;
    if (*refused)
        return error_fault(err, STATUS_INTERNAL, NULL, "drawn at first, then refused: %s", refused);
    int repeats = work->sweep->repeats;
    times[repeat] = result.report.total_ms;
    times[repeats + repeat] = result.report.stage_ms[REPORT_STAGE_draw];
    for (int stage = 0; stage < REPORT_STAGE_COUNT; stage++)
        times[(2 + stage) * repeats + repeat] = result.report.stage_ms[stage];
    render_result_finish(&result);
    return STATUS_OK;
}

static void summarise(const struct work *work, struct sweep_point *point, double *times) {
    size_t repeats = (size_t)work->sweep->repeats;
    point->total_ms = sweep_spread(times, repeats);
    point->draw_ms = sweep_spread(times + repeats, repeats);
    for (size_t stage = 0; stage < REPORT_STAGE_COUNT; stage++)
        point->stage_ms[stage] = sweep_spread(times + (2 + stage) * repeats, repeats).median;
}

/* The n-th point of all, and its series. */
static struct sweep_point *point_at(const struct sweep *sweep, size_t n,
                                    struct sweep_series **series) {
    for (size_t s = 0; s < sweep->series_count; s++) {
        *series = &sweep->series[s];
        size_t count = *(*series)->refused ? 0 : (*series)->point_count;
        if (n < count)
            return &(*series)->points[n];
        n -= count;
    }
    assert(!"past the last point");
    return NULL;
}

static enum status run_rounds(struct work *work, struct error *err) {
    struct sweep *sweep = work->sweep;
    size_t total = work->point_count * (size_t)(1 + sweep->repeats), done = 0;
    struct sweep_series *series;
    for (int round = 0; round <= sweep->repeats; round++)
        for (size_t n = 0; n < work->point_count; n++) {
            size_t at = round % 2 ? work->point_count - 1 - n : n;
            struct sweep_point *point = point_at(sweep, at, &series);
            enum status status = STATUS_OK;
            if (round == 0)
                status = first_drawing(work, series, point, err);
            else if (!*point->refused)
                status = timed_drawing(work, series, point, work->times[at], round - 1, err);
            if (status != STATUS_OK)
                return status;
            tell(work, ++done, total, round ? "draw, timed" : "draw, first");
        }
    struct error refusals = {0};
    size_t drawn = 0;
    for (size_t n = 0; n < work->point_count; n++) {
        struct sweep_point *point = point_at(sweep, n, &series);
        if (*point->refused)
            error_fault(&refusals, STATUS_NOT_IMPLEMENTED, "/objects", "%s at %d: %s",
                        series->row->name, point->quality, point->refused);
        else
            summarise(work, point, work->times[n]);
        drawn += !*point->refused;
    }
    if (drawn == 0) {
        error_move(err, &refusals);
        return STATUS_NOT_IMPLEMENTED;
    }
    error_clear(&refusals); /* told in the sweep itself */
    for (size_t s = 0; s < sweep->series_count; s++) {
        series = &sweep->series[s];
        bool some = false;
        for (size_t i = 0; i < series->point_count; i++)
            some |= !*series->points[i].refused;
        if (!some)
            snprintf(series->refused, sizeof series->refused, "%s", series->points[0].refused);
    }
    return STATUS_OK;
}

/* ---- the reference ---- */

struct reference_progress {
    const struct work *work;
    char what[128];
};

static void reference_progress(void *user, size_t done, size_t total) {
    const struct reference_progress *progress = user;
    tell(progress->work, done, total, progress->what);
}

static enum status draw_reference(struct work *work, size_t count, const char *what,
                                  struct truth *truth, double *seconds, struct error *err) {
    struct sweep *sweep = work->sweep;
    size_t all = (size_t)sweep->width * (size_t)sweep->height;
    struct reference_progress progress = {.work = work};
    snprintf(progress.what, sizeof progress.what, "%s", what);
    free(sweep->pixels);
    sweep->pixels = NULL;
    if (count < all) {
        sweep->pixels = malloc(count * sizeof *sweep->pixels);
        if (!sweep->pixels)
            return out_of_memory(err);
        sweep_stratify(sweep->width, sweep->height, count, sweep->pixels);
    }
    struct reference_request request = {.pixels = sweep->pixels,
                                        .pixel_count = count,
                                        .threads = work->options->threads,
                                        .progress = reference_progress,
                                        .user = &progress,
                                        .cancel = work->options->cancel};
    double began = clock_now_ms();
    tell(work, 0, count, what);
    enum status status = truth_draw_pixels(work->truth, &request, truth, err);
    *seconds = (clock_now_ms() - began) / 1000;
    return status;
}

static enum status run_reference(struct work *work, struct error *err) {
    const struct sweep_options *options = work->options;
    struct sweep *sweep = work->sweep;
    size_t all = (size_t)sweep->width * (size_t)sweep->height, count = all;
    struct truth truth;
    enum status status;
    char what[128] = "reference, all pixels";
    if (options->pixels == SWEEP_PIXELS_SOME && options->pixel_count < all) {
        count = options->pixel_count;
        snprintf(what, sizeof what, "reference, a sample");
    } else if (options->pixels == SWEEP_PIXELS_AUTO && all > SWEEP_SAMPLE_PIXELS) {
        double limit = options->reference_s > 0 ? options->reference_s : SWEEP_REFERENCE_S, spent;
        status = draw_reference(work, TRIAL_PIXELS, "reference, what a pixel takes", &truth, &spent,
                                err);
        if (status != STATUS_OK)
            return status;
        truth_finish(&truth);
        double expected = spent * (double)all / TRIAL_PIXELS;
        if (expected > limit) {
            count = SWEEP_SAMPLE_PIXELS;
            snprintf(what, sizeof what, "reference, a sample (all would take about %.3g s)",
                     expected);
        } else {
            snprintf(what, sizeof what, "reference, all pixels (about %.3g s)", expected);
        }
    }
    status = draw_reference(work, count, what, &truth, &sweep->reference_s, err);
    if (status != STATUS_OK)
        return status;
    sweep->reference_count = truth.count;
    sweep->reference = truth.pixels;
    sweep->touched = truth.touched;
    if (truth.unresolved)
        report_warn(&sweep->report, "reference-unresolved", "", truth.unresolved, 0,
                    "intervals of the reference missed its tolerance of 1e-8");
    if (truth.folded)
        report_warn(&sweep->report, "reference-folds", "", truth.folded, 0,
                    "prisms fold over; the reference draws each of their sheets");
    return STATUS_OK;
}

/* ---- judge ---- */

/* The pixels that the reference drew, of a whole picture: the picture itself, or a copy in
 * `gathered`. */
static const float *gather(const struct sweep *sweep, const float *picture, float *gathered) {
    if (!sweep->pixels)
        return picture;
    for (size_t n = 0; n < sweep->reference_count; n++)
        memcpy(gathered + 4 * n, picture + 4 * (size_t)sweep->pixels[n], 4 * sizeof *gathered);
    return gathered;
}

static enum status judge_point(const struct sweep *sweep, struct sweep_point *point, float *buffer,
                               struct error *err) {
    if (sweep->pixels)
        return error_compare_pixels(gather(sweep, point->pixels, buffer), sweep->reference,
                                    sweep->reference_count, sweep->touched, sweep->background,
                                    &point->error, err);
    point->flip = malloc(sweep->reference_count * sizeof *point->flip);
    if (!point->flip)
        return out_of_memory(err);
    return error_compare(point->pixels, sweep->reference, sweep->width, sweep->height,
                         sweep->touched, sweep->background, point->flip, &point->error, err);
}

static enum status judge_by_limit(struct work *work, struct sweep_series *series, float *buffers[2],
                                  struct error *err) {
    const struct sweep *sweep = work->sweep;
    int highest = series->points[series->point_count - 1].quality,
        most = sweep_row_max(series->row);
    int quality = highest > most / LIMIT_FACTOR ? most : LIMIT_FACTOR * highest;
    char refused[SWEEP_REASON_BYTES] = "";
    struct render_result limit;
    struct error_metrics metrics;
    enum status status = draw(work, series->row, quality, &limit, refused, err);
    if (status != STATUS_OK)
        return status;
    if (*refused) {
        report_warn(&work->sweep->report, "no-limit", "", (uint64_t)quality, 0,
                    "%s: its limit cannot be drawn, so model and discretisation are not known: %s",
                    series->row->name, refused);
        return STATUS_OK;
    }
    series->limit_quality = quality;
    const float *at_limit = gather(sweep, limit.pixels, buffers[0]);
    status = error_compare_pixels(at_limit, sweep->reference, sweep->reference_count,
                                  sweep->touched, sweep->background, &metrics, err);
    series->model = metrics.touched;
    for (size_t i = 0; i < series->point_count && status == STATUS_OK; i++) {
        struct sweep_point *point = &series->points[i];
        if (*point->refused || point->quality > quality / 2)
            continue;
        status = error_compare_pixels(gather(sweep, point->pixels, buffers[1]), at_limit,
                                      sweep->reference_count, sweep->touched, sweep->background,
                                      &metrics, err);
        point->discretisation = metrics.touched;
    }
    render_result_finish(&limit);
    return status;
}

static enum status judge(struct work *work, struct error *err) {
    struct sweep *sweep = work->sweep;
    size_t floats = sweep->pixels ? 4 * sweep->reference_count : 1;
    float *buffers[2] = {malloc(floats * sizeof(float)), malloc(floats * sizeof(float))};
    enum status status = buffers[0] && buffers[1] ? STATUS_OK : out_of_memory(err);
    for (size_t s = 0; s < sweep->series_count && status == STATUS_OK; s++) {
        struct sweep_series *series = &sweep->series[s];
        for (size_t i = 0; i < series->point_count && status == STATUS_OK; i++)
            if (series->points[i].pixels)
                status = judge_point(sweep, &series->points[i], buffers[0], err);
        if (status == STATUS_OK && !*series->refused)
            status = judge_by_limit(work, series, buffers, err);
        tell(work, s + 1, sweep->series_count, "compare, with each limit");
    }
    free(buffers[0]);
    free(buffers[1]);
    return status;
}

/* ---- conclude ---- */

static void conclude_series(struct sweep_series *series) {
    double quality[SWEEP_QUALITIES_MAX], error[SWEEP_QUALITIES_MAX];
    for (size_t i = 0; i < series->point_count; i++) {
        quality[i] = series->points[i].quality;
        error[i] = series->points[i].discretisation.rmse;
    }
    sweep_fit(quality, error, series->point_count, series->limit_quality,
              series->limit_quality * ROUNDING_PER_STEP, &series->fit);
}

static enum status conclude(struct work *work, struct error *err) {
    size_t count = work->point_count;
    double *times = malloc(count * sizeof *times), *errors = malloc(count * sizeof *errors);
    bool *front = malloc(count * sizeof *front);
    enum status status = times && errors && front ? STATUS_OK : out_of_memory(err);
    size_t drawn = 0;
    double tolerance = 0;
    for (size_t s = 0; s < work->sweep->series_count; s++)
        tolerance = fmax(tolerance, work->sweep->series[s].limit_quality * ROUNDING_PER_STEP);
    for (int pass = 0; pass < 2 && status == STATUS_OK; pass++) {
        drawn = 0;
        for (size_t s = 0; s < work->sweep->series_count; s++)
            for (size_t i = 0; i < work->sweep->series[s].point_count; i++) {
                struct sweep_point *point = &work->sweep->series[s].points[i];
                if (!point->pixels)
                    continue;
                times[drawn] = point->total_ms.median;
                errors[drawn] = point->error.touched.rmse;
                if (pass)
                    point->front = front[drawn];
                drawn++;
            }
        if (pass == 0)
            sweep_pareto(times, errors, drawn, tolerance, front);
    }
    for (size_t s = 0; s < work->sweep->series_count; s++)
        if (work->sweep->series[s].limit_quality)
            conclude_series(&work->sweep->series[s]);
    free(times);
    free(errors);
    free(front);
    return status;
}

/* ---- all ---- */

enum status sweep_run(struct renderer *renderer, const struct scene *scene,
                      const struct asset_source *assets, const struct sweep_options *options,
                      struct sweep **out, struct error *err) {
    *out = NULL;
    enum status status = sweep_check(options, err);
    if (status != STATUS_OK)
        return status;
    struct work work = {.renderer = renderer, .assets = assets, .options = options};
    work.sweep = calloc(1, sizeof *work.sweep);
    if (!work.sweep)
        return out_of_memory(err);
    status = prepare(&work, scene, err);
    if (status == STATUS_OK)
        status = run_rounds(&work, err);
    if (status == STATUS_OK)
        status = run_reference(&work, err);
    if (status == STATUS_OK)
        status = judge(&work, err);
    if (status == STATUS_OK)
        status = conclude(&work, err);
    for (size_t i = 0; work.times && i < work.point_count; i++)
        free(work.times[i]);
    free(work.times);
    free(work.objects);
    truth_destroy(work.truth);
    if (status == STATUS_OK)
        *out = work.sweep;
    else
        sweep_destroy(work.sweep);
    return status;
}

void sweep_destroy(struct sweep *sweep) {
    if (!sweep)
        return;
    for (size_t s = 0; s < sweep->series_count; s++) {
        for (size_t i = 0; i < sweep->series[s].point_count && sweep->series[s].points; i++) {
            free(sweep->series[s].points[i].pixels);
            free(sweep->series[s].points[i].flip);
        }
        free(sweep->series[s].points);
    }
    free(sweep->series);
    free(sweep->scene);
    free(sweep->pixels);
    free(sweep->reference);
    free(sweep->touched);
    free(sweep);
}
