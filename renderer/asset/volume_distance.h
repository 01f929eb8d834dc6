/* Exact distances from voxel centres to triangles near them, and whether a centre lies inside, in
 * voxel coordinates: voxel (i, j, k) has its centre at (i + 1/2, j + 1/2, k + 1/2). Periodic along
 * x and y with the grid's size. */
#ifndef PELT_RENDERER_ASSET_VOLUME_DISTANCE_H
#define PELT_RENDERER_ASSET_VOLUME_DISTANCE_H

#include <stdbool.h>
#include <stdint.h>

#include "api/status.h"

#define DISTANCE_NO_TRIANGLE UINT32_MAX

/* How far from a triangle voxels are told of it. The ramp of a solid ends at 1; a cell of eight
 * voxels that its surface crosses reaches to sqrt(3), and must know its colour. */
#define DISTANCE_BAND 2.0

struct distance_grid {
    int size[3];
    float *distance;   /* to the nearest triangle, DISTANCE_BAND where there is none nearer */
    uint32_t *nearest; /* that triangle, or DISTANCE_NO_TRIANGLE */
    int32_t *winding;  /* how often closed triangles wind around the centre; NULL if never asked */
    uint64_t work;     /* distances computed so far */
};

/* False where memory ran out; distance_finish() in either case. */
bool distance_init(struct distance_grid *grid, const int size[3]);
void distance_finish(struct distance_grid *grid);

/* Adds a triangle's distances. STATUS_TOO_COMPLEX where all so far have asked for more than 2^29 of
 * them (some 20 s); `index` is what `nearest` will hold. */
enum status distance_add(struct distance_grid *grid, const double corner[3][3], uint32_t index);

/* Adds a triangle's share to the winding numbers; distance_wind() then makes them from the shares.
 * They mean something where all triangles added are closed. Coordinates within [0, size] along x
 * and y, of any height. Exact but for the rounding of corners to 2^-16 voxel: no column of centres
 * slips between two triangles or is counted by both. */
void distance_add_winding(struct distance_grid *grid, const double corner[3][3]);
void distance_wind(struct distance_grid *grid);

/* The point of a triangle that is nearest to p, as weights of its corners. Returns the distance. */
double distance_to_triangle(const double p[3], const double corner[3][3], double weight[3]);

#endif
