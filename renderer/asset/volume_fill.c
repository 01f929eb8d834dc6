/* Media from columns of extinction, solids from parts; see volume_fill.h.
 *
 * The solid field wants depths in voxels, which need not be cubes in the tile's metric: along the
 * unit normal n the distance D grows by |(n_x h_x, n_y h_y, n_z h_z)| for a step of one in voxel
 * coordinates, h being the voxel's extent; so d = -D / |n h|, and for any field f with gradient g
 * d = -f / |g h|. */
#include "renderer/asset/volume_fill.h"

#include <math.h>

#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

/* The coarsest grid that shows a shape with one sample a voxel. */
enum { FINE_SIDE = 48, FINE_DEPTH = 16 };

_Static_assert((int)FILL_COLUMN_MAX >= (int)VOLUME_DEPTH_MAX, "a column of the finest grid");
_Static_assert((int)FILL_COLUMN_MAX >= 2 * FINE_DEPTH, "and of a grid made of several samples");

enum status fill_medium(const struct scene_material *spec, const float color[3],
                        fill_column *column, const void *user, struct volume *volume) {
    const int *size = volume->size;
    volume->medium = volume_alloc_voxels(size);
    if (!volume->medium)
        return STATUS_OUT_OF_MEMORY;
    int fine[3];
    for (int i = 0; i < 3; i++)
        fine[i] = ((i == 2 ? FINE_DEPTH : FINE_SIDE) + size[i] - 1) / size[i];
    float weight = 1.0f / ((float)fine[0] * (float)fine[1] * (float)fine[2]);
    int layers = size[2] > 1 ? size[2] - 1 : 1;
    size_t layer = (size_t)size[0] * (size_t)size[1] * 4;
    float density[FILL_COLUMN_MAX];
    for (int y = 0; y < size[1] * fine[1]; y++)
        for (int x = 0; x < size[0] * fine[0]; x++) {
            float u = ((float)x + 0.5f) / (float)(size[0] * fine[0]);
            float v = ((float)y + 0.5f) / (float)(size[1] * fine[1]);
            column(user, u, v, size[2] * fine[2], layers * fine[2], density);
            float *voxel = volume->medium +
                           4 * ((size_t)(y / fine[1]) * (size_t)size[0] + (size_t)(x / fine[0]));
            for (int z = 0; z < layers; z++, voxel += layer)
                for (int k = 0; k < fine[2]; k++)
                    voxel[3] += weight * density[z * fine[2] + k];
        }
    size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            volume->medium[4 * i + (size_t)c] =
                volume->medium[4 * i + 3] * (spec->has_color ? (float)spec->color[c] : color[c]);
    volume->medium_max = volume_medium_max(volume->medium, size);
    return STATUS_OK;
}

void fill_turn(float turns, float *cosine, float *sine) {
    /* The nearest quarter turn, and an eighth at most on either side of it. */
    float quarters = 4.0f * turns;
    int quarter = (int)(quarters + (quarters < 0.0f ? -0.5f : 0.5f));
    float x = (quarters - (float)quarter) * 1.57079633f, x2 = x * x;
    float c = 1.0f - x2 * (0.5f - x2 * (1.0f / 24 - x2 * (1.0f / 720 - x2 / 40320)));
    float s = x * (1.0f - x2 * (1.0f / 6 - x2 * (1.0f / 120 - x2 / 5040)));
    switch (fill_wrap(quarter, 4)) {
    case 0:
        *cosine = c, *sine = s;
        break;
    case 1:
        *cosine = -s, *sine = c;
        break;
    case 2:
        *cosine = -c, *sine = -s;
        break;
    default:
        *cosine = s, *sine = -c;
        break;
    }
}

void fill_direction(uint32_t *state, float direction[3]) {
    float z = random_between(state, -1.0f, 1.0f), r = sqrtf(1.0f - z * z), c, s;
    fill_turn(random_next(state), &c, &s);
    direction[0] = r * c;
    direction[1] = r * s;
    direction[2] = z;
}

float fill_gradient_depth(float value, const float gradient[3], const float h[3]) {
    float x = gradient[0] * h[0], y = gradient[1] * h[1], z = gradient[2] * h[2];
    float per_voxel = sqrtf(x * x + y * y + z * z);
    if (per_voxel > fabsf(value) * 0.5f)
        return -value / per_voxel;
    return value < 0.0f ? 2.0f
                        : -2.0f; /* deep, or where there is no normal: only the sign counts */
}

float fill_field_depth(fill_field *field, const void *part, const float point[3],
                       const float h[3]) {
    float value = field(part, point), most = fmaxf(h[0], fmaxf(h[1], h[2]));
    if (fabsf(value) > 2.0f * most) /* further than a voxel, the gradient being at most 2 */
        return value < 0.0f ? 2.0f : -2.0f;
    float gradient[3];
    for (int i = 0; i < 3; i++) {
        float at[3] = {point[0], point[1], point[2]};
        at[i] += h[i] / 32;
        gradient[i] = (field(part, at) - value) / (at[i] - point[i]);
    }
    return fill_gradient_depth(value, gradient, h);
}

void fill_part(float *solid, const int size[3], const float low[3], const float high[3],
               fill_depth *depth, fill_color *color, const void *part) {
    float h[3] = {1.0f / (float)size[0], 1.0f / (float)size[1],
                  (float)VOLUME_TILE_DEPTH / (float)size[2]};
    int first[3], last[3];
    for (int i = 0; i < 3; i++) {
        /* The ramp ends one voxel outside the surface. */
        first[i] = (int)floorf(low[i] / h[i] - 1.5f);
        last[i] = (int)ceilf(high[i] / h[i] + 0.5f);
    }
    first[2] = first[2] < 0 ? 0 : first[2];
    last[2] = last[2] >= size[2] ? size[2] - 1 : last[2];
    for (int z = first[2]; z <= last[2]; z++)
        for (int y = first[1]; y <= last[1]; y++) {
            float *row = solid + ((size_t)z * (size_t)size[1] + (size_t)fill_wrap(y, size[1])) *
                                     (size_t)size[0] * 4;
            int column = fill_wrap(first[0], size[0]);
            for (int x = first[0]; x <= last[0]; x++, column++) {
                if (column == size[0])
                    column = 0;
                float *voxel = row + (size_t)column * 4;
                if (voxel[3] >= 1.0f)
                    continue;
                float point[3] = {((float)x + 0.5f) * h[0], ((float)y + 0.5f) * h[1],
                                  ((float)z + 0.5f) * h[2]};
                float d = depth(part, point, h);
                float s = d > 1.0f ? 1.0f : 0.5f + 0.5f * d;
                if (!(s > voxel[3]))
                    continue;
                float c[3];
                color(part, point, c);
                for (int i = 0; i < 3; i++)
                    voxel[i] = s * c[i];
                voxel[3] = s;
            }
        }
}

void fill_clear_solid(struct volume *volume) {
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    for (size_t i = 0; i < 4 * count; i += 4)
        if (volume->solid[i + 3] >= 0.5f)
            for (size_t c = 0; c < 4; c++)
                volume->medium[i + c] = 0.0f;
}
