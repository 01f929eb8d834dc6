/* Whole files in and out, and the assets that lie beside a scene on the command line. */
#ifndef PELT_SERVICE_FILES_H
#define PELT_SERVICE_FILES_H

#include <stdbool.h>
#include <stddef.h>

#include "api/status.h"
#include "renderer/asset/source.h"

enum { FILES_ASSET_BYTES_MAX = 512 << 20 }; /* one asset */

/* Reads a whole file, "-" being the standard input. `*data` is malloc'ed (caller frees) and has a 0
 * byte behind its `*bytes`; NULL on failure. STATUS_NOT_FOUND, STATUS_IO_ERROR,
 * STATUS_OUT_OF_MEMORY, and STATUS_SCENE_TOO_LARGE past `bytes_max`. Blocks. Thread: any. */
enum status files_read(const char *path, size_t bytes_max, unsigned char **data, size_t *bytes,
                       struct error *err);

/* Writes a whole file, "-" being the standard output. A regular file appears complete or not at
 * all: it is written under another name beside its place and renamed. STATUS_IO_ERROR. Blocks. */
enum status files_write(const char *path, const void *data, size_t bytes, struct error *err);

/* Whether an asset's name may be looked up below a folder: not empty, relative, with no component
 * that is empty, "." or "..", no backslash and no control character. */
bool files_asset_name_ok(const char *name);

/* Assets as files below one folder. */
struct file_assets {
    char *folder; /* owned */
};

/* `folder` NULL: that in which `scene_path` lies ("-": the working directory).
 * STATUS_OUT_OF_MEMORY. */
enum status file_assets_init(struct file_assets *assets, const char *folder, const char *scene_path,
                             struct error *err);
void file_assets_finish(struct file_assets *assets);

/* The renderer's view of them; `assets` must outlive it. Its open() refuses names that are not
 * files_asset_name_ok() (STATUS_INVALID_SCENE), what is no regular file or is larger than
 * FILES_ASSET_BYTES_MAX (STATUS_BAD_ASSET), and what is not there (STATUS_ASSET_NOT_FOUND).
 * Symbolic links are followed: they are the user's own. */
struct asset_source file_assets_source(struct file_assets *assets);

#endif
