/* Walking through shells: see shaders/walk.frag. A full-screen triangle is shaded, so small cells
 * cost no partly empty blocks; a ray ends when nothing more can be seen; and nothing is sorted but
 * the few faces through which a sample's ray enters. */
#include "renderer/path/walk.h"

#include <stdlib.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/resident.h"
#include "renderer/path/variant.h"
#include "renderer/shell/entries.h"

enum { DEVICE_BYTES_MAX = 512 << 20, VISITS_MAX = 16384 };

enum { CELLS, LINKS, LOW, TABLES };

struct device_walk {
    GLuint buffers[TABLES], textures[TABLES];
};

/* Where the rays of this picture enter one object. */
struct doors {
    GLuint buffers[2], textures[2]; /* a sample's first entry; entries */
    uint32_t start;
};

struct walk_pass {
    struct resident_cache shells;
    struct prism_maps *maps;
    struct doors *doors; /* for each object of the picture; kept for the next one */
    size_t door_count;
    GLuint frame_buffer, array;
    GLint texels_max;
};

static void destroy_device(void *data) {
    struct device_walk *device = data;
    glDeleteTextures(TABLES, device->textures);
    glDeleteBuffers(TABLES, device->buffers);
    free(device);
}

struct walk_pass *walk_pass_create(struct prism_maps *maps) {
    struct walk_pass *pass = calloc(1, sizeof *pass);
    if (!pass)
        return NULL;
    pass->maps = maps;
    pass->shells.bytes_max = DEVICE_BYTES_MAX;
    pass->shells.destroy = destroy_device;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &pass->texels_max);
    glCreateVertexArrays(1, &pass->array);
    return pass;
}

void walk_pass_destroy(struct walk_pass *pass) {
    if (!pass)
        return;
    resident_clear(&pass->shells);
    for (size_t i = 0; i < pass->door_count; i++) {
        glDeleteTextures(2, pass->doors[i].textures);
        glDeleteBuffers(2, pass->doors[i].buffers);
    }
    free(pass->doors);
    glDeleteBuffers(1, &pass->frame_buffer);
    glDeleteVertexArrays(1, &pass->array);
    free(pass);
}

bool walk_possible(const struct path_object *object, const char **why) {
    *why = NULL;
    if (object->shell->diagnosis.inverted)
        *why = "the shell has prisms that stand on their heads";
    else if (object->shell->diagnosis.flat)
        *why = "the shell has cells without volume";
    else if (object->projection.behind && object->projection.view.orthographic)
        *why = "the eye's plane cuts the shell, and each parallel ray would begin elsewhere";
    return !*why;
}

static void make_table(struct device_walk *device, int table, GLenum format, const void *data,
                       size_t bytes, struct picture *picture) {
    glCreateBuffers(1, &device->buffers[table]);
    glNamedBufferStorage(device->buffers[table], (GLsizeiptr)bytes, data, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &device->textures[table]);
    glTextureBuffer(device->textures[table], format, device->buffers[table]);
    picture->report->work.upload_bytes += bytes;
}

static enum status upload_shell(struct walk_pass *pass, const struct path_object *object,
                                struct picture *picture, struct error *err) {
    const struct shell *shell = object->shell;
    struct device_walk *device = resident_find(&pass->shells, shell->serial);
    if (device && (device->textures[LOW] || !object->fp64))
        return STATUS_OK;
    size_t count = shell->tetra_count;
    if (count * WALK_TEXELS > (size_t)pass->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "a shell of %zu tetrahedra: this GL holds %zu in one table", count,
                           (size_t)pass->texels_max / WALK_TEXELS);
    bool known = device != NULL;
    float(*cell)[WALK_TEXELS][4] = malloc((count + 1) * sizeof *cell);
    uint32_t(*link)[4] = malloc((count + 1) * sizeof *link);
    float(*low)[LOW_TEXELS][4] = object->fp64 ? malloc((count + 1) * sizeof *low) : NULL;
    if (!known)
        device = calloc(1, sizeof *device);
    if (!cell || !link || !device || (object->fp64 && !low)) {
        free(cell);
        free(link);
        free(low);
        if (!known)
            free(device);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's tables");
    }
    entries_walk_cells(shell, cell, link, low);
    if (!known) {
        make_table(device, CELLS, GL_RGBA32F, cell, count * sizeof *cell, picture);
        make_table(device, LINKS, GL_RGBA32UI, link, count * sizeof *link, picture);
    }
    if (low)
        make_table(device, LOW, GL_RGBA32F, low, count * sizeof *low, picture);
    free(cell);
    free(link);
    free(low);
    if (!known && !resident_add(&pass->shells, shell->serial, device,
                                count * (sizeof *cell + sizeof *link + sizeof *low)))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's tables");
    return gl_check("uploading a shell", err);
}

static uint32_t variant_of(const struct path_object *object, const struct picture *picture,
                           bool solid) {
    return variant_of_shell(object, picture->lights.count, picture->occluded, solid);
}

/* One object's entries to the device. */
static enum status open_doors(struct walk_pass *pass, struct picture *picture,
                              const struct path_object *object, struct doors *doors,
                              struct error *err) {
    stage_clock_next(picture->clock, REPORT_STAGE_sort, false);
    struct entries entries;
    enum status status =
        entries_find(object->shell, &object->projection, picture->met, &entries, err);
    if (status != STATUS_OK)
        return status;
    doors->start = entries.start;
    picture->report->work.fragments += entries.count;

    stage_clock_next(picture->clock, REPORT_STAGE_upload, false);
    size_t samples = (size_t)picture->world.width * (size_t)picture->world.height + 1;
    size_t bytes[2] = {samples * sizeof *entries.first,
                       (entries.count + 1) * sizeof *entries.entry};
    const void *data[2] = {entries.first, entries.entry};
    if (samples > (size_t)pass->texels_max || entries.count >= (size_t)pass->texels_max)
        status =
            error_fault(err, STATUS_TOO_COMPLEX, "/image",
                        "%zu samples: this GL holds %d in one table", samples, pass->texels_max);
    if (!doors->buffers[0]) {
        glCreateBuffers(2, doors->buffers);
        glCreateTextures(GL_TEXTURE_BUFFER, 2, doors->textures);
    }
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        glNamedBufferData(doors->buffers[i], (GLsizeiptr)bytes[i], data[i], GL_STREAM_DRAW);
        glTextureBuffer(doors->textures[i], GL_R32UI, doors->buffers[i]);
        picture->report->work.upload_bytes += bytes[i];
    }
    entries_finish(&entries);
    return status;
}

enum status walk_pass_prepare(struct walk_pass *pass, struct picture *picture, struct error *err) {
    resident_begin_picture(&pass->shells);
    if (picture->object_count > pass->door_count) {
        struct doors *grown = realloc(pass->doors, picture->object_count * sizeof *grown);
        if (!grown)
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to walk");
        pass->doors = grown;
        while (pass->door_count < picture->object_count)
            pass->doors[pass->door_count++] = (struct doors){.start = LINK_NONE};
    }
    enum status status = STATUS_OK;
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->walk)
            continue;
        status = open_doors(pass, picture, object, &pass->doors[i], err);
        if (status == STATUS_OK)
            status = upload_shell(pass, object, picture, err);
        GLuint program;
        if (status == STATUS_OK && volume_has_medium(object->volume))
            status =
                gl_programs_get(picture->programs, GL_PROGRAM_WALK,
                                variant_of(object, picture, false), &program, &picture->cold, err);
        if (status == STATUS_OK && volume_has_solid(object->volume))
            status =
                gl_programs_get(picture->programs, GL_PROGRAM_WALK,
                                variant_of(object, picture, true), &program, &picture->cold, err);
    }
    return status;
}

static void bind_textures(const struct baked *baked) {
    glBindTextureUnit(BINDING_MEDIUM, baked->medium);
    glBindTextureUnit(BINDING_MEDIUM_GRADIENT, baked->medium_gradient);
    glBindTextureUnit(BINDING_SOLID, baked->solid);
    glBindTextureUnit(BINDING_SOLID_GRADIENT, baked->solid_gradient);
}

static enum status draw_object(struct walk_pass *pass, struct picture *picture,
                               const struct path_object *object, const struct doors *doors,
                               bool solid, struct error *err) {
    GLuint program;
    enum status status =
        gl_programs_get(picture->programs, GL_PROGRAM_WALK, variant_of(object, picture, solid),
                        &program, &picture->cold, err);
    if (status != STATUS_OK)
        return status;
    struct frame frame;
    frame_clear(&frame);
    frame_set_view(&frame, picture, &object->projection.view, object);
    frame_set_shell(&frame, object);
    frame_bind(&frame, &pass->frame_buffer);
    const struct device_walk *device = resident_find(&pass->shells, object->shell->serial);
    glUseProgram(program);
    /* A ray meets a cell once; past that many visits something is wrong. */
    uint32_t most = object->shell->tetra_count + 8;
    glProgramUniform1ui(program, 0, doors->start);
    glProgramUniform1i(program, 1, picture->world.width);
    glProgramUniform1i(program, 2, (GLint)(most < VISITS_MAX ? most : VISITS_MAX));
    glBindTextureUnit(BINDING_CELLS, device->textures[CELLS]);
    glBindTextureUnit(BINDING_LINKS, device->textures[LINKS]);
    glBindTextureUnit(BINDING_CELLS_LOW, device->textures[LOW]);
    prism_maps_bind(pass->maps, object);
    glBindTextureUnit(BINDING_FIRST, doors->textures[0]);
    glBindTextureUnit(BINDING_ENTRIES, doors->textures[1]);
    if (object->baked)
        bind_textures(object->baked);
    gl_blocks_draw(picture->blocks, program, pass->array);
    picture->report->work.draws++;
    return gl_check("walking through a shell", err);
}

enum status walk_pass_draw(struct walk_pass *pass, struct picture *picture, bool solid,
                           struct error *err) {
    glDisable(GL_CULL_FACE);
    enum status status = STATUS_OK;
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (object->walk &&
            (solid ? volume_has_solid(object->volume) : volume_has_medium(object->volume)))
            status = draw_object(pass, picture, object, &pass->doors[i], solid, err);
    }
    return status;
}
