/* The views of a light: what pictures would be that the light takes. */
#ifndef PELT_RENDERER_PATH_LIGHT_VIEW_H
#define PELT_RENDERER_PATH_LIGHT_VIEW_H

#include "renderer/path/path.h"

/* Orthographic, along `direction` (of any length, not 0), `size` samples square, as near around
 * every point of the picture's objects as a margin of two samples lets it be; everything lies
 * between the ray parameters -0.25 and 0.25. */
void light_view_fit(const struct picture *picture, const double direction[3], int size,
                    struct view *view);

/* The box around every point of the objects, in the world, relative to `center`. */
void light_view_bounds(const struct path_object *objects, size_t count, const double center[3],
                       double low[3], double high[3]);

/* Whether a corner of a shell's cells is as near as that: there every ray from the light goes
 * through it, and no side of an edge tells which of the cells around it a ray is in. */
bool light_view_at_vertex(const struct path_object *objects, size_t count, const double position[3],
                          double within);

/* Whether a face of the cube around a light, of which `low` and `high` are that box, has any of it
 * in its quarter of the sky. Faces: 2 axis, + 1 toward where coordinates fall. */
bool light_view_meets(const double low[3], const double high[3], int face);

/* In perspective from `position`, through such a face, `size` samples square, as near around the
 * box as a margin of two samples lets it be. Straight lines stay straight, whatever lies around the
 * light. */
void light_view_face(const struct picture *picture, const double position[3], int face, int size,
                     struct view *view);

#endif
