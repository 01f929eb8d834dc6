/* How fast rays walk: a torus shell under fur at 512 x 512, one sample a pixel, all layers (issue
 * 5's figures), by every traversal and map at several step counts, over meshes from coarse to fine.
 * Ways of one mesh are drawn in turns in one process, so that a busy machine slows all of them
 * alike. Beside the time stand the processor's (it is less shaken by others) and the error against
 * the reference, over PIXELS pixels that are traced once for each mesh.
 *
 *   bench_torus REPEATS             all ways, at the three sizes
 *   bench_torus REPEATS WORD...     those whose name holds one of the words
 *   bench_torus REPEATS --growth    the default way, from 1,000 to 1,000,000 tetrahedra, no error
 *
 * Prints one JSON object a line; bench.py makes the table. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "renderer/error/metrics.h"
#include "renderer/render.h"
#include "renderer/truth.h"

enum { SIDE = 512, PIXELS = 4096, REPEATS_MAX = 101 };

/* Around the ring and the tube; six tetrahedra for each product. */
static const struct mesh_size {
    int n, m;
    double asked_ms; /* by issue 5; 0: nothing */
} figures[] = {{24, 12, 60}, {80, 40, 100}, {160, 80, 160}},
  growth[] = {{18, 9, 0}, {40, 20, 0}, {80, 40, 0}, {160, 80, 0}, {320, 160, 0}, {576, 288, 0}};

static const struct way {
    const char *name, *quality;
} ways[] = {
    {"default", "\"order\": \"walk\""},
    {"exact 8", "\"order\": \"walk\", \"map\": \"exact\", \"samples\": 8"},
    {"exact 16", "\"order\": \"walk\", \"map\": \"exact\", \"samples\": 16"},
    {"exact 32", "\"order\": \"walk\", \"map\": \"exact\", \"samples\": 32"},
    {"adaptive 32", "\"order\": \"walk\", \"traversal\": \"adaptive\", \"samples\": 32"},
    {"adaptive 64", "\"order\": \"walk\", \"traversal\": \"adaptive\", \"samples\": 64"},
    {"dda 32", "\"order\": \"walk\", \"traversal\": \"dda\", \"samples\": 32"},
    {"affine 8", "\"order\": \"walk\", \"map\": \"affine\", \"samples\": 8"},
    {"affine 16", "\"order\": \"walk\", \"map\": \"affine\", \"samples\": 16"},
    {"affine 32", "\"order\": \"walk\", \"map\": \"affine\", \"samples\": 32"},
};
enum { WAYS = sizeof ways / sizeof *ways };

static enum status no_asset(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s", name);
}

static const struct asset_source assets = {.open = no_asset};

static enum status read_scene(const struct mesh_size *mesh, const char *quality,
                              struct arena *arena, struct scene *scene, struct error *err) {
    char json[1024];
    int length = snprintf(
        json, sizeof json,
        "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"camera\": {\"eye\": [0, "
        "-3, "
        "2.2], \"target\": [0, 0, 0], \"up\": [0, 0, 1], \"fov_y_deg\": 40}, \"objects\": "
        "[{\"shell\": {\"mesh\": {\"shape\": \"torus\", \"radius\": 1, \"tube\": 0.4, "
        "\"divisions\": [%d, %d]}, \"thickness\": 0.12, \"tiles\": [12, 6], \"material\": "
        "{\"builtin\": \"fur\", \"size\": [128, 128, 32]}}, \"path\": \"tetra\", \"quality\": "
        "{%s}}]}",
        SIDE, SIDE, mesh->n, mesh->m, quality);
    return scene_read(json, (size_t)length, arena, scene, err);
}

/* Processor time of all threads of this process. */
static double cpu_ms(void) {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return 1e3 * (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-3 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

static enum status draw(struct renderer *renderer, const struct mesh_size *mesh,
                        const char *quality, struct render_result *result, struct error *err) {
    struct arena arena = {0};
    struct scene scene;
    enum status status = read_scene(mesh, quality, &arena, &scene, err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, &scene, &assets, result, err);
    arena_free(&arena);
    return status;
}

/* A pixel of each block of a grid of PIXELS, not always the same one. */
static void choose_pixels(uint32_t pixel[PIXELS]) {
    enum { ROW = 64, BLOCK = SIDE / ROW };
    uint32_t state = 1;
    for (uint32_t i = 0; i < PIXELS; i++) {
        state = state * 1664525u + 1013904223u; /* Press et al., Numerical Recipes, 7.1 */
        uint32_t x = i % ROW * BLOCK + (state >> 16) % BLOCK;
        uint32_t y = i / ROW * BLOCK + (state >> 24) % BLOCK;
        pixel[i] = y * SIDE + x;
    }
}

static enum status trace(const struct mesh_size *mesh, const uint32_t *pixel, struct truth *truth,
                         struct error *err) {
    struct arena arena = {0};
    struct scene scene;
    struct truth_source *source = NULL;
    struct reference_request request = {.pixels = pixel, .pixel_count = PIXELS, .tolerance = 1e-6};
    enum status status = read_scene(mesh, ways[0].quality, &arena, &scene, err);
    if (status == STATUS_OK)
        status = truth_create(&scene, &assets, &source, err);
    if (status == STATUS_OK)
        status = truth_draw_pixels(source, &request, truth, err);
    truth_destroy(source);
    arena_free(&arena);
    return status;
}

static enum status judge(const struct render_result *result, const uint32_t *pixel,
                         const struct truth *truth, double *rmse, struct error *err) {
    static float test[PIXELS][4];
    const double background[4] = {0, 0, 0, 0};
    for (uint32_t i = 0; i < PIXELS; i++)
        memcpy(test[i], result->pixels + 4 * (size_t)pixel[i], sizeof test[i]);
    struct error_metrics metrics;
    enum status status = error_compare_pixels(test[0], truth->pixels, PIXELS, truth->touched,
                                              background, &metrics, err);
    *rmse = metrics.touched.rmse;
    return status;
}

/* What the runs of one way took. */
struct runs {
    double draw_ms[REPEATS_MAX], total_ms[REPEATS_MAX], cpu_ms[REPEATS_MAX];
    double stage_ms[REPORT_STAGE_COUNT]; /* of the last */
    double rmse;
    uint64_t tetrahedra, entries;
};

static void print_list(const char *name, const double *ms, int count) {
    printf(", \"%s\": [", name);
    for (int i = 0; i < count; i++)
        printf("%s%.2f", i ? ", " : "", ms[i]);
    printf("]");
}

static enum status measure(struct renderer *renderer, const struct mesh_size *mesh,
                           const bool wanted[WAYS], bool judged, int repeats, struct runs *runs,
                           struct error *err) {
    static uint32_t pixel[PIXELS];
    struct truth truth = {0};
    enum status status = STATUS_OK;
    if (judged) {
        choose_pixels(pixel);
        status = trace(mesh, pixel, &truth, err);
    }
    for (int n = -1; n < repeats; n++) /* the first compiles and uploads */
        for (int w = 0; w < WAYS && status == STATUS_OK; w++) {
            if (!wanted[w])
                continue;
            struct render_result result;
            double began_ms = cpu_ms();
            status = draw(renderer, mesh, ways[w].quality, &result, err);
            if (status != STATUS_OK)
                break;
            double used_ms = cpu_ms() - began_ms;
            struct runs *of = &runs[w];
            if (n < 0 && judged)
                status = judge(&result, pixel, &truth, &of->rmse, err);
            if (n >= 0) {
                of->draw_ms[n] = result.report.stage_ms[REPORT_STAGE_draw];
                of->total_ms[n] = result.report.total_ms;
                of->cpu_ms[n] = used_ms;
            }
            memcpy(of->stage_ms, result.report.stage_ms, sizeof of->stage_ms);
            of->tetrahedra = result.report.work.tetrahedra;
            of->entries = result.report.work.fragments;
            render_result_finish(&result);
        }
    truth_finish(&truth);
    for (int w = 0; w < WAYS && status == STATUS_OK; w++) {
        if (!wanted[w])
            continue;
        const struct runs *of = &runs[w];
        printf("{\"tetrahedra\": %llu, \"way\": \"%s\", \"asked_ms\": %g, \"entries\": %llu",
               (unsigned long long)of->tetrahedra, ways[w].name, mesh->asked_ms,
               (unsigned long long)of->entries);
        if (judged)
            printf(", \"rmse\": %.4g", of->rmse);
        print_list("draw_ms", of->draw_ms, repeats);
        print_list("total_ms", of->total_ms, repeats);
        print_list("cpu_ms", of->cpu_ms, repeats);
        printf(", \"sort_ms\": %.2f, \"upload_ms\": %.2f, \"assets_ms\": %.2f, \"readback_ms\": "
               "%.2f}\n",
               of->stage_ms[REPORT_STAGE_sort], of->stage_ms[REPORT_STAGE_upload],
               of->stage_ms[REPORT_STAGE_assets], of->stage_ms[REPORT_STAGE_readback]);
        fflush(stdout);
    }
    return status;
}

int main(int argc, char **argv) {
    int repeats = argc >= 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (repeats < 1 || repeats > REPEATS_MAX) {
        fputs("usage: bench_torus REPEATS [--growth | WORD...]\n", stderr);
        return 2;
    }
    bool grows = argc == 3 && strcmp(argv[2], "--growth") == 0;
    bool wanted[WAYS] = {false};
    for (int w = 0; w < WAYS; w++) {
        wanted[w] = grows ? w == 0 : argc == 2;
        for (int a = 2; a < argc && !grows; a++)
            wanted[w] |= strstr(ways[w].name, argv[a]) != NULL;
    }
    const struct mesh_size *mesh = grows ? growth : figures;
    size_t count = grows ? sizeof growth / sizeof *growth : sizeof figures / sizeof *figures;
    struct runs *runs = calloc(WAYS, sizeof *runs);
    struct renderer *renderer = NULL;
    struct error err = {0};
    enum status status =
        runs ? renderer_create(&(struct renderer_options){.device = -1}, &renderer, &err)
             : STATUS_OUT_OF_MEMORY;
    for (size_t i = 0; i < count && status == STATUS_OK; i++)
        status = measure(renderer, &mesh[i], wanted, !grows, repeats, runs, &err);
    if (status != STATUS_OK)
        fprintf(stderr, "bench_torus: %s\n",
                err.fault_count ? err.faults[0].message : status_title(status));
    renderer_destroy(renderer);
    error_clear(&err);
    free(runs);
    return status == STATUS_OK ? 0 : 1;
}
