/* Uploads volumes and their gradients, and keeps them; see volume_texture.h.
 *
 * Textures are keyed by the content key of the volume, not by its address: a volume may be
 * forgotten and made again while its textures live on. Left out on purpose: smaller formats.
 * Extinction reaches thousands and solid colours are divided by s, so both are kept at fp32; a
 * fetch of RGBA32F costs llvmpipe no more than one of RGBA8 (NUMERICS.md). */
#include "renderer/bake/volume_texture.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/bake/normals.h"
#include "renderer/gl/context.h"

struct entry {
    struct baked baked; /* first: what is handed out */
    unsigned char key[32];
    uint64_t bytes;
    int references;
    struct entry *newer, *older;
};

struct bake_cache {
    struct entry *newest, *oldest;
    uint64_t bytes, bytes_max;
    struct baked nothing; /* what a homogeneous volume has */
};

struct bake_cache *bake_cache_create(size_t bytes_max) {
    struct bake_cache *cache = calloc(1, sizeof *cache);
    if (cache)
        cache->bytes_max = bytes_max;
    return cache;
}

static void unlink_entry(struct bake_cache *cache, struct entry *entry) {
    *(entry->newer ? &entry->newer->older : &cache->newest) = entry->older;
    *(entry->older ? &entry->older->newer : &cache->oldest) = entry->newer;
    entry->newer = entry->older = NULL;
}

static void link_newest(struct bake_cache *cache, struct entry *entry) {
    entry->older = cache->newest;
    entry->newer = NULL;
    *(cache->newest ? &cache->newest->newer : &cache->oldest) = entry;
    cache->newest = entry;
}

static void free_entry(struct bake_cache *cache, struct entry *entry) {
    cache->bytes -= entry->bytes;
    const struct baked *b = &entry->baked;
    /* Names of 0 are ignored by the GL. */
    glDeleteTextures(4,
                     (const GLuint[]){b->medium, b->solid, b->medium_gradient, b->solid_gradient});
    free(entry);
}

static void trim(struct bake_cache *cache) {
    for (struct entry *e = cache->oldest, *next; e && cache->bytes > cache->bytes_max; e = next) {
        next = e->newer;
        if (e->references == 0) {
            unlink_entry(cache, e);
            free_entry(cache, e);
        }
    }
}

void bake_cache_destroy(struct bake_cache *cache) {
    if (!cache)
        return;
    for (struct entry *e = cache->newest, *next; e; e = next) {
        next = e->older;
        free_entry(cache, e);
    }
    free(cache);
}

static enum status upload(const int size[3], GLenum format, GLenum type, const void *texels,
                          GLuint *texture, struct error *err) {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_3D, 1, &name);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureStorage3D(name, 1, format, size[0], size[1], size[2]);
    glTextureSubImage3D(name, 0, 0, 0, 0, size[0], size[1], size[2], GL_RGBA, type, texels);
    enum status status = gl_check("uploading a material", err);
    if (status != STATUS_OK) {
        glDeleteTextures(1, &name);
        return status;
    }
    *texture = name;
    return STATUS_OK;
}

/* What one call adds to an entry. */
struct work {
    const struct volume *volume;
    struct entry *entry;
    struct stage_clock *clock;
    uint64_t uploaded;
    struct error *err;
};

static void enter_stage(struct work *work, enum report_stage stage) {
    if (work->clock && work->clock->stage != stage)
        stage_clock_next(work->clock, stage, false);
}

static size_t voxel_count(const struct volume *volume) {
    return (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
}

static enum status add_voxels(struct work *work, const float *voxels, GLuint *texture) {
    if (!voxels || *texture)
        return STATUS_OK;
    enter_stage(work, REPORT_STAGE_upload);
    enum status status =
        upload(work->volume->size, GL_RGBA32F, GL_FLOAT, voxels, texture, work->err);
    if (status == STATUS_OK)
        work->uploaded += voxel_count(work->volume) * 16;
    return status;
}

static enum status add_gradient(struct work *work, enum bake_field field, GLuint *texture) {
    bool present =
        field == BAKE_FIELD_SOLID ? work->volume->solid != NULL : work->volume->medium != NULL;
    if (!present || *texture)
        return STATUS_OK;
    enter_stage(work, REPORT_STAGE_bake);
    size_t bytes = voxel_count(work->volume) * 8;
    uint16_t *halves = malloc(bytes);
    if (!halves || bake_gradients(work->volume, field, halves) != STATUS_OK) {
        free(halves);
        return error_fault(work->err, STATUS_OUT_OF_MEMORY, NULL, "no memory for normals");
    }
    enter_stage(work, REPORT_STAGE_upload);
    enum status status =
        upload(work->volume->size, GL_RGBA16F, GL_HALF_FLOAT, halves, texture, work->err);
    free(halves);
    if (status == STATUS_OK)
        work->uploaded += bytes;
    return status;
}

static enum status add_textures(struct work *work, bool lit) {
    struct baked *baked = &work->entry->baked;
    enum status status = add_voxels(work, work->volume->medium, &baked->medium);
    if (status == STATUS_OK)
        status = add_voxels(work, work->volume->solid, &baked->solid);
    if (status == STATUS_OK && lit)
        status = add_gradient(work, BAKE_FIELD_MEDIUM, &baked->medium_gradient);
    if (status == STATUS_OK && lit)
        status = add_gradient(work, BAKE_FIELD_SOLID, &baked->solid_gradient);
    return status;
}

static enum status check_size(const struct volume *volume, struct error *err) {
    GLint limit = 0;
    glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &limit);
    for (int i = 0; i < 3; i++)
        if (volume->size[i] > limit)
            return error_fault(err, STATUS_TOO_COMPLEX, NULL,
                               "a material of %d x %d x %d voxels; this GL takes at most %d a side",
                               volume->size[0], volume->size[1], volume->size[2], limit);
    return STATUS_OK;
}

enum status bake_acquire(struct bake_cache *cache, const struct volume *volume, bool lit,
                         const struct baked **baked, bool *made, uint64_t *upload_bytes,
                         struct stage_clock *clock, struct error *err) {
    *baked = &cache->nothing;
    if (!volume->medium && !volume->solid)
        return STATUS_OK;
    *baked = NULL;
    enum status status = check_size(volume, err);
    if (status != STATUS_OK)
        return status;
    struct entry *entry = cache->newest;
    while (entry && memcmp(entry->key, volume->key, sizeof entry->key) != 0)
        entry = entry->older;
    if (entry) {
        unlink_entry(cache, entry);
    } else {
        entry = calloc(1, sizeof *entry);
        if (!entry)
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for textures");
        memcpy(entry->key, volume->key, sizeof entry->key);
    }
    link_newest(cache, entry);

    struct work work = {volume, entry, clock, 0, err};
    status = add_textures(&work, lit);
    entry->bytes += work.uploaded;
    cache->bytes += work.uploaded;
    if (made && work.uploaded)
        *made = true;
    if (upload_bytes)
        *upload_bytes += work.uploaded;
    if (status != STATUS_OK) {
        if (entry->references == 0) {
            unlink_entry(cache, entry);
            free_entry(cache, entry);
        }
        return status;
    }
    entry->references++;
    *baked = &entry->baked;
    trim(cache);
    return STATUS_OK;
}

void bake_release(struct bake_cache *cache, const struct baked *baked) {
    if (!baked)
        return;
    for (struct entry *e = cache->newest; e; e = e->older)
        if (&e->baked == baked) {
            e->references--;
            break;
        }
    trim(cache);
}
