/* Rubble: broken stones of many sizes heaped on the ground, as a solid field; after the "rocks with
 * masking and silhouettes" of Dufort et al. 2005, figure 1, and their tube of 512 x 512 x 32
 * voxels.
 *
 * A stone is the convex body cut out by planes in random directions, with worn edges: the 8-norm of
 * a point's distances to them (1 on the surface), which is smooth, as 1 / (offset) weighs each, and
 * needs no powf(). Stones are dropped one by one, the big ones first, and come to rest where they
 * touch the ground or what lies there already; those that would stand out of the shell are left
 * out. Noise roughens them. Earth covers the ground. */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum { PLANES = 18, STONES_MAX = 700 };
enum { EARTH_CELLS = 5, EARTH_OCTAVES = 4 };

/* In tile widths. */
static const float EARTH = 0.035f, EARTH_SWING = 0.02f;
static const float TOP = 0.243f;
static const float NEAR = 0.74f; /* how far two stones' centres are apart, of their radii's sum */

static const struct {
    int tries;
    float least, most; /* radius */
} classes[] = {{30, 0.085f, 0.125f}, {200, 0.045f, 0.075f}, {700, 0.018f, 0.036f}};

struct stone {
    float center[3];
    float radius;
    uint32_t seed;
};

/* A stone as it is carved. */
struct carved {
    struct stone stone;
    float planes[PLANES][3]; /* normal over offset, in tile widths */
    float color[3];
};

static float nearest_copy(float d) {
    return d - floorf(d + 0.5f);
}

/* How high a stone comes to rest at its (u, v); more than 1 where it cannot lie there. */
static float rest_height(const struct stone *stones, int count, const struct stone *dropped) {
    float height = EARTH + 0.5f * dropped->radius;
    for (int i = 0; i < count; i++) {
        float dx = nearest_copy(dropped->center[0] - stones[i].center[0]);
        float dy = nearest_copy(dropped->center[1] - stones[i].center[1]);
        float reach = NEAR * (stones[i].radius + dropped->radius);
        float up2 = reach * reach - dx * dx - dy * dy;
        if (up2 > 0.0f)
            height = fmaxf(height, stones[i].center[2] + sqrtf(up2));
    }
    return height;
}

static int drop_stones(const struct scene_material *spec, struct stone *stones) {
    int count = 0;
    uint32_t state = random_hash2(spec->seed, 0x90c6u);
    for (size_t k = 0; k < sizeof classes / sizeof *classes; k++)
        for (int i = 0; i < classes[k].tries && count < STONES_MAX; i++) {
            struct stone stone = {.radius =
                                      random_between(&state, classes[k].least, classes[k].most)};
            stone.center[0] = random_next(&state);
            stone.center[1] = random_next(&state);
            stone.seed = random_hash(state);
            stone.center[2] = rest_height(stones, count, &stone);
            if (stone.center[2] + stone.radius <= TOP)
                stones[count++] = stone;
        }
    return count;
}

static struct carved carve(const struct scene_material *spec, const struct stone *stone) {
    static const float minerals[3][3] = {
        {0.27f, 0.255f, 0.235f}, {0.33f, 0.28f, 0.21f}, {0.19f, 0.19f, 0.20f}};
    struct carved carved = {.stone = *stone};
    uint32_t state = stone->seed;
    float squash[3]; /* the axis along which it is flat */
    fill_direction(&state, squash);
    for (int i = 0; i < PLANES; i++) {
        float n[3] = {0.0f, 0.0f, 0.0f}, offset = 1.0f;
        if (i < 6) { /* a box around it: no corner is further than it */
            n[i / 2] = (i & 1) ? -1.0f : 1.0f;
        } else {
            fill_direction(&state, n);
            float flat = n[0] * squash[0] + n[1] * squash[1] + n[2] * squash[2];
            offset = (1.0f - 0.38f * flat * flat) * random_between(&state, 0.74f, 1.0f);
        }
        for (int k = 0; k < 3; k++)
            carved.planes[i][k] = n[k] / (offset * stone->radius);
    }
    const float *mineral = minerals[(int)(random_next(&state) * 3.0f)];
    float shade = random_between(&state, 0.7f, 1.25f);
    for (int i = 0; i < 3; i++)
        carved.color[i] = fill_tint(spec, i, mineral[i]) * shade;
    return carved;
}

/* The gauge minus 1, in tile widths, roughened, and its gradient. */
static float stone_depth(const void *part, const float point[3], const float h[3]) {
    const struct carved *carved = part;
    const struct stone *stone = &carved->stone;
    float q[3], sum = 0.0f, gradient[3] = {0.0f, 0.0f, 0.0f};
    for (int i = 0; i < 3; i++)
        q[i] = point[i] - stone->center[i];
    if (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] > 3.0f * stone->radius * stone->radius)
        return -2.0f; /* beyond the corners of its box */
    for (int i = 0; i < PLANES; i++) {
        const float *n = carved->planes[i];
        float m = n[0] * q[0] + n[1] * q[1] + n[2] * q[2];
        if (m <= 0.0f)
            continue;
        float m2 = m * m, m4 = m2 * m2, m7 = m4 * m2 * m;
        sum += m7 * m;
        for (int k = 0; k < 3; k++)
            gradient[k] += m7 * n[k];
    }
    float most = fmaxf(h[0], fmaxf(h[1], h[2])) / stone->radius; /* a voxel, in radii */
    float gauge = sqrtf(sqrtf(sqrtf(sum)));
    /* Its gradient is at most 1 / (0.62 * 0.74) a radius; the noise adds 0.05 at most. */
    if (gauge - 1.0f > 2.2f * most + 0.05f)
        return -2.0f;
    if (gauge - 1.0f < -2.2f * most - 0.05f)
        return 2.0f;
    float scale = 2.6f / stone->radius;
    float rough = 0.045f * random_noise(stone->seed, q[0] * scale, q[1] * scale, q[2] * scale,
                                        1 << 20, 1 << 20);
    float per = gauge > 0.0f ? gauge / sum : 0.0f;
    for (int k = 0; k < 3; k++)
        gradient[k] *= per;
    return fill_gradient_depth(gauge - 1.0f + rough, gradient, h);
}

/* Speckled, darker where dirt gathers. */
static void stone_color(const void *part, const float point[3], float color[3]) {
    const struct carved *carved = part;
    uint32_t seed = random_hash(carved->stone.seed);
    float q[3];
    for (int i = 0; i < 3; i++)
        q[i] = (point[i] - carved->stone.center[i]) * 30.0f;
    float speckle =
        random_noise(seed, q[0], q[1], q[2], 1 << 20, 1 << 20) +
        0.6f * random_noise(seed, 3.0f * q[0], 3.0f * q[1], 3.0f * q[2], 1 << 20, 1 << 20);
    float low = fill_smooth(0.0f, 0.16f, point[2]);
    float shade = (0.45f + 0.55f * low) * (1.0f + 0.28f * speckle);
    for (int i = 0; i < 3; i++)
        color[i] = fminf(shade * carved->color[i], 1.0f);
}

/* Earth between the stones, gently uneven: its depth is that along w. */
static void lay_earth(const struct scene_material *spec, struct volume *volume) {
    static const float soil[3] = {0.105f, 0.075f, 0.048f};
    const int *size = volume->size;
    uint32_t seed = random_hash2(spec->seed, 0xea27u);
    size_t layer = (size_t)size[0] * (size_t)size[1] * 4;
    float voxels_per_width = (float)size[2] / (float)VOLUME_TILE_DEPTH;
    for (int y = 0; y < size[1]; y++)
        for (int x = 0; x < size[0]; x++) {
            float u = ((float)x + 0.5f) / (float)size[0], v = ((float)y + 0.5f) / (float)size[1];
            float height = EARTH, amplitude = EARTH_SWING;
            for (int octave = 0; octave < EARTH_OCTAVES; octave++) {
                int cells = EARTH_CELLS << octave;
                height +=
                    amplitude * random_noise(random_hash2(seed, (uint32_t)octave), u * (float)cells,
                                             v * (float)cells, 0.5f, cells, cells);
                amplitude *= 0.5f;
            }
            float grain = random_noise(random_hash2(seed, 99u), u * 64.0f, v * 64.0f, 0.5f, 64, 64);
            float *voxel = volume->solid + ((size_t)y * (size_t)size[0] + (size_t)x) * 4;
            for (int z = 0; z < size[2]; z++, voxel += layer) {
                float d = height * voxels_per_width - ((float)z + 0.5f);
                float s = fminf(0.5f + 0.5f * d, 1.0f);
                if (s <= 0.0f)
                    break;
                if (s <= voxel[3])
                    continue;
                for (int i = 0; i < 3; i++) {
                    float own = spec->has_color ? 0.35f * (float)spec->color[i] : soil[i];
                    voxel[i] = s * fminf(own * (1.0f + 0.5f * grain), 1.0f);
                }
                voxel[3] = s;
            }
        }
}

enum status volume_make_rocks(const struct scene_material *spec, struct volume *volume) {
    struct stone *stones = calloc(STONES_MAX, sizeof *stones);
    volume->solid = volume_alloc_voxels(volume->size);
    if (!stones || !volume->solid) {
        free(stones);
        return STATUS_OUT_OF_MEMORY;
    }
    int count = drop_stones(spec, stones);
    for (int k = 0; k < count; k++) {
        struct carved carved = carve(spec, &stones[k]);
        float low[3], high[3];
        for (int i = 0; i < 3; i++) {
            low[i] = stones[k].center[i] - 1.05f * stones[k].radius;
            high[i] = stones[k].center[i] + 1.05f * stones[k].radius;
        }
        fill_part(volume->solid, volume->size, low, high, stone_depth, stone_color, &carved);
    }
    free(stones);
    lay_earth(spec, volume);
    return STATUS_OK;
}
