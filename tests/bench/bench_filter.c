/* Filtering against 64-fold supersampling: one sample a pixel, through each filter, compared with
 * the mean of 64 unfiltered ones, at several distances; the picture shrinks with the distance, so
 * that the object keeps its size in it. RMSE is over the pixels that the 64 samples drew on,
 * premultiplied linear, of up to 24 views around the object; `bias` the mean error of their
 * colours, which noise is not in. Filters take turns, so that all have the same machine. Prints one
 * JSON object a line; filter.py makes the table.
 *
 *   bench_filter REPEATS [SCENE] */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/render.h"
#include "tests/bench/bench_support.h"

enum { TRUTH = 64, REPEATS_MAX = 101 };

static const char *const filters[] = {"none", "mip", "view"};
enum { FILTERS = sizeof filters / sizeof *filters };

static const struct subject {
    const char *name, *objects, *lights;
    double eye[3];
} subjects[] = {
#define LIGHT "[{\"direction\": [-1, 1, -2], \"color\": [3, 3, 3]}]"
    {"fur-torus",
     "{\"shell\": {\"mesh\": {\"shape\": \"torus\"}, \"thickness\": 0.12, \"tiles\": [12, 6], "
     "\"base\": {\"color\": [0.3, 0.2, 0.1]}, \"material\": {\"builtin\": \"fur\"}}",
     LIGHT,
     {0, -3, 2.2}},
    {"fur-torus-unlit",
     "{\"shell\": {\"mesh\": {\"shape\": \"torus\"}, \"thickness\": 0.12, \"tiles\": [12, 6], "
     "\"base\": {\"color\": [0.3, 0.2, 0.1]}, \"material\": {\"builtin\": \"fur\", \"lit\": "
     "false}}",
     LIGHT,
     {0, -3, 2.2}},
    {"fur-plane",
     "{\"shell\": {\"mesh\": {\"shape\": \"plane\", \"size\": [4, 4]}, \"thickness\": 0.12, "
     "\"tiles\": [24, 24], \"base\": {\"color\": [0.3, 0.2, 0.1]}, \"material\": {\"builtin\": "
     "\"fur\", \"lit\": false}}",
     LIGHT,
     {0, -2, 3}},
    {"clouds-sphere",
     "{\"shell\": {\"mesh\": {\"shape\": \"sphere\"}, \"thickness\": 0.15, \"tiles\": [8, 4], "
     "\"base\": {\"color\": [0.1, 0.2, 0.4]}, \"material\": {\"builtin\": \"clouds\"}}",
     LIGHT,
     {0, -3, 1.2}},
    {"chain-torus",
     "{\"shell\": {\"mesh\": {\"shape\": \"torus\"}, \"thickness\": 0.06, \"tiles\": [18, 8], "
     "\"base\": {\"color\": [0.05, 0.04, 0.04]}, \"material\": {\"builtin\": \"chain\"}}",
     LIGHT,
     {0, -2.8, 2.6}},
};

static enum status no_asset(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s", name);
}

static struct renderer *renderer;

static void draw(const struct subject *subject, double distance, double turn, int samples,
                 const char *filter, struct render_result *result) {
    char json[4096], object[2048];
    snprintf(object, sizeof object, "%s, \"quality\": {\"filter\": \"%s\"}}", subject->objects,
             filter);
    double c = cos(turn), s = sin(turn);
    const double *eye = subject->eye;
    int side = (int)lround((distance < 16 ? 256 : 512) / distance);
    snprintf(
        json, sizeof json,
        "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"camera\": {\"eye\": [%g, "
        "%g, %g], \"fov_y_deg\": %g}, \"lights\": %s, \"objects\": [%s]}",
        side, side, samples, distance * (c * eye[0] - s * eye[1]),
        distance * (s * eye[0] + c * eye[1]), distance * eye[2],
        360 / M_PI * atan(tan(20 * M_PI / 180) / distance), subject->lights, object);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source assets = {.open = no_asset};
    enum status status = scene_read(json, strlen(json), &arena, &scene, &err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, &scene, &assets, result, &err);
    if (status != STATUS_OK) {
        fprintf(stderr, "%s\n", err.fault_count ? err.faults[0].message : "failed");
        exit(1);
    }
    error_clear(&err);
    arena_free(&arena);
}

/* What one distance gave, summed over views. */
struct taken {
    double square, bias, draw_ms[REPEATS_MAX], processor_ms[REPEATS_MAX];
};

static void compare(const struct render_result *test, const struct render_result *truth,
                    struct taken *taken) {
    for (size_t p = 0; p < (size_t)truth->width * (size_t)truth->height; p++) {
        if (!(truth->pixels[4 * p + 3] > 0))
            continue;
        for (size_t i = 0; i < 4; i++) {
            double e = (double)test->pixels[4 * p + i] - (double)truth->pixels[4 * p + i];
            taken->square += e * e / 4;
            taken->bias += i < 3 ? e / 3 : 0;
        }
    }
}

static size_t count_touched(const struct render_result *truth) {
    size_t count = 0;
    for (size_t p = 0; p < (size_t)truth->width * (size_t)truth->height; p++)
        count += truth->pixels[4 * p + 3] > 0;
    return count;
}

static void measure(const struct subject *subject, double distance, int repeats) {
    int views = distance < 4 ? 1 : distance < 16 ? 2 : distance < 64 ? 4 : 24;
    static struct taken taken[FILTERS];
    memset(taken, 0, sizeof taken);
    double truth_ms = 0;
    size_t count = 0;
    for (int v = 0; v < views; v++) {
        struct render_result truth, test;
        double turn = 2 * M_PI * v / views + 0.1;
        draw(subject, distance, turn, TRUTH, filters[0], &truth);
        truth_ms += truth.report.stage_ms[REPORT_STAGE_draw];
        count += count_touched(&truth);
        for (int n = -1; n < repeats; n++) /* the first compiles and bakes */
            for (int f = 0; f < FILTERS; f++) {
                double began = bench_processor_ms();
                draw(subject, distance, turn, 1, filters[f], &test);
                if (n < 0) {
                    compare(&test, &truth, &taken[f]);
                } else {
                    taken[f].draw_ms[n] += test.report.stage_ms[REPORT_STAGE_draw];
                    taken[f].processor_ms[n] += bench_processor_ms() - began;
                }
                render_result_finish(&test);
            }
        render_result_finish(&truth);
    }
    for (int f = 0; f < FILTERS; f++) {
        printf(
            "{\"scene\": \"%s\", \"distance\": %g, \"filter\": \"%s\", \"rmse\": %.5g, \"bias\": "
            "%.4g, \"views\": %d, ",
            subject->name, distance, filters[f], sqrt(taken[f].square / (double)count),
            taken[f].bias / (double)count, views);
        bench_print_list("draw_ms", taken[f].draw_ms, repeats);
        bench_print_list("processor_ms", taken[f].processor_ms, repeats);
        printf("\"truth_ms\": %.1f}\n", truth_ms);
    }
    fflush(stdout);
}

int main(int argc, char **argv) {
    int repeats = argc >= 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (argc > 3 || repeats < 1 || repeats > REPEATS_MAX) {
        fputs("usage: bench_filter REPEATS [SCENE]\n", stderr);
        return 2;
    }
    struct renderer_options options = {.device = -1};
    struct error err = {0};
    if (renderer_create(&options, &renderer, &err) != STATUS_OK) {
        bench_failed("bench_filter", "OpenGL", &err);
        return 1;
    }
    static const double distances[] = {1, 4, 16, 64};
    for (size_t s = 0; s < sizeof subjects / sizeof *subjects; s++)
        for (size_t d = 0; d < sizeof distances / sizeof *distances; d++)
            if (argc < 3 || strcmp(argv[2], subjects[s].name) == 0)
                measure(&subjects[s], distances[d], repeats);
    renderer_destroy(renderer);
    return 0;
}
