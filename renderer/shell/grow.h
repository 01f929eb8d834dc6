/* Lists that grow by doubling. Header only. */
#ifndef PELT_RENDERER_SHELL_GROW_H
#define PELT_RENDERER_SHELL_GROW_H

#include <stdbool.h>
#include <stdlib.h>

/* Room for `more` further elements of `size` bytes behind the `count` that a list holds. False, the
 * list as it was, where memory ran out. */
static inline bool list_grow(void **list, size_t count, size_t more, size_t *capacity,
                             size_t size) {
    if (count + more <= *capacity)
        return true;
    size_t wanted = *capacity ? *capacity * 2 : 1024;
    while (wanted < count + more)
        wanted *= 2;
    void *grown = realloc(*list, wanted * size);
    if (!grown)
        return false;
    *list = grown;
    *capacity = wanted;
    return true;
}

#endif
