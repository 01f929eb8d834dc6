/* Shells by mesh, thickness and tiling, so that the next picture of the same object builds nothing.
 */
#include <stdlib.h>

#include "renderer/shell/shell.h"

struct entry {
    struct shell *shell;
    uint64_t mesh, used;
    double thickness, tiles[2];
    struct entry *next;
};

struct shell_cache {
    struct entry *first;
    size_t bytes, bytes_max;
    uint64_t serial, tick;
};

struct shell_cache *shell_cache_create(size_t bytes_max) {
    struct shell_cache *cache = calloc(1, sizeof *cache);
    if (cache)
        cache->bytes_max = bytes_max;
    return cache;
}

static void drop(struct shell_cache *cache, struct entry **at) {
    struct entry *gone = *at;
    *at = gone->next;
    cache->bytes -= gone->shell->bytes;
    shell_destroy(gone->shell);
    free(gone);
}

void shell_cache_destroy(struct shell_cache *cache) {
    if (!cache)
        return;
    while (cache->first)
        drop(cache, &cache->first);
    free(cache);
}

/* Least recently used first, never one that is held. */
static void evict(struct shell_cache *cache) {
    while (cache->bytes > cache->bytes_max) {
        struct entry **oldest = NULL;
        for (struct entry **at = &cache->first; *at; at = &(*at)->next)
            if ((*at)->shell->references == 0 && (!oldest || (*at)->used < (*oldest)->used))
                oldest = at;
        if (!oldest)
            return;
        drop(cache, oldest);
    }
}

enum status shell_acquire(struct shell_cache *cache, const struct mesh *mesh, double thickness,
                          const double tiles[2], const char *pointer, const struct shell **shell,
                          struct error *err) {
    *shell = NULL;
    for (struct entry *entry = cache->first; entry; entry = entry->next)
        if (entry->mesh == mesh->serial && entry->thickness == thickness &&
            entry->tiles[0] == tiles[0] && entry->tiles[1] == tiles[1]) {
            entry->used = ++cache->tick;
            entry->shell->references++;
            *shell = entry->shell;
            return STATUS_OK;
        }
    struct entry *entry = calloc(1, sizeof *entry);
    if (!entry)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a shell");
    enum status status = shell_build(mesh, thickness, tiles, pointer, &entry->shell, err);
    if (status != STATUS_OK) {
        free(entry);
        return status;
    }
    entry->shell->serial = ++cache->serial;
    entry->shell->references = 1;
    entry->mesh = mesh->serial;
    entry->thickness = thickness;
    entry->tiles[0] = tiles[0];
    entry->tiles[1] = tiles[1];
    entry->used = ++cache->tick;
    entry->next = cache->first;
    cache->first = entry;
    cache->bytes += entry->shell->bytes;
    *shell = entry->shell;
    evict(cache);
    return STATUS_OK;
}

void shell_release(struct shell_cache *cache, const struct shell *shell) {
    if (!shell)
        return;
    for (struct entry *entry = cache->first; entry; entry = entry->next)
        if (entry->shell == shell)
            entry->shell->references--;
    evict(cache);
}
