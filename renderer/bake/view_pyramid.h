/* Coarser copies of a medium as it is seen from above, from below and from the sides; no GL.
 *
 * Dufort, Leblanc & Poulin 2005 (section 5.2) "ignore this view dependency": one value stands for a
 * coarse voxel wherever it is seen from, and for each alone. Three things are lost by that. What
 * lets light through is averaged, but from cell to cell as if a clear column of one had nothing to
 * do with a clear column of the next: between strands of fur one sees the skin, and through their
 * mean one does not. What lies in front hides what lies behind, so a cell's colour and normal are
 * those of the side that is seen. And a cell's height stands for its depth, though it is as deep as
 * the view has it.
 *
 * Here only u and v are made coarser, and each cell keeps, a layer, what is seen from seven sides.
 *
 * From above, at three slants to w (VIEW_COS2_*), and from below likewise: with T(z) the mean over
 * the rays through the cell of what they let through on the way to layer z,
 *
 *   lost(z) = <T_k alpha_k> / <T_k>,   c(z) = <T_k alpha_k c_k> / <T_k alpha_k>,
 *
 * T_k, alpha_k and c_k being a ray's: what those lose that have come through so far, where a mean
 * over all columns would let them lose it once more that are lost. At a slant of 0 a ray that goes
 * down through the layers gathers the very mean of what the columns' own rays gather. <T alpha> and
 * <T> are kept apart, since it is those that are linear: read between an opaque cell and a clear
 * one, half of the light comes through, where their mean extinction would let almost none. At the
 * other slants, of which four azimuths are one value, one cell's own rays come by other cells, and
 * their quotient is kept.
 *
 * From the side there is no first layer to begin at, since u and v go on for ever. A cell is taken
 * as deep as it is wide: with tau the optical depth of a ray through it along u (or v),
 *
 *   sigma = -log <exp(-tau)> / length,   c = <E> / (1 - <exp(-tau)>),
 *
 * over the rays of the cell's width and as many layers as are as high, nothing lying above the
 * highest; E is what such a ray gathers, from either end. Both axes and both ends are one value,
 * their mean.
 *
 * Of the normals that are seen two moments are kept, and how far they turn with the viewer:
 * view_source.h.
 *
 * Lengths along u and v are the shell's (`aspect`); those of one shell differ from place to place,
 * and the mean is taken: at a slant of 0 nothing depends on it.
 *
 * Level l has cells of about 2^(l + 1) voxels, sizes as in pyramid.h; the voxels themselves are not
 * among them. Beyond an optical depth of 600 a ray lets through as much as there: exp(-600) is near
 * the smallest number. Where no more than 1e-30 is left of all rays, a layer's plain mean stands.
 */
#ifndef PELT_RENDERER_BAKE_VIEW_PYRAMID_H
#define PELT_RENDERER_BAKE_VIEW_PYRAMID_H

#include <stdbool.h>
#include <stdint.h>

#include "api/status.h"
#include "renderer/asset/volume.h"
#include "renderer/bake/pyramid.h"
#include "shaders/interface.h"

struct view_pyramid {
    int count;  /* levels; 0 where u and v are of one voxel each */
    int layers; /* of a side: size[2] of the volume */
    struct view_level {
        int size[2];
        /* VIEW_SIDES * layers images of size[0] x size[1] texels: VIEW_* of interface.h, each from
         * the bottom up. */
        float *medium; /* 4: T lost in the layer times its colour; T lost */
        float *left;   /* 1: T, let through to the layer */
        /* 4 each: T lost times the normals' moments (view_source.h): m and m_t; M_uu, M_vv, M_ww
         * and t_m along u; M_uv, M_uw, M_vw and t_m along v. NULL where unlit. */
        float *moments[VIEW_MOMENTS];
    } level[PYRAMID_LEVELS_MAX];
};

/* Fills one from a volume that has a medium. `aspect`: the length of a tile along u and v, in
 * thicknesses. STATUS_OUT_OF_MEMORY; it is then empty. view_pyramid_finish() frees it. Thread: any;
 * blocks. */
enum status view_pyramid_make(const struct volume *volume, const double aspect[2], bool lit,
                              struct view_pyramid *pyramid);
void view_pyramid_finish(struct view_pyramid *pyramid);

#endif
