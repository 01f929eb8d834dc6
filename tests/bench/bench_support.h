/* What benches of scenes share: scenes from files, processor time, lists of figures. */
#ifndef PELT_TESTS_BENCH_SUPPORT_H
#define PELT_TESTS_BENCH_SUPPORT_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "api/scene.h"
#include "renderer/render.h"
#include "renderer/truth.h"

/* Of all threads of this process. */
static inline double bench_processor_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

/* Tells on stderr, and clears `err`; false, so that it can be returned. */
static inline bool bench_failed(const char *bench, const char *what, struct error *err) {
    fprintf(stderr, "%s: %s: %s\n", bench, what,
            err->fault_count ? err->faults[0].message : status_title(err->status));
    error_clear(err);
    return false;
}

/* A scene file, whose assets are relative to the current folder; `arena` owns what it holds. */
static inline enum status bench_read_scene(const char *path, struct arena *arena,
                                           struct scene *scene, struct error *err) {
    enum { SCENE_BYTES = 1 << 16 };
    char *json = malloc(SCENE_BYTES);
    FILE *file = json ? fopen(path, "rb") : NULL;
    size_t length = file ? fread(json, 1, SCENE_BYTES, file) : 0;
    enum status status =
        file ? scene_read(json, length, arena, scene, err)
             : error_fault(err, STATUS_ASSET_NOT_FOUND, NULL, "%s cannot be read", path);
    if (file)
        fclose(file);
    free(json);
    return status;
}

/* Pixels to compare at: one of each of `row` x `row` blocks, not always the same place in it, of a
 * picture of `side` x `side`. How many they are. */
enum { BENCH_ROW_MAX = 48, BENCH_PIXELS_MAX = BENCH_ROW_MAX * BENCH_ROW_MAX };
static inline uint32_t bench_choose_pixels(uint32_t side, uint32_t row,
                                           uint32_t pixel[BENCH_PIXELS_MAX]) {
    uint32_t state = 1;
    for (uint32_t i = 0; i < row * row; i++) {
        uint32_t x = i % row, y = i / row;
        uint32_t x0 = x * side / row, x1 = (x + 1) * side / row;
        uint32_t y0 = y * side / row, y1 = (y + 1) * side / row;
        state = state * 1664525u + 1013904223u; /* Press et al., Numerical Recipes, 7.1 */
        pixel[i] = (y0 + (state >> 24) % (y1 - y0)) * side + x0 + (state >> 16) % 256 % (x1 - x0);
    }
    return row * row;
}

/* The truth of those pixels; truth_finish(). */
static inline enum status bench_trace(const struct scene *scene, const struct asset_source *assets,
                                      const uint32_t *pixel, uint32_t count, struct truth *truth,
                                      struct error *err) {
    struct reference_request request = {
        .pixels = pixel, .pixel_count = count, .threads = 2, .tolerance = 1e-4};
    struct truth_source *source = NULL;
    enum status status = truth_create(scene, assets, &source, err);
    if (status == STATUS_OK)
        status = truth_draw_pixels(source, &request, truth, err);
    truth_destroy(source);
    return status;
}

static inline enum status bench_judge(const struct render_result *result, const uint32_t *pixel,
                                      uint32_t count, const struct truth *truth,
                                      const double background[4], struct error_metrics *metrics,
                                      struct error *err) {
    float test[BENCH_PIXELS_MAX][4];
    for (uint32_t i = 0; i < count; i++)
        memcpy(test[i], result->pixels + 4 * (size_t)pixel[i], sizeof test[i]);
    return error_compare_pixels(test[0], truth->pixels, count, truth->touched, background, metrics,
                                err);
}

static inline void bench_print_list(const char *name, const double *values, int count) {
    printf("\"%s\": [", name);
    for (int n = 0; n < count; n++)
        printf("%s%.2f", n ? ", " : "", values[n]);
    printf("], ");
}

#endif
