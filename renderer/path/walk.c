/* Walking through shells: see shaders/walk.frag. A full-screen triangle is shaded, so small cells
 * cost no partly empty blocks; a ray ends when nothing more can be seen; and nothing is sorted but
 * the few faces through which a sample's ray enters. */
#include "renderer/path/walk.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/joint.h"
#include "renderer/path/resident.h"
#include "renderer/path/shadow.h"
#include "renderer/path/variant.h"
#include "renderer/shell/overlap.h"
#include "renderer/shell/precision.h"
#include "renderer/shell/prism_map.h"

enum { DEVICE_BYTES_MAX = 512 << 20, VISITS_MAX = 16384 };

enum { CELLS, LINKS, LOW, SIDES, TABLES };

struct device_walk {
    GLuint buffers[TABLES], textures[TABLES];
};

/* Where the rays of this picture enter what one draw walks through. */
struct doors {
    GLuint buffers[2], textures[2]; /* a sample's first entry; entries */
    uint32_t start;
};

/* One draw of media, or of solids. */
struct walk_draw {
    struct doors doors;
    uint32_t object;            /* its number in the picture; unless joint */
    bool folds;                 /* plain, though folds of the shell overlap */
    const struct doors *shared; /* of a draw of media with the same entries, else NULL */
    bool joined;                /* `joint` is what is drawn */
    struct joint joint;
};

struct draw_list { /* in the order of drawing; what they hold is kept for the next picture */
    struct walk_draw *draw;
    size_t count, made;
};

struct walk_pass {
    struct resident_cache shells;
    struct prism_maps *maps;
    struct draw_list media, solids;
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

static void finish_draws(struct draw_list *list) {
    for (size_t i = 0; i < list->made; i++) {
        glDeleteTextures(2, list->draw[i].doors.textures);
        glDeleteBuffers(2, list->draw[i].doors.buffers);
        joint_finish(&list->draw[i].joint);
    }
    free(list->draw);
}

void walk_pass_destroy(struct walk_pass *pass) {
    if (!pass)
        return;
    resident_clear(&pass->shells);
    finish_draws(&pass->media);
    finish_draws(&pass->solids);
    glDeleteBuffers(1, &pass->frame_buffer);
    glDeleteVertexArrays(1, &pass->array);
    free(pass);
}

/* One more draw; NULL where memory ran out. */
static struct walk_draw *append_draw(struct draw_list *list) {
    if (list->count == list->made) {
        struct walk_draw *grown = realloc(list->draw, (list->made + 1) * sizeof *grown);
        if (!grown)
            return NULL;
        list->draw = grown;
        list->draw[list->made++] = (struct walk_draw){.doors.start = LINK_NONE};
    }
    return &list->draw[list->count++];
}

bool walk_possible(const struct path_object *object, const char **why) {
    *why = NULL;
    if (object->projection.behind && object->projection.view.orthographic)
        *why = "the eye's plane cuts the shell, and each parallel ray would begin elsewhere";
    return !*why;
}

/* Events of all shells are put in order by t in fp32, which so must tell parts of this shell apart:
 * a thousandth of its thickness, or its optical depth would be wrong by more than that. */
bool walk_possible_with_others(const struct path_object *object, const char **why) {
    const struct projection *projection = &object->projection;
    const double *d = projection->view.d0;
    double most = 0, speed = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (uint32_t v = 0; v < object->shell->vertex_count; v++)
        most = fmax(most, fabs(projection->clip[v][2] - 1)); /* view.h: t = H - 1 */
    bool fine = !object->fp64 && most * ldexp(speed, -24) <= 1e-3 * object->shell->thickness;
    *why = fine ? NULL : "the shell is too thin for the depth of the scene";
    return fine;
}

static void make_table(struct device_walk *device, int table, GLenum format, const void *data,
                       size_t bytes, struct picture *picture) {
    glCreateBuffers(1, &device->buffers[table]);
    glNamedBufferStorage(device->buffers[table], (GLsizeiptr)bytes, data, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &device->textures[table]);
    glTextureBuffer(device->textures[table], format, device->buffers[table]);
    picture->report->work.upload_bytes += bytes;
}

/* The prisms' corners, of a shell whose other tables are there. */
static enum status upload_sides(const struct shell *shell, struct device_walk *device,
                                struct picture *picture, struct error *err) {
    size_t prisms = shell->tetra_count / 3;
    float(*side)[SIDE_TEXELS][4] = malloc((prisms + 1) * sizeof *side);
    if (!side)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's tables");
    prism_sides_fill(shell, side);
    make_table(device, SIDES, GL_RGBA32F, side, prisms * sizeof *side, picture);
    free(side);
    return STATUS_OK;
}

static bool by_sides(const struct path_object *object) {
    return object->exact && object->shell->ruled;
}

static enum status upload_shell(struct walk_pass *pass, const struct path_object *object,
                                struct picture *picture, struct error *err) {
    const struct shell *shell = object->shell;
    struct device_walk *device = resident_find(&pass->shells, shell->serial);
    bool sides = by_sides(object);
    bool kept =
        device && (device->textures[LOW] || !object->fp64) && (device->textures[SIDES] || !sides);
    report_reuse(picture->report, REPORT_PART_tables, kept);
    if (kept)
        return STATUS_OK;
    size_t count = shell->tetra_count, texels = WALK_TEXELS;
    if (count * texels > (size_t)pass->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "a shell of %zu tetrahedra: this GL holds %zu in one table", count,
                           (size_t)pass->texels_max / texels);
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
    if (low && !device->textures[LOW])
        make_table(device, LOW, GL_RGBA32F, low, count * sizeof *low, picture);
    free(cell);
    free(link);
    free(low);
    if (!known && !resident_add(&pass->shells, shell->serial, device,
                                count * (sizeof *cell + sizeof *link + sizeof *low +
                                         (sides ? SIDE_TEXELS * 16 / 3 : 0))))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a shell's tables");
    if (sides && !device->textures[SIDES]) {
        enum status status = upload_sides(shell, device, picture, err);
        if (status != STATUS_OK)
            return status;
    }
    return gl_check("uploading a shell", err);
}

static uint32_t variant_of(const struct path_object *object, const struct picture *picture,
                           bool solid) {
    uint32_t folds = solid && object->solid_folds ? FLAG_FOLDS : 0;
    return variant_of_shell(object, picture->lights.count, picture->occluded, solid) | folds;
}

/* One draw's entries to the device; `entry` has one word for each, or two where walks are joint. */
static enum status upload_doors(struct walk_pass *pass, struct picture *picture,
                                const struct entries *entries, const void *entry, int words,
                                struct doors *doors, struct error *err) {
    doors->start = entries->start;
    stage_clock_next(picture->clock, REPORT_STAGE_upload, false);
    size_t samples = (size_t)picture->world.width * (size_t)picture->world.height + 1;
    size_t bytes[2] = {samples * sizeof *entries->first,
                       (entries->count + 1) * (size_t)words * sizeof *entries->entry};
    const void *data[2] = {entries->first, entry};
    const GLenum formats[2] = {GL_R32UI, words == 1 ? GL_R32UI : GL_RG32UI};
    if (samples > (size_t)pass->texels_max || entries->count >= (size_t)pass->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/image",
                           "%zu samples: this GL holds %d in one table", samples, pass->texels_max);
    if (!doors->buffers[0]) {
        glCreateBuffers(2, doors->buffers);
        glCreateTextures(GL_TEXTURE_BUFFER, 2, doors->textures);
    }
    for (int i = 0; i < 2; i++) {
        glNamedBufferData(doors->buffers[i], (GLsizeiptr)bytes[i], data[i], GL_STREAM_DRAW);
        glTextureBuffer(doors->textures[i], formats[i], doors->buffers[i]);
        picture->report->work.upload_bytes += bytes[i];
    }
    return STATUS_OK;
}

static enum status find_program(struct picture *picture, const struct path_object *object,
                                bool solid, struct error *err) {
    GLuint program;
    return gl_programs_get(picture->programs, GL_PROGRAM_WALK, variant_of(object, picture, solid),
                           &program, &picture->cold, err);
}

/* One of the draws that overlap_find() gives; `object_of`: the picture's objects by its numbers. */
static enum status prepare_medium(struct walk_pass *pass, struct picture *picture,
                                  const struct overlap_draw *from, const uint32_t *object_of,
                                  struct error *err) {
    struct walk_draw *draw = append_draw(&pass->media);
    if (!draw)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to walk");
    draw->object = object_of[from->shell[0]];
    draw->joined = from->joint;
    draw->folds = from->slots[0] > 1;
    if (!from->joint) {
        enum status status =
            upload_doors(pass, picture, &from->entries, from->entries.entry, 1, &draw->doors, err);
        return status == STATUS_OK
                   ? find_program(picture, &picture->objects[draw->object], false, err)
                   : status;
    }
    struct joint *joint = &draw->joint;
    joint->shell_count = from->shell_count;
    joint->starts = from->starts;
    for (uint32_t i = 0; i < from->shell_count; i++) {
        const struct path_object *object = &picture->objects[object_of[from->shell[i]]];
        const struct device_walk *device = resident_find(&pass->shells, object->shell->serial);
        if (path_object_leaps(object, false))
            frame_warn_fixed(object, "shells or folds that overlap are walked through at once",
                             picture->report);
        joint->shell[i] = (struct joint_shell){object,
                                               device->buffers[CELLS],
                                               device->buffers[LINKS],
                                               prism_maps_buffer(pass->maps, object),
                                               from->slots[i],
                                               0};
    }
    enum status status =
        upload_doors(pass, picture, &from->entries, from->door, 2, &draw->doors, err);
    return status == STATUS_OK ? joint_prepare(joint, picture, from, pass->texels_max, err)
                               : status;
}

/* The plan has it that nothing overlaps (renderer/plan.c). */
static void tell_overlap(const struct overlap *overlap, struct report *report) {
    char why[160];
    snprintf(why, sizeof why,
             "%llu samples: up to %d stretches lie over one another and are walked at once",
             (unsigned long long)(overlap->samples - overlap->approximate), overlap->deepest);
    bool joint = false;
    for (size_t i = 0; i < overlap->draw_count; i++)
        joint |= overlap->draw[i].joint;
    if (joint && overlap->samples == overlap->approximate)
        snprintf(why, sizeof why, "nothing overlaps, but each of several shells hides another");
    if (joint)
        report_pass(report, "overlap", why);
    else if (overlap->approximate)
        report_left_out(report, "overlap", "a shell folds too deep to walk through all at once");
    if (overlap->approximate)
        report_warn(report, "folds-overlap", "/objects", overlap->approximate, 0,
                    "samples on whose ray a shell folds over itself, more than %d times or so thin "
                    "that it needs doubles; there its colours are mixed one fold after another, "
                    "not by extinction",
                    SLOTS_MAX);
}

/* More shells overlap than can be walked at once: their cells are sorted, unless the scene asks for
 * the walk. */
static enum status give_up_media(struct picture *picture, struct error *err) {
    for (size_t i = 0; i < picture->object_count; i++) {
        struct path_object *object = &picture->objects[i];
        if (!object->walk || !volume_has_medium(object->volume))
            continue;
        if (picture->behind && picture->behind[3] < 1 && !picture->shares &&
            volume_is_tinted(object->volume)) {
            char pointer[96];
            snprintf(pointer, sizeof pointer, "%s/shell/material/extinction_color",
                     object->pointer);
            return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                               "more than %d stretches of semi-transparent shells would have to be "
                               "walked at once, and of cells drawn one by one its alpha is not "
                               "known: take an opaque background",
                               SLOTS_MAX);
        }
        if (object->walk_asked) {
            char pointer[64];
            snprintf(pointer, sizeof pointer, "%s/quality/order", object->pointer);
            return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                               "cannot walk: more than %d stretches of semi-transparent shells "
                               "would have to be walked at once",
                               SLOTS_MAX);
        }
        object->walk = false;
    }
    report_pass(picture->report, "sort", "more shells overlap than can be walked at once");
    report_pass(picture->report, "cells", "tetrahedra are drawn one by one, from a table");
    report_left_out(picture->report, "overlap", "more shells overlap than can be walked at once");
    return STATUS_OK;
}

static enum status prepare_media(struct walk_pass *pass, struct picture *picture,
                                 struct error *err) {
    struct overlap_shell shells[OVERLAP_SHELLS_MAX];
    uint32_t object_of[OVERLAP_SHELLS_MAX], count = 0;
    for (size_t i = 0; i < picture->object_count; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->walk || !volume_has_medium(object->volume))
            continue;
        if (count == OVERLAP_SHELLS_MAX)
            return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                               "at most %d semi-transparent shells can be drawn together",
                               OVERLAP_SHELLS_MAX);
        object_of[count] = (uint32_t)i;
        shells[count++] =
            (struct overlap_shell){object->shell, &object->projection,
                                   object->object->shell.has_base, object->fp64, false};
    }
    if (count == 0)
        return STATUS_OK;
    stage_clock_next(picture->clock, REPORT_STAGE_sort, false);
    struct overlap overlap;
    enum status status = overlap_find(shells, count, picture->met, &overlap, err);
    report_reuse(picture->report, REPORT_PART_orders, false);
    picture->report->work.fragments += overlap.fragments;
    if (status == STATUS_OK && overlap.too_many)
        status = give_up_media(picture, err);
    else if (status == STATUS_OK)
        tell_overlap(&overlap, picture->report);
    stage_clock_next(picture->clock, REPORT_STAGE_upload, false);
    for (uint32_t i = 0; i < count && status == STATUS_OK && !overlap.too_many; i++)
        status = upload_shell(pass, &picture->objects[object_of[i]], picture, err);
    for (size_t i = 0; i < overlap.draw_count && status == STATUS_OK; i++) {
        status = prepare_medium(pass, picture, &overlap.draw[i], object_of, err);
        const struct path_object *first = &picture->objects[object_of[overlap.draw[i].shell[0]]];
        if (overlap.draw[i].joint && first->filter == SCENE_FILTER_VIEW)
            report_warn(picture->report, "filter-folds", first->pointer, overlap.samples, 0,
                        "samples on whose ray folds of the shell overlap are not filtered: what is "
                        "seen from a side is not known of several at once");
    }
    overlap_finish(&overlap);
    return status;
}

/* What the media's draws tell of an object: whether folds of it overlap, and the plain walk through
 * it if there is one that leaves no sample to a joint walk. */
static const struct walk_draw *plain_walk(const struct walk_pass *pass,
                                          const struct picture *picture, uint32_t index,
                                          bool *folds) {
    const struct walk_draw *plain = NULL;
    bool joined = false;
    *folds = false;
    for (size_t i = 0; i < pass->media.count; i++) {
        const struct walk_draw *draw = &pass->media.draw[i];
        if (!draw->joined && draw->object == index) {
            plain = draw;
            *folds |= draw->folds;
        }
        for (uint32_t k = 0; draw->joined && k < draw->joint.shell_count; k++)
            if (draw->joint.shell[k].object == &picture->objects[index]) {
                joined = true;
                *folds |= draw->joint.shell[k].slots > 1;
            }
    }
    return joined ? NULL : plain;
}

/* Where rays enter a solid. The first surface along a ray is that of the first stretch that holds
 * one, unless stretches overlap: then all of them are looked at that begin before it (FLAG_FOLDS).
 * Where the eye stands within several its cells are drawn instead, in any order, and the depth test
 * decides. */
static enum status find_doors(struct walk_pass *pass, struct picture *picture,
                              struct path_object *object, struct doors *doors, struct error *err) {
    stage_clock_next(picture->clock, REPORT_STAGE_sort, false);
    report_reuse(picture->report, REPORT_PART_orders, false);
    struct entries entries = {0};
    struct overlap overlap = {0};
    enum status status;
    if (object->solid_folds) { /* its media have told */
        status = entries_find(object->shell, &object->projection, picture->met, &entries, err);
        picture->report->work.fragments += entries.count;
    } else {
        struct overlap_shell shell = {object->shell, &object->projection,
                                      object->object->shell.has_base, object->fp64, true};
        status = overlap_find(&shell, 1, picture->met, &overlap, err);
        picture->report->work.fragments += overlap.fragments;
        object->solid_folds = overlap.samples > 0;
    }
    const struct entries *all = overlap.draw_count ? &overlap.draw[0].entries : &entries;
    object->solid_cells = object->solid_folds && all->starts > 1;
    if (status == STATUS_OK && !object->solid_cells)
        status = upload_doors(pass, picture, all, all->entry, 1, doors, err);
    entries_finish(&entries);
    overlap_finish(&overlap);
    if (object->solid_folds && !object->solid_cells)
        report_pass(picture->report, "folds",
                    "the nearest surface of a solid's folds that overlap");
    return status;
}

static enum status prepare_solid(struct walk_pass *pass, struct picture *picture, uint32_t index,
                                 struct error *err) {
    struct path_object *object = &picture->objects[index];
    struct walk_draw *draw = append_draw(&pass->solids);
    if (!draw)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to walk");
    draw->object = index;
    const struct walk_draw *plain = plain_walk(pass, picture, index, &object->solid_folds);
    draw->shared = plain && !object->solid_folds ? &plain->doors : NULL;
    enum status status =
        draw->shared ? STATUS_OK : find_doors(pass, picture, object, &draw->doors, err);
    if (object->solid_cells)
        pass->solids.count--;
    return status == STATUS_OK && !object->solid_cells ? find_program(picture, object, true, err)
                                                       : status;
}

enum status walk_pass_prepare(struct walk_pass *pass, struct picture *picture, struct error *err) {
    resident_begin_picture(&pass->shells);
    pass->media.count = pass->solids.count = 0;
    bool by_cells = false;
    enum status status = prepare_media(pass, picture, err);
    for (uint32_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!object->walk || !volume_has_solid(object->volume))
            continue;
        status = prepare_solid(pass, picture, i, err);
        if (status == STATUS_OK && !object->solid_cells)
            status = upload_shell(pass, object, picture, err);
        by_cells |= object->solid_cells;
    }
    if (by_cells) {
        report_pass(
            picture->report, "cells",
            "the eye stands where folds of a solid overlap: the depth of its cells finds the "
            "nearest surface");
        report_pass(picture->report, "depth", "opaque things hide one another, or media");
        report_pass(picture->report, "eye-inside", "each segment of those cells begins at the eye");
        picture->depth = true;
    }
    return status;
}

static void bind_textures(const struct path_object *object, bool solid) {
    const struct baked *baked = object->baked;
    path_object_bind_medium(object, BINDING_MEDIUM, BINDING_MEDIUM_GRADIENT);
    if (solid && baked->solid_leap)
        glBindTextureUnit(BINDING_LEAP, baked->solid_leap);
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
    shadow_bind(picture, &object->projection.view, object);
    const struct device_walk *device = resident_find(&pass->shells, object->shell->serial);
    glUseProgram(program);
    /* A ray meets a cell once, and may come in by each from outside; past that many visits
     * something is wrong. */
    uint32_t most = 2 * object->shell->tetra_count + 8;
    glProgramUniform1ui(program, 0, doors->start);
    glProgramUniform1i(program, 1, picture->world.width);
    glProgramUniform1i(program, 2, (GLint)(most < VISITS_MAX ? most : VISITS_MAX));
    glBindTextureUnit(BINDING_CELLS, device->textures[CELLS]);
    glBindTextureUnit(BINDING_LINKS, device->textures[LINKS]);
    glBindTextureUnit(BINDING_CELLS_LOW, device->textures[LOW]);
    glBindTextureUnit(BINDING_SIDES, device->textures[SIDES]);
    prism_maps_bind(pass->maps, object);
    glBindTextureUnit(BINDING_FIRST, doors->textures[0]);
    glBindTextureUnit(BINDING_ENTRIES, doors->textures[1]);
    if (object->baked)
        bind_textures(object, solid);
    gl_blocks_draw(picture->blocks, program, pass->array);
    picture->report->work.draws++;
    return gl_check("walking through a shell", err);
}

enum status walk_pass_draw(struct walk_pass *pass, struct picture *picture, bool solid,
                           struct error *err) {
    glDisable(GL_CULL_FACE);
    enum status status = STATUS_OK;
    struct draw_list *list = solid ? &pass->solids : &pass->media;
    for (size_t i = 0; i < list->count && status == STATUS_OK; i++) {
        struct walk_draw *draw = &list->draw[i];
        if (draw->joined)
            status = joint_draw(&draw->joint, picture, draw->doors.textures[0],
                                draw->doors.textures[1], VISITS_MAX, err);
        else
            status = draw_object(pass, picture, &picture->objects[draw->object],
                                 draw->shared ? draw->shared : &draw->doors, solid, err);
    }
    return status;
}
