/* The camera that a scene leaves out: all objects framed in a three-quarter view. */
#ifndef PELT_RENDERER_CAMERA_H
#define PELT_RENDERER_CAMERA_H

#include <stdbool.h>

#include "api/scene.h"

/* Grows bounds by a box mapped through a transform (column-major). Start from +inf, -inf. */
void camera_add_bounds(const double transform[16], const double box_min[3], const double box_max[3],
                       double bounds_min[3], double bounds_max[3]);

/* Points to be framed, one after another: false after the last. */
typedef bool camera_next_point(void *user, double point[3]);

/* Fills eye and target so that the points (within the world bounds) fill the image, seen from the
 * front, the right and above; keeps the field of view and the up vector. `given` becomes true.
 * `restart` is called before each pass over the points. */
void camera_frame(const struct scene_image *image, const double bounds_min[3],
                  const double bounds_max[3], camera_next_point *next, void (*restart)(void *),
                  void *user, struct scene_camera *camera);

#endif
