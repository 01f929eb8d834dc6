/* Bark: long plates with deep fissures between them that run along v, fibres along the plates, and
 * cross cracks; the tree bark of Wang et al. 2004, figure 10 (128 x 128 x 16 voxels), and the
 * relief of Bhagvat et al. 2009.
 *
 * It is a height field: plates are the cells of a stretched cellular noise, and how deep a place is
 * follows from F2 - F1, the difference between the distances to the two nearest feature points
 * (Worley 1996), which is 0 on the borders between cells. What turns heights into a solid is what
 * height images use (volume_height.c). Left out: plates that peel off. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

/* Whole numbers of cells across the tile. */
enum { PLATES_U = 6, PLATES_V = 2, FINE_U = 14, FINE_V = 9 };
enum { FIBRES_U = 32, FIBRES_V = 4, BEND_U = 2, BEND_V = 4 };
enum { FINE_SIDE = 96 }; /* the coarsest grid that takes one sample a voxel */

struct spot {
    float height; /* 0 to 1 */
    float color[3];
};

/* F2 - F1 at (x, y) in cells, and the hash of the cell of F1. */
static float crack_at(uint32_t seed, float x, float y, int period_x, int period_y,
                      uint32_t *nearest) {
    int ix = (int)floorf(x), iy = (int)floorf(y);
    float first = 9.0f, second = 9.0f; /* squared cells: any feature point is nearer */
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++) {
            uint32_t hash = random_hash4(seed, 0xbac6u, (uint32_t)fill_wrap(ix + i, period_x),
                                         (uint32_t)fill_wrap(iy + j, period_y));
            float dx = (float)(ix + i) + 0.1f + 0.8f * random_unit(hash) - x;
            float dy = (float)(iy + j) + 0.1f + 0.8f * random_unit(random_hash(hash)) - y;
            float d = dx * dx + dy * dy;
            if (d < first) {
                second = first;
                first = d;
                *nearest = hash;
            } else if (d < second) {
                second = d;
            }
        }
    return sqrtf(second) - sqrtf(first);
}

static float bend_at(uint32_t seed, uint32_t salt, float u, float v) {
    return random_noise(random_hash2(seed, salt), u * BEND_U, v * BEND_V, 0.5f, BEND_U, BEND_V);
}

static struct spot bark_at(const struct scene_material *spec, float u, float v) {
    static const float deep[3] = {0.050f, 0.032f, 0.020f}, plate[3] = {0.235f, 0.185f, 0.140f};
    uint32_t seed = spec->seed, cell = 0, unused;
    float x = u + 0.030f * bend_at(seed, 1, u, v) + 0.008f * bend_at(seed, 2, 2.0f * u, 4.0f * v);
    float y = v + 0.020f * bend_at(seed, 3, u, v);
    float fissure = crack_at(seed, x * PLATES_U, y * PLATES_V, PLATES_U, PLATES_V, &cell);
    float fine = crack_at(random_hash(seed), x * FINE_U, y * FINE_V, FINE_U, FINE_V, &unused);
    float fibre = 0.0f, amplitude = 0.6f;
    for (int octave = 0; octave < 3; octave++) {
        int cells[2] = {FIBRES_U << octave, FIBRES_V << octave};
        fibre += amplitude * random_noise(random_hash2(seed, 0xf1b7eu + (uint32_t)octave),
                                          x * (float)cells[0], y * (float)cells[1], 0.5f, cells[0],
                                          cells[1]);
        amplitude *= 0.6f;
    }
    float own = random_unit(random_hash2(cell, 7)); /* of the plate */
    float body = fill_smooth(0.0f, 0.40f, fissure);
    float crack = 1.0f - fill_smooth(0.0f, 0.16f, fine);
    struct spot spot;
    spot.height =
        0.16f + body * (0.36f + 0.16f * own - 0.12f * crack) + 0.09f * fibre * (0.3f + body);
    spot.height = fminf(fmaxf(spot.height, 0.0f), 0.98f);
    float light = fill_smooth(0.12f, 0.62f, spot.height) * (0.75f + 0.5f * own);
    for (int i = 0; i < 3; i++) {
        float high = fill_tint(spec, i, plate[i]);
        float low = spec->has_color ? 0.2f * (float)spec->color[i] : deep[i];
        spot.color[i] = (low + (high - low) * light) * (1.0f + 0.35f * fibre);
        spot.color[i] = fminf(fmaxf(spot.color[i], 0.0f), 1.0f);
    }
    return spot;
}

enum status volume_make_bark(const struct scene_material *spec, struct volume *volume) {
    const int *size = volume->size;
    size_t count = (size_t)size[0] * (size_t)size[1];
    float *heights = calloc(count, sizeof *heights), *colors = calloc(count, 3 * sizeof *colors);
    volume->solid = volume_alloc_voxels(size);
    enum status status = STATUS_OUT_OF_MEMORY;
    if (!heights || !colors || !volume->solid)
        goto done;
    int fine[2];
    for (int i = 0; i < 2; i++)
        fine[i] = (FINE_SIDE + size[i] - 1) / size[i];
    float weight = 1.0f / ((float)fine[0] * (float)fine[1]);
    for (int y = 0; y < size[1] * fine[1]; y++)
        for (int x = 0; x < size[0] * fine[0]; x++) {
            size_t i = (size_t)(y / fine[1]) * (size_t)size[0] + (size_t)(x / fine[0]);
            struct spot spot = bark_at(spec, ((float)x + 0.5f) / (float)(size[0] * fine[0]),
                                       ((float)y + 0.5f) / (float)(size[1] * fine[1]));
            heights[i] += weight * spot.height;
            for (size_t c = 0; c < 3; c++)
                colors[3 * i + c] += weight * spot.color[c];
        }
    fill_heights(volume, heights, colors);
    status = STATUS_OK;
done:
    free(heights);
    free(colors);
    return status;
}
