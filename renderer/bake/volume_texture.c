/* Uploads volumes and their gradients, and keeps them; see volume_texture.h.
 *
 * Textures are keyed by the content key of the volume, not by its address: a volume may be
 * forgotten and made again while its textures live on. Left out on purpose: smaller formats.
 * Extinction reaches thousands and solid colours are divided by s, so both are kept at fp32; a
 * fetch of RGBA32F costs llvmpipe no more than one of RGBA8 (NUMERICS.md). */
#include "renderer/bake/volume_texture.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/bake/empty_space.h"
#include "renderer/bake/normals.h"
#include "renderer/bake/pyramid.h"
#include "renderer/bake/view_pyramid.h"
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
    glDeleteTextures(13,
                     (const GLuint[]){b->medium, b->solid, b->medium_gradient, b->solid_gradient,
                                      b->medium_mips, b->gradient_mips, b->medium_views,
                                      b->left_views, b->medium_leap, b->solid_leap, b->strands,
                                      b->strand_mips, b->strand_layers});
    glDeleteTextures(VIEW_MOMENTS, b->moment_views);
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

/* A texture of `levels` levels, without texels. */
static GLuint make_texture(const int size[3], GLenum format, int levels) {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_3D, 1, &name);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER,
                        levels > 1 ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureStorage3D(name, levels, format, size[0], size[1], size[2]);
    return name;
}

static enum status upload(const int size[3], GLenum format, GLenum type, const void *texels,
                          GLuint *texture, struct error *err) {
    GLuint name = make_texture(size, format, 1);
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

/* How far from each voxel the nearest one is that holds something. */
static enum status add_leaps(struct work *work, enum bake_field field, GLuint *texture) {
    const struct volume *volume = work->volume;
    bool present = field == BAKE_FIELD_SOLID ? volume->solid != NULL : volume->medium != NULL;
    if (!present || *texture)
        return STATUS_OK;
    enter_stage(work, REPORT_STAGE_bake);
    size_t bytes = voxel_count(volume);
    uint8_t *distance = malloc(bytes);
    if (!distance || empty_space(volume, field, distance) != STATUS_OK) {
        free(distance);
        return error_fault(work->err, STATUS_OUT_OF_MEMORY, NULL, "no memory for empty space");
    }
    enter_stage(work, REPORT_STAGE_upload);
    const int *size = volume->size;
    GLuint name = make_texture(size, GL_R8, 1);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glTextureSubImage3D(name, 0, 0, 0, 0, size[0], size[1], size[2], GL_RED, GL_UNSIGNED_BYTE,
                        distance);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    free(distance);
    *texture = name;
    work->uploaded += bytes;
    return gl_check("uploading empty space", work->err);
}

/* Of materials whose strands nobody knows. */
static const float upright[4] = {0, 0, 1, 1};

static enum status add_strands(struct work *work, GLuint *texture) {
    if (work->volume->strands)
        return add_voxels(work, work->volume->strands, texture);
    if (*texture)
        return STATUS_OK;
    enter_stage(work, REPORT_STAGE_upload);
    work->uploaded += sizeof upright;
    return upload((const int[3]){1, 1, 1}, GL_RGBA32F, GL_FLOAT, upright, texture, work->err);
}

/* The medium with all its levels, and their gradients or strands where they are wanted. */
static enum status add_mips(struct work *work, bool normals, bool strands) {
    struct baked *baked = &work->entry->baked;
    bool lit = normals && !baked->gradient_mips;
    bool stranded = strands && work->volume->strands && !baked->strand_mips;
    if (!work->volume->medium || (baked->medium_mips && !lit && !stranded))
        return STATUS_OK;
    enter_stage(work, REPORT_STAGE_bake);
    struct pyramid pyramid;
    enum pyramid_light light = lit ? PYRAMID_NORMALS : stranded ? PYRAMID_STRANDS : PYRAMID_UNLIT;
    if (pyramid_make(work->volume, light, &pyramid) != STATUS_OK)
        return error_fault(work->err, STATUS_OUT_OF_MEMORY, NULL, "no memory to filter voxels");
    enter_stage(work, REPORT_STAGE_upload);
    bool medium = !baked->medium_mips;
    const int *size = work->volume->size;
    if (medium)
        baked->medium_mips = make_texture(size, GL_RGBA32F, pyramid.count);
    if (lit)
        baked->gradient_mips = make_texture(size, GL_RGBA16F, pyramid.count);
    if (stranded)
        baked->strand_mips = make_texture(size, GL_RGBA32F, pyramid.count);
    for (int l = 0; l < pyramid.count; l++) {
        const struct pyramid_level *level = &pyramid.level[l];
        const int *n = level->size;
        uint64_t voxels = (uint64_t)n[0] * (uint64_t)n[1] * (uint64_t)n[2];
        if (medium)
            glTextureSubImage3D(baked->medium_mips, l, 0, 0, 0, n[0], n[1], n[2], GL_RGBA, GL_FLOAT,
                                level->medium);
        if (lit)
            glTextureSubImage3D(baked->gradient_mips, l, 0, 0, 0, n[0], n[1], n[2], GL_RGBA,
                                GL_HALF_FLOAT, level->gradient);
        if (stranded)
            glTextureSubImage3D(baked->strand_mips, l, 0, 0, 0, n[0], n[1], n[2], GL_RGBA, GL_FLOAT,
                                level->strands);
        work->uploaded += voxels * ((medium ? 16 : 0) + (lit ? 8 : 0) + (stranded ? 16 : 0));
    }
    pyramid_finish(&pyramid);
    return gl_check("uploading a filtered material", work->err);
}

static GLuint make_array(const int size[2], int layers, int levels, GLenum format) {
    GLuint name = 0;
    glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
    glTextureParameteri(name, GL_TEXTURE_WRAP_S, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_WRAP_T, GL_REPEAT);
    glTextureParameteri(name, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    glTextureParameteri(name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTextureStorage3D(name, levels, format, size[0], size[1], layers);
    return name;
}

/* Strands for what is seen from a side: coarser along u and v alone. */
static enum status add_strand_layers(struct work *work) {
    struct baked *baked = &work->entry->baked;
    const struct volume *volume = work->volume;
    if (baked->strand_layers)
        return STATUS_OK;
    enter_stage(work, REPORT_STAGE_bake);
    if (!volume->strands) {
        baked->strand_layers = make_array((const int[2]){1, 1}, 1, 1, GL_RGBA32F);
        glTextureSubImage3D(baked->strand_layers, 0, 0, 0, 0, 1, 1, 1, GL_RGBA, GL_FLOAT, upright);
        work->uploaded += sizeof upright;
        return gl_check("uploading filtered strands", work->err);
    }
    struct pyramid layers;
    if (pyramid_strand_layers(volume, &layers) != STATUS_OK)
        return error_fault(work->err, STATUS_OUT_OF_MEMORY, NULL, "no memory to filter strands");
    enter_stage(work, REPORT_STAGE_upload);
    baked->strand_layers = make_array(volume->size, volume->size[2], layers.count, GL_RGBA32F);
    for (int l = 0; l < layers.count; l++) {
        const int *n = layers.level[l].size;
        glTextureSubImage3D(baked->strand_layers, l, 0, 0, 0, n[0], n[1], n[2], GL_RGBA, GL_FLOAT,
                            layers.level[l].strands);
        work->uploaded += (uint64_t)n[0] * (uint64_t)n[1] * (uint64_t)n[2] * 16;
    }
    pyramid_finish(&layers);
    return gl_check("uploading filtered strands", work->err);
}

/* What is seen of the medium from each side, beside the medium itself. */
static enum status add_views(struct work *work, bool lit, const double aspect[2]) {
    struct baked *baked = &work->entry->baked;
    if (!work->volume->medium || (baked->medium_views && (baked->moment_views[0] || !lit)))
        return STATUS_OK;
    enter_stage(work, REPORT_STAGE_bake);
    struct view_pyramid pyramid;
    if (view_pyramid_make(work->volume, aspect, lit, &pyramid) != STATUS_OK)
        return error_fault(work->err, STATUS_OUT_OF_MEMORY, NULL, "no memory to filter voxels");
    memcpy(baked->aspect, aspect, sizeof baked->aspect);
    enter_stage(work, REPORT_STAGE_upload);
    bool medium = !baked->medium_views && pyramid.count > 0;
    const int *size = pyramid.level[0].size, layers = pyramid.layers * VIEW_SIDES;
    if (medium) {
        baked->medium_views = make_array(size, layers, pyramid.count, GL_RGBA32F);
        baked->left_views = make_array(size, layers, pyramid.count, GL_R32F);
    }
    for (int k = 0; k < VIEW_MOMENTS && lit && pyramid.count > 0; k++)
        baked->moment_views[k] = make_array(size, layers, pyramid.count, GL_RGBA32F);
    for (int l = 0; l < pyramid.count; l++) {
        const struct view_level *level = &pyramid.level[l];
        int width = level->size[0], height = level->size[1];
        uint64_t texels = (uint64_t)width * (uint64_t)height * (uint64_t)layers;
        if (medium) {
            glTextureSubImage3D(baked->medium_views, l, 0, 0, 0, width, height, layers, GL_RGBA,
                                GL_FLOAT, level->medium);
            glTextureSubImage3D(baked->left_views, l, 0, 0, 0, width, height, layers, GL_RED,
                                GL_FLOAT, level->left);
        }
        for (int k = 0; k < VIEW_MOMENTS && lit; k++)
            glTextureSubImage3D(baked->moment_views[k], l, 0, 0, 0, width, height, layers, GL_RGBA,
                                GL_FLOAT, level->moments[k]);
        work->uploaded += texels * ((medium ? 20 : 0) + (lit ? 16 * VIEW_MOMENTS : 0));
    }
    view_pyramid_finish(&pyramid);
    return gl_check("uploading a filtered material", work->err);
}

static enum status add_textures(struct work *work, bool lit, const struct bake_filter *filter) {
    struct baked *baked = &work->entry->baked;
    bool filtered = filter->kind == SCENE_FILTER_MIP, viewed = filter->kind == SCENE_FILTER_VIEW;
    bool by_strands = lit && work->volume->strand_lit;
    enum status status = filtered ? add_mips(work, lit && !by_strands, by_strands)
                                  : add_voxels(work, work->volume->medium, &baked->medium);
    if (status == STATUS_OK && viewed)
        status = add_views(work, lit && !by_strands, filter->aspect);
    if (status == STATUS_OK && viewed && by_strands)
        status = add_strand_layers(work);
    if (status == STATUS_OK)
        status = add_voxels(work, work->volume->solid, &baked->solid);
    bool filters_strands = viewed || (filtered && work->volume->strands);
    if (status == STATUS_OK && by_strands && !filters_strands)
        status = add_strands(work, &baked->strands);
    if (status == STATUS_OK && lit && !filtered && !by_strands)
        status = add_gradient(work, BAKE_FIELD_MEDIUM, &baked->medium_gradient);
    if (status == STATUS_OK && lit)
        status = add_gradient(work, BAKE_FIELD_SOLID, &baked->solid_gradient);
    if (status == STATUS_OK && filter->leaps[0])
        status = add_leaps(work, BAKE_FIELD_MEDIUM, &baked->medium_leap);
    if (status == STATUS_OK && filter->leaps[1])
        status = add_leaps(work, BAKE_FIELD_SOLID, &baked->solid_leap);
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

/* Whether an entry is of a volume; views of other aspects are other textures. */
static bool serves(const struct entry *entry, const struct volume *volume,
                   const struct bake_filter *filter) {
    const struct baked *baked = &entry->baked;
    return memcmp(entry->key, volume->key, sizeof entry->key) == 0 &&
           (filter->kind != SCENE_FILTER_VIEW || !baked->medium_views ||
            (baked->aspect[0] == filter->aspect[0] && baked->aspect[1] == filter->aspect[1]));
}

enum status bake_acquire(struct bake_cache *cache, const struct volume *volume, bool lit,
                         const struct baked **baked, bool *made, uint64_t *upload_bytes,
                         struct stage_clock *clock, struct error *err) {
    static const struct bake_filter none = {.kind = SCENE_FILTER_NONE};
    return bake_acquire_filtered(cache, volume, lit, &none, baked, made, upload_bytes, clock, err);
}

enum status bake_acquire_filtered(struct bake_cache *cache, const struct volume *volume, bool lit,
                                  const struct bake_filter *filter, const struct baked **baked,
                                  bool *made, uint64_t *upload_bytes, struct stage_clock *clock,
                                  struct error *err) {
    *baked = &cache->nothing;
    if (!volume->medium && !volume->solid)
        return STATUS_OK;
    *baked = NULL;
    enum status status = check_size(volume, err);
    if (status != STATUS_OK)
        return status;
    struct entry *entry = cache->newest;
    while (entry && !serves(entry, volume, filter))
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
    status = add_textures(&work, lit, filter);
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
