/* Walking through media: see shaders/walk.frag. A full-screen triangle is shaded, so small cells
 * cost no partly empty blocks; a ray ends when nothing more can be seen; and nothing is sorted but
 * the few faces through which a sample's ray enters. */
#include "renderer/path/walk.h"

#include <stdlib.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/resident.h"
#include "renderer/shell/entries.h"

enum { DEVICE_BYTES_MAX = 512 << 20, VISITS_MAX = 16384 };

struct device_walk {
    GLuint buffers[2], textures[2]; /* cells, links */
};

struct walk_pass {
    struct resident_cache shells;
    GLuint buffers[2], textures[2]; /* a sample's first entry; entries: of this picture */
    GLuint frame_buffer, array;
    GLint texels_max;
    uint32_t start;
};

static void destroy_device(void *data) {
    struct device_walk *device = data;
    glDeleteTextures(2, device->textures);
    glDeleteBuffers(2, device->buffers);
    free(device);
}

struct walk_pass *walk_pass_create(void) {
    struct walk_pass *pass = calloc(1, sizeof *pass);
    if (!pass)
        return NULL;
    pass->shells.bytes_max = DEVICE_BYTES_MAX;
    pass->shells.destroy = destroy_device;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &pass->texels_max);
    glCreateBuffers(2, pass->buffers);
    glCreateTextures(GL_TEXTURE_BUFFER, 2, pass->textures);
    glCreateVertexArrays(1, &pass->array);
    return pass;
}

void walk_pass_destroy(struct walk_pass *pass) {
    if (!pass)
        return;
    resident_clear(&pass->shells);
    glDeleteTextures(2, pass->textures);
    glDeleteBuffers(2, pass->buffers);
    glDeleteBuffers(1, &pass->frame_buffer);
    glDeleteVertexArrays(1, &pass->array);
    free(pass);
}

bool walk_possible(const struct path_object *objects, size_t count, const char **why) {
    const struct path_object *only = NULL;
    *why = NULL;
    for (size_t i = 0; i < count; i++) {
        if (!objects[i].shell || !volume_has_medium(objects[i].volume))
            continue;
        if (only)
            *why = "several semi-transparent shells hide one another";
        only = &objects[i];
        if (only->shell->diagnosis.flat)
            *why = "the shell has cells without volume";
        else if (only->projection.behind && only->projection.view.orthographic)
            *why = "the eye's plane cuts the shell, and each parallel ray would begin elsewhere";
    }
    return !*why;
}

static enum status upload_shell(struct walk_pass *pass, const struct shell *shell,
                                struct picture *picture, struct error *err) {
    if (resident_find(&pass->shells, shell->serial))
        return STATUS_OK;
    size_t count = shell->tetra_count;
    if (count * WALK_TEXELS > (size_t)pass->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "a shell of %zu tetrahedra: this GL holds %zu in one table", count,
                           (size_t)pass->texels_max / WALK_TEXELS);
    float(*cell)[WALK_TEXELS][4] = malloc((count + 1) * sizeof *cell);
    uint32_t(*link)[4] = malloc((count + 1) * sizeof *link);
    struct device_walk *device = calloc(1, sizeof *device);
    if (!cell || !link || !device) {
        free(cell);
        free(link);
        free(device);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's tables");
    }
    entries_walk_cells(shell, cell, link);
    size_t bytes[2] = {count * sizeof *cell, count * sizeof *link};
    const void *data[2] = {cell, link};
    static const GLenum formats[2] = {GL_RGBA32F, GL_RGBA32UI};
    glCreateBuffers(2, device->buffers);
    glCreateTextures(GL_TEXTURE_BUFFER, 2, device->textures);
    for (int i = 0; i < 2; i++) {
        glNamedBufferStorage(device->buffers[i], (GLsizeiptr)bytes[i], data[i], 0);
        glTextureBuffer(device->textures[i], formats[i], device->buffers[i]);
        picture->report->work.upload_bytes += bytes[i];
    }
    free(cell);
    free(link);
    if (!resident_add(&pass->shells, shell->serial, device, bytes[0] + bytes[1]))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's tables");
    return gl_check("uploading a shell", err);
}

static uint32_t variant_of(const struct path_object *object, const struct picture *picture) {
    const struct volume *volume = object->volume;
    uint32_t flags = (volume->homogeneous ? FLAG_HOMOGENEOUS : FLAG_MEDIUM) |
                     (picture->occluded ? FLAG_OCCLUDED : 0);
    if (volume->lit && !volume->homogeneous)
        flags |= FLAG_LIT | (volume->specular > 0 && picture->lights.count ? FLAG_SPECULAR : 0);
    return flags;
}

enum status walk_pass_prepare(struct walk_pass *pass, struct picture *picture,
                              const struct path_object *object, struct error *err) {
    struct entries entries;
    resident_begin_picture(&pass->shells);
    enum status status = entries_find(object->shell, &object->projection, &entries, err);
    if (status != STATUS_OK)
        return status;
    pass->start = entries.start;
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
    for (int i = 0; i < 2 && status == STATUS_OK; i++) {
        glNamedBufferData(pass->buffers[i], (GLsizeiptr)bytes[i], data[i], GL_STREAM_DRAW);
        glTextureBuffer(pass->textures[i], GL_R32UI, pass->buffers[i]);
        picture->report->work.upload_bytes += bytes[i];
    }
    entries_finish(&entries);
    GLuint program;
    if (status == STATUS_OK)
        status = upload_shell(pass, object->shell, picture, err);
    if (status == STATUS_OK)
        status = gl_programs_get(picture->programs, GL_PROGRAM_WALK, variant_of(object, picture),
                                 &program, &picture->cold, err);
    return status;
}

enum status walk_pass_draw(struct walk_pass *pass, struct picture *picture,
                           const struct path_object *object, struct error *err) {
    GLuint program;
    enum status status =
        gl_programs_get(picture->programs, GL_PROGRAM_WALK, variant_of(object, picture), &program,
                        &picture->cold, err);
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
    glProgramUniform1ui(program, 0, pass->start);
    glProgramUniform1i(program, 1, picture->world.width);
    glProgramUniform1i(program, 2, (GLint)(most < VISITS_MAX ? most : VISITS_MAX));
    glBindTextureUnit(BINDING_CELLS, device->textures[0]);
    glBindTextureUnit(BINDING_LINKS, device->textures[1]);
    glBindTextureUnit(BINDING_FIRST, pass->textures[0]);
    glBindTextureUnit(BINDING_ENTRIES, pass->textures[1]);
    if (object->baked) {
        glBindTextureUnit(BINDING_MEDIUM, object->baked->medium);
        glBindTextureUnit(BINDING_MEDIUM_GRADIENT, object->baked->medium_gradient);
    }
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_CULL_FACE);
    glBindVertexArray(pass->array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    picture->report->work.draws++;
    return gl_check("walking through a medium", err);
}
