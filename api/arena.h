/* An arena for each request: everything read from one scene is freed in one call. */
#ifndef PELT_API_ARENA_H
#define PELT_API_ARENA_H

#include <stddef.h>

struct arena_block;

/* Zero-initialise ({0}); arena_free() releases all. Not thread-safe. */
struct arena {
    struct arena_block *blocks;
    size_t bytes; /* handed out so far */
};

/* `count` zeroed elements of `size` bytes, aligned to 16; NULL where memory ran out or count * size
 * overflows. Never NULL for a count of 0. */
void *arena_alloc(struct arena *arena, size_t count, size_t size);

char *arena_strdup(struct arena *arena, const char *text); /* NULL where memory ran out */

void arena_free(struct arena *arena);

#endif
