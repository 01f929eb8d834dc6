/* Triangles before they are a mesh: every corner stands alone. Both sources of geometry (the
 * built-in shapes and glTF assets) end here, and mesh_build() starts from here. */
#ifndef PELT_RENDERER_ASSET_MESH_SOUP_H
#define PELT_RENDERER_ASSET_MESH_SOUP_H

#include <stdbool.h>
#include <stdint.h>

#include "api/scene.h"
#include "api/status.h"

/* Entries [3 * t + k] belong to corner k of triangle t. Object space, Z up, counter-clockwise seen
 * from outside. */
struct mesh_soup {
    uint64_t triangle_count;
    double (*position)[3]; /* finite */
    float (*normal)[3];    /* of any length; zero or not finite: none at this corner */
    double (*uv)[2];
    uint8_t *has_normal, *has_uv; /* for each triangle */
    uint16_t *surface;            /* for each triangle */
    /* Corners weld within a part alone: where each ends, counted in triangles. 0: all is one part.
     */
    uint32_t part_count;
    const uint64_t *part_end;
};

/* Room for `capacity` triangles, zeroed, triangle_count 0. False where memory ran out; then *soup
 * is zeroed. Thread: any. */
bool mesh_soup_init(struct mesh_soup *soup, uint64_t capacity);
void mesh_soup_finish(struct mesh_soup *soup); /* a zeroed soup is fine */

/* The built-in shape that `spec` describes (any kind but SCENE_MESH_ASSET), with normals and UVs,
 * into an empty soup that the caller finishes. `pointer` is that of the mesh in the scene.
 * STATUS_INVALID_SCENE (too few divisions to enclose anything), STATUS_TOO_COMPLEX (more than
 * MESH_TRIANGLES_MAX), STATUS_OUT_OF_MEMORY. Thread: any. */
enum status mesh_shape_make(const struct scene_mesh *spec, const char *pointer,
                            struct mesh_soup *soup, struct error *err);

/* Appends a grid of points as triangles, two for each of the n * m quads; the parts of
 * mesh_shape_make() share it. Point (i, j), 0 <= i <= n, 0 <= j <= m, is entry j * (n + 1) + i; u
 * grows with i, v with j, and u x v points outwards. All quads are split along the diagonal from
 * (i, j) to (i + 1, j + 1). Where a row has shrunk to a point (a pole), the empty half of its quads
 * is left out and the other half takes the u in the middle of its quad. The soup has the room. */
void mesh_soup_add_grid(struct mesh_soup *soup, int n, int m, double (*position)[3],
                        float (*normal)[3], double (*uv)[2]);

/* (cos, sin) of 2 pi i / n, n > 0, any i >= 0. Periodic in i and symmetric over all eight octants
 * to the bit, so that seams and mirror images weld. */
void mesh_circle_point(int i, int n, double *cosine, double *sine);

/* mesh_teapot.c and mesh_terrain.c; the rest is in mesh_shapes.c. */
enum status mesh_teapot_make(const struct scene_mesh *spec, struct mesh_soup *soup,
                             const char *pointer, struct error *err);

/* Height over (x, y), both in units of the shorter side, and its slopes. In [0, 1]. `cells` is the
 * number of grid cells along that shorter side: octaves with fewer than four cells a period are
 * left out. */
double mesh_terrain_height(double x, double y, int cells, uint32_t seed, double slope[2]);

#endif
