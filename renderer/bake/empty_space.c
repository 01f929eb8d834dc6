/* See empty_space.h. Each round lets every voxel learn from its 26 neighbours; the minimum over a
 * cube is three minima along a line, which compilers turn into vector code. */
#include "renderer/bake/empty_space.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

static uint8_t least(uint8_t a, uint8_t b) {
    return a < b ? a : b;
}

/* to[i] = min(a[i], b[i], c[i]) */
static void least_of_rows(uint8_t *to, const uint8_t *a, const uint8_t *b, const uint8_t *c,
                          int n) {
    for (int i = 0; i < n; i++)
        to[i] = least(a[i], least(b[i], c[i]));
}

/* The minimum of each value of a periodic row and its two neighbours. */
static void least_along_row(uint8_t *to, const uint8_t *row, int n) {
    for (int i = 1; i + 1 < n; i++)
        to[i] = least(row[i], least(row[i - 1], row[i + 1]));
    to[0] = least(row[0], least(row[n - 1], row[n > 1 ? 1 : 0]));
    to[n - 1] = least(row[n - 1], least(row[n > 1 ? n - 2 : 0], row[0]));
}

/* One round; whether anything changed. `rows` and `layers` are as large as `distance`. */
static bool spread(const int size[3], uint8_t *distance, uint8_t *rows, uint8_t *layers) {
    const int nu = size[0], nv = size[1], nw = size[2];
    const size_t layer = (size_t)nu * (size_t)nv;
    for (size_t row = 0; row < (size_t)nv * (size_t)nw; row++)
        least_along_row(rows + row * (size_t)nu, distance + row * (size_t)nu, nu);
    for (int w = 0; w < nw; w++)
        for (int v = 0; v < nv; v++) {
            const uint8_t *in = rows + (size_t)w * layer;
            least_of_rows(layers + (size_t)w * layer + (size_t)v * (size_t)nu,
                          in + (size_t)v * (size_t)nu,
                          in + (size_t)((v + nv - 1) % nv) * (size_t)nu,
                          in + (size_t)((v + 1) % nv) * (size_t)nu, nu);
        }
    bool changed = false;
    for (int w = 0; w < nw; w++) {
        const uint8_t *here = layers + (size_t)w * layer;
        const uint8_t *below = w > 0 ? here - layer : here,
                      *above = w + 1 < nw ? here + layer : here;
        uint8_t *to = distance + (size_t)w * layer;
        uint8_t differs = 0;
        for (size_t i = 0; i < layer; i++) {
            uint8_t nearest = least(here[i], least(below[i], above[i]));
            uint8_t found = least(to[i], (uint8_t)(nearest + 1));
            differs |= (uint8_t)(found ^ to[i]);
            to[i] = found;
        }
        changed = changed || differs;
    }
    return changed;
}

enum status empty_space(const struct volume *volume, enum bake_field field, uint8_t *distance) {
    const float *voxels = field == BAKE_FIELD_SOLID ? volume->solid : volume->medium;
    const float holds = field == BAKE_FIELD_SOLID ? 0.5f : 0;
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    for (size_t i = 0; i < count; i++) {
        float value = voxels[4 * i + 3];
        bool full = field == BAKE_FIELD_SOLID ? value >= holds : value > holds;
        distance[i] = full ? 0 : EMPTY_SPACE_MAX;
    }
    uint8_t *rows = calloc(count + 1, 1), *layers = calloc(count + 1, 1);
    enum status status = rows && layers ? STATUS_OK : STATUS_OUT_OF_MEMORY;
    if (status == STATUS_OK)
        for (int round = 1;
             round < EMPTY_SPACE_MAX && spread(volume->size, distance, rows, layers);)
            round++;
    free(rows);
    free(layers);
    return status;
}
