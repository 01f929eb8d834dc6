/* See force.h. A part is put in as data wherever that does: an empty medium takes its texture,
 * its pass and its branches with it by the same ways as a full one. */
#include "renderer/force.h"

#include <stdlib.h>
#include <string.h>

enum { VOXELS_U = 64, VOXELS_W = 16 }; /* of a homogeneous medium */

/* `size` voxels, all alike; NULL where memory ran out. */
static float *even_voxels(const int size[3], const float voxel[4]) {
    size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    float *voxels = malloc(count * 4 * sizeof *voxels);
    for (size_t i = 0; voxels && i < count; i++)
        memcpy(voxels + 4 * i, voxel, 4 * sizeof *voxel);
    return voxels;
}

static bool add_voxels(struct volume *volume, float **voxels, const float voxel[4], int part) {
    *voxels = even_voxels(volume->size, voxel);
    volume->key[0] ^= (unsigned char)part; /* other voxels than the cache knows under that key */
    return *voxels != NULL;
}

static bool force_volume(uint32_t force, const struct path_object *object,
                         struct forced_volume *forced) {
    static const float nothing[4] = {0, 0, 0, 0};
    struct volume *volume = &forced->volume;
    if ((force & FORCE_VOXELS) && volume->homogeneous) {
        double radiance[3];
        float tau = (float)(path_object_constant(object, radiance) * object->shell->thickness);
        float voxel[4] = {(float)radiance[0] * tau, (float)radiance[1] * tau,
                          (float)radiance[2] * tau, tau};
        volume->absorption = 0;
        memset(volume->emission, 0, sizeof volume->emission);
        memcpy(volume->size, (const int[3]){VOXELS_U, VOXELS_U, VOXELS_W}, sizeof volume->size);
        volume->homogeneous = volume->lit = false;
        volume->medium_max = tau;
        if (!add_voxels(volume, &forced->medium, voxel, 1))
            return false;
        volume->medium = forced->medium;
    }
    if ((force & FORCE_MEDIUM) && volume->solid && !volume->medium) {
        if (!add_voxels(volume, &forced->medium, nothing, 2))
            return false;
        volume->medium = forced->medium;
    }
    if ((force & FORCE_SOLID) && volume->medium && !volume->solid) {
        if (!add_voxels(volume, &forced->solid, nothing, 4))
            return false;
        volume->solid = forced->solid;
    }
    if (force & FORCE_LIGHT)
        volume->lit = true;
    return true;
}

enum status force_objects(uint32_t force, struct prepared *prepared, struct error *err) {
    if (!force)
        return STATUS_OK;
    static const uint32_t flags[][2] = {{FORCE_LIGHT, FLAG_LIT},
                                        {FORCE_SPECULAR, FLAG_SPECULAR},
                                        {FORCE_EYE_INSIDE, FLAG_EYE_INSIDE},
                                        {FORCE_TEXTURED, FLAG_TEXTURED}};
    prepared->forced = calloc(prepared->object_count + 1, sizeof *prepared->forced);
    if (!prepared->forced)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to measure");
    for (size_t i = 0; i < prepared->object_count; i++) {
        struct path_object *object = &prepared->objects[i];
        for (size_t f = 0; f < sizeof flags / sizeof *flags; f++)
            object->forced |= force & flags[f][0] ? flags[f][1] : 0;
        object->every_plane = (force & FORCE_EVERY_PLANE) != 0;
        if (!object->shell)
            continue;
        struct forced_volume *forced = &prepared->forced[i];
        forced->original = object->volume;
        forced->volume = *object->volume;
        if (!force_volume(force, object, forced))
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to measure");
        object->volume = &forced->volume;
    }
    return STATUS_OK;
}

void force_plan(uint32_t force, struct plan *plan) {
    plan->occluded |= plan->media && (force & FORCE_OCCLUDED);
    plan->depth |= plan->occluded || (force & FORCE_DEPTH);
    plan->flags |= plan->occluded ? FLAG_OCCLUDED : 0;
}
