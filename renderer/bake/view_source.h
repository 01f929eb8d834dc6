/* What the two halves of the views share (view_pyramid.c: from above and below; view_sides.c: from
 * the sides): the voxels, what is kept of each thing that is seen, and how it is written.
 *
 * Of the normals that are seen their first two moments are kept, m and M, the means of w n and of
 * w n n^T (as Olano & Baker 2010, LEAN mapping, keep those of slopes): n a unit vector in the frame
 * of a tile as it is in the shell on the mean, u, v and w at right angles, lengths in thicknesses;
 * w its weight g / (g + 0.01). The trace of M is the mean weight W.
 *
 * What is seen depends on the azimuth from which one looks. With t the unit vector along the
 * surface toward the viewer: of cells whose normal stays what it is m does not turn; around a
 * strand all of it does. The regression of n on t tells them apart,
 *
 *   m(t) = m + (m_t - m.t_m / W) t,   m_t = <w n.t>,   t_m = <w t>,
 *
 * t_m being from where on the mean the cell is seen. Without the second term a cliff that is seen
 * from its front alone would face it twice, which made clouds over a sphere 8 % too bright. That M
 * turns as well is left out: in fur, clouds and chain the mean of w ((n.t)^2 - (n.s)^2), s = w x t,
 * is 0.01, 0.04, 0.08. */
#ifndef PELT_RENDERER_BAKE_VIEW_SOURCE_H
#define PELT_RENDERER_BAKE_VIEW_SOURCE_H

#include "renderer/bake/view_pyramid.h"

/* Numbers of what is seen, each weighted by what is lost there. Where unlit: the colour alone. */
enum {
    SEEN_COLOR = 0,
    SEEN_MEAN = 3,      /* m, then m_t */
    SEEN_SQUARES = 7,   /* M_uu, M_vv, M_ww, then t_m along u */
    SEEN_PRODUCTS = 11, /* M_uv, M_uw, M_vw, then t_m along v */
    SEEN_COUNT = 15
};

struct view_source {
    const struct volume *volume;
    float *gradient; /* 4 a voxel, per voxel (normals.h), the last 0; NULL where unlit */
    float steep[3]; /* voxels a thickness along u, v, w: a gradient times these has n's direction */
    int count;      /* numbers of what is seen: SEEN_MEAN or SEEN_COUNT */
};

static inline size_t view_voxel(const struct view_source *source, int x, int y, int z) {
    const int *n = source->volume->size;
    return ((size_t)z * (size_t)n[1] + (size_t)y) * (size_t)n[0] + (size_t)x;
}

/* The moments of one gradient, w n and w n n^T, into their places of `seen`; those that turn are
 * not set. `toward`: the viewer, a unit vector in the same frame. */
void view_moments(const struct view_source *source, const float gradient[4], const float toward[3],
                  float *seen);

/* How far within a step of the optical depth tau, 1 - exp(-tau) = `lost`, what is seen of it lies
 * on the mean: 1/2 where it is thin, 0 where it is opaque. */
double view_depth_seen(double tau, double lost);

/* `left` is let through to a layer, `lost` of it is lost there, in which `seen` is contained;
 * `plain` is what a layer of the mean extinction would lose, for where nothing is left. */
void view_write(const struct view_source *source, const struct view_level *level, size_t index,
                double left, double lost, double plain, const double *seen);

/* Finer cells that lie within a coarser one along an axis, with the share of each. */
struct view_cover {
    int first, last;
    double from, to;
};
struct view_cover view_cover_of(int fine, int coarse, int cell);
double view_share_of(const struct view_cover *cover, int i);

#define VIEW_DEEPEST 600.0 /* optical depth: exp(-600) is near the smallest number */

/* Fills the layers of VIEW_SIDE of every level. STATUS_OUT_OF_MEMORY. */
enum status view_look_along_surface(const struct view_source *source, const double aspect[2],
                                    const struct view_pyramid *pyramid);

#endif
