/* One ray through one prism, exactly.
 *
 * P(b, w) = sum b_i p_i(w), p_i(w) = bottom_i + w offset_i. Seen along the ray the vertices are
 * points q_i(w) of a plane, linear in w, the ray its origin: b_i(w) = B_i(w) / S(w) with
 * B_i = q_j x q_k and S = B_0 + B_1 + B_2, quadratics in w (DESIGN's rational ray). The ray crosses
 * the bilinear side i where B_i = 0. With N(w) = (p_1 - p_0) x (p_2 - p_0)(w), the point at t lies
 * in the layer w where
 *
 *   F(w, t) = N(w) . (o + t d - p_0(w)) = A(w) + t D(w) = 0,
 *
 * a cubic in w whose slope there is -det dP: never 0 inside a prism that does not fold. So w(t) is
 * found by bracketed Newton even where the ray lies in one layer and t(w) has no meaning. */
#ifndef PELT_RENDERER_REFERENCE_PRISM_H
#define PELT_RENDERER_REFERENCE_PRISM_H

#include <stdbool.h>

#include "renderer/reference/world.h"

/* A ray in one object's space, relative to the object's centre. */
struct object_ray {
    double o[3], d[3];
    double a[3], b[3]; /* orthonormal and perpendicular to d */
    double speed;      /* |d|: object lengths for each unit of t */
};

void object_ray_init(const struct world_object *object, const double o[3], const double d[3],
                     struct object_ray *ray);

/* A prism as one ray sees it. */
struct prism_ray {
    const struct world_object *object;
    uint32_t prism;
    const struct object_ray *ray;
    double o[3], d[3];                               /* the ray */
    double p0[3], pw[3], e1[3], g1[3], e2[3], g2[3]; /* p_0 = p0 + w pw, p_k - p_0 = ek + w gk */
    double n[3][3];                                  /* N(w), ascending powers */
    double a[4], s[3];                               /* A and D of F */
    double side[3][3];                               /* B_i */
    double uv[3][2];                                 /* of the corners, in tiles */
};

/* A part of the ray within a prism, on which w(t) is monotone or constant. */
struct prism_interval {
    double t[2], w[2];
};

enum { PRISM_INTERVALS_MAX = 16 };

/* Fills `prism` and up to PRISM_INTERVALS_MAX intervals, ascending in t (in a prism that folds:
 * each sheet's); returns how many. */
int prism_meet(const struct world_object *object, uint32_t index, const struct object_ray *ray,
               struct prism_ray *prism, struct prism_interval *intervals);

/* w at t, given that it lies between w[0] at t[0] and w[1] at t[1]. */
double prism_w(const struct prism_ray *prism, const struct prism_interval *within, double t);

/* t at w, within the interval. */
double prism_t(const struct prism_ray *prism, const struct prism_interval *within, double w);

/* Barycentric coordinates of the ray's point at (t, w), and whether they could be found. */
bool prism_barycentric(const struct prism_ray *prism, double t, double w, double b[3]);

/* The gradient in object space of a field with the derivatives `over_uv` and `over_w` at (b, w):
 * the inverse transpose of dP, up to a positive factor. */
void prism_gradient(const struct prism_ray *prism, const double b[3], double w,
                    const double over_uv[2], double over_w, double gradient[3]);

/* Where steps go in object space at (b, w): dP of `uv` over the texture, and of 1 over the height.
 * False where the corners' (u, v) span nothing. */
bool prism_tangents(const struct prism_ray *prism, const double b[3], double w, const double uv[2],
                    double layer[3], double height[3]);

/* A normal of the prism's boundary where the ray meets it at (b, w): of the top, the bottom or a
 * side, whichever is nearest; either direction. */
void prism_face(const struct prism_ray *prism, const double b[3], double w, double normal[3]);

#endif
