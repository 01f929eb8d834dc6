/* Table 1 of Dufort, Leblanc & Poulin 2005 on this machine: scenes of its triangles, texture sizes
 * and samples at 512 x 512, one sample a pixel, drawn by tetra in three ways: as published (sorted
 * cells, textures by each tetrahedron's affine map), as here with the paper's samples, and as here
 * by default. The ways take turns, so that all have the same machine. Errors are against
 * the truth (renderer/truth.h) at pixels spread over the frame, traced once for each scene. Prints
 * one JSON object a line; dufort.py makes the table, with the paper's figures beside.
 *
 *   bench_dufort REPEATS SCENE.json...    in the scenes' folder: assets are relative to it */
#include "renderer/render.h"
#include "tests/bench/bench_support.h"
#include "tests/unit/asset_files.h"

enum { REPEATS_MAX = 101, STAGES = 3 };

static const struct way {
    const char *name;
    enum scene_order order;
    enum scene_map map;
    bool samples; /* the scene's, else the path's own choice */
} ways[] = {
    {"published", SCENE_ORDER_SORTED, SCENE_MAP_AFFINE, true},
    {"as here", SCENE_ORDER_AUTO, SCENE_MAP_AUTO, true},
    {"default", SCENE_ORDER_AUTO, SCENE_MAP_AUTO, false},
};
enum { WAYS = sizeof ways / sizeof *ways };

/* What a picture from another place takes: nothing is read, baked or uploaded again. */
static const struct stage {
    const char *name;
    enum report_stage stage;
} stages[STAGES] = {{"sort_ms", REPORT_STAGE_sort},
                    {"shadow_ms", REPORT_STAGE_shadow},
                    {"draw_ms", REPORT_STAGE_draw}};

static int open_files;
static const struct asset_source source = {files_open, files_close, &open_files};

struct taken {
    double wall[REPEATS_MAX], processor[REPEATS_MAX], stage[STAGES][REPEATS_MAX];
    struct error_metrics error;
    struct report_work work;
    int samples; /* of the first shell */
    enum scene_order order;
};

static bool draw(struct renderer *renderer, struct scene *scene, const struct scene_quality *given,
                 const struct way *way, struct render_result *result) {
    struct error err = {0};
    for (size_t i = 0; i < scene->object_count; i++) {
        if (scene->objects[i].kind != SCENE_OBJECT_SHELL)
            continue;
        scene->objects[i].path = SCENE_PATH_TETRA;
        scene->objects[i].quality = (struct scene_quality){
            .samples = way->samples ? given[i].samples : 0, .order = way->order, .map = way->map};
    }
    return renderer_render(renderer, scene, &source, result, &err) == STATUS_OK ||
           bench_failed("bench_dufort", way->name, &err);
}

static void keep(struct taken *taken, int n, double processor_ms, struct render_result *result) {
    const struct report *report = &result->report;
    if (n >= 0) {
        taken->processor[n] = processor_ms;
        taken->wall[n] = 0;
        for (int s = 0; s < STAGES; s++) {
            taken->stage[s][n] = report->stage_ms[stages[s].stage];
            taken->wall[n] += taken->stage[s][n];
        }
    }
    taken->work = report->work;
    taken->samples = report->resolved.objects[0].quality.samples;
    taken->order = report->resolved.objects[0].quality.order;
    render_result_finish(result);
}

static void print(const char *name, const struct way *way, const struct taken *taken,
                  uint32_t pixels, int repeats) {
    printf("{\"scene\": \"%s\", \"way\": \"%s\", \"order\": \"%s\", \"samples\": %d, ", name,
           way->name, taken->order == SCENE_ORDER_SORTED ? "sorted" : "walk", taken->samples);
    bench_print_list("ms", taken->wall, repeats);
    bench_print_list("processor_ms", taken->processor, repeats);
    for (int s = 0; s < STAGES; s++)
        bench_print_list(stages[s].name, taken->stage[s], repeats);
    printf("\"rmse\": %.6g, \"p99\": %.4g, \"pixels\": %u, \"prisms\": %llu, \"tetrahedra\": %llu, "
           "\"fragments\": %llu}\n",
           taken->error.touched.rmse, taken->error.touched.p99, pixels,
           (unsigned long long)taken->work.prisms, (unsigned long long)taken->work.tetrahedra,
           (unsigned long long)taken->work.fragments);
    fflush(stdout);
}

static bool run_scene(struct renderer *renderer, const char *path, int repeats) {
    static struct taken taken[WAYS];
    static uint32_t pixel[BENCH_PIXELS_MAX];
    uint32_t pixels = 0;
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct scene_quality *given = NULL;
    struct truth truth = {0};
    bool good = bench_read_scene(path, &arena, &scene, &err) == STATUS_OK ||
                bench_failed("bench_dufort", path, &err);
    if (good)
        good = (given = calloc(scene.object_count, sizeof *given)) != NULL;
    for (size_t i = 0; good && i < scene.object_count; i++)
        given[i] = scene.objects[i].quality;
    if (good) {
        /* Where something throws shadows each step of the truth traces a ray to the light. */
        bool shadow = scene.light_count && scene.lights[0].shadow;
        pixels = bench_choose_pixels((uint32_t)scene.image.width, shadow ? 16 : 48, pixel);
        good = bench_trace(&scene, &source, pixel, pixels, &truth, &err) == STATUS_OK ||
               bench_failed("bench_dufort", path, &err);
    }
    for (int n = -1; n < repeats && good; n++) /* the first may compile */
        for (size_t w = 0; w < WAYS && good; w++) {
            struct render_result result;
            double began = bench_processor_ms();
            good = draw(renderer, &scene, given, &ways[w], &result);
            double processor_ms = bench_processor_ms() - began;
            if (good && n < 0)
                good = bench_judge(&result, pixel, pixels, &truth, scene.image.background,
                                   &taken[w].error, &err) == STATUS_OK ||
                       bench_failed("bench_dufort", path, &err);
            if (good)
                keep(&taken[w], n, processor_ms, &result);
        }
    for (size_t w = 0; w < WAYS && good; w++)
        print(path, &ways[w], &taken[w], pixels, repeats);
    truth_finish(&truth);
    free(given);
    arena_free(&arena);
    return good;
}

int main(int argc, char **argv) {
    int repeats = argc > 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (repeats < 1 || repeats > REPEATS_MAX) {
        fputs("usage: bench_dufort REPEATS SCENE.json...\n", stderr);
        return 2;
    }
    struct renderer_options options = {.device = -1};
    struct renderer *renderer = NULL;
    if (renderer_create(&options, &renderer, NULL) != STATUS_OK)
        return 1;
    bool good = true;
    for (int i = 2; i < argc && good; i++)
        good = run_scene(renderer, argv[i], repeats);
    renderer_destroy(renderer);
    return good ? 0 : 1;
}
