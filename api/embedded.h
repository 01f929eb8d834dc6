/* Files that the program carries within itself: shaders, schema, OpenAPI document, pages. */
#ifndef PELT_API_EMBEDDED_H
#define PELT_API_EMBEDDED_H

#include <stddef.h>

struct embedded {
    const char *name;        /* path in the source tree, e.g. "shaders/tetra.frag" */
    const char *begin, *end; /* text, with a 0 byte at *end */
};

extern const struct embedded embedded_files[]; /* ends with a row of NULLs */

const struct embedded *embedded_find(const char *name); /* NULL: no such file */

#endif
