/* The cache of materials as voxels: finds or makes a volume, counts references, and forgets the
 * least recently used ones when they outgrow their budget.
 *
 * Two materials that differ only in how they are lit share their voxels. What makes the voxels is
 * in volume_builtin.c, volume_height.c, volume_file.c and
 * volume_geometry.c. Not thread-safe: one cache belongs to one thread. */
#include "renderer/asset/volume.h"

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/volume_generators.h"

enum { KEY_BYTES = 32, ENTRIES_MAX = 256 };

/* Voxels, shared by the volumes that differ in other things. */
struct voxels {
    struct volume made; /* as the generator left it */
    int users;          /* entries that point here */
};

struct entry {
    struct volume volume; /* first: what is handed out */
    struct voxels *voxels;
    struct entry *newer, *older;
};

struct volume_cache {
    struct entry *newest, *oldest;
    size_t entry_count;
    size_t bytes, bytes_max;
};

struct volume_cache *volume_cache_create(size_t bytes_max) {
    struct volume_cache *cache = calloc(1, sizeof *cache);
    if (cache)
        cache->bytes_max = bytes_max;
    return cache;
}

static void unlink_entry(struct volume_cache *cache, struct entry *entry) {
    *(entry->newer ? &entry->newer->older : &cache->newest) = entry->older;
    *(entry->older ? &entry->older->newer : &cache->oldest) = entry->newer;
    entry->newer = entry->older = NULL;
    cache->entry_count--;
}

static void link_newest(struct volume_cache *cache, struct entry *entry) {
    entry->older = cache->newest;
    entry->newer = NULL;
    *(cache->newest ? &cache->newest->newer : &cache->oldest) = entry;
    cache->newest = entry;
    cache->entry_count++;
}

static void free_voxels(struct voxels *voxels) {
    free(voxels->made.medium);
    free(voxels->made.solid);
    free(voxels->made.strands);
    free(voxels);
}

static void free_entry(struct volume_cache *cache, struct entry *entry) {
    if (--entry->voxels->users == 0) {
        cache->bytes -= entry->voxels->made.bytes;
        free_voxels(entry->voxels);
    }
    free(entry);
}

/* Drops unused entries, oldest first, until the budget is met or all are in use. */
static void trim(struct volume_cache *cache) {
    for (struct entry *e = cache->oldest, *next; e; e = next) {
        if (cache->bytes <= cache->bytes_max && cache->entry_count <= ENTRIES_MAX)
            return;
        next = e->newer;
        if (e->volume.references == 0) {
            unlink_entry(cache, e);
            free_entry(cache, e);
        }
    }
}

void volume_cache_destroy(struct volume_cache *cache) {
    if (!cache)
        return;
    for (struct entry *e = cache->newest, *next; e; e = next) {
        next = e->older;
        free_entry(cache, e);
    }
    free(cache);
}

float *volume_alloc_voxels(const int size[3]) {
    return calloc((size_t)size[0] * (size_t)size[1] * (size_t)size[2], 4 * sizeof(float));
}

float volume_medium_max(const float *medium, const int size[3]) {
    size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    float max = 0.0f;
    for (size_t i = 0; i < count; i++)
        max = medium[4 * i + 3] > max ? medium[4 * i + 3] : max;
    return max;
}

static float medium_through(const struct volume *volume) {
    size_t columns = (size_t)volume->size[0] * (size_t)volume->size[1];
    double sum = 0;
    for (size_t c = 0; c < columns; c++) {
        double tau = 0;
        for (int w = 0; volume->medium && w < volume->size[2]; w++)
            tau += (double)volume->medium[4 * ((size_t)w * columns + c) + 3] / volume->size[2];
        sum += exp(-tau);
    }
    return columns ? (float)(sum / (double)columns) : 1;
}

/* A member's pointer below the material's. */
static enum status member_fault(struct error *err, enum status status, const char *pointer,
                                const char *member, const char *message) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", pointer, member);
    return error_fault(err, status, path, "%s", message);
}

/* What can be made here, and its size in range: the room's door. */
static enum status check_spec(const struct scene_material *spec, const char *pointer,
                              struct error *err) {
    switch (spec->kind) {
    case SCENE_MATERIAL_BUILTIN:
        if (spec->builtin != SCENE_BUILTIN_HOMOGENEOUS && !volume_builtin_exists(spec->builtin))
            return member_fault(err, STATUS_NOT_IMPLEMENTED, pointer, "builtin",
                                "this built-in material cannot be made yet");
        break;
    case SCENE_MATERIAL_HEIGHT:
        if (!spec->height)
            return member_fault(err, STATUS_INVALID_SCENE, pointer, "height",
                                "a height material needs a height image");
        break;
    case SCENE_MATERIAL_VOLUME:
        if (!spec->volume)
            return member_fault(err, STATUS_INVALID_SCENE, pointer, "volume",
                                "a volume material needs a file");
        break;
    case SCENE_MATERIAL_GEOMETRY:
        break;
    case SCENE_MATERIAL_NONE:
        return error_fault(err, STATUS_INVALID_SCENE, pointer, "the object has no material");
    }
    bool sized_by_file = spec->kind == SCENE_MATERIAL_HEIGHT || spec->kind == SCENE_MATERIAL_VOLUME;
    for (int i = 0; i < 3; i++) {
        int limit = i == 2 ? VOLUME_DEPTH_MAX : VOLUME_SIDE_MAX;
        if (spec->size[i] > limit || spec->size[i] < (sized_by_file ? 0 : 1))
            return member_fault(err, STATUS_TOO_COMPLEX, pointer, "size",
                                "a volume has at least 1 and at most 512 x 512 x 64 voxels");
    }
    return STATUS_OK;
}

/* The assets of a material, by the member that names each; closed by close_files(). A tile's mesh
 * is opened again by what makes it: here it is but for the key. */
enum { FILE_HEIGHT, FILE_COLOR, FILE_VOLUME, FILE_GEOMETRY, FILE_COUNT };

struct files {
    struct asset_bytes bytes[FILE_COUNT];
    bool open[FILE_COUNT];
};

static void close_files(const struct asset_source *source, struct files *files) {
    for (int i = 0; i < FILE_COUNT; i++)
        if (files->open[i])
            source->close(source->user, &files->bytes[i]);
}

static enum status open_files(const struct scene_material *spec, const char *pointer,
                              const struct asset_source *source, struct files *files,
                              struct error *err) {
    static const char *const members[FILE_COUNT] = {"height", "color", "volume", "geometry/asset"};
    const char *names[FILE_COUNT] = {NULL};
    *files = (struct files){0};
    if (spec->kind == SCENE_MATERIAL_HEIGHT) {
        names[FILE_HEIGHT] = spec->height;
        names[FILE_COLOR] = spec->color_image;
    }
    if (spec->kind == SCENE_MATERIAL_VOLUME)
        names[FILE_VOLUME] = spec->volume;
    if (spec->kind == SCENE_MATERIAL_GEOMETRY && spec->geometry.kind == SCENE_MESH_ASSET)
        names[FILE_GEOMETRY] = spec->geometry.asset;
    for (int i = 0; i < FILE_COUNT; i++) {
        if (!names[i])
            continue;
        enum status status =
            source ? STATUS_OK
                   : error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "there are no assets here");
        if (status == STATUS_OK) {
            char path[256];
            snprintf(path, sizeof path, "%s/%s", pointer, members[i]);
            status = source->open(source->user, names[i], path, &files->bytes[i], err);
        }
        if (status != STATUS_OK) {
            close_files(source, files);
            return status;
        }
        files->open[i] = true;
    }
    return STATUS_OK;
}

/* Everything that the voxels depend on, hashed. Members that a material does not use are left out,
 * so that they do not make another volume of it. */
static enum status content_key(const struct scene_material *spec, double thickness,
                               const struct files *files, unsigned char key[KEY_BYTES],
                               struct error *err) {
    struct {
        int32_t kind, builtin, size[3];
        uint32_t seed, has_color, mesh_kind, strands;
        double extinction, color[3], thickness, growth, phase;
        double mesh_size[2], mesh_radius, mesh_tube, mesh_height;
        int32_t mesh_divisions[2];
        uint32_t mesh_seed, mesh_posed;
        double mesh_time_s;
        char mesh_animation[4 * SCENE_TEXT_MAX + 4];
        unsigned char file[FILE_COUNT][32];
    } text;
    memset(&text, 0, sizeof text);
    bool builtin = spec->kind == SCENE_MATERIAL_BUILTIN;
    bool homogeneous = builtin && spec->builtin == SCENE_BUILTIN_HOMOGENEOUS;
    text.kind = spec->kind;
    text.builtin = builtin ? (int32_t)spec->builtin : -1;
    for (int i = 0; i < 3; i++)
        text.size[i] = homogeneous ? 1 : spec->size[i];
    text.seed = builtin && !homogeneous ? spec->seed : 0;
    text.extinction = homogeneous ? spec->extinction : 0.0;
    text.growth = spec->has_growth ? spec->growth : 1;
    text.phase = spec->phase - floor(spec->phase);
    text.has_color = spec->has_color;
    text.strands = builtin && volume_wants_strands(spec);
    if (spec->has_color || homogeneous)
        memcpy(text.color, spec->color, sizeof text.color);
    text.thickness = spec->kind == SCENE_MATERIAL_VOLUME ? thickness : 0.0;
    if (spec->kind == SCENE_MATERIAL_GEOMETRY) {
        const struct scene_mesh *mesh = &spec->geometry;
        text.mesh_kind = (uint32_t)mesh->kind;
        if (mesh->kind != SCENE_MESH_ASSET) {
            memcpy(text.mesh_size, mesh->size, sizeof text.mesh_size);
            text.mesh_radius = mesh->radius;
            text.mesh_tube = mesh->tube;
            text.mesh_height = mesh->height;
            memcpy(text.mesh_divisions, mesh->divisions, sizeof text.mesh_divisions);
            text.mesh_seed = mesh->seed;
        } else if (mesh->has_time || mesh->animation) {
            text.mesh_posed = 1;
            text.mesh_time_s = mesh->has_time ? mesh->time_s : 0;
            if (mesh->animation)
                snprintf(text.mesh_animation, sizeof text.mesh_animation, "%s", mesh->animation);
        }
    }
    for (int i = 0; i < FILE_COUNT; i++)
        if (files->open[i])
            memcpy(text.file[i], files->bytes[i].sha256, 32);
    int result = gnutls_hash_fast(GNUTLS_DIG_SHA256, &text, sizeof text, key);
    if (result == 0)
        return STATUS_OK;
    return error_fault(err,
                       result == GNUTLS_E_MEMORY_ERROR ? STATUS_OUT_OF_MEMORY : STATUS_INTERNAL,
                       NULL, "SHA-256 failed: %s", gnutls_strerror(result));
}

static enum status make_voxels(const struct scene_material *spec, double thickness,
                               const struct files *files, const struct asset_source *source,
                               const char *pointer, struct volume *volume, struct error *err) {
    memcpy(volume->size, spec->size, sizeof volume->size);
    enum status status = STATUS_OK;
    bool told = true; /* the maker says why it failed */
    if (spec->kind == SCENE_MATERIAL_HEIGHT) {
        status = volume_make_height(spec, &files->bytes[FILE_HEIGHT],
                                    files->open[FILE_COLOR] ? &files->bytes[FILE_COLOR] : NULL,
                                    pointer, volume, err);
    } else if (spec->kind == SCENE_MATERIAL_VOLUME) {
        status = volume_make_file(&files->bytes[FILE_VOLUME], thickness, pointer, volume, err);
    } else if (spec->kind == SCENE_MATERIAL_GEOMETRY) {
        status = volume_make_geometry(spec, source, pointer, volume, err);
    } else if (spec->builtin == SCENE_BUILTIN_HOMOGENEOUS) {
        volume->size[0] = volume->size[1] = volume->size[2] = 1;
        volume->homogeneous = true;
        volume->extinction = spec->extinction;
        memcpy(volume->radiance, spec->color, sizeof volume->radiance);
    } else {
        status = volume_make_builtin(spec, volume);
        told = false;
    }
    if (status != STATUS_OK)
        return told ? status
                    : error_fault(err, status, pointer, "no memory for %d x %d x %d voxels",
                                  volume->size[0], volume->size[1], volume->size[2]);
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    volume->bytes = sizeof(struct entry) + sizeof(struct voxels);
    volume->medium_through = medium_through(volume);
    volume->bytes +=
        ((volume->medium != NULL) + (volume->solid != NULL) + (volume->strands != NULL)) * count *
        16;
    return STATUS_OK;
}

/* How the voxels are lit, and what fills the shell besides. A homogeneous medium has no gradient:
 * its colour is its radiance. */
static void set_light(struct volume *volume, const struct scene_material *spec) {
    volume->lit = spec->lit && !volume->homogeneous;
    volume->strand_lit = volume->lit && volume->medium && spec->shading == SCENE_SHADING_KAJIYA_KAY;
    volume->absorption = spec->absorption;
    memcpy(volume->emission, spec->emission, sizeof volume->emission);
    volume->glow = spec->glow;
    /* Only what holds a medium has the member. */
    for (int i = 0; i < 3; i++)
        volume->tint[i] = volume->homogeneous || volume->medium ? spec->extinction_color[i] : 1;
    volume->specular = volume->lit ? (float)spec->specular : 0.0f;
    volume->shininess = volume->lit ? (float)spec->shininess : 0.0f;
}

static bool same_light(const struct volume *a, const struct volume *b) {
    bool filled_alike = a->absorption == b->absorption && a->glow == b->glow;
    for (int i = 0; i < 3; i++)
        filled_alike &= a->emission[i] == b->emission[i] && a->tint[i] == b->tint[i];
    return filled_alike && a->lit == b->lit && a->strand_lit == b->strand_lit &&
           a->specular == b->specular && a->shininess == b->shininess;
}

enum status volume_acquire(struct volume_cache *cache, const struct scene_material *spec,
                           double thickness, const char *pointer, const struct asset_source *source,
                           const struct volume **volume, bool *made, struct error *err) {
    *volume = NULL;
    *made = false;
    enum status status = check_spec(spec, pointer, err);
    if (status != STATUS_OK)
        return status;
    struct files files;
    status = open_files(spec, pointer, source, &files, err);
    if (status != STATUS_OK)
        return status;

    unsigned char key[KEY_BYTES];
    struct entry *entry = NULL;
    struct voxels *voxels = NULL, *fresh = NULL;
    status = content_key(spec, thickness, &files, key, err);
    if (status != STATUS_OK)
        goto done;
    for (struct entry *e = cache->newest; e; e = e->older) {
        if (memcmp(e->volume.key, key, KEY_BYTES) != 0)
            continue;
        voxels = e->voxels;
        struct volume wanted = voxels->made;
        set_light(&wanted, spec);
        if (same_light(&e->volume, &wanted)) {
            entry = e;
            unlink_entry(cache, entry);
            break;
        }
    }
    if (!voxels) {
        voxels = fresh = calloc(1, sizeof *fresh);
        if (!fresh) {
            status = error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a material");
            goto done;
        }
        memcpy(fresh->made.key, key, KEY_BYTES);
        status = make_voxels(spec, thickness, &files, source, pointer, &fresh->made, err);
        if (status != STATUS_OK) {
            free_voxels(fresh);
            goto done;
        }
        *made = true;
    }
    if (!entry) {
        entry = calloc(1, sizeof *entry);
        if (!entry) {
            if (fresh)
                free_voxels(fresh);
            *made = false;
            status = error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a material");
            goto done;
        }
        entry->volume = voxels->made;
        set_light(&entry->volume, spec);
        entry->voxels = voxels;
        voxels->users++;
        if (fresh)
            cache->bytes += fresh->made.bytes;
    }
    entry->volume.references++;
    link_newest(cache, entry);
    *volume = &entry->volume;
    trim(cache);
done:
    close_files(source, &files);
    return status;
}

void volume_release(struct volume_cache *cache, const struct volume *volume) {
    if (!volume)
        return;
    for (struct entry *e = cache->newest; e; e = e->older)
        if (&e->volume == volume) {
            e->volume.references--;
            break;
        }
    trim(cache);
}

void volume_warn(const struct volume *volume, const char *pointer, struct report *report) {
    const struct volume_notes *notes = &volume->notes;
    if (notes->negative)
        report_warn(report, "volume-negative", pointer, notes->negative, 0,
                    "%llu values of the volume are below 0; they count as 0",
                    (unsigned long long)notes->negative);
    if (notes->huge)
        report_warn(report, "volume-huge", pointer, notes->huge, 0,
                    "%llu values of the volume are beyond what is drawn (a density of 1e12 per "
                    "unit, an alpha of 1); they count as that",
                    (unsigned long long)notes->huge);
    if (notes->open_edges)
        report_warn(report, "geometry-open", pointer, notes->open_edges, 0,
                    "the tile's mesh has %llu open edges: where it is not closed it has no inside, "
                    "and its triangles become sheets two voxels thick",
                    (unsigned long long)notes->open_edges);
}
