/* What makes the samples of one grid from those of another: means where the source is finer, linear
 * interpolation where it is coarser. Samples stand at (k + 1/2) / n. */
#ifndef PELT_RENDERER_ASSET_VOLUME_RESAMPLE_H
#define PELT_RENDERER_ASSET_VOLUME_RESAMPLE_H

#include <math.h>
#include <stdbool.h>

/* Which source samples make one target sample along one axis: `count` of them from `first` on,
 * modulo the source's size. Weights add up to 1. */
struct taps {
    int first, count;
    float *weights; /* within the table's own memory */
};

/* The taps of every target sample; one malloc'ed block, or NULL. `periodic`: the source repeats;
 * else its ends are held. */
struct taps *resample_taps(int source, int target, bool periodic);

static inline float resample_linear_from_srgb(float v) {
    return v <= 0.04045f ? v / 12.92f : powf((v + 0.055f) / 1.055f, 2.4f);
}

#endif
