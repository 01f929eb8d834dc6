/* Chain mail: rings of round steel wire in the European four-in-one pattern, as a solid field.
 *
 * Every ring of a row leans the same way about u, the next row the other way, half a pitch aside,
 * so that each ring passes through two rings of the row above and two of the row below. The
 * proportions below were searched for: neighbours are linked (linking number 1), all others apart,
 * and the least distance between two wires' centre lines is 0.37 ring radii, so wires of 0.155 do
 * not touch.
 *
 * The distance to a torus is exact and analytic in the tile's metric (1 x 1 x VOLUME_TILE_DEPTH);
 * volume_fill.c says how it comes to be in voxels.
 */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum { RINGS_U = 3, ROWS = 8 }; /* ROWS is even: the pattern repeats after two */

#define RING_RADIUS (1.0f / (RINGS_U * 2.4f)) /* of the wire's centre line */
#define WIRE_RADIUS (0.155f * RING_RADIUS)
#define LEAN_COS    0.8660254f /* 30 degrees */
#define LEAN_SIN    0.5f

struct ring {
    float center[3];
    float sine; /* of the lean: + or - LEAN_SIN */
    float color[3];
};

static struct ring make_ring(const struct scene_material *spec, int row, int column) {
    static const float steel[3] = {0.30f, 0.31f, 0.33f};
    uint32_t state = random_hash4(spec->seed, 0xc4a1u, (uint32_t)row, (uint32_t)column);
    struct ring ring;
    ring.center[0] = ((float)column + ((row & 1) ? 0.75f : 0.25f)) / RINGS_U;
    ring.center[1] = ((float)row + 0.5f) / ROWS;
    ring.center[2] = 0.5f * (float)VOLUME_TILE_DEPTH;
    ring.sine = (row & 1) ? -LEAN_SIN : LEAN_SIN;
    float shade = random_between(&state, 0.88f, 1.10f);
    float rust = random_next(&state);
    rust = 0.10f * rust * rust;
    for (int i = 0; i < 3; i++) {
        float base = spec->has_color ? (float)spec->color[i] : steel[i];
        ring.color[i] = fminf(base * shade * (1.0f + rust * (float)(1 - i)), 1.0f);
    }
    return ring;
}

/* Depth below the surface of the ring's wire, in voxels of extent h, at a point of the tile. */
static float ring_depth(const void *part, const float point[3], const float h[3]) {
    const struct ring *ring = part;
    float x = point[0] - ring->center[0], y = point[1] - ring->center[1],
          z = point[2] - ring->center[2];
    /* Within the ring's plane: along u and along (0, cos, sin); across it: along (0, -sin, cos). */
    float e = y * LEAN_COS + z * ring->sine, across = z * LEAN_COS - y * ring->sine;
    float radius = sqrtf(x * x + e * e);
    float outward = radius - RING_RADIUS;
    float to_line = sqrtf(outward * outward + across * across);
    float distance = to_line - WIRE_RADIUS;
    if (to_line <= 0.0f || radius <= 0.0f) /* no normal: on the wire's own axis or the ring's */
        return -distance / fminf(h[0], fminf(h[1], h[2]));
    float a = outward / (to_line * radius), b = across / to_line;
    float nx = a * x * h[0];
    float ny = (a * e * LEAN_COS - b * ring->sine) * h[1];
    float nz = (a * e * ring->sine + b * LEAN_COS) * h[2];
    return -distance / sqrtf(nx * nx + ny * ny + nz * nz);
}

/* Dirt gathers deep down; polish is on top. */
static void ring_color(const void *part, const float point[3], float color[3]) {
    const struct ring *ring = part;
    float polish = 0.55f + 0.45f * point[2] / (float)VOLUME_TILE_DEPTH;
    for (int i = 0; i < 3; i++)
        color[i] = polish * ring->color[i];
}

enum status volume_make_chain(const struct scene_material *spec, struct volume *volume) {
    static const float reach[3] = {RING_RADIUS + WIRE_RADIUS, RING_RADIUS * LEAN_COS + WIRE_RADIUS,
                                   RING_RADIUS * LEAN_SIN + WIRE_RADIUS};
    volume->solid = volume_alloc_voxels(volume->size);
    if (!volume->solid)
        return STATUS_OUT_OF_MEMORY;
    for (int row = 0; row < ROWS; row++)
        for (int column = 0; column < RINGS_U; column++) {
            struct ring ring = make_ring(spec, row, column);
            float low[3], high[3];
            for (int i = 0; i < 3; i++) {
                low[i] = ring.center[i] - reach[i];
                high[i] = ring.center[i] + reach[i];
            }
            fill_part(volume->solid, volume->size, low, high, ring_depth, ring_color, &ring);
        }
    return STATUS_OK;
}
