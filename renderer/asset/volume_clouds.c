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

static const float EXTINCTION = 22.0f; /* times the thickness: the heart of a cloud is opaque */

static float smooth(float low, float high, float x) {
    float t = fminf(fmaxf((x - low) / (high - low), 0.0f), 1.0f);
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
    return sum + 0.12f;
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
    float tint[3] = {0.97f, 0.975f, 0.985f};
    if (spec->has_color)
        for (int i = 0; i < 3; i++)
            tint[i] = (float)spec->color[i];
    float cost[VOLUME_DEPTH_MAX];
    for (int z = 0; z < size[2]; z++)
        cost[z] = height_cost(((float)z + 0.5f) / (float)size[2]);

    size_t layer = (size_t)size[0] * (size_t)size[1] * 4;
    for (int y = 0; y < size[1]; y++)
        for (int x = 0; x < size[0]; x++) {
            float u = ((float)x + 0.5f) / (float)size[0], v = ((float)y + 0.5f) / (float)size[1];
            float cover = cover_at(spec->seed, u, v);
            float *voxel = volume->medium + ((size_t)y * (size_t)size[0] + (size_t)x) * 4;
            for (int z = 0; z < size[2]; z++, voxel += layer) {
                /* Billows add at most about 0.5 after their mean is taken off. */
                if (cover - cost[z] < -0.5f || (z == size[2] - 1 && size[2] > 1))
                    continue;
                float w = ((float)z + 0.5f) / (float)size[2];
                float f = cover - cost[z] + 1.1f * (billow_at(cells, u, v, w) - 0.62f);
                if (f <= 0.0f)
                    continue;
                float extinction = EXTINCTION * smooth(0.0f, 0.55f, f);
                for (int i = 0; i < 3; i++)
                    voxel[i] = extinction * tint[i];
                voxel[3] = extinction;
            }
        }
    volume->medium_max = volume_medium_max(volume->medium, size);
    status = STATUS_OK;
done:
    for (int octave = 0; octave < BILLOW_OCTAVES; octave++)
        random_cells_free(&cells[octave]);
    return status;
}
