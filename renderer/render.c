/* The facade: a scene goes through its stages in order, and every stage's time is told.
 *
 *   assets    meshes, shells, voxels          renderer/prepare.c
 *   bake      gradients                       renderer/bake
 *   upload    textures, buffers               bake, path
 *   shadow    the lights' own views           path
 *   sort      visibility order, outlines      path
 *   choose    trials for a target             aim.c
 *   draw      surfaces, solids, media         drawing.c: path, in the order that plan.c decides
 *   readback  resolve, pixels                 here
 *   error     estimate, reference             estimate.c, measure.c */
#include "renderer/render.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "renderer/aim.h"
#include "renderer/asset/module.h"
#include "renderer/choice.h"
#include "renderer/contest.h"
#include "renderer/drawing.h"
#include "renderer/estimate.h"
#include "renderer/far_solids.h"
#include "renderer/force.h"
#include "renderer/gl/clock.h"
#include "renderer/gl/context.h"
#include "renderer/gl/resolve.h"
#include "renderer/gl/target.h"
#include "renderer/measure.h"
#include "renderer/path/footprint.h"
#include "renderer/path/variant.h"
#include "renderer/prepare.h"
#include "renderer/resolve.h"
#include "renderer/tint.h"

enum {
    MESH_CACHE_BYTES = 256 << 20,
    SHELL_CACHE_BYTES = 256 << 20,
    VOLUME_CACHE_BYTES = 320 << 20, /* one of the largest, 512 x 512 x 64, is 256 MiB */
    TEXTURE_CACHE_BYTES = 256 << 20,
    PATHS_MAX = 8
};

struct renderer {
    struct gl_context *context;
    struct gl_programs *programs;
    struct caches caches;
    struct bake_cache *textures;
    struct surface_pass *surface;
    struct shadow_pass *shadow;  /* made when a light first throws a shadow */
    void *path_state[PATHS_MAX]; /* made when a path is first used */
    struct gl_target samples, picture;
    struct probe probe;
    double readback_ms_per_sample; /* running mean of what resolving and reading took */
    uint32_t force;                /* 0 but while measuring: force.h */
    char cpu[128];
    int threads;
};

static void describe_cpu(struct renderer *renderer) {
    snprintf(renderer->cpu, sizeof renderer->cpu, "unknown");
    FILE *file = fopen("/proc/cpuinfo", "re");
    char line[256];
    while (file && fgets(line, sizeof line, file)) {
        char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) != 0 || !colon)
            continue;
        line[strcspn(line, "\n")] = 0;
        snprintf(renderer->cpu, sizeof renderer->cpu, "%.100s", colon + 2);
        break;
    }
    if (file)
        fclose(file);
    /* llvmpipe's own switch; without it, one thread for each core. */
    const char *threads = getenv("LP_NUM_THREADS");
    renderer->threads = threads ? atoi(threads) : (int)sysconf(_SC_NPROCESSORS_ONLN);
}

enum status renderer_create(const struct renderer_options *options, struct renderer **out,
                            struct error *err) {
    *out = NULL;
    struct renderer *renderer = calloc(1, sizeof *renderer);
    if (!renderer)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the renderer");
    static const enum gl_backend backends[] = {[RENDER_BACKEND_AUTO] = GL_BACKEND_AUTO,
                                               [RENDER_BACKEND_EGL] = GL_BACKEND_EGL,
                                               [RENDER_BACKEND_OSMESA] = GL_BACKEND_OSMESA};
    struct gl_options gl = {backends[options->backend], options->device, options->require_hardware};
    enum status status = gl_context_create(&gl, &renderer->context, err);
    if (status != STATUS_OK)
        goto fail;
    renderer->programs = gl_programs_create();
    renderer->caches.meshes = mesh_cache_create(MESH_CACHE_BYTES);
    renderer->caches.shells = shell_cache_create(SHELL_CACHE_BYTES);
    renderer->caches.volumes = volume_cache_create(VOLUME_CACHE_BYTES);
    renderer->textures = bake_cache_create(TEXTURE_CACHE_BYTES);
    renderer->surface = surface_pass_create();
    if (!renderer->programs || !renderer->caches.meshes || !renderer->caches.shells ||
        !renderer->caches.volumes || !renderer->textures || !renderer->surface) {
        status =
            error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the renderer's caches");
        goto fail;
    }
    renderer->readback_ms_per_sample = 2e-5; /* until there is one: measured on two slow cores */
    describe_cpu(renderer);
    *out = renderer;
    return STATUS_OK;
fail:
    renderer_destroy(renderer);
    return status;
}

void renderer_destroy(struct renderer *renderer) {
    if (!renderer)
        return;
    if (renderer->context) {
        for (int i = 0; i < PATHS_MAX && path_table[i]; i++)
            path_table[i]->destroy(renderer->path_state[i]);
        shadow_pass_destroy(renderer->shadow);
        surface_pass_destroy(renderer->surface);
        bake_cache_destroy(renderer->textures);
        probe_finish(&renderer->probe);
        gl_target_finish(&renderer->samples);
        gl_target_finish(&renderer->picture);
        gl_programs_destroy(renderer->programs);
    }
    volume_cache_destroy(renderer->caches.volumes);
    shell_cache_destroy(renderer->caches.shells);
    mesh_cache_destroy(renderer->caches.meshes);
    gl_context_destroy(renderer->context);
    free(renderer);
}

static enum status path_state(void *user, const struct path *path, void **state,
                              struct error *err) {
    struct renderer *renderer = user;
    int i = 0;
    while (path_table[i] != path)
        i++;
    enum status status = STATUS_OK;
    if (!renderer->path_state[i])
        status = path->create(&renderer->path_state[i], err);
    *state = renderer->path_state[i];
    return status;
}

static enum status draw_shadows(struct renderer *renderer, const struct plan *plan,
                                struct picture *picture, struct error *err) {
    if (!renderer->shadow && !(renderer->shadow = shadow_pass_create()))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for shadows");
    return shadow_pass_draw(renderer->shadow, &plan->shadow, renderer->surface, picture, err);
}

/* A copy of the scene to fill choices into: what the report calls resolved. */
static enum status copy_scene(const struct scene *scene, struct render_result *result, bool *open,
                              struct error *err) {
    struct scene *copy = &result->report.resolved;
    *copy = *scene;
    copy->objects = arena_alloc(&result->arena, scene->object_count, sizeof *copy->objects);
    if (!copy->objects)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the scene");
    for (size_t i = 0; i < scene->object_count; i++)
        copy->objects[i] = scene->objects[i];
    return plan_paths(copy, open, err);
}

static void report_renderer(const struct renderer *renderer, struct report *report) {
    const struct gl_info *info = gl_context_info(renderer->context);
    snprintf(report->backend, sizeof report->backend, "%s", info->backend);
    snprintf(report->device, sizeof report->device, "%s", info->device);
    snprintf(report->gl_renderer, sizeof report->gl_renderer, "%s", info->renderer);
    snprintf(report->gl_version, sizeof report->gl_version, "%s", info->version);
    snprintf(report->cpu, sizeof report->cpu, "%s", renderer->cpu);
    report->threads = renderer->threads;
    /* Stages are timed by fence and CPU clock even where queries can be trusted: they must add up
     * to the request's time, and a query knows nothing of what the CPU does meanwhile. What the
     * check said of queries is told by doctor and /v1/capabilities. */
    report->clock = REPORT_CLOCK_FENCE;
    const char *names[MODULE_COUNT];
    report->loaded_count = module_loaded(names);
    for (size_t i = 0; i < report->loaded_count && i < REPORT_LOADED_MAX; i++)
        snprintf(report->loaded[i], sizeof report->loaded[i], "%s", names[i]);
}

/* A pixel that is no number is a fault of Pelt's or of what it was given: it is drawn as nothing,
 * and the report says so. */
static uint64_t check_finite(struct render_result *result) {
    uint64_t count = 0, first = 0;
    size_t pixels = (size_t)result->width * (size_t)result->height;
    for (size_t p = 0; p < pixels; p++) {
        float *pixel = result->pixels + 4 * p;
        if (isfinite(pixel[0] + pixel[1] + pixel[2] + pixel[3]))
            continue;
        if (count++ == 0)
            first = p;
        memset(pixel, 0, 4 * sizeof *pixel);
    }
    if (count)
        report_warn(&result->report, "not-finite", "/image", count, first,
                    "pixels came out as infinite or as no number; they are left empty");
    return count;
}

/* Everything but drawing; shared by renderer_render and renderer_plan. */
static enum status make_ready(struct renderer *renderer, const struct scene *scene,
                              const struct asset_source *assets, struct render_result *result,
                              bool may_walk, struct prepared *prepared, struct view *world,
                              struct plan *plan, struct error *err) {
    memset(result, 0, sizeof *result);
    result->width = scene->image.width;
    result->height = scene->image.height;
    bool open;
    enum status status = copy_scene(scene, result, &open, err);
    if (status != STATUS_OK)
        return status;
    struct report *report = &result->report;
    status = prepare_objects(&renderer->caches, &report->resolved, assets, prepared, &report->cold,
                             report, err);
    if (status != STATUS_OK)
        return status;
    if (renderer->force & FORCE_SAMPLES)
        report->resolved.image.samples = 4;
    may_walk = may_walk && !(renderer->force & FORCE_SORT);
    status = force_objects(renderer->force, prepared, err);
    if (status == STATUS_OK)
        status = prepare_views(prepared, &report->resolved, world, err);
    if (status == STATUS_OK)
        status = far_solids(prepared, report, err);
    if (status == STATUS_OK && open)
        status = choice_decide(prepared, &report->resolved, world, may_walk, report, err);
    if (status == STATUS_OK)
        status = resolve_plan(scene, prepared, world, may_walk, renderer->force, report, plan, err);
    if (status != STATUS_OK)
        prepared_finish(&renderer->caches, prepared);
    return status;
}

enum status renderer_plan(struct renderer *renderer, const struct scene *scene,
                          const struct asset_source *assets, struct render_result *result,
                          struct error *err) {
    struct prepared prepared = {0};
    struct view world;
    struct plan plan;
    double started = clock_now_ms();
    enum status status =
        make_ready(renderer, scene, assets, result, true, &prepared, &world, &plan, err);
    if (status != STATUS_OK) {
        render_result_finish(result);
        return status;
    }
    prepared_finish(&renderer->caches, &prepared);
    report_renderer(renderer, &result->report);
    result->report.total_ms = result->report.stage_ms[REPORT_STAGE_assets] =
        clock_now_ms() - started;
    return STATUS_OK;
}

/* Draws the prepared picture, resolves and reads it; *lost as in render_once(). */
static enum status develop(struct renderer *renderer, const struct drawing *drawing,
                           struct render_result *result, uint64_t *lost, struct error *err) {
    struct picture *picture = drawing->picture;
    const struct scene *scene = &result->report.resolved;
    stage_clock_next(picture->clock, REPORT_STAGE_draw, true);
    enum status status =
        gl_target_resize(&renderer->samples, picture->world.width, picture->world.height,
                         drawing->plan->depth || picture->depth, err);
    if (status == STATUS_OK)
        status = drawing_run(drawing, err);
    if (status != STATUS_OK)
        return status;
    stage_clock_next(picture->clock, REPORT_STAGE_readback, true);
    double began = clock_now_ms();
    status = gl_resolve(renderer->programs, &renderer->samples, drawing->plan->k,
                        scene->image.background, &renderer->picture, &picture->cold, err);
    if (status == STATUS_OK)
        status = gl_target_read(&renderer->picture, result->pixels, err);
    if (status == STATUS_OK)
        *lost = check_finite(result);
    double samples = (double)picture->world.width * picture->world.height;
    double per_sample = (clock_now_ms() - began) / samples;
    renderer->readback_ms_per_sample += (per_sample - renderer->readback_ms_per_sample) / 4;
    return status;
}

/* What a picture that was thrown away took is part of what the choice costs. */
static void throw_away(double stage_ms[REPORT_STAGE_COUNT]) {
    static const enum report_stage stages[] = {REPORT_STAGE_draw, REPORT_STAGE_readback,
                                               REPORT_STAGE_error};
    for (size_t i = 0; i < sizeof stages / sizeof *stages; i++) {
        stage_ms[REPORT_STAGE_choose] += stage_ms[stages[i]];
        stage_ms[stages[i]] = 0;
    }
}

/* For drawing: what is left of a deadline when all else is taken off. */
static double left_ms(const struct renderer *renderer, const struct contest *contest,
                      const struct render_limits *limits) {
    const struct view *world = &contest->drawing->picture->world;
    double left = limits->began_ms + contest->asked->target.deadline_ms - limits->reserve_ms -
                  renderer->readback_ms_per_sample * world->width * world->height - clock_now_ms();
    /* measure.h: what an estimate may cost */
    return contest->asked->error_mode == SCENE_ERROR_ESTIMATE ? left / 1.3 : left;
}

/* Chooses, draws and measures, as far as the scene asks for each. */
static enum status fulfil(struct renderer *renderer, const struct contest *contest,
                          const struct asset_source *assets, const struct render_limits *limits,
                          struct render_result *result, uint64_t *lost, struct error *err) {
    const struct scene *scene = contest->asked;
    const struct drawing *drawing = contest->drawing;
    struct picture *picture = drawing->picture;
    struct stage_clock *clock = picture->clock;
    struct report *report = &result->report;
    struct scene filtered;
    struct measure measure = {
        .scene = scene,
        .truth = measure_truth(scene, picture->objects, picture->object_count, &filtered),
        .camera = &report->resolved.camera,
        .assets = assets,
        .caches = &renderer->caches,
        .drawing = drawing,
        .probe = &renderer->probe,
        .met = picture->met,
        .pixels = result->pixels,
        .threads = renderer->threads,
        .promises = scene->target.has_max_error,
    };
    struct aim aim = {.measure = &measure};
    const struct scene_target *target = &scene->target;
    enum status status = STATUS_OK;
    if (target->has_max_error || target->has_deadline_ms) {
        report->target.kind =
            target->has_max_error ? REPORT_TARGET_MAX_ERROR : REPORT_TARGET_DEADLINE_MS;
        report->target.model = NAN;
        report->target.asked = target->has_max_error ? target->max_error : target->deadline_ms;
        snprintf(report->target.why, sizeof report->target.why,
                 "nothing to choose: no object that could be drawn better or faster leaves out its "
                 "quality");
    }
    if (report->target.kind != REPORT_TARGET_NONE) {
        stage_clock_next(clock, REPORT_STAGE_choose, true);
        if (target->has_deadline_ms)
            status = contest_deadline(contest, &measure, left_ms(renderer, contest, limits), err);
        aim.left_ms = left_ms(renderer, contest, limits);
        if (status == STATUS_OK &&
            (aim_is_free(&measure) || (target->has_max_error && contest_doubts(contest))))
            status = aim_choose(&aim, report, err);
        if (status == STATUS_OK && target->has_max_error)
            status = contest_error(contest, &aim, err);
    }
    for (bool again = status == STATUS_OK; again;) {
        double began = clock_now_ms();
        again = false;
        status = develop(renderer, drawing, result, lost, err);
        if (status != STATUS_OK || *lost)
            break;
        measure.spent_ms = clock_now_ms() - began + clock->stage_ms[REPORT_STAGE_sort];
        if (target->has_max_error || scene->error_mode == SCENE_ERROR_ESTIMATE) {
            stage_clock_next(clock, REPORT_STAGE_error, true);
            status = estimate_error(&measure, report, err);
        }
        if (status == STATUS_OK && target->has_max_error && aim_again(&aim, report)) {
            stage_clock_next(clock, REPORT_STAGE_choose, true);
            throw_away(clock->stage_ms);
            again = true;
        }
    }
    if (status == STATUS_OK && scene->error_mode == SCENE_ERROR_REFERENCE && !*lost) {
        stage_clock_next(clock, REPORT_STAGE_error, true);
        status = measure_reference(&measure, report, err);
    }
    return status;
}

/* Where the device is this processor it has nothing to gain by making its own lists
 * (renderer/path/README.md). */
static bool device_lists(const struct renderer *renderer) {
    if (renderer->force & (FORCE_DEVICE_LISTS | FORCE_HOST_LISTS))
        return renderer->force & FORCE_DEVICE_LISTS;
    return !gl_context_info(renderer->context)->software;
}

/* One picture from beginning to end; *lost is set to the number of pixels that are no number. */
static enum status render_once(struct renderer *renderer, const struct scene *scene,
                               const struct asset_source *assets,
                               const struct render_limits *limits, bool may_walk,
                               struct render_result *result, uint64_t *lost, struct error *err) {
    struct prepared prepared = {0};
    struct view world;
    struct plan plan;
    double started = clock_now_ms();
    double stage_ms[REPORT_STAGE_COUNT] = {0}, shares[3];
    struct stage_clock clock;
    stage_clock_start(&clock, stage_ms, REPORT_STAGE_assets);
    enum status status =
        make_ready(renderer, scene, assets, result, may_walk, &prepared, &world, &plan, err);
    if (status != STATUS_OK) {
        render_result_finish(result);
        return status;
    }
    struct report *report = &result->report;
    struct picture picture = {
        .programs = renderer->programs,
        .target = &renderer->samples,
        .world = world,
        .objects = prepared.objects,
        .object_count = prepared.object_count,
        .occluded = plan.occluded,
        .behind =
            tint_wanted(prepared.objects, prepared.object_count) ? scene->image.background : NULL,
        .shares =
            tint_shared(scene, prepared.objects, prepared.object_count, shares) ? shares : NULL,
        .device_lists = device_lists(renderer),
        .forced_order = renderer->force & FORCE_NEAREST_FIRST    ? 1
                        : renderer->force & FORCE_FARTHEST_FIRST ? -1
                                                                 : 0,
        .report = report,
        .clock = &clock,
    };
    struct drawing drawing = {&plan, renderer->surface, NULL, &picture};
    light_set_from_scene(&report->resolved, &picture.lights);
    size_t pixel_count = (size_t)result->width * (size_t)result->height;
    size_t sample_count = (size_t)world.width * (size_t)world.height;
    result->pixels = malloc(pixel_count * 4 * sizeof *result->pixels);
    if (plan.measured && plan.path)
        picture.met = calloc(sample_count, 1);
    if (!result->pixels || (plan.measured && plan.path && !picture.met)) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, "/image", "no memory for %zu pixels",
                             pixel_count);
        goto done;
    }

    gl_programs_begin_picture(renderer->programs);
    for (size_t i = 0; i < prepared.object_count; i++) {
        struct path_object *object = &prepared.objects[i];
        if (!object->shell || object->volume->homogeneous)
            continue;
        bool baked = false;
        struct bake_filter filter = footprint_filter(object);
        status = bake_acquire_filtered(
            renderer->textures, object->volume, variant_needs_normals(object, picture.lights.count),
            &filter, &object->baked, &baked, &report->work.upload_bytes, &clock, err);
        if (status != STATUS_OK)
            goto done;
        report->cold |= baked;
        report_reuse(report, REPORT_PART_textures, !baked);
    }
    stage_clock_next(&clock, REPORT_STAGE_upload, true);
    if ((status = gl_target_resize(&renderer->samples, world.width, world.height, plan.depth,
                                   err)) != STATUS_OK ||
        (status = gl_target_resize(&renderer->picture, result->width, result->height, false,
                                   err)) != STATUS_OK)
        goto done;
    if (plan.surface &&
        (status = surface_pass_upload(renderer->surface, &picture, err)) != STATUS_OK)
        goto done;
    if ((plan.shadow.count || plan.shadow.points) &&
        (status = draw_shadows(renderer, &plan, &picture, err)) != STATUS_OK)
        goto done;
    struct contest contest = {.asked = scene,
                              .prepared = &prepared,
                              .plan = &plan,
                              .drawing = &drawing,
                              .may_walk = may_walk && !(renderer->force & FORCE_SORT),
                              .force = renderer->force,
                              .state_of = path_state,
                              .user = renderer};
    status = contest_prepare(&contest, err);
    if (status != STATUS_OK)
        goto done;
    status = fulfil(renderer, &contest, assets, limits, result, lost, err);
    stage_clock_stop(&clock, true);
    resolve_objects(&report->resolved, &prepared);
    /* Not when they are drawn: a change of path takes back what has been said of the first one. */
    if (plan.shadow.count)
        shadow_pass_warn(renderer->shadow, &picture);

done:
    free(picture.met);
    for (size_t i = 0; i < prepared.object_count; i++)
        bake_release(renderer->textures, prepared.objects[i].baked);
    prepared_finish(&renderer->caches, &prepared);
    if (status != STATUS_OK) {
        render_result_finish(result);
        return status;
    }
    report->cold |= picture.cold;
    gl_programs_used(renderer->programs, &report->reuse[REPORT_PART_programs].kept,
                     &report->reuse[REPORT_PART_programs].renewed);
    report->work.samples = (uint64_t)world.width * (uint64_t)world.height;
    memcpy(report->stage_ms, stage_ms, sizeof stage_ms);
    report->total_ms = clock_now_ms() - started;
    report_renderer(renderer, report);
    return STATUS_OK;
}

/* Whether a walk was the renderer's own choice, so that it may choose otherwise. */
static bool chose_walk(const struct scene *scene, const struct render_result *result) {
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].quality.order == SCENE_ORDER_AUTO &&
            result->report.resolved.objects[i].quality.order == SCENE_ORDER_WALK)
            return true;
    return false;
}

enum status renderer_render(struct renderer *renderer, const struct scene *scene,
                            const struct asset_source *assets, struct render_result *result,
                            struct error *err) {
    struct render_limits limits = {.began_ms = clock_now_ms()};
    return renderer_render_within(renderer, scene, assets, &limits, result, err);
}

enum status renderer_render_within(struct renderer *renderer, const struct scene *scene,
                                   const struct asset_source *assets,
                                   const struct render_limits *limits, struct render_result *result,
                                   struct error *err) {
    uint64_t lost = 0;
    enum status status = render_once(renderer, scene, assets, limits, true, result, &lost, err);
    if (status != STATUS_OK || lost == 0 || !chose_walk(scene, result))
        return status;
    /* A ray that lost its way gives no number (shaders/walk.frag): the cells are drawn instead, and
     * both attempts are in the times. */
    struct report first = result->report;
    uint64_t still_lost = 0;
    render_result_finish(result);
    status = render_once(renderer, scene, assets, limits, false, result, &still_lost, err);
    if (status != STATUS_OK)
        return status;
    struct report *report = &result->report;
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        report->stage_ms[i] += first.stage_ms[i];
    report->total_ms += first.total_ms;
    report->cold |= first.cold;
    for (int i = 0; i < REPORT_PART_COUNT; i++) /* what the first made is made now */
        report->reuse[i] = first.reuse[i];
    report_warn(report, "walk-abandoned", "/objects", lost, 0,
                "rays lost their way between cells; the cells were drawn one by one instead");
    return STATUS_OK;
}

void renderer_force(struct renderer *renderer, uint32_t force) {
    renderer->force = force;
}

enum status renderer_count_fetches(struct renderer *renderer, bool on, struct error *err) {
    return gl_programs_count(renderer->programs, on, err);
}

uint64_t renderer_fetches(const struct renderer *renderer) {
    return gl_programs_counted(renderer->programs);
}

bool renderer_variant(const struct renderer *renderer, size_t index, const char **program,
                      uint32_t *variant) {
    enum gl_program_id id;
    if (!gl_programs_at(renderer->programs, index, &id, variant))
        return false;
    *program = gl_program_name(id);
    return true;
}

void render_result_finish(struct render_result *result) {
    free(result->pixels);
    arena_free(&result->arena);
    memset(result, 0, sizeof *result);
}
