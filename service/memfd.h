/* Sealed memory files: how scenes, assets and pictures travel between the front and its workers.
 * Once sealed their size and bytes cannot change, so a reader may map them without fear of SIGBUS.
 */
#ifndef PELT_SERVICE_MEMFD_H
#define PELT_SERVICE_MEMFD_H

#include <stdbool.h>
#include <stddef.h>

#include "api/status.h"

/* An empty memory file that can be sealed, close-on-exec; -1 with errno on failure. `name` is for
 * /proc only. */
int memfd_open(const char *name);

/* Appends. STATUS_OUT_OF_MEMORY, STATUS_IO_ERROR. Blocks for the copy. */
enum status memfd_write(int fd, const void *data, size_t bytes, struct error *err);

/* Seals size and contents for good. STATUS_IO_ERROR. */
enum status memfd_seal(int fd, struct error *err);

/* True where the file is sealed against every change and holds exactly `bytes`. */
bool memfd_is_sealed(int fd, size_t bytes);

/* For a file that grows while it is read: it never becomes shorter. STATUS_IO_ERROR. */
enum status memfd_seal_growing(int fd, struct error *err);

/* True where the file can never become shorter and holds at least `bytes`. */
bool memfd_holds(int fd, size_t bytes);

/* Maps a sealed file for reading; *data is NULL for 0 bytes. Release with memfd_unmap().
 * STATUS_IO_ERROR, STATUS_OUT_OF_MEMORY. */
enum status memfd_map(int fd, size_t bytes, const void **data, struct error *err);
void memfd_unmap(const void *data, size_t bytes); /* takes NULL */

#endif
