/* See tint.h. */
#include "renderer/tint.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* renderer/path/slicing.c sums more than 512 slabs in groups, each of one optical depth, so that
 * fp32 sums stay within 1e-4. These it sums at once: 4096 terms are off by 1.2e-4 at the worst. */
enum { SLABS_MAX = 4096 };

static const struct path_object *first_tinted(const struct path_object *objects, size_t count) {
    for (size_t i = 0; i < count; i++)
        if (objects[i].shell && volume_has_medium(objects[i].volume) &&
            volume_is_tinted(objects[i].volume))
            return &objects[i];
    return NULL;
}

bool tint_wanted(const struct path_object *objects, size_t count) {
    return first_tinted(objects, count) != NULL;
}

bool tint_shared(const struct scene *scene, const struct path_object *objects, size_t count,
                 double shares[3]) {
    const struct path_object *first = first_tinted(objects, count);
    if (!first || scene->image.background[3] >= 1)
        return false;
    const double *tint = first->volume->tint;
    double most = fmax(fmax(tint[0], tint[1]), tint[2]);
    for (int i = 0; i < 3; i++)
        shares[i] = most > 0 ? tint[i] / most : 1; /* else nothing is lost of any */
    for (size_t i = 0; i < count; i++)
        if (objects[i].shell && volume_has_medium(objects[i].volume) &&
            memcmp(objects[i].volume->tint, tint, sizeof objects[i].volume->tint) != 0)
            return false;
    return true;
}

static enum status refuse(const struct path_object *object, const char *why, struct error *err) {
    char pointer[96];
    snprintf(pointer, sizeof pointer, "%s/shell/material/extinction_color", object->pointer);
    return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer, "%s", why);
}

enum status tint_check(const struct scene *scene, const struct path_object *objects, size_t count,
                       struct error *err) {
    const struct path_object *tinted = first_tinted(objects, count);
    if (!tinted)
        return STATUS_OK;
    double shares[3];
    bool shared = tint_shared(scene, objects, count, shares);
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        if (!object->shell || !volume_has_medium(object->volume))
            continue;
        if (object->object->path == SCENE_PATH_SLICING && object->quality > SLABS_MAX)
            return refuse(tinted, "by the slicing path at most 4096 slices", err);
        if (!object->walk && scene->image.background[3] < 1 && !shared)
            return refuse(tinted,
                          "where cells are drawn one by one and another medium's extinction has "
                          "another colour alpha is not known: take an opaque background, or "
                          "`order` `walk`",
                          err);
    }
    return STATUS_OK;
}
