/* Media from columns of extinction; see volume_fill.h. */
#include "renderer/asset/volume_fill.h"

#include "renderer/asset/volume_generators.h"

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
