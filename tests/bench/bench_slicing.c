/* Table 1 of Lensch, Daubert & Seidel 2002 on this machine: a torus of 576 triangles and a terrain
 * of 3,200, cut by 250, 500 and 1,000 planes, 512 x 512, by each method; with the reject (lists by
 * depth) and, of the hardware method, without. Beside the time stands the error against the limit,
 * which is what tetra draws with very many steps, and how many pairs of plane and prism were drawn.
 * Prints one JSON object a line; bench.py makes the table.
 *
 *   bench_slicing REPEATS */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/scene.h"
#include "renderer/force.h"

static const struct subject {
    const char *name, *mesh;
} subjects[] = {
    {"torus", "\"shape\": \"torus\", \"divisions\": [24, 12]"},
    {"terrain", "\"shape\": \"terrain\", \"divisions\": [40, 40]"},
};

/* The paper's frames a second on a GeForce 4, by planes 250, 500, 1,000; 0: not told. */
static const struct method {
    const char *name, *quality;
    bool every_plane;
    int planes_max;
    double paper_fps[2][3];
} methods[] = {
    {"software", "software", false, 1000, {{0, 0, 0}, {0, 0, 0}}},
    {"hybrid", "hybrid", false, 1000, {{38, 20, 12}, {13, 7, 4}}},
    {"hardware", "hardware", false, 1000, {{25, 13, 6}, {12, 6, 3}}},
    {"hardware, every prism", "hardware", true, 250, {{4, 0, 0}, {0.7, 0, 0}}},
    {"slabs", "slabs", false, 1000, {{0, 0, 0}, {0, 0, 0}}},
};

static enum status no_asset(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s", name);
}

static bool draw(struct renderer *renderer, const char *mesh, const char *quality, int side,
                 const char *error, struct render_result *result) {
    char json[1024];
    snprintf(
        json, sizeof json,
        "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"report\": {\"error\": "
        "\"%s\"}, \"objects\": [{\"shell\": {\"mesh\": {%s}, \"thickness\": 0.15, \"tiles\": [6, "
        "3], \"material\": {\"builtin\": \"clouds\", \"size\": [64, 64, 32]}}, \"quality\": "
        "{%s}}]}",
        side, side, error, mesh, quality);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source assets = {.open = no_asset};
    enum status status = scene_read(json, strlen(json), &arena, &scene, &err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, &scene, &assets, result, &err);
    if (status != STATUS_OK)
        fprintf(stderr, "bench_slicing: %s: %s\n", quality,
                err.fault_count ? err.faults[0].message : "failed");
    error_clear(&err);
    arena_free(&arena);
    return status == STATUS_OK;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

enum { REPEATS_MAX = 101 };

static bool measure(struct renderer *renderer, const struct subject *subject,
                    const struct method *method, int step, int repeats) {
    int planes = method->quality ? 250 << step : 0;
    char quality[96] = "\"order\": \"walk\"";
    double ms[REPEATS_MAX];
    struct render_result result;
    if (method->quality)
        snprintf(quality, sizeof quality, "\"slices\": %d, \"method\": \"%s\"", planes,
                 method->quality);
    if (!draw(renderer, subject->mesh, quality, 64, "reference", &result))
        return false;
    struct report_error error = result.report.error;
    struct report_work work = result.report.work;
    render_result_finish(&result);
    renderer_force(renderer, method->every_plane ? FORCE_EVERY_PLANE : 0);
    for (int n = -1; n < repeats; n++) { /* the first may compile */
        if (!draw(renderer, subject->mesh, quality, 512, "none", &result))
            return false;
        if (n >= 0)
            ms[n] = result.report.stage_ms[REPORT_STAGE_draw] +
                    result.report.stage_ms[REPORT_STAGE_sort];
        work = result.report.work;
        render_result_finish(&result);
    }
    renderer_force(renderer, 0);
    qsort(ms, (size_t)repeats, sizeof *ms, by_value);
    printf("{\"scene\": \"%s\", \"planes\": %d, \"method\": \"%s\", \"ms\": %.1f, \"rmse\": %.3g, "
           "\"model\": %.3g, \"discretisation\": %.3g, \"drawn\": %llu, \"pairs\": %llu, "
           "\"fragments\": %llu, \"upload\": %llu, \"paper_fps\": %g}\n",
           subject->name, planes, method->name, ms[repeats / 2], error.rmse, error.model,
           error.discretisation, (unsigned long long)work.segments,
           (unsigned long long)(work.prisms * work.slices), (unsigned long long)work.fragments,
           (unsigned long long)work.upload_bytes,
           planes ? method->paper_fps[subject - subjects][step] : 0);
    fflush(stdout);
    return true;
}

int main(int argc, char **argv) {
    int repeats = argc == 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (repeats < 1 || repeats > REPEATS_MAX) {
        fputs("usage: bench_slicing REPEATS\n", stderr);
        return 2;
    }
    struct renderer_options options = {.device = -1};
    struct renderer *renderer = NULL;
    if (renderer_create(&options, &renderer, NULL) != STATUS_OK)
        return 1;
    static const struct method tetra = {.name = "tetra, its default"};
    bool good = true;
    for (size_t s = 0; s < sizeof subjects / sizeof *subjects && good; s++) {
        for (int step = 0; step < 3 && good; step++)
            for (size_t m = 0; m < sizeof methods / sizeof *methods && good; m++)
                if (250 << step <= methods[m].planes_max)
                    good = measure(renderer, &subjects[s], &methods[m], step, repeats);
        good = good && measure(renderer, &subjects[s], &tetra, 0, repeats);
    }
    renderer_destroy(renderer);
    return good ? 0 : 1;
}
