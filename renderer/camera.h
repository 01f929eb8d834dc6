/* The camera that a scene leaves out: all objects framed in a three-quarter view. */
#ifndef PELT_RENDERER_CAMERA_H
#define PELT_RENDERER_CAMERA_H

#include "api/scene.h"

/* Grows bounds by a box mapped through a transform (column-major). Start from +inf, -inf. */
void camera_add_bounds(const double transform[16], const double box_min[3], const double box_max[3],
                       double bounds_min[3], double bounds_max[3]);

/* Fills eye and target so that the world bounds fit the image, seen from the front, the right and
 * above; keeps the field of view and the up vector. `given` becomes true. */
void camera_frame(const struct scene_image *image, const double bounds_min[3],
                  const double bounds_max[3], struct scene_camera *camera);

#endif
