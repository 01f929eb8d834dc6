/* What the built-in materials share when they fill their voxels. */
#ifndef PELT_RENDERER_ASSET_VOLUME_FILL_H
#define PELT_RENDERER_ASSET_VOLUME_FILL_H

#include "api/scene.h"
#include "api/status.h"
#include "renderer/asset/volume.h"

/* 0 below `low`, 1 above `high`, smooth between; low < high. */
static inline float fill_smooth(float low, float high, float x) {
    float t = (x - low) / (high - low);
    t = t < 0.0f ? 0.0f : t > 1.0f ? 1.0f : t;
    return t * t * (3.0f - 2.0f * t);
}

/* Whole number modulo n, in [0, n). */
static inline int fill_wrap(int i, int n) {
    int r = i % n;
    return r < 0 ? r + n : r;
}

/* The most heights that a column is asked for at once. */
enum { FILL_COLUMN_MAX = 64 };

/* Extinction (times the thickness) of a column at (u, v) in [0, 1): at the heights
 * w = (i + 1/2) / full, i < count <= FILL_COLUMN_MAX. */
typedef void fill_column(const void *user, float u, float v, int full, int count, float *density);

/* Fills a medium of one colour (`spec`'s, else `color`) from its columns. A grid coarser than 48 x
 * 48 x 16 takes the mean of several samples a voxel, so that the mean extinction is the same at
 * every size. The top layer stays empty where there are several, so that nothing is cut at w = 1.
 * STATUS_OUT_OF_MEMORY. */
enum status fill_medium(const struct scene_material *spec, const float color[3],
                        fill_column *column, const void *user, struct volume *volume);

#endif
