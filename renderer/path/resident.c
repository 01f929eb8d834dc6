/* See resident.h. Lists are short (one entry a mesh or shell in use): searched from the front. */
#include "renderer/path/resident.h"

#include <stdlib.h>

void *resident_find(struct resident_cache *cache, uint64_t serial) {
    for (struct resident *entry = cache->first; entry; entry = entry->next)
        if (entry->serial == serial) {
            entry->picture = cache->picture;
            return entry->data;
        }
    return NULL;
}

static void evict(struct resident_cache *cache) {
    while (cache->bytes > cache->bytes_max) {
        struct resident **oldest = NULL;
        for (struct resident **at = &cache->first; *at; at = &(*at)->next)
            if ((*at)->picture != cache->picture &&
                (!oldest || (*at)->picture < (*oldest)->picture))
                oldest = at;
        if (!oldest)
            return; /* the picture needs all of it */
        struct resident *gone = *oldest;
        *oldest = gone->next;
        cache->bytes -= gone->bytes;
        cache->destroy(gone->data);
        free(gone);
    }
}

void *resident_add(struct resident_cache *cache, uint64_t serial, void *data, size_t bytes) {
    struct resident *entry = malloc(sizeof *entry);
    if (!entry) {
        cache->destroy(data);
        return NULL;
    }
    *entry = (struct resident){serial, cache->picture, bytes, data, cache->first};
    cache->first = entry;
    cache->bytes += bytes;
    evict(cache);
    return data;
}

void resident_begin_picture(struct resident_cache *cache) {
    cache->picture++;
}

void resident_clear(struct resident_cache *cache) {
    while (cache->first) {
        struct resident *gone = cache->first;
        cache->first = gone->next;
        cache->destroy(gone->data);
        free(gone);
    }
    cache->bytes = 0;
}
