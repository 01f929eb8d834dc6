/* Cumulus: soft white billows with an almost flat base and rounded tops, as extinction per voxel.
 *
 * A field F over the tile is positive inside the cloud: where clouds stand is decided by Perlin
 * noise over (u, v) alone, how high they reach by how far inside a point is; their outline is
 * pushed out by inverted cellular noise in three octaves, whose rounded bumps and sharp creases are
 * the cauliflower look (Worley 1996; Schneider and Vos 2015, "The Real-time Volumetric Cloudscapes
 * of Horizon Zero Dawn"). Extinction rises smoothly with F, so the rim is thin and the heart dense.
 *
 * Left out: scattering, and wind. The top layer is empty, so that nothing is cut at w = 1. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

/* Whole numbers of noise cells across the tile. */
enum { COVER_CELLS = 3, BILLOW_CELLS = 7, BILLOW_OCTAVES = 3 };

/* The coarsest grid that shows the shape with one sample a voxel. */
enum { FINE_SIDE = 48, FINE_DEPTH = 16 };

static const float white[3] = {0.84f, 0.85f, 0.87f};
static const float EXTINCTION = 18.0f; /* times the thickness: the heart of a cloud is opaque */

static float smooth(float low, float high, float x) {
    float t = (x - low) / (high - low);
    t = t < 0.0f ? 0.0f : t > 1.0f ? 1.0f : t;
    return t * t * (3.0f - 2.0f * t);
}

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
    float base = 2.2f * (1.0f - smooth(0.04f, 0.20f, w));
    return base + 0.85f * w * w;
}

/* Extinction at one point; `cover` is that of its (u, v). */
static float extinction_at(const struct random_cells cells[BILLOW_OCTAVES], float cover, float u,
                           float v, float w) {
    float inside = cover - height_cost(w);
    if (inside < -0.5f) /* billows add at most about 0.4 */
        return 0.0f;
    inside += 1.1f * (billow_at(cells, u, v, w) - 0.62f);
    return inside > 0.0f ? EXTINCTION * smooth(0.0f, 0.8f, inside) : 0.0f;
}

/* Adds one column of samples to a column of voxels, `weight` each. The top layer stays empty. */
static void add_column(const struct random_cells cells[BILLOW_OCTAVES], const int size[3], int deep,
                       float cover, float u, float v, float weight, float *voxel) {
    int layers = size[2] > 1 ? size[2] - 1 : 1;
    size_t layer = (size_t)size[0] * (size_t)size[1] * 4;
    for (int z = 0; z < layers; z++, voxel += layer)
        for (int k = 0; k < deep; k++) {
            float w = ((float)(z * deep + k) + 0.5f) / (float)(size[2] * deep);
            voxel[3] += weight * extinction_at(cells, cover, u, v, w);
        }
}

enum status volume_make_clouds(const struct scene_material *spec, struct volume *volume) {
    const int *size = volume->size;
    enum status status = STATUS_OUT_OF_MEMORY;
    struct random_cells cells[BILLOW_OCTAVES] = {{{0}, NULL}};
    volume->medium = volume_alloc_voxels(size);
    if (!volume->medium)
        return status;
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++) {
        int n = BILLOW_CELLS << octave;
        int nz = (int)ceilf((float)n * (float)VOLUME_TILE_DEPTH) + 1;
        uint32_t seed = random_hash2(spec->seed, 0xb1110u + (uint32_t)octave);
        if (!random_cells_make(&cells[octave], seed, n, n, nz))
            goto done;
    }

    /* Grids too coarse for the shape take the mean of several samples a voxel. */
    int fine[3];
    for (int i = 0; i < 3; i++)
        fine[i] = ((i == 2 ? FINE_DEPTH : FINE_SIDE) + size[i] - 1) / size[i];
    float weight = 1.0f / ((float)fine[0] * (float)fine[1] * (float)fine[2]);
    for (int y = 0; y < size[1] * fine[1]; y++)
        for (int x = 0; x < size[0] * fine[0]; x++) {
            float u = ((float)x + 0.5f) / (float)(size[0] * fine[0]);
            float v = ((float)y + 0.5f) / (float)(size[1] * fine[1]);
            size_t column = (size_t)(y / fine[1]) * (size_t)size[0] + (size_t)(x / fine[0]);
            add_column(cells, size, fine[2], cover_at(spec->seed, u, v), u, v, weight,
                       volume->medium + column * 4);
        }

    size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            volume->medium[4 * i + (size_t)c] =
                volume->medium[4 * i + 3] * (spec->has_color ? (float)spec->color[c] : white[c]);
    volume->medium_max = volume_medium_max(volume->medium, size);
    status = STATUS_OK;
done:
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++)
        random_cells_free(&cells[octave]);
    return status;
}
