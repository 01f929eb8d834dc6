/* What the reference does not draw. Asked before anything is acquired, and by those who take a
 * scene now and draw it later. */
#include <stdio.h>

#include "renderer/reference/reference.h"

enum status reference_check(const struct scene *scene, struct error *err) {
    enum status status = STATUS_OK;
    char pointer[64];
    for (size_t i = 0; i < scene->object_count; i++) {
        if (scene->objects[i].kind != SCENE_OBJECT_SKELETON)
            continue;
        snprintf(pointer, sizeof pointer, "/objects/%zu/skeleton", i);
        status = error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                             "the reference does not draw skeletons");
    }
    return status;
}
