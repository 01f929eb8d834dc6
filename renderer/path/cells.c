/* See cells.h. Media are blended back to front: colour is multiplied by what the nearer segment
 * lets through, optical depths are summed. (Dufort et al. sort back to front and name the blend
 * factors of front to back, (1 - alpha_dst, 1).) */
#include "renderer/path/cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/resident.h"
#include "renderer/path/runs.h"
#include "renderer/path/shadow.h"
#include "renderer/path/variant.h"
#include "renderer/shell/grow.h"
#include "renderer/shell/precision.h"

enum { DEVICE_BYTES_MAX = 512 << 20 };

/* Stands for "the cell's own end": beyond every depth, and finite. */
static const float OPEN = 1e30f;

struct device_shell {
    GLuint buffer, texture;
    GLuint low_buffer, low_texture; /* 0 until doubles are needed */
};

struct cell_pass {
    enum gl_program_id program;
    struct prism_maps *maps; /* not its own */
    int slices[3];
    struct resident_cache shells;
    GLuint vertex_array, vertices, slabs, elements, frame_buffer;
    GLint texels_max;
};

/* ---- outlines ---- */

void outlines_clear(struct outlines *outlines) {
    outlines->corner_count = outlines->index_count = outlines->run_count = outlines->outline_count =
        0;
}

void outlines_finish(struct outlines *outlines) {
    free(outlines->corners);
    free(outlines->slab);
    free(outlines->indices);
    free(outlines->runs);
    *outlines = (struct outlines){0};
}

/* The depth (DEPTH_OF_T) of the nearest point, of depth h, rounded toward the eye by more than the
 * shaders round theirs: whatever is nearer than that hides all of it before it is shaded. */
static float nearest_depth(const struct view *view, double h) {
    double behind = view->depth_scale * (fmax(h, 0) - 1);
    return (float)fmin(1, (1 + 1e-5) / fmax(1, 2 + behind));
}

/* Of the prism's vertices where cells end at its ruled sides: those lie between them. */
static double nearest_vertex(const struct path_object *object, uint32_t tetra) {
    bool ruled = object->exact && object->shell->ruled;
    uint32_t first = ruled ? tetra - tetra % 3 : tetra, last = ruled ? first + 2 : tetra;
    double h = INFINITY;
    for (uint32_t t = first; t <= last; t++)
        for (int v = 0; v < 4; v++)
            h = fmin(h, object->projection.clip[object->shell->tetra[t][v]][2]);
    return h;
}

/* Appends an outline as a fan; false where memory ran out. */
static bool append(struct outlines *out, const struct path_object *object, uint32_t index,
                   uint32_t tetra, double outline[OUTLINE_MAX][2], int corners, double nearest) {
    if (corners == 0)
        return true;
    void *list = out->corners;
    if (!list_grow(&list, out->corner_count, (size_t)corners, &out->corner_capacity,
                   sizeof *out->corners))
        return false;
    out->corners = list;
    list = out->indices;
    if (!list_grow(&list, out->index_count, 3 * (size_t)corners, &out->index_capacity,
                   sizeof *out->indices))
        return false;
    out->indices = list;
    if (out->run_count == 0 || out->runs[out->run_count - 1].object != index) {
        list = out->runs;
        if (!list_grow(&list, out->run_count, 1, &out->run_capacity, sizeof *out->runs))
            return false;
        out->runs = list;
        out->runs[out->run_count++] = (struct cell_run){index, (uint32_t)out->index_count, 0};
    }
    const struct view *view = &object->projection.view;
    uint32_t base = (uint32_t)out->corner_count;
    float z = nearest_depth(view, nearest);
    out->outline_count++;
    for (int i = 0; i < corners; i++)
        out->corners[out->corner_count++] =
            (struct cell_corner){(float)(outline[i][0] * 2 / view->width - 1),
                                 (float)(outline[i][1] * 2 / view->height - 1), z, tetra};
    for (int i = 1; i + 1 < corners; i++) {
        out->indices[out->index_count++] = base;
        out->indices[out->index_count++] = base + (uint32_t)i;
        out->indices[out->index_count++] = base + (uint32_t)i + 1;
    }
    out->runs[out->run_count - 1].count =
        (uint32_t)out->index_count - out->runs[out->run_count - 1].first;
    return true;
}

bool outlines_append(struct outlines *outlines, const struct path_object *object, uint32_t index,
                     uint32_t tetra) {
    double outline[OUTLINE_MAX][2];
    int corners = project_outline(object->shell, &object->projection, tetra, outline);
    return append(outlines, object, index, tetra, outline, corners, nearest_vertex(object, tetra));
}

bool outlines_append_rectangle(struct outlines *outlines, const struct path_object *object,
                               uint32_t index, uint32_t tetra, const uint32_t box[4]) {
    double corner[OUTLINE_MAX][2] = {
        {box[0], box[1]}, {box[2], box[1]}, {box[2], box[3]}, {box[0], box[3]}};
    return append(outlines, object, index, tetra, corner, 4, nearest_vertex(object, tetra));
}

bool outlines_append_slab(struct outlines *outlines, const struct path_object *object,
                          uint32_t index, uint32_t tetra, const struct cell_slab *slab) {
    double outline[OUTLINE_MAX][2];
    int corners = project_slab_outline(object->shell, &object->projection, tetra,
                                       slab->open_low ? 0 : slab->low,
                                       slab->open_high ? INFINITY : slab->high, outline);
    size_t before = outlines->corner_count;
    void *list = outlines->slab;
    if (!list_grow(&list, before, (size_t)corners, &outlines->slab_capacity,
                   sizeof *outlines->slab))
        return false;
    outlines->slab = list;
    double nearest = nearest_vertex(object, tetra);
    if (!append(outlines, object, index, tetra, outline, corners,
                slab->open_low ? nearest : fmax(nearest, slab->low)))
        return false;
    /* Relative to the shell's centre, where fp32 is at its finest. */
    double center = object->projection.view.h_row[3];
    for (size_t i = before; i < outlines->corner_count; i++) {
        outlines->slab[i][0] = slab->open_low ? -OPEN : (float)(slab->low - center);
        outlines->slab[i][1] = slab->open_high ? OPEN : (float)(slab->high - center);
    }
    return true;
}

/* ---- the device ---- */

static void destroy_shell(void *data) {
    struct device_shell *device = data;
    glDeleteTextures(1, &device->texture);
    glDeleteTextures(1, &device->low_texture);
    glDeleteBuffers(1, &device->buffer);
    glDeleteBuffers(1, &device->low_buffer);
    free(device);
}

struct cell_pass *cell_pass_create(enum gl_program_id program, struct prism_maps *maps) {
    struct cell_pass *pass = calloc(1, sizeof *pass);
    if (!pass)
        return NULL;
    pass->program = program;
    pass->maps = maps;
    pass->shells.bytes_max = DEVICE_BYTES_MAX;
    pass->shells.destroy = destroy_shell;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &pass->texels_max);
    glCreateBuffers(1, &pass->vertices);
    glCreateBuffers(1, &pass->elements);
    glCreateVertexArrays(1, &pass->vertex_array);
    GLuint array = pass->vertex_array;
    glVertexArrayVertexBuffer(array, 0, pass->vertices, 0, sizeof(struct cell_corner));
    glVertexArrayElementBuffer(array, pass->elements);
    glEnableVertexArrayAttrib(array, 0);
    glVertexArrayAttribFormat(array, 0, 3, GL_FLOAT, GL_FALSE, offsetof(struct cell_corner, x));
    glVertexArrayAttribBinding(array, 0, 0);
    glEnableVertexArrayAttrib(array, 1);
    glVertexArrayAttribIFormat(array, 1, 1, GL_UNSIGNED_INT, offsetof(struct cell_corner, cell));
    glVertexArrayAttribBinding(array, 1, 0);
    if (program == GL_PROGRAM_SLABS) {
        glCreateBuffers(1, &pass->slabs);
        glVertexArrayVertexBuffer(array, 1, pass->slabs, 0, 2 * sizeof(float));
        glEnableVertexArrayAttrib(array, 2);
        glVertexArrayAttribFormat(array, 2, 2, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(array, 2, 1);
    }
    return pass;
}

void cell_pass_destroy(struct cell_pass *pass) {
    if (!pass)
        return;
    resident_clear(&pass->shells);
    glDeleteVertexArrays(1, &pass->vertex_array);
    glDeleteBuffers(1, &pass->vertices);
    glDeleteBuffers(1, &pass->slabs);
    glDeleteBuffers(1, &pass->elements);
    glDeleteBuffers(1, &pass->frame_buffer);
    free(pass);
}

void cell_pass_cast(struct cell_pass *pass, enum gl_program_id program, const int slices[3]) {
    pass->program = program;
    memcpy(pass->slices, slices, sizeof pass->slices);
}

/* Of what the program knows; only the surface of a solid throws by its normal. Cells are cut at the
 * eye, however rays go through the rest of the object; slabs are by themselves. */
static uint32_t variant_of(const struct cell_pass *pass, const struct path_object *object,
                           const struct picture *picture, bool solid) {
    uint32_t flags = variant_in_picture(object, picture, solid);
    bool cast = pass->program == GL_PROGRAM_CASTER || pass->program == GL_PROGRAM_CASTER_RANGE;
    flags |= object->projection.behind ? (uint32_t)FLAG_EYE_INSIDE : 0;
    if (cast && solid)
        flags &= ~(uint32_t)FLAG_SHADOW_CHANNELS;
    else if (cast) /* optical depths are laid out in equal steps */
        flags = (flags & ~(uint32_t)(FLAG_LEAP | FLAG_DDA)) |
                (object->shadow & (uint32_t)FLAG_SHADOW_CHANNELS);
    flags &= gl_program_flags(pass->program);
    return pass->program == GL_PROGRAM_CASTER && !solid ? flags & ~(uint32_t)FLAG_LIT : flags;
}

void cell_pass_begin_picture(struct cell_pass *pass) {
    resident_begin_picture(&pass->shells);
}

enum status cell_pass_upload(struct cell_pass *pass, const struct shell *shell,
                             struct picture *picture, struct error *err) {
    bool kept = resident_find(&pass->shells, shell->serial) != NULL;
    report_reuse(picture->report, REPORT_PART_tables, kept);
    if (kept)
        return STATUS_OK;
    uint64_t texels = (uint64_t)shell->tetra_count * CELL_TEXELS;
    if (texels > (uint64_t)pass->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "a shell of %u tetrahedra: this GL holds %u in one table",
                           shell->tetra_count, (unsigned)pass->texels_max / CELL_TEXELS);
    struct device_shell *device = calloc(1, sizeof *device);
    if (!device)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's buffers");
    size_t bytes = shell->tetra_count * sizeof *shell->cell;
    glCreateBuffers(1, &device->buffer);
    glNamedBufferStorage(device->buffer, (GLsizeiptr)bytes, shell->cell, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &device->texture);
    glTextureBuffer(device->texture, GL_RGBA32F, device->buffer);
    picture->report->work.upload_bytes += bytes;
    if (!resident_add(&pass->shells, shell->serial, device, bytes))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's buffers");
    return gl_check("uploading a shell", err);
}

/* What fp32 leaves off the cells of a shell that is uploaded. */
static enum status upload_low(struct cell_pass *pass, const struct shell *shell,
                              struct picture *picture, struct error *err) {
    struct device_shell *device = resident_find(&pass->shells, shell->serial);
    if (device->low_texture)
        return STATUS_OK;
    float(*low)[LOW_TEXELS][4] = malloc((shell->tetra_count + (size_t)1) * sizeof *low);
    if (!low)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's buffers");
    precision_cells_low(shell, low);
    size_t bytes = shell->tetra_count * sizeof *low;
    glCreateBuffers(1, &device->low_buffer);
    glNamedBufferStorage(device->low_buffer, (GLsizeiptr)bytes, low, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &device->low_texture);
    glTextureBuffer(device->low_texture, GL_RGBA32F, device->low_buffer);
    picture->report->work.upload_bytes += bytes;
    free(low);
    return gl_check("uploading a shell", err);
}

GLuint cell_pass_table(struct cell_pass *pass, const struct shell *shell) {
    const struct device_shell *device = resident_find(&pass->shells, shell->serial);
    return device ? device->texture : 0;
}

enum status cell_pass_prepare(struct cell_pass *pass, const struct path_object *object,
                              struct picture *picture, struct error *err) {
    enum status status = cell_pass_upload(pass, object->shell, picture, err);
    if (status == STATUS_OK && object->fp64)
        status = upload_low(pass, object->shell, picture, err);
    GLuint program;
    if (status == STATUS_OK && volume_has_medium(object->volume) && !object->walk)
        status = gl_programs_get(picture->programs, pass->program,
                                 variant_of(pass, object, picture, false), &program, &picture->cold,
                                 err);
    if (status == STATUS_OK && volume_has_solid(object->volume))
        status =
            gl_programs_get(picture->programs, pass->program,
                            variant_of(pass, object, picture, true), &program, &picture->cold, err);
    return status;
}

void cell_pass_begin_solid(void) {
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
}

void cell_pass_begin_media(const struct picture *picture) {
    const struct gl_target *target = picture->target;
    glDepthMask(GL_FALSE);
    if (picture->occluded || (picture->blocks && target->depth)) {
        /* Tested, and sampled by the shader for those that pass: both only read, which GL 4.5
         * section 9.3.1 allows. */
        glEnable(GL_DEPTH_TEST);
        glDepthFunc(GL_GREATER);
        glBindTextureUnit(BINDING_OCCLUDER, target->depth);
    } else {
        glDisable(GL_DEPTH_TEST);
    }
    glEnable(GL_BLEND);
    glBlendEquation(GL_FUNC_ADD);
    glBlendFuncSeparate(GL_ONE, picture->behind ? GL_SRC1_COLOR : GL_SRC1_ALPHA, GL_ONE, GL_ONE);
}

void cell_pass_end_media(void) {
    glDisable(GL_BLEND);
    glBindTextureUnit(BINDING_OCCLUDER, 0);
}

void cells_bind_textures(const struct path_object *object, bool solid) {
    const struct baked *baked = object->baked;
    if (!baked) /* a homogeneous medium has none */
        return;
    if (solid) {
        if (baked->solid_leap)
            glBindTextureUnit(BINDING_LEAP, baked->solid_leap);
        glBindTextureUnit(BINDING_SOLID, baked->solid);
        glBindTextureUnit(BINDING_SOLID_GRADIENT, baked->solid_gradient);
    } else {
        path_object_bind_medium(object, BINDING_MEDIUM, BINDING_MEDIUM_GRADIENT);
    }
}

enum status cell_pass_draw(struct cell_pass *pass, struct picture *picture,
                           const struct outlines *outlines, bool solid, struct error *err) {
    if (outlines->index_count == 0)
        return STATUS_OK;
    bool slabs = pass->program == GL_PROGRAM_SLABS;
    size_t vertex_bytes = outlines->corner_count * sizeof *outlines->corners;
    size_t index_bytes = outlines->index_count * sizeof *outlines->indices;
    size_t slab_bytes = slabs ? outlines->corner_count * sizeof *outlines->slab : 0;
    glNamedBufferData(pass->vertices, (GLsizeiptr)vertex_bytes, outlines->corners, GL_STREAM_DRAW);
    glNamedBufferData(pass->elements, (GLsizeiptr)index_bytes, outlines->indices, GL_STREAM_DRAW);
    if (slabs)
        glNamedBufferData(pass->slabs, (GLsizeiptr)slab_bytes, outlines->slab, GL_STREAM_DRAW);
    picture->report->work.upload_bytes += vertex_bytes + index_bytes + slab_bytes;
    glBindVertexArray(pass->vertex_array);
    glDisable(GL_CULL_FACE);
    enum status status = STATUS_OK;
    uint32_t bound = UINT32_MAX;
    for (size_t r = 0; r < outlines->run_count && status == STATUS_OK; r++) {
        const struct cell_run *run = &outlines->runs[r];
        const struct path_object *object = &picture->objects[run->object];
        if (run->object != bound) {
            GLuint program;
            status = gl_programs_get(picture->programs, pass->program,
                                     variant_of(pass, object, picture, solid), &program,
                                     &picture->cold, err);
            if (status != STATUS_OK)
                break;
            struct frame frame;
            frame_clear(&frame);
            frame_set_view(&frame, picture, &object->projection.view, object);
            frame_set_shell(&frame, object);
            if (slabs)
                frame_set_spacing(&frame, outlines->spacing,
                                  runs_step(&object->projection.view, outlines->spacing));
            frame_bind(&frame, &pass->frame_buffer);
            shadow_bind(picture, &object->projection.view, object);
            glUseProgram(program);
            if (pass->program == GL_PROGRAM_CASTER && !solid)
                glProgramUniform3iv(program, 0, 1, pass->slices);
            const struct device_shell *device = resident_find(&pass->shells, object->shell->serial);
            glBindTextureUnit(BINDING_CELLS, device->texture);
            glBindTextureUnit(BINDING_CELLS_LOW, device->low_texture);
            prism_maps_bind(pass->maps, object);
            cells_bind_textures(object, solid);
            bound = run->object;
        }
        glDrawElements(GL_TRIANGLES, (GLsizei)run->count, GL_UNSIGNED_INT,
                       (const void *)(uintptr_t)(run->first * sizeof *outlines->indices));
        picture->report->work.draws++;
    }
    if (status == STATUS_OK)
        status = gl_check(solid ? "drawing solids" : "drawing media", err);
    return status;
}
