/* Overlapping scales, as of a reptile: each rises from under the ones behind it and lies with its
 * free end (towards -v) over the ones before it, with air between, which no height field can show;
 * after the "overlapped squamae" of the dinosaur of Wang et al. 2004, figure 9(d).
 *
 * A scale is a lens: rho^4 + (z/t)^2 = 1, with rho = 1 along its outline, an ellipse that is drawn
 * to a point at the free end, and z the height above a tilted plane that is bent down to both sides
 * and raised to a keel in the middle. Skin closes what is seen from under the free ends. */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum { COLUMNS = 4, ROWS = 6 }; /* ROWS is even: the rows are half a scale aside in turns */

/* In tile widths. */
static const float HALF_WIDTH = 0.143f, HALF_LENGTH = 0.178f, HALF_THICKNESS = 0.016f;
static const float MIDDLE = 0.118f; /* height of the centre */
static const float TILT = 0.34f;    /* rise towards -v */
static const float BEND = 0.034f, KEEL = 0.018f;
static const float SKIN = 0.042f;

struct scale {
    float center[2];
    float height, tilt, skew;
    uint32_t seed;
    float color[3];
};

static struct scale make_scale(const struct scene_material *spec, int row, int column) {
    static const float hide[3] = {0.155f, 0.175f, 0.062f};
    struct scale scale;
    scale.seed = random_hash4(spec->seed, 0x5ca1eu, (uint32_t)row, (uint32_t)column);
    uint32_t state = scale.seed;
    scale.center[0] = ((float)column + ((row & 1) ? 0.75f : 0.25f)) / COLUMNS +
                      random_between(&state, -0.006f, 0.006f);
    scale.center[1] = ((float)row + 0.5f) / ROWS + random_between(&state, -0.006f, 0.006f);
    scale.height = MIDDLE + random_between(&state, -0.003f, 0.003f);
    scale.tilt = TILT + random_between(&state, -0.02f, 0.02f);
    scale.skew = random_between(&state, -0.05f, 0.05f);
    float shade = random_between(&state, 0.75f, 1.25f);
    float warmth = random_between(&state, -0.12f, 0.12f);
    for (int i = 0; i < 3; i++) {
        float tint = shade * (1.0f + warmth * (float)(1 - i));
        scale.color[i] = fminf(fill_tint(spec, i, hide[i]) * tint, 1.0f);
    }
    return scale;
}

/* Position on the scale: across (-1 to 1), towards the free end (-1 to 1), squared radius rho^2. */
static void place(const struct scale *scale, const float point[3], float at[3]) {
    at[1] = (scale->center[1] - point[1]) / HALF_LENGTH;
    float narrow = 1.0f - 0.22f * fill_smooth(0.0f, 1.0f, at[1]);
    at[0] = (point[0] - scale->center[0]) / (HALF_WIDTH * narrow);
    at[2] = at[0] * at[0] + at[1] * at[1];
}

static float scale_field(const void *part, const float point[3]) {
    const struct scale *scale = part;
    float at[3];
    place(scale, point, at);
    float across = fminf(at[0] * at[0], 2.0f);
    float keel = KEEL / (1.0f + 30.0f * across);
    float plane = scale->height + scale->tilt * at[1] * HALF_LENGTH +
                  scale->skew * at[0] * HALF_WIDTH - BEND * across + keel;
    float z = (point[2] - plane) / HALF_THICKNESS;
    return (sqrtf(at[2] * at[2] + z * z) - 1.0f) * HALF_THICKNESS;
}

static float scale_depth(const void *part, const float point[3], const float h[3]) {
    return fill_field_depth(scale_field, part, point, h);
}

/* Growth rings, a pale rim, mottled; the covered end is dark. */
static void scale_color(const void *part, const float point[3], float color[3]) {
    const struct scale *scale = part;
    float at[3], ring, unused;
    place(scale, point, at);
    float rho = sqrtf(at[2]);
    fill_turn(5.0f * rho, &ring, &unused);
    float mottle = random_noise(scale->seed, 3.0f * at[0], 3.0f * at[1], 0.5f, 1 << 20, 1 << 20);
    float rim = fill_smooth(0.80f, 0.98f, rho) * fill_smooth(-0.4f, 0.3f, at[1]);
    float covered = 0.35f + 0.65f * fill_smooth(-0.7f, 0.3f, at[1]);
    float shade = covered * (1.0f + 0.07f * ring + 0.30f * mottle) * (1.0f + 0.9f * rim);
    for (int i = 0; i < 3; i++)
        color[i] = fminf(shade * scale->color[i], 1.0f);
}

static float skin_depth(const void *part, const float point[3], const float h[3]) {
    (void)part;
    return (SKIN - point[2]) / h[2];
}

static void skin_color(const void *part, const float point[3], float color[3]) {
    static const float own[3] = {0.060f, 0.058f, 0.030f};
    (void)point;
    const struct scene_material *spec = part;
    for (int i = 0; i < 3; i++)
        color[i] = spec->has_color ? 0.3f * (float)spec->color[i] : own[i];
}

enum status volume_make_scales(const struct scene_material *spec, struct volume *volume) {
    volume->solid = volume_alloc_voxels(volume->size);
    if (!volume->solid)
        return STATUS_OUT_OF_MEMORY;
    for (int row = 0; row < ROWS; row++)
        for (int column = 0; column < COLUMNS; column++) {
            struct scale scale = make_scale(spec, row, column);
            float low[3] = {scale.center[0] - HALF_WIDTH, scale.center[1] - HALF_LENGTH, 0.0f};
            float high[3] = {scale.center[0] + HALF_WIDTH, scale.center[1] + HALF_LENGTH,
                             (float)VOLUME_TILE_DEPTH};
            fill_part(volume->solid, volume->size, low, high, scale_depth, scale_color, &scale);
        }
    static const float low[3] = {0.0f, 0.0f, 0.0f};
    float high[3] = {1.0f, 1.0f, SKIN};
    fill_part(volume->solid, volume->size, low, high, skin_depth, skin_color, spec);
    return STATUS_OK;
}
