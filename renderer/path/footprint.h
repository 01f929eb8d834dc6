/* How many voxels a sample of the picture covers: decides whether a medium is filtered. */
#ifndef PELT_RENDERER_PATH_FOOTPRINT_H
#define PELT_RENDERER_PATH_FOOTPRINT_H

#include "renderer/path/path.h"

/* The largest and the smallest footprint of a sample in a shell's cells, in voxels along the axis
 * where it is largest, each cell by its own affine map where it is farthest from the eye (for the
 * smallest: nearest). {0, 0} where nothing is in front of the eye. Only cells with volume count.
 * Thread: any; about 10 M cells a second. No GL. */
struct footprint {
    double least, most;
};
struct footprint footprint_find(const struct path_object *object);

/* Decides path_object.filter of every shell, as the scene asks, as long as a footprint is larger
 * than a voxel; a filtered shell is read by the prisms' own map (path_object.exact). After
 * plan_order(). STATUS_NOT_IMPLEMENTED, with its pointer, where the scene asks for a filter that
 * its path or its map has not. */
enum status footprint_choose_filters(struct path_object *objects, size_t count, struct error *err);

/* What is to be baked for it. */
struct bake_filter footprint_filter(const struct path_object *object);

#endif
