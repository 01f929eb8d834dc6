/* The prisms' own maps (renderer/shell/prism_map.h) on the device, for shaders with FLAG_EXACT. */
#ifndef PELT_RENDERER_PATH_PRISM_MAPS_H
#define PELT_RENDERER_PATH_PRISM_MAPS_H

#include <glad/gl.h>

#include "renderer/path/path.h"
#include "renderer/path/resident.h"

struct prism_maps {
    struct resident_cache shells;
    GLint texels_max;
};

/* Between these two a context must be current. */
void prism_maps_init(struct prism_maps *maps);
void prism_maps_finish(struct prism_maps *maps);

/* Brings the maps of every object that is `exact` to the device, in one call a picture.
 * STATUS_TOO_COMPLEX, STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status prism_maps_prepare(struct prism_maps *maps, struct picture *picture, struct error *err);

/* The buffer with an object's maps; 0 where it is not exact. */
GLuint prism_maps_buffer(struct prism_maps *maps, const struct path_object *object);

/* Binds an object's maps where it is exact; a shell that was prepared. */
void prism_maps_bind(struct prism_maps *maps, const struct path_object *object);

#endif
