/* Central differences of opacity and of the solid field; see normals.h for what is stored and why.
 *
 * Opacity needs an exponential for each voxel, so each thread keeps three layers of the field and
 * moves up through its part of the volume: memory stays at 3 * size_u * size_v floats, and each
 * voxel is evaluated once (but for the two layers that two threads share). */
#include "renderer/bake/normals.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

/* Below this many voxels a second thread costs more than it gains. */
enum { TWO_THREADS_FROM = 1 << 20 };

uint16_t bake_half_from_float(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    uint32_t sign = (bits >> 16) & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u)
        return (uint16_t)(sign | 0x7e00u); /* NaN */
    if (magnitude >= 0x477ff000u)
        return (uint16_t)(sign | 0x7c00u); /* rounds past 65504 */
    if (magnitude < 0x38800000u) {
        /* A subnormal half counts in units of 2^-24: adding 1/2, whose last place is 2^-24, makes
         * the FPU round to that, to nearest even. */
        float shifted;
        memcpy(&shifted, &magnitude, sizeof shifted);
        shifted += 0.5f;
        uint32_t rounded;
        memcpy(&rounded, &shifted, sizeof rounded);
        return (uint16_t)(sign | (rounded - 0x3f000000u));
    }
    uint32_t odd = (magnitude >> 13) & 1u;
    return (uint16_t)(sign | ((magnitude - 0x38000000u + 0xfffu + odd) >> 13));
}

float bake_float_from_half(uint16_t half) {
    uint32_t sign = (uint32_t)(half & 0x8000u) << 16, magnitude = half & 0x7fffu;
    float value;
    if (magnitude < 0x400u) {
        value = (float)magnitude * 0x1p-24f;
    } else {
        uint32_t bits = magnitude >= 0x7c00u ? 0x7f800000u | (magnitude & 0x3ffu) << 13
                                             : (magnitude << 13) + 0x38000000u;
        memcpy(&value, &bits, sizeof value);
    }
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits |= sign;
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* The layers [first, end) of one thread. */
struct part {
    const struct volume *volume;
    enum bake_field field;
    uint16_t *halves;
    float *layers; /* scratch: three layers of the field */
    int first, end;
};

static void load_layer(const struct part *part, int z, float *layer) {
    const struct volume *volume = part->volume;
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1];
    if (part->field == BAKE_FIELD_SOLID) {
        const float *voxel = volume->solid + 4 * count * (size_t)z;
        for (size_t i = 0; i < count; i++)
            layer[i] = voxel[4 * i + 3];
    } else {
        const float *voxel = volume->medium + 4 * count * (size_t)z;
        float per_voxel = -1.0f / (float)volume->size[2];
        for (size_t i = 0; i < count; i++)
            layer[i] = voxel[4 * i + 3] > 0.0f ? -expm1f(voxel[4 * i + 3] * per_voxel) : 0.0f;
    }
}

static void write_layer(const struct part *part, int z, const float *below, const float *here,
                        const float *above) {
    int nx = part->volume->size[0], ny = part->volume->size[1];
    size_t width = (size_t)nx;
    uint16_t *out = part->halves + 4 * width * (size_t)ny * (size_t)z;
    for (int y = 0; y < ny; y++) {
        const float *row = here + width * (size_t)y;
        const float *front = here + width * (size_t)(y ? y - 1 : ny - 1);
        const float *back = here + width * (size_t)(y + 1 < ny ? y + 1 : 0);
        const float *down = below + width * (size_t)y, *up = above + width * (size_t)y;
        for (int x = 0; x < nx; x++, out += 4) {
            float left = row[x ? x - 1 : nx - 1], right = row[x + 1 < nx ? x + 1 : 0];
            out[0] = bake_half_from_float(0.5f * (left - right));
            out[1] = bake_half_from_float(0.5f * (front[x] - back[x]));
            out[2] = bake_half_from_float(0.5f * (down[x] - up[x]));
            out[3] = 0;
        }
    }
}

static void *run_part(void *argument) {
    const struct part *part = argument;
    int last = part->volume->size[2] - 1;
    size_t count = (size_t)part->volume->size[0] * (size_t)part->volume->size[1];
    float *below = part->layers, *here = below + count, *above = here + count;
    load_layer(part, part->first, here);
    if (part->first > 0)
        load_layer(part, part->first - 1, below);
    else
        memcpy(below, here, count * sizeof *here);
    for (int z = part->first; z < part->end; z++) {
        if (z < last)
            load_layer(part, z + 1, above);
        else
            memcpy(above, here, count * sizeof *here);
        write_layer(part, z, below, here, above);
        float *spare = below;
        below = here;
        here = above;
        above = spare;
    }
    return NULL;
}

enum status bake_gradients(const struct volume *volume, enum bake_field field, uint16_t *halves) {
    assert(field == BAKE_FIELD_SOLID ? volume->solid != NULL : volume->medium != NULL);
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1];
    bool two = volume->size[2] > 1 && count * (size_t)volume->size[2] >= TWO_THREADS_FROM;
    float *layers = malloc((two ? 6 : 3) * count * sizeof *layers);
    if (!layers)
        return STATUS_OUT_OF_MEMORY;
    int middle = two ? volume->size[2] / 2 : volume->size[2];
    struct part lower = {volume, field, halves, layers, 0, middle};
    struct part upper = {volume, field, halves, layers + 3 * count, middle, volume->size[2]};
    pthread_t thread;
    bool started = two && pthread_create(&thread, NULL, run_part, &upper) == 0;
    run_part(&lower);
    if (started)
        pthread_join(thread, NULL);
    else if (two)
        run_part(&upper); /* no thread to be had: the same work, later */
    free(layers);
    return STATUS_OK;
}
