/* Pieces of scenes that the cases of the matrix share. JSON with ' for ". */
#ifndef PELT_TESTS_STABILITY_MATRIX_SCENES_H
#define PELT_TESTS_STABILITY_MATRIX_SCENES_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/stability/matrix.h"

#define IMAGE(pixels) "'image': {'width': " #pixels ", 'height': " #pixels ", 'samples': 1}, "

/* Straight down on z = 0, parallel rays. */
#define FROM_ABOVE                                                                                 \
    "'camera': {'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 2}, "

#define FROM_THE_FRONT                                                                             \
    "'camera': {'eye': [0.7, -2.8, 2.1], 'target': [0, 0, 0.1], 'fov_y_deg': 35}, "

#define LIGHTS                                                                                     \
    "'lights': [{'direction': [-1, 1, -2], 'color': [3, 2, 1]}, {'direction': [1, 0.2, -0.3], "    \
    "'color': [0.2, 0.5, 1]}], 'ambient': [0.1, 0.2, 0.1], "

#define HOMOGENEOUS                                                                                \
    "'material': {'builtin': 'homogeneous', 'extinction': %.17g, 'color': [0.25, 0.5, 1]}"

/* Why bounds are what they are, where several cases share the reason. */
#define WHY_CLOSED_FORM                                                                            \
    "closed form: 1e-4 of the optical depth up to 10, beyond that 1e-6 of transmittance"
#define WHY_SAME_SOLID                                                                             \
    "tetrahedra fill the prisms exactly: tops and bottoms are triangles in both, sides of "        \
    "neighbours cancel; what is left is fp32 along a ray, 1e-4 of its length"

/* ---- voxels ---- */

static inline void voxel_set(struct volume *volume, int x, int y, int z, double value,
                             const double color[3]) {
    float *voxel =
        (volume->medium ? volume->medium : volume->solid) +
        4 * (((size_t)z * (size_t)volume->size[1] + (size_t)y) * (size_t)volume->size[0] +
             (size_t)x);
    for (int c = 0; c < 3; c++)
        voxel[c] = (float)(color[c] * value);
    voxel[3] = (float)value;
}

/* All voxels alike. */
static inline void voxels_fill(struct volume *volume, double value, const double color[3]) {
    for (int z = 0; z < volume->size[2]; z++)
        for (int y = 0; y < volume->size[1]; y++)
            for (int x = 0; x < volume->size[0]; x++)
                voxel_set(volume, x, y, z, value, color);
}

/* Solid throughout, of one colour: a case's `voxels`. */
static inline void voxels_solid(struct volume *volume, const struct matrix_case *self) {
    (void)self;
    voxels_fill(volume, 1, (const double[3]){1, 0.5, 0.25});
}

/* The optical depth across one thickness that a voxel of this alpha stands for. */
static inline double voxel_depth(const struct volume *volume, double alpha) {
    return -log1p(-alpha) * volume->size[2];
}

#endif
