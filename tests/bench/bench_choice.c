/* What path auto stands on, measured: scenes that are not alike, each drawn by every way through
 * its shells (walked, sorted, slabs), beside the figures that renderer/cost.c counts. Prints one
 * JSON object a line; bench.py (--only choice) fits the rates of cost.c to them and says how far
 * off the committed ones are.
 *
 *   bench_choice REPEATS */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "api/scene.h"
#include "renderer/force.h"

static const struct way {
    const char *name, *path, *quality;
} ways[] = {
    {"walked", "tetra", "\"order\": \"walk\""},
    {"sorted", "tetra", "\"order\": \"sorted\""},
    {"slabs", "slicing", "\"method\": \"slabs\""},
};

#define MIST    "\"material\": {\"builtin\": \"homogeneous\", \"extinction\": 4}"
#define CLOUDS  "\"material\": {\"builtin\": \"clouds\", \"size\": [64, 64, 32], \"lit\": false}"
#define FUR     "\"material\": {\"builtin\": \"fur\", \"size\": [64, 64, 32]}"
#define CHAIN   "\"material\": {\"builtin\": \"chain\", \"size\": [64, 64, 32]}"
#define TORUS   "\"shape\": \"torus\", \"divisions\": "
#define SPHERE  "\"shape\": \"sphere\", \"divisions\": "
#define PLANE   "\"shape\": \"plane\", \"divisions\": "
#define TERRAIN "\"shape\": \"terrain\", \"divisions\": "

static const struct contents {
    const char *name, *material;
} contents[] = {{"even", MIST}, {"medium", CLOUDS}, {"lit", FUR}, {"solid", CHAIN}};

static const struct shape {
    const char *name, *mesh;
} shapes[] = {{"torus of 576", TORUS "[24, 12]"},      {"torus of 8,192", TORUS "[64, 64]"},
              {"sphere of 120", SPHERE "[12, 6]"},     {"sphere of 3,968", SPHERE "[64, 32]"},
              {"plane of 2", PLANE "[1, 1]"},          {"plane of 2,048", PLANE "[32, 32]"},
              {"terrain of 3,200", TERRAIN "[40, 40]"}};

static const struct view_of {
    int side;
    double thickness;
    int fineness; /* per cent of the default */
} views[] = {{64, 0.15, 100}, {192, 0.15, 100}, {192, 0.04, 100}, {192, 0.15, 25}};

static enum status no_asset(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s", name);
}

typedef enum status facade(struct renderer *renderer, const struct scene *scene,
                           const struct asset_source *assets, struct render_result *result,
                           struct error *err);

static bool run(facade *act, struct renderer *renderer, const char *json,
                struct render_result *result) {
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source assets = {.open = no_asset};
    enum status status = scene_read(json, strlen(json), &arena, &scene, &err);
    if (status == STATUS_OK)
        status = act(renderer, &scene, &assets, result, &err);
    if (status != STATUS_OK)
        fprintf(stderr, "bench_choice: %s: %s\n", json,
                err.fault_count ? err.faults[0].message : "failed");
    error_clear(&err);
    arena_free(&arena);
    return status == STATUS_OK;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double processor_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

enum { REPEATS_MAX = 101 };

struct subject {
    const struct shape *shape;
    const struct contents *contents;
    const struct way *way;
    const struct view_of *view;
};

/* Median processor time of a picture, all threads: other work on the machine does not disturb it.
 */
static bool time_picture(struct renderer *renderer, const char *json, int repeats, double *ms,
                         struct report *report) {
    double took[REPEATS_MAX];
    for (int n = -1; n < repeats; n++) { /* the first may compile */
        struct render_result result;
        double began = processor_ms();
        if (!run(renderer_render, renderer, json, &result))
            return false;
        if (n >= 0)
            took[n] = processor_ms() - began;
        *report = result.report;
        render_result_finish(&result);
    }
    qsort(took, (size_t)repeats, sizeof *took, by_value);
    *ms = took[repeats / 2];
    return true;
}

static void write_scene(const struct subject *subject, int quality, bool empty, char json[1024]) {
    char asked[32] = "";
    const char *member = strcmp(subject->way->path, "tetra") == 0 ? "samples" : "slices";
    if (quality)
        snprintf(asked, sizeof asked, ", \"%s\": %d", member, quality);
    snprintf(json, 1024,
             "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"objects\": "
             "[{\"shell\": {\"mesh\": {%s}, \"thickness\": %g, \"tiles\": [6, 3], %s}, \"path\": "
             "\"%s\", \"quality\": {%s%s}}]}",
             subject->view->side, subject->view->side, subject->shape->mesh,
             subject->view->thickness,
             empty ? "\"material\": {\"builtin\": \"homogeneous\", \"extinction\": 0}"
                   : subject->contents->material,
             subject->way->path, subject->way->quality, asked);
}

static bool measure(struct renderer *renderer, const struct subject *subject, int repeats) {
    char json[1024];
    double ms, empty_ms;
    struct report report;
    int quality = 0;
    if (subject->view->fineness != 100) { /* of its default, which a plan tells */
        struct render_result plan;
        write_scene(subject, 0, false, json);
        if (!run(renderer_plan, renderer, json, &plan))
            return false;
        const struct scene_quality *planned = &plan.report.resolved.objects[0].quality;
        quality = (planned->slices ? planned->slices : planned->samples) * subject->view->fineness;
        quality = quality / 100 > 1 ? quality / 100 : 1;
        render_result_finish(&plan);
    }
    write_scene(subject, 0, true, json);
    if (!time_picture(renderer, json, repeats, &empty_ms, &report))
        return false;
    write_scene(subject, quality, false, json);
    if (!time_picture(renderer, json, repeats, &ms, &report))
        return false;
    const struct report_candidate *cost = &report.choice.among[0];
    printf(
        "{\"way\": \"%s\", \"contents\": \"%s\", \"shape\": \"%s\", \"side\": %d, \"thickness\": "
        "%g, \"fineness\": %d, \"ms\": %.4f, \"wall_ms\": %.4f, \"model_ms\": %.4f, "
        "\"outlines\": %.0f, \"fragments\": %.0f, \"steps\": %.0f, \"samples\": %d}\n",
        subject->way->name, subject->contents->name, subject->shape->name, subject->view->side,
        subject->view->thickness, subject->view->fineness, ms - empty_ms,
        report.stage_ms[REPORT_STAGE_sort] + report.stage_ms[REPORT_STAGE_draw], cost->expected_ms,
        cost->outlines, cost->fragments, cost->steps, subject->view->side * subject->view->side);
    fflush(stdout);
    return true;
}

#define COUNT(list) (sizeof(list) / sizeof *(list))

int main(int argc, char **argv) {
    int repeats = argc == 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (repeats < 1 || repeats > REPEATS_MAX) {
        fputs("usage: bench_choice REPEATS\n", stderr);
        return 2;
    }
    struct renderer_options options = {.device = -1};
    struct renderer *renderer = NULL;
    if (renderer_create(&options, &renderer, NULL) != STATUS_OK)
        return 1;
    renderer_force(renderer, FORCE_COST);
    bool good = true;
    size_t total = COUNT(views) * COUNT(contents) * COUNT(shapes) * COUNT(ways);
    for (size_t n = 0; n < total && good; n++) {
        size_t of_view = n / COUNT(ways);
        struct subject subject = {.way = &ways[n % COUNT(ways)],
                                  .shape = &shapes[of_view % COUNT(shapes)],
                                  .contents = &contents[of_view / COUNT(shapes) % COUNT(contents)],
                                  .view = &views[of_view / COUNT(shapes) / COUNT(contents)]};
        /* Even media are drawn the same at any quality. */
        if (subject.view->fineness == 100 || strcmp(subject.contents->name, "even") != 0)
            good = measure(renderer, &subject, repeats);
    }
    renderer_destroy(renderer);
    return good ? 0 : 1;
}
