/* The view of a light with a direction: what a picture would be that the light takes. */
#ifndef PELT_RENDERER_PATH_LIGHT_VIEW_H
#define PELT_RENDERER_PATH_LIGHT_VIEW_H

#include "renderer/path/path.h"

/* Orthographic, along `direction` (of any length, not 0), `size` samples square, as near around
 * every point of the picture's objects as a margin of two samples lets it be; everything lies
 * between the ray parameters -0.25 and 0.25. */
void light_view_fit(const struct picture *picture, const double direction[3], int size,
                    struct view *view);

#endif
