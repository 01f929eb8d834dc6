/* A welded grate: flat bars along v stand on edge, round rods along u lie across them, and one sees
 * through; the vase with "a mesostructure interior that consists of empty space" of Wang et al.
 * 2004, figure 9(a), whose grid has 32 x 32 x 16 voxels.
 *
 * The distances to a bar (a rounded box without ends) and to a rod (a cylinder) are exact. Where
 * they meet, the weld is the polynomial smooth minimum of both (Quilez 2013, "Smooth minimum"). */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum { BARS = 4, RODS = 4 };
enum { RUST_CELLS = 6, RUST_OCTAVES = 4 };

/* In tile widths. */
static const float BAR_HALF_WIDTH = 0.026f, BAR_LOW = 0.02f, BAR_HIGH = 0.185f, BAR_ROUND = 0.014f;
static const float ROD_RADIUS = 0.031f, ROD_HEIGHT = 0.178f, WELD = 0.024f;

struct grate {
    uint32_t seed;
    const struct scene_material *spec;
};

/* Distance to the nearest of `count` lines across an axis. */
static float to_line(float at, int count) {
    float x = at * (float)count;
    return fabsf(x - floorf(x) - 0.5f) / (float)count;
}

static float grate_field(const void *part, const float point[3]) {
    (void)part;
    float middle = 0.5f * (BAR_LOW + BAR_HIGH), half = 0.5f * (BAR_HIGH - BAR_LOW);
    float x = to_line(point[0], BARS) - (BAR_HALF_WIDTH - BAR_ROUND);
    float z = fabsf(point[2] - middle) - (half - BAR_ROUND);
    float x0 = fmaxf(x, 0.0f), z0 = fmaxf(z, 0.0f);
    float bar = sqrtf(x0 * x0 + z0 * z0) + fminf(fmaxf(x, z), 0.0f) - BAR_ROUND;
    float y = to_line(point[1], RODS), up = point[2] - ROD_HEIGHT;
    float rod = sqrtf(y * y + up * up) - ROD_RADIUS;
    float blend = fmaxf(WELD - fabsf(bar - rod), 0.0f);
    return fminf(bar, rod) - blend * blend / (4.0f * WELD);
}

static float grate_depth(const void *part, const float point[3], const float h[3]) {
    return fill_field_depth(grate_field, part, point, h);
}

/* Grey iron, with rust in patches that grow towards the bottom. */
static void grate_color(const void *part, const float point[3], float color[3]) {
    static const float iron[3] = {0.22f, 0.23f, 0.25f}, rust[3] = {0.16f, 0.072f, 0.036f};
    const struct grate *grate = part;
    float sum = 0.0f, amplitude = 0.6f;
    for (int octave = 0; octave < RUST_OCTAVES; octave++) {
        int cells = RUST_CELLS << octave;
        float scale = (float)cells;
        sum +=
            amplitude * random_noise(random_hash2(grate->seed, (uint32_t)octave), point[0] * scale,
                                     point[1] * scale, point[2] * scale, cells, cells);
        amplitude *= 0.6f;
    }
    float w = point[2] / (float)VOLUME_TILE_DEPTH;
    float rusty = fill_smooth(-0.05f, 0.45f, sum + 0.25f * (0.6f - w));
    for (int i = 0; i < 3; i++) {
        float paint = fill_tint(grate->spec, i, iron[i]);
        float worn = grate->spec->has_color ? 0.45f * paint : rust[i];
        color[i] = fminf((paint + (worn - paint) * rusty) * (1.0f + 0.3f * sum), 1.0f);
    }
}

enum status volume_make_grate(const struct scene_material *spec, struct volume *volume) {
    static const float low[3] = {0.0f, 0.0f, 0.0f}, high[3] = {1.0f, 1.0f, VOLUME_TILE_DEPTH};
    struct grate grate = {random_hash2(spec->seed, 0x96a7eu), spec};
    volume->solid = volume_alloc_voxels(volume->size);
    if (!volume->solid)
        return STATUS_OUT_OF_MEMORY;
    fill_part(volume->solid, volume->size, low, high, grate_depth, grate_color, &grate);
    return STATUS_OK;
}
