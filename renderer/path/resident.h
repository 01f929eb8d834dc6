/* GL objects that stay on the device between pictures: a small cache by serial number, least
 * recently used first out. Entries used by the picture being drawn are pinned by their `picture`.
 */
#ifndef PELT_RENDERER_PATH_RESIDENT_H
#define PELT_RENDERER_PATH_RESIDENT_H

#include <stddef.h>
#include <stdint.h>

struct resident {
    uint64_t serial;
    uint64_t picture; /* number of the last picture that used it */
    size_t bytes;
    void *data;
    struct resident *next;
};

struct resident_cache {
    struct resident *first;
    size_t bytes, bytes_max;
    uint64_t picture; /* number of the current picture */
    void (*destroy)(void *data);
};

void *resident_find(struct resident_cache *cache, uint64_t serial); /* NULL: not there */

/* Takes `data` over; evicts others that the current picture has not used. NULL (and destroys data)
 * where memory ran out. */
void *resident_add(struct resident_cache *cache, uint64_t serial, void *data, size_t bytes);

void resident_begin_picture(struct resident_cache *cache);
void resident_clear(struct resident_cache *cache);

#endif
