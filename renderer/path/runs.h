/* How the slicing path's slabs lie over the shells of a picture, and how many of them it draws at
 * once: what slicing.c draws by, and renderer/cost.c counts by. Needs no context. */
#ifndef PELT_RENDERER_PATH_RUNS_H
#define PELT_RENDERER_PATH_RUNS_H

#include "renderer/path/path.h"
#include "renderer/shell/slabs.h"

/* The depths of all shells that are drawn, as one slab. */
void runs_find_range(const struct path_object *objects, size_t count, struct slabs *slabs);

/* What a unit of H (view.h) is along the ray through the middle of the picture, object units. */
double runs_along_ray(const struct view *view);

/* The longest step, object units, that the part of a ray through the middle of the picture takes
 * where slabs are `spacing` apart in H: the way between the planes straight across, in the object's
 * space. Along the ray it is as much, unless the transform stretches some directions more than
 * others. */
double runs_step(const struct view *view, double spacing);

/* How many slabs of a thickness `spacing`, in H, are drawn at once, at least 1, by the methods that
 * the objects hold: after path.choose(). `solid`: by the draw of solids, else by that of media. */
uint32_t runs_slabs(const struct path_object *objects, size_t count, double spacing, bool solid);

/* How many runs that makes of `slabs` slabs; the range is then cut into as many equal parts. */
static inline uint32_t runs_count(uint32_t slabs, uint32_t slabs_in_run) {
    return (slabs - 1) / slabs_in_run + 1;
}

#endif
