/* Gradients of a volume, from which the paths take their shading normals.
 *
 * The field f is opacity, 1 - exp(-sigma_voxel), for a medium, where sigma_voxel is the optical
 * depth across one voxel's own height (sigma * thickness / size[2]); and the solid field s for a
 * solid. What is stored is -(df/du, df/dv, df/dw) per voxel: it points outward, from dense to
 * empty.
 *
 * Per voxel means that each component is a difference along its own axis over one voxel, so that it
 * lies in [-1/2, 1/2]; multiplied by `size` componentwise it is the gradient over (u, v, w) in
 * [0, 1], which the inverse transpose of dP/d(u, v, w) takes to object space. The weight
 * g / (g + 0.01) of DESIGN.md takes the length as stored.
 *
 * Differences are central: (f[k+1] - f[k-1]) / 2, periodic in u and v. In w the field continues
 * beyond its first and last centre with their values, as it does wherever it is sampled; so at the
 * two end layers the difference is that of the clamped field, half of the one-sided one. A
 * one-sided difference would be steeper there than the field that is drawn. It is taken as it is,
 * and so the cut of a dense medium at w = 1 has no gradient of its own: nothing is known of what
 * lies above.
 */
#ifndef PELT_RENDERER_BAKE_NORMALS_H
#define PELT_RENDERER_BAKE_NORMALS_H

#include <stdint.h>

#include "api/status.h"
#include "renderer/asset/volume.h"

enum bake_field { BAKE_FIELD_MEDIUM, BAKE_FIELD_SOLID };

/* Writes 4 half floats for each voxel (x, y, z as above, then 0), in the volume's order, into
 * `halves` (4 * voxel count, the caller's). The volume must have the field. Runs on two threads for
 * large volumes, with the same result. STATUS_OK, or STATUS_OUT_OF_MEMORY. Thread: any; blocks:
 * about 16 M voxels a second. No GL. */
enum status bake_gradients(const struct volume *volume, enum bake_field field, uint16_t *halves);

/* IEEE 754 binary16, rounded to nearest even; too large becomes infinite. */
uint16_t bake_half_from_float(float value);
float bake_float_from_half(uint16_t half);

#endif
