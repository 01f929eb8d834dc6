/* The tetra path: semi-transparent and solid voxels in a shell of tetrahedra.
 * After Dufort, Leblanc & Poulin 2005, sections 3 to 4.3; shaders/tetra.frag integrates.
 *
 * Media are drawn back to front in the order that SXMPVO gives, all shells together; solids in any
 * order under the depth test, since the first surface is what counts. (The paper sorts back to
 * front and names the blend factors of front to back, (1 - alpha_dst, 1); with those below, back to
 * front, colour is multiplied by what the nearer segment lets through, and optical depths are
 * summed.)
 *
 * Wherever that is possible, rays walk instead (walk.h).
 *
 * Left out here: filtering and shadow. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/path.h"
#include "renderer/path/prism_maps.h"
#include "renderer/path/resident.h"
#include "renderer/path/variant.h"
#include "renderer/path/walk.h"
#include "renderer/shell/entries.h"
#include "renderer/shell/precision.h"
#include "renderer/shell/sort.h"

/* Voxels that a step may pass before it is told of: of two, a ray at 45 degrees reads every one. */
enum { DEVICE_BYTES_MAX = 512 << 20, STEP_VOXELS_MAX = 2 };

struct corner {
    float x, y; /* in [-1, 1] on the sample grid */
    float z;    /* depth of the cell's nearest vertex: hides cells that lie wholly behind */
    uint32_t cell;
};

/* Consecutive triangles that belong to one object. */
struct run {
    uint32_t object;
    uint32_t first, count; /* indices */
};

/* Outlines of tetrahedra, cut into triangles. */
struct outlines {
    struct corner *corners;
    uint32_t *indices;
    struct run *runs;
    size_t corner_count, corner_capacity, index_count, index_capacity, run_count, run_capacity;
    size_t outline_count;
};

struct device_shell {
    GLuint buffer, texture;
    GLuint low_buffer, low_texture; /* 0 until doubles are needed */
};

struct tetra {
    struct resident_cache shells;
    GLuint vertex_array, vertices, elements, frame_buffer;
    GLint texels_max;
    struct outlines media, solids;
    struct prism_maps maps;
    struct walk_pass *walk;
};

static void destroy_shell(void *data) {
    struct device_shell *device = data;
    glDeleteTextures(1, &device->texture);
    glDeleteTextures(1, &device->low_texture);
    glDeleteBuffers(1, &device->buffer);
    glDeleteBuffers(1, &device->low_buffer);
    free(device);
}

static void outlines_finish(struct outlines *outlines) {
    free(outlines->corners);
    free(outlines->indices);
    free(outlines->runs);
    *outlines = (struct outlines){0};
}

static void tetra_destroy(void *state) {
    struct tetra *tetra = state;
    if (!tetra)
        return;
    resident_clear(&tetra->shells);
    glDeleteVertexArrays(1, &tetra->vertex_array);
    glDeleteBuffers(1, &tetra->vertices);
    glDeleteBuffers(1, &tetra->elements);
    glDeleteBuffers(1, &tetra->frame_buffer);
    prism_maps_finish(&tetra->maps);
    walk_pass_destroy(tetra->walk);
    outlines_finish(&tetra->media);
    outlines_finish(&tetra->solids);
    free(tetra);
}

static enum status tetra_create(void **state, struct error *err) {
    struct tetra *tetra = calloc(1, sizeof *tetra);
    if (tetra)
        tetra->walk = walk_pass_create(&tetra->maps);
    if (!tetra || !tetra->walk) {
        free(tetra);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the tetra path");
    }
    tetra->shells.bytes_max = DEVICE_BYTES_MAX;
    tetra->shells.destroy = destroy_shell;
    prism_maps_init(&tetra->maps);
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &tetra->texels_max);
    glCreateBuffers(1, &tetra->vertices);
    glCreateBuffers(1, &tetra->elements);
    glCreateVertexArrays(1, &tetra->vertex_array);
    GLuint array = tetra->vertex_array;
    glVertexArrayVertexBuffer(array, 0, tetra->vertices, 0, sizeof(struct corner));
    glVertexArrayElementBuffer(array, tetra->elements);
    glEnableVertexArrayAttrib(array, 0);
    glVertexArrayAttribFormat(array, 0, 3, GL_FLOAT, GL_FALSE, offsetof(struct corner, x));
    glVertexArrayAttribBinding(array, 0, 0);
    glEnableVertexArrayAttrib(array, 1);
    glVertexArrayAttribIFormat(array, 1, 1, GL_UNSIGNED_INT, offsetof(struct corner, cell));
    glVertexArrayAttribBinding(array, 1, 0);
    *state = tetra;
    return gl_check("creating the tetra path", err);
}

/* Room for `more` further elements of `size` bytes; doubles. */
static bool grow(void **list, size_t count, size_t more, size_t *capacity, size_t size) {
    if (count + more <= *capacity)
        return true;
    size_t wanted = *capacity ? *capacity * 2 : 4096;
    while (wanted < count + more)
        wanted *= 2;
    void *grown = realloc(*list, wanted * size);
    if (!grown)
        return false;
    *list = grown;
    *capacity = wanted;
    return true;
}

/* The depth (DEPTH_OF_T) of a cell's nearest vertex, rounded toward the eye by more than the
 * shaders round theirs: whatever is nearer than that hides the whole cell before it is shaded. */
static float nearest_depth(const struct path_object *object, uint32_t tetra) {
    double h = INFINITY;
    for (int v = 0; v < 4; v++)
        h = fmin(h, object->projection.clip[object->shell->tetra[tetra][v]][2]);
    double behind = object->projection.view.depth_scale * (fmax(h, 0) - 1);
    return (float)fmin(1, (1 + 1e-5) / fmax(1, 2 + behind));
}

/* Appends a tetrahedron's outline as a fan; false where memory ran out. */
static bool append_outline(struct outlines *out, const struct path_object *object, uint32_t index,
                           uint32_t tetra) {
    double outline[OUTLINE_MAX][2];
    int corners = project_outline(object->shell, &object->projection, tetra, outline);
    if (corners == 0)
        return true;
    void *list = out->corners;
    if (!grow(&list, out->corner_count, (size_t)corners, &out->corner_capacity,
              sizeof *out->corners))
        return false;
    out->corners = list;
    list = out->indices;
    if (!grow(&list, out->index_count, 3 * (size_t)corners, &out->index_capacity,
              sizeof *out->indices))
        return false;
    out->indices = list;
    if (out->run_count == 0 || out->runs[out->run_count - 1].object != index) {
        list = out->runs;
        if (!grow(&list, out->run_count, 1, &out->run_capacity, sizeof *out->runs))
            return false;
        out->runs = list;
        out->runs[out->run_count++] = (struct run){index, (uint32_t)out->index_count, 0};
    }
    const struct view *view = &object->projection.view;
    uint32_t base = (uint32_t)out->corner_count;
    float nearest = nearest_depth(object, tetra);
    out->outline_count++;
    for (int i = 0; i < corners; i++)
        out->corners[out->corner_count++] =
            (struct corner){(float)(outline[i][0] * 2 / view->width - 1),
                            (float)(outline[i][1] * 2 / view->height - 1), nearest, tetra};
    for (int i = 1; i + 1 < corners; i++) {
        out->indices[out->index_count++] = base;
        out->indices[out->index_count++] = base + (uint32_t)i;
        out->indices[out->index_count++] = base + (uint32_t)i + 1;
    }
    out->runs[out->run_count - 1].count =
        (uint32_t)out->index_count - out->runs[out->run_count - 1].first;
    return true;
}

static enum status upload_shell(struct tetra *tetra, const struct shell *shell,
                                struct picture *picture, struct error *err) {
    if (resident_find(&tetra->shells, shell->serial))
        return STATUS_OK;
    uint64_t texels = (uint64_t)shell->tetra_count * CELL_TEXELS;
    if (texels > (uint64_t)tetra->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "a shell of %u tetrahedra: this GL holds %u in one table",
                           shell->tetra_count, (unsigned)tetra->texels_max / CELL_TEXELS);
    struct device_shell *device = calloc(1, sizeof *device);
    if (!device)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's buffers");
    size_t bytes = shell->tetra_count * sizeof *shell->cell;
    glCreateBuffers(1, &device->buffer);
    glNamedBufferStorage(device->buffer, (GLsizeiptr)bytes, shell->cell, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &device->texture);
    glTextureBuffer(device->texture, GL_RGBA32F, device->buffer);
    picture->report->work.upload_bytes += bytes;
    if (!resident_add(&tetra->shells, shell->serial, device, bytes))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's buffers");
    return gl_check("uploading a shell", err);
}

/* What fp32 leaves off the cells of a shell that is uploaded. */
static enum status upload_low(struct tetra *tetra, const struct shell *shell,
                              struct picture *picture, struct error *err) {
    struct device_shell *device = resident_find(&tetra->shells, shell->serial);
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

static enum status sort_media(struct tetra *tetra, struct picture *picture, struct error *err) {
    struct sort_shell shells[SORT_SHELLS_MAX];
    uint32_t object_of[SORT_SHELLS_MAX], count = 0;
    for (size_t i = 0; i < picture->object_count; i++) {
        struct path_object *object = &picture->objects[i];
        if (!object->shell || !volume_has_medium(object->volume) || object->walk)
            continue;
        if (count == SORT_SHELLS_MAX)
            return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                               "at most %d semi-transparent shells can be sorted together",
                               SORT_SHELLS_MAX);
        object_of[count] = (uint32_t)i;
        shells[count++] = (struct sort_shell){object->shell, &object->projection};
    }
    if (count == 0)
        return STATUS_OK;
    struct sort_result sorted;
    enum status status = sort_tetrahedra(shells, count, picture->met, &sorted, err);
    if (status != STATUS_OK)
        return status;
    struct report_work *work = &picture->report->work;
    work->sort_nodes += sorted.count;
    work->sort_edges += sorted.edges;
    work->fragments += sorted.fragments;
    work->cycles += sorted.cycles;
    if (sorted.cycles)
        report_warn(picture->report, "cycles", "/objects", sorted.cycles, sorted.cycle_first,
                    "groups of tetrahedra hide one another in a circle (%llu in all); where they "
                    "do, they are drawn by the depth of their centres",
                    (unsigned long long)sorted.cycle_tetra);
    if (sorted.overlaps)
        report_warn(picture->report, "overlap-approximate", "/objects", sorted.overlaps, 0,
                    "samples on whose ray sorted cells of different shells or folds overlap; there "
                    "their colours are mixed cell by cell, not by extinction");
    for (uint64_t i = 0; i < sorted.count; i++) {
        uint32_t index = object_of[sorted.order[i] >> 32];
        if (!append_outline(&tetra->media, &picture->objects[index], index,
                            (uint32_t)sorted.order[i])) {
            status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for outlines");
            break;
        }
    }
    free(sorted.order);
    return status;
}

static uint32_t variant_of(const struct path_object *object, const struct picture *picture,
                           bool solid) {
    return variant_of_shell(object, picture->lights.count, picture->occluded, solid);
}

/* Compiles, or finds, what an object is drawn with, so that drawing only draws. */
static enum status make_programs(const struct path_object *object, struct picture *picture,
                                 struct error *err) {
    enum status status = STATUS_OK;
    GLuint program;
    if (volume_has_medium(object->volume) && !object->walk)
        status = gl_programs_get(picture->programs, GL_PROGRAM_TETRA,
                                 variant_of(object, picture, false), &program, &picture->cold, err);
    if (status == STATUS_OK && volume_has_solid(object->volume))
        status = gl_programs_get(picture->programs, GL_PROGRAM_TETRA,
                                 variant_of(object, picture, true), &program, &picture->cold, err);
    return status;
}

static bool solid_by_cells(const struct path_object *object) {
    return object->shell && volume_has_solid(object->volume) &&
           (!object->walk || object->solid_cells);
}

/* Whether an object is drawn cell by cell. */
static bool needs_cells(const struct path_object *object) {
    return object->shell &&
           ((!object->walk && volume_has_medium(object->volume)) || solid_by_cells(object));
}

/* Where `samples` is not what the rays get, or not what the voxels need: steps are counted across
 * the thickness, so rays that run along a surface with many small tiles pass over voxels. More
 * steps would not do: such voxels are smaller than a pixel too, mostly, and one step for each would
 * be thousands. */
static void warn_of_steps(const struct path_object *object, struct report *report) {
    const struct shell *shell = object->shell;
    if (object->volume->homogeneous)
        return;
    double steps = frame_steps_needed(object);
    if (steps > PATH_STEPS_MAX)
        report_warn(report, "steps-capped", object->pointer, 1, 0,
                    "a ray along the longest edge would take %.3g steps; segments of more "
                    "than %d take longer ones than `samples` asks for",
                    steps, PATH_STEPS_MAX);
    double voxels = 0, step = shell->thickness / object->samples;
    for (int i = 0; i < 2; i++)
        voxels = fmax(voxels, shell->tiles_rate[i] * object->volume->size[i] * step);
    if (voxels > STEP_VOXELS_MAX)
        report_warn(report, "voxels-skipped", object->pointer, 1, 0,
                    "a step along the surface passes %.3g voxels: `tiles` is large for `samples`, "
                    "and slanting rays miss what lies between",
                    voxels);
}

static enum status tetra_prepare(void *state, struct picture *picture, struct error *err) {
    struct tetra *tetra = state;
    resident_begin_picture(&tetra->shells);
    struct outlines *both[2] = {&tetra->media, &tetra->solids};
    for (int i = 0; i < 2; i++)
        both[i]->corner_count = both[i]->index_count = both[i]->run_count = both[i]->outline_count =
            0;

    stage_clock_next(picture->clock, REPORT_STAGE_upload, true);
    enum status status = prism_maps_prepare(&tetra->maps, picture, err);
    /* First what is walked: it may turn out that the cells must be sorted after all. */
    stage_clock_next(picture->clock, REPORT_STAGE_sort, false);
    if (status == STATUS_OK)
        status = walk_pass_prepare(tetra->walk, picture, err);
    stage_clock_next(picture->clock, REPORT_STAGE_sort, false);
    if (status == STATUS_OK)
        status = sort_media(tetra, picture, err);
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!solid_by_cells(object))
            continue;
        if (picture->met &&
            !object->walk) { /* they need no order: the A-buffer is made for this alone */
            struct entries entries;
            status = entries_find(object->shell, &object->projection, picture->met, &entries, err);
            entries_finish(&entries);
            if (status != STATUS_OK)
                break;
        }
        for (uint32_t t = 0; t < object->shell->tetra_count; t++)
            if (!append_outline(&tetra->solids, object, (uint32_t)i, t)) {
                status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for outlines");
                break;
            }
    }
    if (status == STATUS_OK &&
        (tetra->media.corner_count > UINT32_MAX / 2 || tetra->solids.corner_count > UINT32_MAX / 2))
        status = error_fault(err, STATUS_TOO_COMPLEX, "/objects", "too many outlines for one draw");

    for (int i = 0; i < 2; i++)
        picture->report->work.segments += both[i]->outline_count;

    stage_clock_next(picture->clock, REPORT_STAGE_upload, false);
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->shell)
            continue;
        warn_of_steps(object, picture->report);
        if (needs_cells(object)) {
            status = upload_shell(tetra, object->shell, picture, err);
            if (status == STATUS_OK && object->fp64)
                status = upload_low(tetra, object->shell, picture, err);
            if (status == STATUS_OK)
                status = make_programs(object, picture, err);
        }
    }
    return status;
}

static void bind_textures(const struct baked *baked, bool solid) {
    if (solid) {
        glBindTextureUnit(BINDING_SOLID, baked->solid);
        glBindTextureUnit(BINDING_SOLID_GRADIENT, baked->solid_gradient);
    } else {
        glBindTextureUnit(BINDING_MEDIUM, baked->medium);
        glBindTextureUnit(BINDING_MEDIUM_GRADIENT, baked->medium_gradient);
    }
}

static enum status draw_outlines(struct tetra *tetra, struct picture *picture,
                                 const struct outlines *outlines, bool solid, struct error *err) {
    if (outlines->index_count == 0)
        return STATUS_OK;
    size_t vertex_bytes = outlines->corner_count * sizeof *outlines->corners;
    size_t index_bytes = outlines->index_count * sizeof *outlines->indices;
    glNamedBufferData(tetra->vertices, (GLsizeiptr)vertex_bytes, outlines->corners, GL_STREAM_DRAW);
    glNamedBufferData(tetra->elements, (GLsizeiptr)index_bytes, outlines->indices, GL_STREAM_DRAW);
    picture->report->work.upload_bytes += vertex_bytes + index_bytes;
    glBindVertexArray(tetra->vertex_array);
    glDisable(GL_CULL_FACE);
    enum status status = STATUS_OK;
    uint32_t bound = UINT32_MAX;
    for (size_t r = 0; r < outlines->run_count && status == STATUS_OK; r++) {
        const struct run *run = &outlines->runs[r];
        const struct path_object *object = &picture->objects[run->object];
        if (run->object != bound) {
            GLuint program;
            status =
                gl_programs_get(picture->programs, GL_PROGRAM_TETRA,
                                variant_of(object, picture, solid), &program, &picture->cold, err);
            if (status != STATUS_OK)
                break;
            struct frame frame;
            frame_clear(&frame);
            frame_set_view(&frame, picture, &object->projection.view, object);
            frame_set_shell(&frame, object);
            frame_bind(&frame, &tetra->frame_buffer);
            glUseProgram(program);
            const struct device_shell *device =
                resident_find(&tetra->shells, object->shell->serial);
            glBindTextureUnit(BINDING_CELLS, device->texture);
            glBindTextureUnit(BINDING_CELLS_LOW, device->low_texture);
            prism_maps_bind(&tetra->maps, object);
            if (object->baked) /* a homogeneous medium has no textures */
                bind_textures(object->baked, solid);
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

static enum status tetra_draw_solid(void *state, struct picture *picture, struct error *err) {
    struct tetra *tetra = state;
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glDepthMask(GL_TRUE);
    glDisable(GL_BLEND);
    enum status status = draw_outlines(tetra, picture, &tetra->solids, true, err);
    return status == STATUS_OK ? walk_pass_draw(tetra->walk, picture, true, err) : status;
}

static enum status tetra_draw_media(void *state, struct picture *picture, struct error *err) {
    struct tetra *tetra = state;
    struct gl_target *target = picture->target;
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
    glBlendFuncSeparate(GL_ONE, GL_SRC1_ALPHA, GL_ONE, GL_ONE);
    enum status status = draw_outlines(tetra, picture, &tetra->media, false, err);
    if (status == STATUS_OK) {
        glDisable(GL_DEPTH_TEST); /* a walk stops at the occluder by itself */
        status = walk_pass_draw(tetra->walk, picture, false, err);
    }
    glDisable(GL_BLEND);
    glBindTextureUnit(BINDING_OCCLUDER, 0);
    return status;
}

const struct path path_tetra = {
    .name = "tetra",
    .id = SCENE_PATH_TETRA,
    .create = tetra_create,
    .destroy = tetra_destroy,
    .prepare = tetra_prepare,
    .draw_solid = tetra_draw_solid,
    .draw_media = tetra_draw_media,
};
