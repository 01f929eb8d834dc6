/* The view: the rays of a picture, and where points fall on it, in the space of any object.
 *
 * All of it is fp64 until the last moment, and relative to a reference point near the object, so
 * that scenes a million units from the origin and cameras a million units away lose nothing:
 *
 *   ray(t) = o + t d,   o = o0 + x ou + y ov,   d = d0 + x du + y dv,   (x, y) in [-1, 1], y up.
 *
 * t = -1 is the eye (perspective) or its plane (orthographic), t = 0 the plane through the scene's
 * centre; d is not normalised. t of a point is the same in the space of every object, since
 * objects differ by affine maps; so it serves as the depth that all passes share. */
#ifndef PELT_RENDERER_SHELL_VIEW_H
#define PELT_RENDERER_SHELL_VIEW_H

#include <stdbool.h>

#include "api/scene.h"

struct view {
    int width, height; /* of the sample grid: pixels times k */
    bool orthographic;
    double center[3]; /* the reference point, in this view's space; all below is relative to it */
    double o0[3], ou[3], ov[3];
    double d0[3], du[3], dv[3];
    /* Projection of a point p relative to `center`: with (X, Y, H) = row . (p, 1), the point's
     * depth is t = H - 1, and it falls on (X, Y) / W, W being H in perspective and 1 otherwise. */
    double x_row[4], y_row[4], h_row[4];
    double depth_scale; /* of depths in fp32: DEPTH_OF_T in shaders/interface.h */
};

/* The world's view of a camera that is `given`. `bounds_*`: of all objects, in the world. `k`:
 * samples along a pixel's side. */
void view_from_camera(const struct scene_camera *camera, const struct scene_image *image,
                      const double bounds_min[3], const double bounds_max[3], int k,
                      struct view *view);

/* The same view in the space of an object whose `transform` (world from object, column-major) is
 * invertible, relative to `center` in that space. */
void view_in_object(const struct view *world, const double transform[16], const double center[3],
                    struct view *view);

/* Inverse transpose of a transform's linear part, row-major: maps gradients to the world. */
void view_normal_matrix(const double transform[16], double rows[3][3]);

#endif
