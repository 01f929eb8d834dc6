/* See variant.h. A flag stands here only where its branch can change a pixel. */
#include "renderer/path/variant.h"

static bool is_lit(const struct volume *volume) {
    return volume && volume->lit && !volume->homogeneous;
}

bool variant_needs_normals(const struct path_object *object, int lights) {
    return (lights > 0 || (object->forced & FLAG_LIT)) && is_lit(object->volume);
}

bool variant_by_strands(const struct path_object *object, int lights) {
    return variant_needs_normals(object, lights) && object->volume->strand_lit;
}

uint32_t variant_of_shell(const struct path_object *object, int lights, bool occluded, bool solid) {
    const struct volume *volume = object->volume;
    bool slicing = object->object->path == SCENE_PATH_SLICING;
    uint32_t flags = FLAG_SOLID;
    /* A point on a plane is hidden or not: the depth test says it. */
    bool points = slicing && object->method != SCENE_SLICING_SLABS;
    if (!solid)
        flags = (volume->homogeneous ? FLAG_HOMOGENEOUS : FLAG_MEDIUM) |
                (occluded && !points ? FLAG_OCCLUDED : 0);
    /* A walk begins at the eye by itself, and so does the first slab. */
    bool cut = object->walk || slicing;
    if ((object->projection.behind || (object->forced & FLAG_EYE_INSIDE)) && !cut)
        flags |= FLAG_EYE_INSIDE;
    if (object->fp64 && !points)
        flags |= FLAG_FP64;
    if (object->exact)
        flags |= FLAG_EXACT | (!slicing && object->shell->ruled ? FLAG_RULED : 0);
    if (!solid && object->filter != SCENE_FILTER_NONE)
        flags |= FLAG_FILTER | (object->filter == SCENE_FILTER_VIEW ? FLAG_FILTER_VIEW : 0);
    if (path_object_leaps(object, solid))
        flags |= FLAG_LEAP | (object->traversal[solid] == SCENE_TRAVERSAL_DDA ? FLAG_DDA : 0);
    if (!solid)
        flags |= (volume_is_tinted(volume) ? FLAG_TINT : 0) |
                 (!volume->homogeneous && volume_is_filled(volume) ? FLAG_FILL : 0);
    if (variant_needs_normals(object, lights))
        flags |= FLAG_LIT | (lights > 1 ? FLAG_LIGHTS : 0) | object->shadow |
                 (volume->specular > 0 ? FLAG_SPECULAR : object->forced & FLAG_SPECULAR) |
                 (volume->strand_lit && !solid ? FLAG_STRANDS : 0);
    else if (is_lit(volume))
        flags |= FLAG_AMBIENT;
    return flags;
}

uint32_t variant_in_picture(const struct path_object *object, const struct picture *picture,
                            bool solid) {
    return variant_of_shell(object, picture->lights.count, picture->occluded, solid);
}

uint32_t variant_of_surface(const struct path_object *object, int lights, bool textured) {
    bool lit = lights > 0 || (object->forced & FLAG_LIT);
    return (lit ? FLAG_LIT | (lights > 1 ? FLAG_LIGHTS : 0) | object->shadow : FLAG_AMBIENT) |
           (textured ? FLAG_TEXTURED : object->forced & FLAG_TEXTURED);
}
