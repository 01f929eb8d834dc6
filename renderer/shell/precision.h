/* Whether fp32 can tell a shell's cells apart, or rays must meet them in doubles.
 *
 * All lengths are as seen, in samples' widths: across the picture, and along the view by the same
 * measure. A point of a shell that reaches E from its centre is rounded by up to 2^-25 E. Where a
 * ray crosses a cell its length is off by as much for each of the two faces it meets: relative to a
 * thickness h that is 2^-24 E / h, and 2^-24 E / a in a cell that is only a high (a sliver), which
 * matters as far as it is seen: not where a is a few samples' width. So fp32 gives optical depths
 * to 1e-4 relative, or nearly, while E is within PRECISION_FP32_MAX of the least of h and 16
 * samples' width. (Measured on planes and spheres, whose errors do not add up, it does at ten times
 * that.)
 *
 * Doubles are left out of every shader that does not need them (FLAG_FP64): on a CPU they cost
 * little beside a march through voxels, but many GPUs are slow at them. */
#ifndef PELT_RENDERER_SHELL_PRECISION_H
#define PELT_RENDERER_SHELL_PRECISION_H

#include "renderer/shell/project.h"

enum { PRECISION_FP32_MAX = 4096, PRECISION_SAMPLES_SEEN = 16 };

/* Whether `shell`, as `projection` sees it, needs doubles. `world` is the same view in the world.
 */
bool precision_needs_fp64(const struct shell *shell, const struct projection *projection,
                          const struct view *world);

/* What fp32 leaves off four vectors: LOW_TEXELS texels (interface.h). */
void precision_low(const double v[4][3], float low[LOW_TEXELS][4]);

/* precision_low() of every tetrahedron's vertices. */
void precision_cells_low(const struct shell *shell, float (*low)[LOW_TEXELS][4]);

#endif
