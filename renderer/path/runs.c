/* See runs.h. */
#include "renderer/path/runs.h"

#include <math.h>

#include "renderer/path/frame.h"

enum {
    /* Slabs of one medium that are drawn at once. RMSE of torus and sphere under fur, torus and
     * terrain under clouds with 64, 256, 1,024 slabs: no more than with 1; of the teapot, whose
     * folds overlap, with 1,024: 0.0078 with 1, 0.0084 with 4, 0.012 with 8. */
    RUN_SLABS = 4,
    RUN_LONGEST = PATH_STEPS_MAX / 2
};

void runs_find_range(const struct path_object *objects, size_t count, struct slabs *slabs) {
    slabs_init(slabs);
    for (size_t i = 0; i < count; i++)
        if (path_object_drawn(&objects[i]))
            slabs_include(slabs, &objects[i].projection, objects[i].shell->vertex_count);
}

double runs_along_ray(const struct view *view) {
    const double *d = view->d0;
    return sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
}

/* Where a transform flattens a shell, planes that are near in the world are far apart along a ray
 * in the object: 4,096 slabs over a plane flattened by 1e3 are 2.5 of its thicknesses each, and one
 * step for each, through all of its voxels, is no better than no picture. Nor need a step be as
 * long: straight across, the same planes lie as close as they do in the object as it was modelled.
 * Since h . d0 = 1 that is never more than along the ray (|h| |d0| >= 1), and as much where angles
 * are kept. */
double runs_step(const struct view *view, double spacing) {
    const double *h = view->h_row;
    return spacing / sqrt(h[0] * h[0] + h[1] * h[1] + h[2] * h[2]);
}

/* Planes as published are drawn one by one. Solids hide one another by depth: there a run is as
 * long as a loop may be. Several media are mixed slab by slab. Else a run is no thicker than the
 * shell, so that what it holds of a ray is one stretch, mostly (500 layers in one pixel, RMSE:
 * 0.0056 by runs of six thicknesses, 0.0049 by slabs). */
uint32_t runs_slabs(const struct path_object *objects, size_t count, double spacing, bool solid) {
    uint32_t media = 0;
    double fit = RUN_SLABS;
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        if (!path_object_drawn(object))
            continue;
        if (object->method != SCENE_SLICING_SLABS)
            return 1;
        media += volume_has_medium(object->volume);
        fit = fmin(fit,
                   object->shell->thickness / (spacing * runs_along_ray(&object->projection.view)));
    }
    return solid ? RUN_LONGEST : media > 1 ? 1 : (uint32_t)fmax(fit, 1);
}
