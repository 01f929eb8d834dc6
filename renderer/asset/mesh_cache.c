/* Meshes that are made once: a cache with reference counts, least recently used out first.
 *
 * The key is what decides the mesh and nothing else: a built-in shape's own parameters, or the
 * SHA-256 of an asset's bytes, never its name, with the pose that is asked for. A posed mesh holds
 * the rest pose, which is made or found first: frames of an animation share it. A mesh in use is
 * never evicted, so bytes_max may be passed for as long as a scene needs it. */
#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/mesh_asset.h"
#include "renderer/asset/mesh_build.h"

enum { ENTRIES_MAX = 256 }; /* keeps the linear search short where meshes are small */

struct key { /* members that a kind does not have are 0 */
    enum scene_mesh_kind kind;
    double size[2], radius, tube, height;
    uint32_t seed;
    int divisions[2];
    unsigned char sha256[32];
    bool for_poses; /* the rest pose that poses stand on */
    bool posed;     /* as an animation has it at a time */
    double time_s;
    char animation[4 * SCENE_TEXT_MAX + 1]; /* "": the first */
};

struct entry {
    struct entry *next;
    struct key key;
    bool textures; /* images were decoded */
    bool has_images;
    uint64_t used; /* the cache's clock at the last use */
    struct mesh *mesh;
};

struct mesh_cache {
    size_t bytes, bytes_max;
    size_t entries;
    uint64_t clock, serial;
    struct entry *first;
};

struct mesh_cache *mesh_cache_create(size_t bytes_max) {
    struct mesh_cache *cache = calloc(1, sizeof *cache);
    if (cache)
        cache->bytes_max = bytes_max;
    return cache;
}

static void entry_remove(struct mesh_cache *cache, struct entry **link) {
    struct entry *entry = *link;
    *link = entry->next;
    cache->bytes -= entry->mesh->bytes;
    cache->entries--;
    if (entry->mesh->rest)
        entry->mesh->rest->references--;
    mesh_destroy(entry->mesh);
    free(entry);
}

void mesh_cache_destroy(struct mesh_cache *cache) {
    if (!cache)
        return;
    for (struct entry **link = &cache->first; *link;) /* these hold others */
        if ((*link)->mesh->rest)
            entry_remove(cache, link);
        else
            link = &(*link)->next;
    while (cache->first)
        entry_remove(cache, &cache->first);
    free(cache);
}

static void evict(struct mesh_cache *cache) {
    while (cache->bytes > cache->bytes_max || cache->entries > ENTRIES_MAX) {
        struct entry **oldest = NULL;
        for (struct entry **link = &cache->first; *link; link = &(*link)->next)
            if ((*link)->mesh->references == 0 && (!oldest || (*link)->used < (*oldest)->used))
                oldest = link;
        if (!oldest)
            return;
        entry_remove(cache, oldest);
    }
}

static void key_of(const struct scene_mesh *spec, const unsigned char *sha256, struct key *key) {
    *key = (struct key){0};
    key->kind = spec->kind;
    if (spec->kind == SCENE_MESH_ASSET) {
        memcpy(key->sha256, sha256, sizeof key->sha256);
        key->posed = spec->has_time || spec->animation;
        key->time_s = spec->has_time ? spec->time_s : 0;
        if (spec->animation)
            snprintf(key->animation, sizeof key->animation, "%s", spec->animation);
        return;
    }
    for (int k = 0; k < 2; k++)
        key->divisions[k] = spec->divisions[k];
    bool plane = spec->kind == SCENE_MESH_PLANE || spec->kind == SCENE_MESH_TERRAIN;
    bool round = spec->kind == SCENE_MESH_SPHERE || spec->kind == SCENE_MESH_TORUS ||
                 spec->kind == SCENE_MESH_CYLINDER;
    for (int k = 0; plane && k < 2; k++)
        key->size[k] = spec->size[k];
    if (round)
        key->radius = spec->radius;
    if (spec->kind == SCENE_MESH_TORUS)
        key->tube = spec->tube;
    if (spec->kind == SCENE_MESH_CYLINDER || spec->kind == SCENE_MESH_TERRAIN)
        key->height = spec->height;
    if (spec->kind == SCENE_MESH_TERRAIN)
        key->seed = spec->seed;
}

static bool key_equals(const struct key *a, const struct key *b) {
    return a->kind == b->kind && a->size[0] == b->size[0] && a->size[1] == b->size[1] &&
           a->radius == b->radius && a->tube == b->tube && a->height == b->height &&
           a->seed == b->seed && a->divisions[0] == b->divisions[0] &&
           a->divisions[1] == b->divisions[1] && a->posed == b->posed &&
           a->for_poses == b->for_poses && a->time_s == b->time_s &&
           strcmp(a->animation, b->animation) == 0 &&
           memcmp(a->sha256, b->sha256, sizeof a->sha256) == 0;
}

static struct entry *find(struct mesh_cache *cache, const struct key *key, bool want_textures) {
    for (struct entry *entry = cache->first; entry; entry = entry->next)
        if (key_equals(&entry->key, key) &&
            (!entry->has_images || entry->textures == want_textures))
            return entry;
    return NULL;
}

static enum status make_shape(const struct scene_mesh *spec, const char *pointer,
                              struct mesh **mesh, struct error *err) {
    struct mesh_soup soup;
    enum status status = mesh_shape_make(spec, pointer, &soup, err);
    if (status == STATUS_OK)
        status = mesh_build(&soup, pointer, mesh, err);
    mesh_soup_finish(&soup);
    if (status == STATUS_OK) { /* shapes have no poses */
        free((*mesh)->source);
        (*mesh)->source = NULL;
    }
    return status;
}

static enum status find_or_make(struct mesh_cache *cache, const struct scene_mesh *spec,
                                bool want_textures, bool for_poses, const char *pointer,
                                const struct asset_bytes *bytes, struct entry **entry,
                                struct error *err);

/* A pose of the mesh that lies in the file. */
static enum status make_pose(struct mesh_cache *cache, const struct scene_mesh *spec,
                             bool want_textures, const char *pointer,
                             const struct asset_bytes *bytes, struct entry *entry,
                             struct error *err) {
    struct scene_mesh rest_spec = *spec;
    struct entry *rest;
    rest_spec.has_time = false;
    rest_spec.animation = NULL;
    enum status status =
        find_or_make(cache, &rest_spec, want_textures, true, pointer, bytes, &rest, err);
    if (status != STATUS_OK)
        return status;
    rest->used = ++cache->clock;
    entry->has_images = rest->has_images;
    status =
        mesh_asset_pose(bytes->data, bytes->size, spec, rest->mesh, pointer, &entry->mesh, err);
    if (status == STATUS_OK)
        rest->mesh->references++;
    return status;
}

/* A new entry with its mesh, in the cache. `bytes` are an asset's. */
static enum status make(struct mesh_cache *cache, const struct scene_mesh *spec, bool want_textures,
                        const char *pointer, const struct asset_bytes *bytes, const struct key *key,
                        struct entry **made, struct error *err) {
    struct entry *entry = calloc(1, sizeof *entry);
    if (!entry)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a mesh");
    enum status status;
    if (key->posed)
        status = make_pose(cache, spec, want_textures, pointer, bytes, entry, err);
    else if (spec->kind == SCENE_MESH_ASSET)
        status = mesh_asset_load(bytes->data, bytes->size, want_textures, key->for_poses, pointer,
                                 &entry->mesh, &entry->has_images, err);
    else
        status = make_shape(spec, pointer, &entry->mesh, err);
    if (status != STATUS_OK) {
        free(entry);
        return status;
    }
    entry->key = *key;
    entry->mesh->serial = ++cache->serial;
    entry->textures = want_textures;
    entry->next = cache->first;
    cache->first = entry;
    cache->entries++;
    cache->bytes += entry->mesh->bytes;
    *made = entry;
    return STATUS_OK;
}

static enum status find_or_make(struct mesh_cache *cache, const struct scene_mesh *spec,
                                bool want_textures, bool for_poses, const char *pointer,
                                const struct asset_bytes *bytes, struct entry **entry,
                                struct error *err) {
    struct key key;
    key_of(spec, bytes->sha256, &key);
    key.for_poses = for_poses;
    *entry = find(cache, &key, want_textures);
    return *entry ? STATUS_OK : make(cache, spec, want_textures, pointer, bytes, &key, entry, err);
}

enum status mesh_acquire(struct mesh_cache *cache, const struct scene_mesh *spec,
                         bool want_textures, const char *pointer, const struct asset_source *source,
                         const struct mesh **mesh, struct error *err) {
    *mesh = NULL;
    struct asset_bytes bytes = {0};
    bool asset = spec->kind == SCENE_MESH_ASSET;
    enum status status = STATUS_OK;
    if (asset) {
        char at[256];
        snprintf(at, sizeof at, "%s/asset", pointer);
        status = source->open(source->user, spec->asset, at, &bytes, err);
        if (status != STATUS_OK)
            return status;
    }
    struct entry *entry = NULL;
    status = find_or_make(cache, spec, want_textures, false, pointer, &bytes, &entry, err);
    if (asset)
        source->close(source->user, &bytes);
    if (status != STATUS_OK)
        return status;
    assert(entry); /* found or made */
    entry->used = ++cache->clock;
    entry->mesh->references++;
    *mesh = entry->mesh;
    evict(cache);
    return STATUS_OK;
}

void mesh_release(struct mesh_cache *cache, const struct mesh *mesh) {
    for (struct entry *entry = cache->first; mesh && entry; entry = entry->next)
        if (entry->mesh == mesh) {
            entry->mesh->references--;
            evict(cache);
            return;
        }
}

void mesh_warn(const struct mesh *mesh, const char *pointer, struct report *report) {
    const struct mesh_diagnosis *found = &mesh->diagnosis;
    if (found->zero_area)
        report_warn(
            report, "zero-area-triangles", pointer, found->zero_area, found->zero_area_first,
            "%llu triangles without an area are left out; the first is number %llu of the "
            "mesh as given",
            (unsigned long long)found->zero_area, (unsigned long long)found->zero_area_first);
    if (found->non_manifold)
        report_warn(
            report, "non-manifold-edges", pointer, found->non_manifold, found->non_manifold_first,
            "%llu edges have more than two triangles, or two that face opposite ways; the "
            "first belongs to triangle %llu. The shell is open there",
            (unsigned long long)found->non_manifold, (unsigned long long)found->non_manifold_first);
    if (found->normals_made)
        report_warn(
            report, "normals-made", pointer, found->normals_made_count, found->normals_made_first,
            "%llu vertices have no usable normal; they are given the angle-weighted mean of "
            "their triangles' normals",
            (unsigned long long)found->normals_made_count);
    if (found->uvs_made)
        report_warn(report, "uvs-made", pointer, found->uvs_made_count, found->uvs_made_first,
                    "triangles at %llu vertices have no texture coordinates; they are given a box "
                    "projection",
                    (unsigned long long)found->uvs_made_count);
}
