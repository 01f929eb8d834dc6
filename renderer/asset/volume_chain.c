/* Chain mail: rings of round steel wire in the European four-in-one pattern, as a solid field.
 *
 * Every ring of a row leans the same way about u, the next row the other way, half a pitch aside,
 * so that each ring passes through two rings of the row above and two of the row below. The
 * proportions below were searched for: neighbours are linked (linking number 1), all others apart,
 * and the least distance between two wires' centre lines is 0.37 ring radii, so wires of 0.155 do
 * not touch.
 *
 * The distance to a torus is exact and analytic in the tile's metric (1 x 1 x VOLUME_TILE_DEPTH).
 * The solid field wants it in voxels, which need not be cubes there: along the unit normal n the
 * distance D grows by |(n_x h_x, n_y h_y, n_z h_z)| for a step of one in voxel coordinates, h being
 * the voxel's extent; so d = -D / |n h|, exact for a plane and right to first order at the surface.
 */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum { RINGS_U = 3, ROWS = 8 }; /* ROWS is even: the pattern repeats after two */

static const float RING_RADIUS = 1.0f / (RINGS_U * 2.4f); /* of the wire's centre line */
static const float WIRE_RADIUS = 0.155f / (RINGS_U * 2.4f);
static const float LEAN_COS = 0.8660254f, LEAN_SIN = 0.5f; /* 30 degrees */

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
static float depth_in_voxels(const struct ring *ring, const float point[3], const float h[3]) {
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

static int wrap(int i, int n) {
    int r = i % n;
    return r < 0 ? r + n : r;
}

/* Puts one ring into the field: where two overlap within a voxel, the deeper one shows. */
static void place_ring(float *solid, const int size[3], const struct ring *ring) {
    float h[3] = {1.0f / (float)size[0], 1.0f / (float)size[1],
                  (float)VOLUME_TILE_DEPTH / (float)size[2]};
    float reach[3] = {RING_RADIUS + WIRE_RADIUS, RING_RADIUS * LEAN_COS + WIRE_RADIUS,
                      RING_RADIUS * LEAN_SIN + WIRE_RADIUS};
    int low[3], high[3];
    for (int i = 0; i < 3; i++) {
        /* The ramp ends one voxel outside the surface. */
        low[i] = (int)floorf((ring->center[i] - reach[i]) / h[i] - 1.5f);
        high[i] = (int)ceilf((ring->center[i] + reach[i]) / h[i] + 0.5f);
    }
    low[2] = low[2] < 0 ? 0 : low[2];
    high[2] = high[2] >= size[2] ? size[2] - 1 : high[2];
    for (int z = low[2]; z <= high[2]; z++)
        for (int y = low[1]; y <= high[1]; y++) {
            float *row = solid + ((size_t)z * (size_t)size[1] + (size_t)wrap(y, size[1])) *
                                     (size_t)size[0] * 4;
            for (int x = low[0]; x <= high[0]; x++) {
                float point[3] = {((float)x + 0.5f) * h[0], ((float)y + 0.5f) * h[1],
                                  ((float)z + 0.5f) * h[2]};
                float depth = depth_in_voxels(ring, point, h);
                float s = depth > 1.0f ? 1.0f : 0.5f + 0.5f * depth;
                float *voxel = row + (size_t)wrap(x, size[0]) * 4;
                if (s <= voxel[3])
                    continue;
                /* Dirt gathers deep down; polish is on top. */
                float polish = 0.55f + 0.45f * point[2] / (float)VOLUME_TILE_DEPTH;
                for (int i = 0; i < 3; i++)
                    voxel[i] = s * polish * ring->color[i];
                voxel[3] = s;
            }
        }
}

enum status volume_make_chain(const struct scene_material *spec, struct volume *volume) {
    volume->solid = volume_alloc_voxels(volume->size);
    if (!volume->solid)
        return STATUS_OUT_OF_MEMORY;
    for (int row = 0; row < ROWS; row++)
        for (int column = 0; column < RINGS_U; column++) {
            struct ring ring = make_ring(spec, row, column);
            place_ring(volume->solid, volume->size, &ring);
        }
    return STATUS_OK;
}
