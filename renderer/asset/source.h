/* Where the bytes of an asset come from. The renderer knows no files and no HTTP: the command line
 * answers from beside the scene file, a worker from file descriptors passed by the front. */
#ifndef PELT_RENDERER_ASSET_SOURCE_H
#define PELT_RENDERER_ASSET_SOURCE_H

#include <stddef.h>

#include "api/status.h"

struct asset_bytes {
    const unsigned char *data; /* valid until close */
    size_t size;
    unsigned char sha256[32]; /* of the bytes; the key of every cache */
    void *handle;             /* the source's own */
};

struct asset_source {
    /* Opens an asset by the name the scene uses. `pointer`: where the scene names it, for faults.
     * STATUS_ASSET_NOT_FOUND, STATUS_BAD_ASSET, STATUS_IO_ERROR. */
    enum status (*open)(void *user, const char *name, const char *pointer,
                        struct asset_bytes *bytes, struct error *err);
    void (*close)(void *user, struct asset_bytes *bytes);
    void *user;
};

#endif
