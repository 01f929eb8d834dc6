/* Every path that this version draws. */
#include "renderer/path/path.h"

const struct path *const path_table[] = {&path_tetra, &path_slicing, NULL};

const struct path *path_find(enum scene_path id) {
    for (const struct path *const *path = path_table; *path; path++)
        if ((*path)->id == id)
            return *path;
    return NULL;
}
