/* Which boxes a ray may meet: a plain bounding volume hierarchy in doubles. */
#ifndef PELT_RENDERER_REFERENCE_BVH_H
#define PELT_RENDERER_REFERENCE_BVH_H

#include <stdbool.h>
#include <stdint.h>

struct bvh_box {
    double low[3], high[3];
};

struct bvh;

/* Over `count` boxes, which are copied and grown by `padding` on every side. NULL where memory ran
 * out. bvh_destroy() takes NULL. */
struct bvh *bvh_create(const struct bvh_box *boxes, uint32_t count, double padding);
void bvh_destroy(struct bvh *bvh);

/* Calls `visit` for every box that the ray o + t d, t in [t_min, *t_max], may meet, in no order.
 * `*t_max` may be lowered during the visits; false from `visit` ends them and is passed on. */
typedef bool bvh_visit(void *user, uint32_t index);
bool bvh_candidates(const struct bvh *bvh, const double o[3], const double d[3], double t_min,
                    const double *t_max, bvh_visit *visit, void *user);

#endif
