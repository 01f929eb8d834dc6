/* See variant.h. A flag stands here only where its branch can change a pixel. */
#include "renderer/path/variant.h"

static bool is_lit(const struct volume *volume) {
    return volume && volume->lit && !volume->homogeneous;
}

bool variant_needs_normals(const struct path_object *object, int lights) {
    return (lights > 0 || (object->forced & FLAG_LIT)) && is_lit(object->volume);
}

uint32_t variant_of_shell(const struct path_object *object, int lights, bool occluded, bool solid) {
    const struct volume *volume = object->volume;
    uint32_t flags = FLAG_SOLID;
    if (!solid)
        flags =
            (volume->homogeneous ? FLAG_HOMOGENEOUS : FLAG_MEDIUM) | (occluded ? FLAG_OCCLUDED : 0);
    /* A walk begins at the eye by itself. */
    if ((object->projection.behind || (object->forced & FLAG_EYE_INSIDE)) && !object->walk)
        flags |= FLAG_EYE_INSIDE;
    if (object->fp64)
        flags |= FLAG_FP64;
    if (object->exact)
        flags |= FLAG_EXACT;
    if (variant_needs_normals(object, lights))
        flags |= FLAG_LIT | (volume->specular > 0 ? FLAG_SPECULAR : object->forced & FLAG_SPECULAR);
    else if (is_lit(volume))
        flags |= FLAG_AMBIENT;
    return flags;
}

uint32_t variant_of_surface(const struct path_object *object, int lights, bool textured) {
    bool lit = lights > 0 || (object->forced & FLAG_LIT);
    return (lit ? FLAG_LIT : FLAG_AMBIENT) |
           (textured ? FLAG_TEXTURED : object->forced & FLAG_TEXTURED);
}
