/* Coarser copies of a medium, for samples whose footprint is larger than a voxel; no GL.
 *
 * After Dufort, Leblanc & Poulin 2005, section 5.2: layers are combined "by using the opacity
 * equation [...] to filter along the z dimension (height) of the volumetric texture (top-down)",
 * and "the color (weighted by the opacity) of the combined layers" is averaged "in the two other
 * (horizontal) dimensions as it is done in a regular mipmap".
 *
 * In Pelt's terms, with sigma the extinction (times the thickness), c its colour, and depth the
 * part of the thickness that a source layer fills, from the top down over the layers of a coarser
 * one:
 *
 *   tau_i = sigma_i depth_i,  T_0 = 1,  T_i = T_(i-1) exp(-tau_i),  E = sum T_(i-1) (1 -
 * exp(-tau_i)) c_i
 *
 * and across the columns k of area a_k (sum 1)
 *
 *   sigma' = -log(sum a_k T_k) / depth',   c' = sum a_k E_k / (1 - sum a_k T_k).
 *
 * What is averaged is thus what columns let through, not their extinction. The sum is taken about
 * the clearest column, so stiff media (exp(-tau) = 0) keep a finite sigma' and a colour.
 *
 * Sizes that are no power of two: a level has max(1, floor(n / 2)) cells along each axis, as GL has
 * it, and a coarse cell covers n / floor(n / 2) finer ones, 2 to 3, those at its ends in part. An
 * axis of one voxel stays so. u and v are periodic: cells begin at 0, and none crosses the seam.
 *
 * Normals: the mean over a cell of what light falls on, w n, with n a voxel's normal (per voxel)
 * and w its weight g / (g + 0.01) (DESIGN.md), weighted as colours are. Its length |M| is the share
 * of the light that still has a direction. It is kept as the gradient whose own weight is |M|, so
 * that shading needs to know nothing of it: g' = 0.01 |M| / (1 - |M|).
 *
 * Strands (struct volume's `strands`, sigma T and sigma): T likewise, the mean of tangents, whose
 * length is the share of them that are of one mind. */
#ifndef PELT_RENDERER_BAKE_PYRAMID_H
#define PELT_RENDERER_BAKE_PYRAMID_H

#include <stdbool.h>
#include <stdint.h>

#include "api/status.h"
#include "renderer/asset/volume.h"

enum { PYRAMID_LEVELS_MAX = 16 }; /* of the largest volume that a scene may ask for: 13 */

struct pyramid {
    int count; /* levels, the voxels themselves being level 0 */
    struct pyramid_level {
        int size[3];
        float *medium;      /* struct volume's layout; level 0: the volume's own, borrowed */
        uint16_t *gradient; /* normals.h's layout; NULL unless lit by normals */
        float *strands;     /* struct volume's layout; level 0: borrowed; NULL unless lit by them */
    } level[PYRAMID_LEVELS_MAX];
};

/* The sizes of all levels of a volume; `level[].medium` and `.gradient` are NULL. */
void pyramid_sizes(const int size[3], struct pyramid *pyramid);

/* What the levels are to be lit by; PYRAMID_STRANDS: of a volume that has some. */
enum pyramid_light { PYRAMID_UNLIT, PYRAMID_NORMALS, PYRAMID_STRANDS };

/* Fills a pyramid from a volume that has a medium. STATUS_OUT_OF_MEMORY; the pyramid is then empty.
 * pyramid_finish() frees it; the volume must live until then. Thread: any; blocks: about 8 M voxels
 * a second. */
enum status pyramid_make(const struct volume *volume, enum pyramid_light light,
                         struct pyramid *pyramid);
void pyramid_finish(struct pyramid *pyramid);

/* Strands coarser along u and v alone, as view_pyramid.h has what is seen of a medium: layer by
 * layer the mean of sigma T and of sigma. Level 0 is the volume's own, borrowed; size[2] of all
 * is its. Of the levels only `size` and `strands` are set. STATUS_OUT_OF_MEMORY; it is then empty.
 */
enum status pyramid_strand_layers(const struct volume *volume, struct pyramid *layers);

#endif
