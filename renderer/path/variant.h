/* Which branches of the shaders (FLAG_* of shaders/interface.h) an object's draws need: asked by
 * the paths when they draw, and by the plan when it says what is left out, so that they agree. */
#ifndef PELT_RENDERER_PATH_VARIANT_H
#define PELT_RENDERER_PATH_VARIANT_H

#include "renderer/path/path.h"

/* Whether a shell's voxels need normals. Ambient light, the same from everywhere, needs none.
 * `lights`: how many lights with a direction there are. */
bool variant_needs_normals(const struct path_object *object, int lights);

/* Whether a shell's medium is lit by its strands, which then stand in for its normals. */
bool variant_by_strands(const struct path_object *object, int lights);

/* An object's shell, its medium or its solid, drawn cell by cell or walked through as
 * `object->walk` says. `occluded`: something opaque may lie before the medium. */
uint32_t variant_of_shell(const struct path_object *object, int lights, bool occluded, bool solid);

/* The same, for one of the two draws of a picture. */
uint32_t variant_in_picture(const struct path_object *object, const struct picture *picture,
                            bool solid);

/* An object's triangles. */
uint32_t variant_of_surface(const struct path_object *object, int lights, bool textured);

#endif
