/* See contest.h. */
#include "renderer/contest.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/cost.h"
#include "renderer/gl/clock.h"

enum {
    TILES = 12,      /* along the frame's longer side */
    TILE_TRIALS = 2, /* of two numbers of tiles */
    TILE_EVERY = 8,  /* of how many tiles one is drawn to tell the time */
    TILE_MAX = 64    /* samples along a tile's side: blocks are drawn as points (gl/blocks.h), and
                        every driver draws them this large */
};

/* Where a sample mixes overlapping colours in the wrong order it is off by 0.2 at the worst of
 * those measured (two lit shells: 0.185); a share s of such samples makes an RMSE of 0.2 sqrt(s),
 * which is as much as that of the default qualities, 0.01, from this share on. */
static const double APPROXIMATE_SHARE = 1.0 / 400;

/* Of what is left of a deadline, both paths' tiles may take this. */
static const double TILES_SHARE = 0.2;

/* Whatever is drawn, planning the other path and its first blocks take this: measured 20 to 37 ms
 * on small pictures, whose deadlines they broke. */
static const double TILES_MS = 25;

/* A time below this is taken again: other work on the machine disturbs it. */
static const double TILE_SHORT_MS = 10;

/* All that differs between two paths: enough to go back to one. */
struct stand {
    struct report report;
    struct plan plan;
    void *path_state;
    bool occluded, depth;
    uint64_t approximate;
    struct path_object *objects;
    struct scene_object *specs;
};

static void stand_free(struct stand *stand) {
    if (stand) {
        free(stand->objects);
        free(stand->specs);
    }
    free(stand);
}

/* NULL where memory ran out. */
static struct stand *stand_save(const struct contest *contest) {
    const struct picture *picture = contest->drawing->picture;
    struct stand *stand = calloc(1, sizeof *stand);
    if (!stand)
        return NULL;
    stand->objects = malloc((picture->object_count + 1) * sizeof *stand->objects);
    stand->specs = malloc((picture->object_count + 1) * sizeof *stand->specs);
    if (!stand->objects || !stand->specs) {
        stand_free(stand);
        return NULL;
    }
    stand->report = *picture->report;
    stand->plan = *contest->plan;
    stand->path_state = contest->drawing->path_state;
    stand->occluded = picture->occluded;
    stand->depth = picture->depth;
    stand->approximate = picture->approximate;
    memcpy(stand->objects, picture->objects, picture->object_count * sizeof *stand->objects);
    memcpy(stand->specs, picture->report->resolved.objects,
           picture->object_count * sizeof *stand->specs);
    return stand;
}

static void stand_restore(const struct contest *contest, const struct stand *stand) {
    struct picture *picture = contest->drawing->picture;
    *picture->report = stand->report;
    *contest->plan = stand->plan;
    contest->drawing->path_state = stand->path_state;
    picture->occluded = stand->occluded;
    picture->depth = stand->depth;
    picture->approximate = stand->approximate;
    memcpy(picture->objects, stand->objects, picture->object_count * sizeof *stand->objects);
    memcpy(picture->report->resolved.objects, stand->specs,
           picture->object_count * sizeof *stand->specs);
}

static enum status no_memory(struct error *err) {
    return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to choose a path");
}

static enum status make_ready(const struct contest *contest, struct error *err) {
    struct drawing *drawing = contest->drawing;
    const struct path *path = contest->plan->path;
    if (!path || (!contest->plan->solid && !contest->plan->media))
        return STATUS_OK;
    enum status status = contest->state_of(contest->user, path, &drawing->path_state, err);
    return status == STATUS_OK ? path->prepare(drawing->path_state, drawing->picture, err) : status;
}

/* Plans the picture for a path instead of the one that it was planned for, and makes that ready. */
static enum status take(const struct contest *contest, const struct path *path, struct error *err) {
    struct picture *picture = contest->drawing->picture;
    struct report *report = picture->report;
    struct report_work *work = &report->work;
    report->pass_count = report->left_out_count = 0;
    report->warning_count = contest->plan->warnings;
    report->warnings_left_out = 0;
    work->slices = work->segments = work->fragments = work->cycles = 0;
    work->sort_nodes = work->sort_edges = 0;
    choice_set(&report->resolved, report, path);
    enum status status =
        resolve_plan(contest->asked, contest->prepared, &picture->world, contest->may_walk,
                     contest->force, report, contest->plan, err);
    picture->occluded = contest->plan->occluded;
    picture->depth = false;
    picture->approximate = 0;
    return status == STATUS_OK ? make_ready(contest, err) : status;
}

static bool refusal(enum status status) {
    return status == STATUS_TOO_COMPLEX || status == STATUS_NOT_IMPLEMENTED;
}

/* A path's row in the report; all candidates have one. */
static struct report_candidate *row_of(struct report_choice *choice, const struct path *path) {
    size_t i = 0;
    while (strcmp(choice->among[i].path, path->name) != 0)
        i++;
    return &choice->among[i];
}

static void tell_refusal(struct report_choice *choice, const struct path *path,
                         const struct error *refused) {
    struct report_candidate *candidate = row_of(choice, path);
    candidate->able = false;
    if (refused->fault_count) /* memory may have run out for it */
        snprintf(candidate->why, sizeof candidate->why, "%s: %s", refused->faults[0].pointer,
                 refused->faults[0].message);
}

enum status contest_prepare(const struct contest *contest, struct error *err) {
    struct picture *picture = contest->drawing->picture;
    struct report *report = picture->report;
    const struct path *other =
        report->choice.by == REPORT_CHOICE_MODEL ? choice_other(report) : NULL;
    if (!other)
        return make_ready(contest, err);
    struct stand *before = stand_save(contest);
    struct error refused = {0};
    if (!before)
        return no_memory(err);
    const struct path *first = contest->plan->path;
    enum status status = make_ready(contest, &refused);
    bool refuses = refusal(status);
    double share = (double)picture->approximate /
                   ((double)picture->world.width * (double)picture->world.height);
    /* For max_error it is seen in the trials whether that matters. */
    bool wrong = share > APPROXIMATE_SHARE && !contest->asked->target.has_max_error;
    if (refuses || (status == STATUS_OK && wrong)) {
        struct report_choice *choice = &report->choice;
        stand_restore(contest, before);
        if (picture->met)
            memset(picture->met, 0, (size_t)picture->world.width * (size_t)picture->world.height);
        if (refuses)
            tell_refusal(choice, first, &refused);
        status = take(contest, other, err);
        choice->by = REPORT_CHOICE_PREPARE;
        snprintf(choice->why, sizeof choice->why,
                 refuses ? "%s is expected to be cheaper, but cannot draw the scene"
                         : "%s is expected to be cheaper, but cannot mix overlapping colours in "
                           "the right order in %.2g of the samples",
                 first->name, share);
        error_clear(&refused);
    } else {
        error_move(err, &refused);
    }
    stand_free(before);
    return status;
}

/* How long the probe's tiles take: the least of some, after one that is not counted if things may
 * have to be compiled. */
static enum status time_probe(const struct measure *measure, bool warm, double *ms,
                              struct error *err) {
    const double *background = measure->scene->image.background;
    double took = 0;
    enum status status = STATUS_OK;
    if (!warm) /* drivers compile when something is first drawn */
        status = probe_draw(measure->probe, measure->drawing, background, 1, &took, err);
    *ms = INFINITY;
    for (int n = 0; n < 3 && status == STATUS_OK && (n == 0 || *ms < TILE_SHORT_MS); n++) {
        status = probe_draw(measure->probe, measure->drawing, background, 1, &took, err);
        *ms = fmin(*ms, took);
    }
    return status;
}

/* What drawing the picture takes at the qualities that the objects hold: a time for what is drawn
 * wherever the tiles are (slabs make outlines of all large cells), and one for each tile, from a
 * share of the tiles and from a single one. */
static enum status time_tiles(const struct measure *measure, bool warm, double *ms,
                              struct error *err) {
    const struct picture *picture = measure->drawing->picture;
    const struct scene_image *image = &measure->scene->image;
    struct report_drawn drawn;
    report_keep_drawn(picture->report, &drawn);
    int k = measure->drawing->plan->k;
    int longer = image->width > image->height ? image->width : image->height;
    int shorter = image->width > image->height ? image->height : image->width;
    int side = (int)fmax(1, fmin(fmin((double)longer / TILES, (double)TILE_MAX / k), shorter));
    double eligible =
        fmax(1, (double)probe_eligible(image->width, image->height, k, side, measure->met));
    double every[2] = {fmin(TILE_EVERY, eligible), eligible}, took[2], tiles[2];
    enum status status = STATUS_OK;
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        status = probe_choose(measure->probe, image->width, image->height, k, side, measure->met,
                              NULL, every[i], err);
        tiles[i] = measure->probe->blocks.count;
        if (status == STATUS_OK)
            status = time_probe(measure, warm || i > 0, &took[i], err);
    }
    report_restore_drawn(picture->report, &drawn);
    if (status != STATUS_OK)
        return status;
    double more = tiles[0] - tiles[1];
    double each = more > 0 ? fmax(0, took[0] - took[1]) / more : 0;
    *ms = took[0] + each * (eligible - tiles[0]);
    return STATUS_OK;
}

/* Whether the other path is worth trying at `factor` times its default: what it is expected to cost
 * there to what the first costs as it stands. Leaves everything as it is. */
static enum status expected_ratio(const struct contest *contest, const struct stand *first,
                                  const struct path *other, double factor, double *ratio,
                                  struct error *err) {
    struct picture *picture = contest->drawing->picture;
    bool lights = contest->asked->light_count > 0;
    struct cost mine, theirs;
    cost_find(picture->objects, picture->object_count, &picture->world, lights, &mine);
    choice_set(&picture->report->resolved, picture->report, other);
    for (size_t i = 0; i < picture->object_count; i++)
        picture->report->resolved.objects[i].quality = contest->asked->objects[i].quality;
    enum status status = other->choose(picture->objects, picture->object_count, err);
    if (status == STATUS_OK)
        status = plan_order(picture->objects, picture->object_count, contest->may_walk, err);
    for (size_t i = 0; i < picture->object_count; i++) {
        struct path_object *object = &picture->objects[i];
        if (object->quality_free)
            object->quality =
                (int)fmax(1, fmin(other->quality_max, ceil(object->quality * factor)));
    }
    cost_find(picture->objects, picture->object_count, &picture->world, lights, &theirs);
    stand_restore(contest, first);
    *ratio = mine.ms > 0 ? theirs.ms / mine.ms : INFINITY;
    return status;
}

/* By how much the objects' qualities are finer than their path's defaults; 1 where none is free. */
static enum status factor_of(const struct contest *contest, double *factor, struct error *err) {
    struct picture *picture = contest->drawing->picture;
    int quality[SCENE_OBJECTS_MAX];
    *factor = 1;
    for (size_t i = 0; i < picture->object_count; i++)
        quality[i] = picture->objects[i].quality;
    struct scene_object *specs = picture->report->resolved.objects;
    for (size_t i = 0; i < picture->object_count; i++)
        specs[i].quality = contest->asked->objects[i].quality;
    enum status status = contest->plan->path->choose(picture->objects, picture->object_count, err);
    for (size_t i = 0; i < picture->object_count; i++) {
        struct path_object *object = &picture->objects[i];
        if (object->shell && object->quality_free && object->quality > 0)
            *factor = (double)quality[i] / object->quality;
        object->quality = quality[i];
    }
    return status;
}

/* What was found of one of the two. */
struct trial {
    size_t candidate; /* index into report->choice.among */
    double ms, error; /* NAN: not asked for */
    bool within;
};

static bool second_wins(const struct trial *a, const struct trial *b) {
    if (a->within != b->within)
        return b->within;
    return a->within ? b->ms < a->ms : b->error < a->error;
}

static void tell(struct report_choice *choice, const struct trial *won, const struct trial *lost) {
    const struct trial *both[2] = {won, lost};
    choice->by = REPORT_CHOICE_TRIALS;
    choice->chosen = won->candidate;
    for (int i = 0; i < 2; i++) {
        choice->among[both[i]->candidate].measured_ms = both[i]->ms;
        choice->among[both[i]->candidate].error = both[i]->error;
    }
    const char *winner = choice->among[won->candidate].path;
    const char *loser = choice->among[lost->candidate].path;
    if (isnan(won->error) || isnan(lost->error))
        snprintf(choice->why, sizeof choice->why, "tried: %s takes about %.3g ms, %s %.3g ms",
                 winner, won->ms, loser, lost->ms);
    else
        snprintf(choice->why, sizeof choice->why,
                 "tried: %s reaches %.2g in about %.3g ms, %s %.2g in %.3g ms", winner, won->error,
                 won->ms, loser, lost->error, lost->ms);
}

/* Tries the other path beside the first one, which `first` holds as it stands, and leaves the
 * better one in place. `aim`: chooses a quality for max_error; NULL: both are timed at what they
 * hold. */
static enum status try_other(const struct contest *contest, const struct path *other,
                             const struct stand *first, const struct aim *aim,
                             const struct measure *measure, struct error *err) {
    struct picture *picture = contest->drawing->picture;
    struct report *report = picture->report;
    struct trial a = {.candidate = report->choice.chosen, .error = NAN, .within = true}, b = a;
    if (aim && report->target.trials > 0) {
        a.error = report->target.reached;
        a.within = a.error <= report->target.asked;
    }
    uint64_t before = report->target.trials;
    enum status status = time_tiles(measure, report->target.trials > 0, &a.ms, err);
    double stage_ms[REPORT_STAGE_COUNT];
    memcpy(stage_ms, picture->clock->stage_ms, sizeof stage_ms);
    struct error refused = {0};
    uint8_t *met = picture->met; /* both are judged by the samples that the first one met */
    picture->met = NULL;
    if (status == STATUS_OK)
        status = take(contest, other, &refused);
    picture->met = met;
    stage_clock_next(picture->clock, REPORT_STAGE_choose, true);
    if (refusal(status)) {
        stand_restore(contest, first);
        tell_refusal(&report->choice, other, &refused);
        error_clear(&refused);
        return STATUS_OK;
    }
    error_move(err, &refused);
    b.candidate = report->choice.chosen;
    report->target.trials = 0;
    if (status == STATUS_OK && aim && (aim_is_free(measure) || picture->approximate > 0)) {
        status = aim_choose(aim, report, err);
        b.error = report->target.reached;
        b.within = b.error <= report->target.asked;
    }
    if (status == STATUS_OK)
        status = time_tiles(measure, report->target.trials > 0, &b.ms, err);
    if (status != STATUS_OK)
        return status;
    uint64_t of_other = report->target.trials;
    bool wins = second_wins(&a, &b);
    if (!wins) {
        stand_restore(contest, first);
        for (int i = REPORT_STAGE_upload; i <= REPORT_STAGE_sort; i++) { /* for nothing */
            picture->clock->stage_ms[REPORT_STAGE_choose] +=
                picture->clock->stage_ms[i] - stage_ms[i];
            picture->clock->stage_ms[i] = stage_ms[i];
        }
    }
    tell(&report->choice, wins ? &b : &a, wins ? &a : &b);
    report->target.trials = before + of_other + 2 * TILE_TRIALS;
    return STATUS_OK;
}

static const struct path *open_other(const struct contest *contest) {
    const struct report *report = contest->drawing->picture->report;
    return report->choice.by == REPORT_CHOICE_MODEL ? choice_other(report) : NULL;
}

bool contest_doubts(const struct contest *contest) {
    return contest->drawing->picture->approximate > 0 && open_other(contest);
}

enum status contest_error(const struct contest *contest, const struct aim *aim, struct error *err) {
    struct report *report = contest->drawing->picture->report;
    const struct path *other = open_other(contest);
    if (!other)
        return STATUS_OK;
    const struct report_choice *choice = &report->choice;
    bool approximate = contest->drawing->picture->approximate > 0;
    if (choice->among[choice->chosen].exact && !approximate &&
        !row_of(&report->choice, other)->exact)
        return STATUS_OK; /* no number of steps is as good as none */
    struct stand *first = stand_save(contest);
    if (!first)
        return no_memory(err);
    double factor = 1, ratio = 0;
    enum status status = STATUS_OK;
    bool missed = report->target.trials > 0 && report->target.reached > report->target.asked;
    if (!missed || !approximate) {
        status = factor_of(contest, &factor, err);
        if (status == STATUS_OK)
            status = expected_ratio(contest, first, other, factor, &ratio, err);
    }
    if (status == STATUS_OK && ratio < CHOICE_TIE)
        status = try_other(contest, other, first, aim, aim->measure, err);
    stand_free(first);
    return status;
}

enum status contest_deadline(const struct contest *contest, const struct measure *measure,
                             double left_ms, struct error *err) {
    struct report *report = contest->drawing->picture->report;
    const struct path *other = open_other(contest);
    if (!other)
        return STATUS_OK;
    const struct report_choice *choice = &report->choice;
    double sum = 0, least = INFINITY, most = 0;
    for (size_t i = 0; i < choice->count; i++) {
        if (!choice->among[i].able)
            continue;
        sum += choice->among[i].expected_ms;
        least = fmin(least, choice->among[i].expected_ms);
        most = fmax(most, choice->among[i].expected_ms);
    }
    if (most >= CHOICE_TIE * least || TILES_MS + sum / TILE_EVERY > TILES_SHARE * left_ms)
        return STATUS_OK;
    /* Twice as long as expected, and still in time: no number of steps is as good as none. */
    const struct report_candidate *chosen = &choice->among[choice->chosen];
    if (chosen->exact && !row_of(&report->choice, other)->exact &&
        2 * chosen->expected_ms < left_ms)
        return STATUS_OK;
    struct stand *first = stand_save(contest);
    if (!first)
        return no_memory(err);
    enum status status = try_other(contest, other, first, NULL, measure, err);
    stand_free(first);
    return status;
}
