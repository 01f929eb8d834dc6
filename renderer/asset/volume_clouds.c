/* Cumulus: soft white billows with an almost flat base and rounded tops, as extinction per voxel.
 *
 * A field F over the tile is positive inside the cloud: where clouds stand is decided by Perlin
 * noise over (u, v) alone, how high they reach by how far inside a point is; their outline is
 * pushed out by inverted cellular noise in three octaves, whose rounded bumps and sharp creases are
 * the cauliflower look (Worley 1996; Schneider and Vos 2015, "The Real-time Volumetric Cloudscapes
 * of Horizon Zero Dawn"). Extinction rises smoothly with F, so the rim is thin and the heart dense.
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

/* Where clouds stand: about -0.5 (clear sky) to 0.7 (middle of a cloud). */
static float cover_at(uint32_t seed, float u, float v) {
    float sum = 0.0f, amplitude = 1.0f;
    for (int octave = 0; octave < 3; octave++) {
        int cells = COVER_CELLS << octave;
        sum += amplitude * random_noise(random_hash2(seed, 0xc0feu + (uint32_t)octave),
                                        u * (float)cells, v * (float)cells, 0.37f, cells, cells);
        amplitude *= 0.45f;
    }
    return sum + 0.18f;
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
    struct random_cells cells[BILLOW_OCTAVES];
};

static void fill_clouds(const void *user, float u, float v, int full, int count, float *density) {
    const struct clouds *clouds = user;
    float cover = cover_at(clouds->seed, u, v);
    for (int i = 0; i < count; i++)
        density[i] = extinction_at(clouds->cells, cover, u, v, ((float)i + 0.5f) / (float)full);
}

enum status volume_make_clouds(const struct scene_material *spec, struct volume *volume) {
    enum status status = STATUS_OUT_OF_MEMORY;
    struct clouds clouds = {.seed = spec->seed};
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++) {
        int n = BILLOW_CELLS << octave;
        int nz = (int)ceilf((float)n * (float)VOLUME_TILE_DEPTH) + 1;
        uint32_t seed = random_hash2(spec->seed, 0xb1110u + (uint32_t)octave);
        if (!random_cells_make(&clouds.cells[octave], seed, n, n, nz))
            goto done;
    }
    status = fill_medium(spec, white, fill_clouds, &clouds, volume);
done:
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++)
        random_cells_free(&clouds.cells[octave]);
    return status;
}
