/* Cumulus: soft white billows with an almost flat base and rounded tops, as extinction per voxel.
 *
 * A field F over the tile is positive inside the cloud: where clouds stand is decided by Perlin
 * noise over (u, v) alone, how high they reach by how far inside a point is; their outline is
 * pushed out by inverted cellular noise in three octaves, whose rounded bumps and sharp creases are
 * the cauliflower look (Worley 1996; Schneider and Vos 2015, "The Real-time Volumetric Cloudscapes
 * of Horizon Zero Dawn"). Extinction rises smoothly with F, so the rim is thin and the heart dense.
 *
 * `phase` is a fourth dimension, closed to a loop so that an animation may run round: where clouds
 * stand is cos(2 pi phase) of one Perlin noise and sin(2 pi phase) of another, which has the spread
 * of one at every phase, and each feature point of the billows runs along an ellipse through its
 * place of phase 0 that stays within its cell.
 *
 * Left out: scattering, and wind. */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

/* Whole numbers of noise cells across the tile. */
enum { COVER_CELLS = 3, BILLOW_CELLS = 7, BILLOW_OCTAVES = 3 };

static const float white[3] = {0.84f, 0.85f, 0.87f};
static const float EXTINCTION = 18.0f; /* times the thickness: the heart of a cloud is opaque */

/* Cosine and sine of the phase: exactly 1 and 0 for whole turns. */
struct loop {
    float cosine, sine;
};

static struct loop loop_at(double phase) {
    const double turn = 2 * 3.14159265358979324;
    double part = phase - floor(phase);
    return part == 0 ? (struct loop){1.0f, 0.0f}
                     : (struct loop){(float)cos(turn * part), (float)sin(turn * part)};
}

static bool loop_moves(struct loop loop) {
    return loop.sine != 0.0f || loop.cosine != 1.0f;
}

/* Where clouds stand: about -0.5 (clear sky) to 0.7 (middle of a cloud). */
static float cover_at(uint32_t seed, struct loop loop, float u, float v) {
    float sum = 0.0f, amplitude = 1.0f;
    for (int octave = 0; octave < 3; octave++) {
        int cells = COVER_CELLS << octave;
        float x = u * (float)cells, y = v * (float)cells;
        float noise = loop.cosine * random_noise(random_hash2(seed, 0xc0feu + (uint32_t)octave), x,
                                                 y, 0.37f, cells, cells);
        if (loop_moves(loop))
            noise += loop.sine * random_noise(random_hash2(seed, 0xc0deu + (uint32_t)octave), x, y,
                                              0.37f, cells, cells);
        sum += amplitude * noise;
        amplitude *= 0.45f;
    }
    return sum + 0.18f;
}

/* Moves the feature points along their loops. In each coordinate, with f the place of phase 0 and m
 * the middle between it and another place g in the cell, the point is at
 * m + (f - m) cos + r sin; m - |f - m| = min(f, g) >= 0, so there is an r up to which it stays. */
static void move_points(struct random_cells *cells, uint32_t seed, struct loop loop) {
    const int *n = cells->count;
    float(*point)[3] = cells->points;
    for (int k = -1; k <= n[2]; k++)
        for (int j = -1; j <= n[1]; j++)
            for (int i = -1; i <= n[0]; i++, point++) {
                uint32_t state = random_hash4(seed, (uint32_t)((i + n[0]) % n[0]),
                                              (uint32_t)((j + n[1]) % n[1]), (uint32_t)k);
                const int cell[3] = {i, j, k};
                for (int c = 0; c < 3; c++) {
                    float f = (*point)[c] - (float)cell[c];
                    float m = 0.5f * (f + random_next(&state));
                    float room = m < 0.5f ? m : 1.0f - m;
                    float r = sqrtf(fmaxf(room * room - (f - m) * (f - m), 0.0f)) *
                              random_between(&state, -1.0f, 1.0f);
                    float to = m + (f - m) * loop.cosine + r * loop.sine;
                    (*point)[c] = (float)cell[c] + fminf(fmaxf(to, 0.0f), 1.0f);
                }
            }
}

/* Rounded bumps: 0 at the creases to about 1. */
static float billow_at(const struct random_cells cells[BILLOW_OCTAVES], float u, float v, float w) {
    float sum = 0.0f, amplitude = 0.58f;
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++) {
        float scale = (float)(BILLOW_CELLS << octave);
        sum += amplitude * (1.0f - random_cells_at(&cells[octave], u * scale, v * scale,
                                                   w * scale * (float)VOLUME_TILE_DEPTH));
        amplitude *= 0.5f;
    }
    return sum;
}

/* What the height alone takes from F: a nearly flat base at w = 0.12, a round top. */
static float height_cost(float w) {
    float base = 2.2f * (1.0f - fill_smooth(0.04f, 0.20f, w));
    return base + 0.85f * w * w;
}

/* Extinction at one point; `cover` is that of its (u, v). */
static float extinction_at(const struct random_cells cells[BILLOW_OCTAVES], float cover, float u,
                           float v, float w) {
    float inside = cover - height_cost(w);
    if (inside < -0.5f) /* billows add at most about 0.4 */
        return 0.0f;
    inside += 1.1f * (billow_at(cells, u, v, w) - 0.62f);
    return inside > 0.0f ? EXTINCTION * fill_smooth(0.0f, 0.8f, inside) : 0.0f;
}

/* What a column needs to know. */
struct clouds {
    uint32_t seed;
    struct loop loop;
    struct random_cells cells[BILLOW_OCTAVES];
};

static void fill_clouds(const void *user, float u, float v, int full, int count, float *density) {
    const struct clouds *clouds = user;
    float cover = cover_at(clouds->seed, clouds->loop, u, v);
    for (int i = 0; i < count; i++)
        density[i] = extinction_at(clouds->cells, cover, u, v, ((float)i + 0.5f) / (float)full);
}

enum status volume_make_clouds(const struct scene_material *spec, struct volume *volume) {
    enum status status = STATUS_OUT_OF_MEMORY;
    struct clouds clouds = {.seed = spec->seed, .loop = loop_at(spec->phase)};
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++) {
        int n = BILLOW_CELLS << octave;
        int nz = (int)ceilf((float)n * (float)VOLUME_TILE_DEPTH) + 1;
        uint32_t seed = random_hash2(spec->seed, 0xb1110u + (uint32_t)octave);
        if (!random_cells_make(&clouds.cells[octave], seed, n, n, nz))
            goto done;
        if (loop_moves(clouds.loop))
            move_points(&clouds.cells[octave], random_hash2(seed, 0x1009u), clouds.loop);
    }
    status = fill_medium(spec, white, fill_clouds, &clouds, volume);
done:
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++)
        random_cells_free(&clouds.cells[octave]);
    return status;
}
