/* Looks through the table that the build makes; see embedded.h. */
#include "api/embedded.h"

#include <string.h>

const struct embedded *embedded_find(const char *name) {
    for (const struct embedded *file = embedded_files; file->name; file++)
        if (strcmp(file->name, name) == 0)
            return file;
    return NULL;
}
