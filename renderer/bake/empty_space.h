/* How far around each voxel there is nothing, so that rays leap over it (Dufort et al. 2005,
 * section 5.1, "empty-space skipping"). Calls no GL.
 *
 * A level of the min-max pyramid says "nothing in this block"; a distance says the same of the
 * largest block around each voxel, in one fetch where a pyramid takes one for each level. */
#ifndef PELT_RENDERER_BAKE_EMPTY_SPACE_H
#define PELT_RENDERER_BAKE_EMPTY_SPACE_H

#include <stdint.h>

#include "api/status.h"
#include "renderer/asset/volume.h"
#include "renderer/bake/normals.h"

/* The largest distance told, in voxels. */
enum { EMPTY_SPACE_MAX = 32 };

/* For each voxel, in the order of the volume's: the Chebyshev distance, in voxels, to the nearest
 * one that holds something (extinction above 0; s of at least 1/2, which is what a surface needs),
 * at most EMPTY_SPACE_MAX; periodic in u and v. Where it is d, trilinear interpolation meets
 * nothing within d - 3/2 voxels of any point of the voxel, along each axis. `distance`: as many
 * bytes as there are voxels. STATUS_OUT_OF_MEMORY. */
enum status empty_space(const struct volume *volume, enum bake_field field, uint8_t *distance);

#endif
