/* The material: eight voxels around a cell, and what lies between them. */
#ifndef PELT_RENDERER_REFERENCE_VOXELS_H
#define PELT_RENDERER_REFERENCE_VOXELS_H

#include <stdbool.h>

#include "renderer/asset/volume.h"
#include "renderer/reference/prism.h"

/* Corner c has the offsets (c & 1, c >> 1 & 1, c >> 2). */
struct voxels {
    const struct volume *volume;
    int x, y, z;
    double value[8][4];    /* weighted colour, weight (extinction times thickness, or s) */
    double gradient[8][3]; /* outward (from dense to empty), per voxel along u, v, w */
    double strand[8][3];   /* mean tangent times weight, in tile widths; see struct volume */
};

/* Loads the voxels around a cell: of the solid, or of the medium. `lit`: the gradients too. */
void voxels_load(const struct volume *volume, bool solid, bool lit, int x, int y, int z,
                 struct voxels *voxels);

/* Where a ray's point lies, counted in voxels: centres are at whole numbers. */
bool voxels_place(const struct prism_ray *prism, double t, double w, double at[3], double b[3]);

void voxels_value(const struct voxels *voxels, const double at[3], double value[4]);
void voxels_gradient(const struct voxels *voxels, const double at[3], double gradient[3]);

/* Of voxels that voxels_load_strands() filled: the mean tangent of the strands where the weight is
 * `weight` > 0; not of unit length. */
void voxels_load_strands(struct voxels *voxels);
void voxels_strand(const struct voxels *voxels, const double at[3], double weight,
                   double tangent[3]);

/* A tangent (tile widths) to the world at (b, w), of unit length; what it has along the layers is
 * laid perpendicular to the height. False where the texture has no direction there. */
bool voxels_tangent(const struct prism_ray *prism, const double b[3], double w,
                    const double tangent[3], double world[3]);

/* The unit normal in the world of a gradient (per voxel) at (b, w); false where it has no length.
 */
bool voxels_normal(const struct volume *volume, const struct prism_ray *prism, const double b[3],
                   double w, const double gradient[3], double normal[3]);

#endif
