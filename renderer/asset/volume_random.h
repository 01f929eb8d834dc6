/* Random numbers and periodic gradient noise for the built-in materials, from integers and IEEE
 * arithmetic alone: the same seed gives the same bytes on every machine and C library.
 *
 * The hash is PCG-RXS-M-XS 32 (O'Neill 2014, as a hash: Jarzynski and Olano 2020, "Hash Functions
 * for GPU Rendering"); the noise is Perlin's (2002, "Improving Noise") with a hash in place of his
 * permutation table, which allows any period. */
#ifndef PELT_RENDERER_ASSET_VOLUME_RANDOM_H
#define PELT_RENDERER_ASSET_VOLUME_RANDOM_H

#include <stdbool.h>
#include <stdint.h>

static inline uint32_t random_hash(uint32_t x) {
    uint32_t state = x * 747796405u + 2891336453u;
    uint32_t word = ((state >> ((state >> 28) + 4)) ^ state) * 277803737u;
    return (word >> 22) ^ word;
}

static inline uint32_t random_hash2(uint32_t a, uint32_t b) {
    return random_hash(a + random_hash(b));
}

static inline uint32_t random_hash4(uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    return random_hash2(random_hash2(a, b), random_hash2(c, d));
}

/* [0, 1) from the upper 24 bits: exact in float. */
static inline float random_unit(uint32_t hash) {
    return (float)(hash >> 8) * 0x1p-24f;
}

/* A stream: each call of random_next() advances it. */
static inline float random_next(uint32_t *state) {
    *state += 0x9e3779b9u;
    return random_unit(random_hash(*state));
}

/* Between low and high. */
static inline float random_between(uint32_t *state, float low, float high) {
    return low + (high - low) * random_next(state);
}

/* Perlin noise, about [-1, 1], at (x, y, z) in lattice cells; periodic in x and y with the given
 * periods (whole numbers of cells, >= 1), unbounded in z. C1, and C2 but for float rounding. */
float random_noise(uint32_t seed, float x, float y, float z, int period_x, int period_y);

/* Adds `amplitude` times the same noise at (x, y, z + i * dz) to sums[i], i < count; dz > 0. Along
 * such a line the noise is linear between lattice planes but for the fade, so the lattice is hashed
 * once a plane and not once a sample: 64 samples over 8 cells cost a tenth. */
void random_noise_line(uint32_t seed, float x, float y, float z, float dz, int period_x,
                       int period_y, float amplitude, int count, float *sums);

/* Worley's cellular noise (1996): one feature point in each cell of a lattice, periodic in x and y,
 * kept in a table because 27 of them are looked at for each value. */
struct random_cells {
    int count[3];       /* cells along x, y, z */
    float (*points)[3]; /* (count + 2)^3 of them: with a border of one cell on every side */
};

/* False where memory ran out. The caller frees. */
bool random_cells_make(struct random_cells *cells, uint32_t seed, int nx, int ny, int nz);
void random_cells_free(struct random_cells *cells);

/* The squared distance to the nearest feature point in cells, at most 1. (x, y, z) within
 * [0, count]. */
float random_cells_at(const struct random_cells *cells, float x, float y, float z);

#endif
