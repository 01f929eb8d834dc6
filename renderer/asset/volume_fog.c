/* Fog: dense and even on the ground, thinning out with height, torn into wisps at the top; for what
 * lies over terrain or hangs above a volcano (with `color`).
 *
 * Extinction falls with height as that of ground fog does, over a scale that varies from place to
 * place: (1 + h/a)^-8, which is nearly exponential and, unlike expf(), the same in every C library.
 * It is then eroded by gradient noise in five octaves (Perlin 2002), flattened to half its width
 * because layers of air shear fog into streaks: the threshold rises with height, so that nearly all
 * of the noise stays near the ground, and only its crests near the top (after the cloud erosion of
 * Schneider and Vos 2015). A coarser noise bends the finer ones' coordinates (Perlin's and
 * Hoffert's turbulence, 1989), which draws wisps out into curls.
 *
 * Left out: scattering, and wind. */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

/* Whole numbers of noise cells across the tile. */
enum { COVER_CELLS = 2, BEND_CELLS = 5, WISP_CELLS = 4, WISP_OCTAVES = 5 };

static const float grey[3] = {0.78f, 0.80f, 0.83f};
static const float EXTINCTION = 4.0f; /* times the thickness, on the ground */

/* The share of the ground's extinction at h tops above it. */
static float thinned(float h) {
    float q = 1.0f / (1.0f + 0.3f * h);
    float q4 = q * q * q * q;
    return q4 * q4;
}

/* Height at which the fog ends, but for its wisps: 0.25 to 0.95 of the thickness. */
static float top_at(uint32_t seed, float u, float v) {
    float sum = 0.0f, amplitude = 1.0f;
    for (int octave = 0; octave < 3; octave++) {
        int cells = COVER_CELLS << octave;
        sum += amplitude * random_noise(random_hash2(seed, 0xf09u + (uint32_t)octave),
                                        u * (float)cells, v * (float)cells, 0.61f, cells, cells);
        amplitude *= 0.5f;
    }
    return 0.25f + 0.7f * fill_smooth(-0.7f, 0.8f, sum);
}

/* What bends the coordinate along one axis, in tile widths. */
static float bend_at(uint32_t seed, int axis, float u, float v) {
    uint32_t salt = random_hash2(seed, 0xbe4du + (uint32_t)axis);
    float cells = (float)BEND_CELLS;
    return 0.045f * random_noise(salt, u * cells, v * cells, 0.23f, BEND_CELLS, BEND_CELLS);
}

static void fill_fog(const void *user, float u, float v, int full, int count, float *density) {
    uint32_t seed = *(const uint32_t *)user;
    float top = top_at(seed, u, v);
    float bent[2] = {u + bend_at(seed, 0, u, v), v + bend_at(seed, 1, u, v)};
    float noise[FILL_COLUMN_MAX] = {0};
    float amplitude = 0.62f;
    for (int octave = 0; octave < WISP_OCTAVES; octave++) {
        int cells = WISP_CELLS << octave;
        float step = 2.0f * (float)cells * (float)VOLUME_TILE_DEPTH / (float)full;
        random_noise_line(random_hash2(seed, 0x3159u + (uint32_t)octave), bent[0] * (float)cells,
                          bent[1] * (float)cells, 0.5f * step, step, cells, cells, amplitude, count,
                          noise);
        amplitude *= 0.58f;
    }
    for (int i = 0; i < count; i++) {
        float w = ((float)i + 0.5f) / (float)full, h = w / top;
        float threshold = -0.9f + 0.9f * h;
        float kept = fill_smooth(threshold, threshold + 0.6f, noise[i]);
        float open = 1.0f - fill_smooth(0.8f, 1.0f, w); /* nothing is left at the shell's top */
        density[i] = EXTINCTION * thinned(h) * kept * open;
    }
}

enum status volume_make_fog(const struct scene_material *spec, struct volume *volume) {
    return fill_medium(spec, grey, fill_fog, &spec->seed, volume);
}
