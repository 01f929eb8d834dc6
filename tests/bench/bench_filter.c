/* Filtering against 64-fold supersampling: one sample a pixel, through each filter, compared with
 * the mean of 64 unfiltered ones, at several distances; the picture shrinks with the distance, so
 * that the object keeps its size in it. RMSE is over the pixels that the 64 samples drew on,
 * premultiplied linear, of up to 24 views around the object. Prints one JSON object a line;
 * bench.py makes the table.
 *
 *   bench_filter [SCENE [FILTER...]] */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/scene.h"
#include "renderer/render.h"

enum { TRUTH = 64 };

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
    snprintf(object, sizeof object, "%s, \"quality\": {%s}}", subject->objects, filter);
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

int main(int argc, char **argv) {
    struct renderer_options options = {.device = -1};
    struct error err = {0};
    if (renderer_create(&options, &renderer, &err) != STATUS_OK)
        return 1;
    static const char *all[] = {"\"filter\": \"none\"", "\"filter\": \"mip\"",
                                "\"filter\": \"view\""};
    const char *const *filters = argc > 2 ? (const char *const *)argv + 2 : all;
    int filter_count = argc > 2 ? argc - 2 : 3;
    static const double distances[] = {1, 4, 16, 64};
    for (size_t s = 0; s < sizeof subjects / sizeof *subjects; s++) {
        if (argc > 1 && strcmp(argv[1], "all") != 0 && strcmp(argv[1], subjects[s].name) != 0)
            continue;
        for (size_t d = 0; d < sizeof distances / sizeof *distances; d++) {
            int views = distances[d] < 4 ? 1 : distances[d] < 16 ? 2 : distances[d] < 64 ? 4 : 24;
            double sum[16] = {0}, bias[16] = {0}, ms[17] = {0};
            size_t count = 0;
            for (int v = 0; v < views; v++) {
                struct render_result truth, test;
                double turn = 2 * M_PI * v / views + 0.1;
                draw(&subjects[s], distances[d], turn, TRUTH, all[0], &truth);
                ms[16] += truth.report.stage_ms[REPORT_STAGE_draw];
                for (int f = 0; f < filter_count; f++) {
                    draw(&subjects[s], distances[d], turn, 1, filters[f], &test);
                    ms[f] += test.report.stage_ms[REPORT_STAGE_draw];
                    for (size_t p = 0; p < (size_t)truth.width * (size_t)truth.height; p++) {
                        if (!(truth.pixels[4 * p + 3] > 0))
                            continue;
                        count += f == 0;
                        for (size_t i = 0; i < 4; i++) {
                            double e =
                                (double)test.pixels[4 * p + i] - (double)truth.pixels[4 * p + i];
                            sum[f] += e * e / 4;
                            bias[f] += i < 3 ? e / 3 : 0;
                        }
                    }
                    render_result_finish(&test);
                }
                render_result_finish(&truth);
            }
            for (int f = 0; f < filter_count; f++)
                printf("%-16s %3g x  %-24s rmse %.5f  bias %+.5f  draw ms %.1f (64 samples %.1f)\n",
                       subjects[s].name, distances[d], filters[f], sqrt(sum[f] / (double)count),
                       bias[f] / (double)count, ms[f], ms[16]);
            fflush(stdout);
        }
    }
    renderer_destroy(renderer);
    return 0;
}
