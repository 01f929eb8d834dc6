/* Woven cloth: a plain weave of thick yarn (over one, under one), as a solid field; the weave of
 * Wang et al. 2004, figure 9(c), and Dufort et al. 2005, color plate C, which both use volumes of
 * 64 x 64 x 32.
 *
 * A thread is a flattened round section along a line that sways over and under its neighbours. Its
 * surface is the plies of the yarn: bulges that run round it in a helix, a whole number of turns
 * along the tile. The field is the section's gauge (1 on the surface) in tile widths. */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum { THREADS = 4, PLIES = 5, TURNS = 8 }; /* THREADS is even: over and under repeat after two */

/* In tile widths. Where two threads cross, their centres are 2 SWAY apart: they touch. */
static const float HALF_WIDTH = 0.098f, HALF_HEIGHT = 0.056f, SWAY = 0.056f;
static const float PLY = 0.07f; /* of the section's radius */

struct thread {
    int axis; /* along which it runs: 0 is u */
    float center;
    float sign; /* over (1) or under its first crossing */
    float phase;
    uint32_t seed;
    float color[3];
};

static struct thread make_thread(const struct scene_material *spec, int axis, int index) {
    static const float yarns[2][3] = {{0.50f, 0.37f, 0.22f}, {0.40f, 0.27f, 0.15f}};
    struct thread thread = {.axis = axis};
    thread.seed = random_hash4(spec->seed, 0x3ea7u, (uint32_t)axis, (uint32_t)index);
    uint32_t state = thread.seed;
    thread.center = ((float)index + 0.5f + random_between(&state, -0.03f, 0.03f)) / THREADS;
    thread.sign = ((index + axis) & 1) ? -1.0f : 1.0f;
    thread.phase = random_next(&state);
    float shade = random_between(&state, 0.85f, 1.15f);
    float warmth = random_between(&state, -0.05f, 0.05f);
    for (int i = 0; i < 3; i++) {
        float tint = shade * (1.0f + warmth * (float)(1 - i));
        thread.color[i] = fminf(fill_tint(spec, i, yarns[axis][i]) * tint, 1.0f);
    }
    return thread;
}

/* How high the thread's centre lies: +1 and -1 at its crossings, in turns. */
static float sway_at(const struct thread *thread, float along) {
    float crossings = along * THREADS - 0.5f;
    int first = (int)floorf(crossings);
    float t = fill_smooth(0.0f, 1.0f, crossings - (float)first);
    return thread->sign * ((first & 1) ? 2.0f * t - 1.0f : 1.0f - 2.0f * t);
}

/* The section at a point: position around the centre in radii, and how far the plies bulge there,
 * 0 in the grooves to 1. */
struct section {
    float x, y, radius, bulge;
};

/* Without the plies. */
static struct section smooth_section(const struct thread *thread, const float point[3]) {
    float sway = SWAY * sway_at(thread, point[thread->axis]);
    struct section s = {.bulge = 1.0f};
    s.x = (point[1 - thread->axis] - thread->center) / HALF_WIDTH;
    s.y = (point[2] - 0.5f * (float)VOLUME_TILE_DEPTH - sway) / HALF_HEIGHT;
    s.radius = sqrtf(s.x * s.x + s.y * s.y);
    return s;
}

static struct section section_at(const struct thread *thread, const float point[3]) {
    struct section s = smooth_section(thread, point);
    float along = point[thread->axis];
    float c = s.radius > 0.0f ? s.x / s.radius : 1.0f, i = s.radius > 0.0f ? s.y / s.radius : 0.0f;
    /* cos(5 a) and sin(5 a) from those of a. */
    float c2 = c * c - i * i, i2 = 2.0f * c * i, c4 = c2 * c2 - i2 * i2, i4 = 2.0f * c2 * i2;
    float c5 = c4 * c - i4 * i, i5 = i4 * c + c4 * i, helix_c, helix_i;
    fill_turn(along * TURNS + thread->phase, &helix_c, &helix_i);
    float wave = c5 * helix_c + i5 * helix_i;
    s.bulge = 1.0f - (0.5f - 0.5f * wave) * (0.5f - 0.5f * wave);
    return s;
}

static float thread_field(const void *part, const float point[3]) {
    struct section s = section_at(part, point);
    return (s.radius - (1.0f - PLY + PLY * s.bulge)) * HALF_HEIGHT;
}

static float thread_depth(const void *part, const float point[3], const float h[3]) {
    /* Far outside and far inside the plies do not matter: the field's gradient is below 2. */
    float radius = smooth_section(part, point).radius;
    float most = 2.0f * fmaxf(h[0], fmaxf(h[1], h[2])) / HALF_HEIGHT;
    if (radius > 1.0f + most || radius < 1.0f - PLY - most)
        return radius > 1.0f ? -2.0f : 2.0f;
    return fill_field_depth(thread_field, part, point, h);
}

/* Grooves are dark, and so is what lies deep; fibres run along the plies. */
static void thread_color(const void *part, const float point[3], float color[3]) {
    const struct thread *thread = part;
    struct section s = section_at(thread, point);
    float along = point[thread->axis], fibre = 0.0f;
    if (s.radius > 0.6f) /* deeper down nobody sees them */
        fibre = random_noise(thread->seed, along * 48.0f, 9.0f * s.x + 24.0f * along,
                             9.0f * s.y + 0.5f, 48, 1 << 20);
    float w = point[2] / (float)VOLUME_TILE_DEPTH;
    float shade = (0.45f + 0.55f * s.bulge) * (0.55f + 0.45f * w) * (1.0f + 0.18f * fibre);
    for (int i = 0; i < 3; i++)
        color[i] = fminf(shade * thread->color[i], 1.0f);
}

enum status volume_make_weave(const struct scene_material *spec, struct volume *volume) {
    volume->solid = volume_alloc_voxels(volume->size);
    if (!volume->solid)
        return STATUS_OUT_OF_MEMORY;
    for (int axis = 0; axis < 2; axis++)
        for (int index = 0; index < THREADS; index++) {
            struct thread thread = make_thread(spec, axis, index);
            float low[3] = {0.0f, 0.0f, 0.0f}, high[3] = {1.0f, 1.0f, (float)VOLUME_TILE_DEPTH};
            low[1 - axis] = thread.center - HALF_WIDTH;
            high[1 - axis] = thread.center + HALF_WIDTH;
            fill_part(volume->solid, volume->size, low, high, thread_depth, thread_color, &thread);
        }
    return STATUS_OK;
}
