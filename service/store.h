/* Assets from the server's --assets folder, as sealed memory files that can be passed to workers.
 * A file is copied and hashed once and kept until it changes or room is needed, so that what a
 * worker reads is what was hashed, whatever happens on the disk meanwhile. */
#ifndef PELT_SERVICE_STORE_H
#define PELT_SERVICE_STORE_H

#include <stddef.h>

#include "api/status.h"
#include "service/job.h"

struct store;

enum { STORE_FILE_BYTES_MAX = 256 << 20, STORE_BYTES_MAX = 512 << 20, STORE_FILES_MAX = 256 };

/* `folder` NULL: a store in which nothing is found. STATUS_IO_ERROR where the folder cannot be
 * opened, STATUS_OUT_OF_MEMORY. */
enum status store_create(const char *folder, struct store **store, struct error *err);
void store_destroy(struct store *store); /* takes NULL */

/* The asset of that name, which is a path beneath the folder and never leads out of it: `..`,
 * absolute paths and symbolic links that leave are refused. `pointer`: where the scene names it. On
 * success asset->fd is the caller's. STATUS_INVALID_SCENE (a name that is no such path),
 * STATUS_ASSET_NOT_FOUND, STATUS_BAD_ASSET, STATUS_IO_ERROR, STATUS_OUT_OF_MEMORY. Thread: any.
 * Blocks for the disk the first time. */
enum status store_open(struct store *store, const char *name, const char *pointer,
                       struct job_asset *asset, struct error *err);

size_t store_bytes(struct store *store); /* held in memory files now */

#endif
