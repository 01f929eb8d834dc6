/* The shell's own map in each prism, P(b, w) = sum b_k (p_k + w o_k), as the shaders take it:
 * shaders/common_prism.glsl derives how they invert it.
 *
 * MAP_TEXELS texels a cell, with e_k = p_k - p_0 and g_k = o_k - o_0 over the length `unit` and
 * du_k the texture coordinates of corner k relative to corner 0's (the cell's own table holds
 * those): (o_0, du_1.u) (e_1, du_1.v) (e_2, du_2.u) (g_1, du_2.v) (g_2, 1 / unit); 1 / unit is
 * negative where the cells of the prism are turned differently, so that it has no inside of its
 * own: there cells end at their plane faces (shaders/common_ruled.glsl).
 *
 * A cell's affine map has this form too, with g_k = 0, since in all three cells of a prism b and w
 * are affine coordinates. So prisms in which Newton's few steps would not settle need no branch in
 * the shaders: their cells get that map, each its own. */
#ifndef PELT_RENDERER_SHELL_PRISM_MAP_H
#define PELT_RENDERER_SHELL_PRISM_MAP_H

#include "renderer/shell/shell.h"

/* How uneven the map of a prism is. */
enum prism_map_kind {
    PRISM_MAP_AFFINE, /* to what fp32 can tell: both maps are one */
    PRISM_MAP_EVEN,
    PRISM_MAP_UNEVEN /* it folds, or nearly: det dP changes too much for Newton's few steps */
};

/* Of the prism over mesh triangle f. */
enum prism_map_kind prism_map_look(const struct shell *shell, uint32_t f);

/* How far the ruled sides of the prism over triangle f are at the most from the plane ones of its
 * cells, as a share of its height or of the side's edge, whichever is less. The side between two
 * corners with the offsets o_i, o_j is s (1 - w) (o_i - o_j), or w (1 - s) of that, off the plane
 * ones: a quarter at the most. */
double prism_map_bend(const struct shell *shell, uint32_t f);

/* The corners of each prism for walks, as shaders/common_sides.glsl takes them; the array is the
 * caller's, of tetra_count / 3 elements. */
void prism_sides_fill(const struct shell *shell, float (*side)[SIDE_TEXELS][4]);

/* Fills the table; the array is the caller's, of tetra_count elements. */
void prism_map_fill(const struct shell *shell, float (*map)[MAP_TEXELS][4]);

#endif
