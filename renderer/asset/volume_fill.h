/* What the built-in materials share when they fill their voxels. */
#ifndef PELT_RENDERER_ASSET_VOLUME_FILL_H
#define PELT_RENDERER_ASSET_VOLUME_FILL_H

#include <stdint.h>

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

/* Cosine and sine of an angle in turns, |turns| < 2^22, to 4e-7 and the same in every C library. */
void fill_turn(float turns, float *cosine, float *sine);

/* A direction of unit length, from a stream of random numbers. */
void fill_direction(uint32_t *state, float direction[3]);

/* The material's tint, or else its own colour. */
static inline float fill_tint(const struct scene_material *spec, int i, float own) {
    return spec->has_color ? (float)spec->color[i] : own;
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

/* A solid is made of parts. Points are in the tile's metric (1 x 1 x VOLUME_TILE_DEPTH), and not
 * wrapped: a part sees all of itself, the voxels wrap.
 *
 * The depth below a part's surface at a point, in voxels of extent h; beyond +-1 only its sign
 * counts. And its linear colour there. */
typedef float fill_depth(const void *part, const float point[3], const float h[3]);
typedef void fill_color(const void *part, const float point[3], float color[3]);

/* Puts a part within [low, high] into a solid field: where two overlap, the deeper one shows. */
void fill_part(float *solid, const int size[3], const float low[3], const float high[3],
               fill_depth *depth, fill_color *color, const void *part);

/* The depth below the surface where a field is 0, negative inside: f over its change for a step of
 * one voxel, which is exact for a plane and right to first order at any surface. The field is in
 * tile widths, its gradient at most 2. */
typedef float fill_field(const void *part, const float point[3]);
float fill_field_depth(fill_field *field, const void *part, const float point[3], const float h[3]);

/* The same for a value with a gradient that is known. */
float fill_gradient_depth(float value, const float gradient[3], const float h[3]);

/* Takes the extinction out of voxels that are solid: s >= 1/2. */
void fill_clear_solid(struct volume *volume);

/* The solid under a height for each column, 0 to 1 of the thickness, with 3 colours each: tells
 * steep places from flat ones as volume_height.c says, where it is. `heights` are clamped. */
void fill_heights(struct volume *volume, float *heights, const float *colors);

#endif
