/* The slicing path: planes that face the viewer cut all shells of a picture into slabs, which are
 * drawn back to front. After Lensch, Daubert & Seidel 2002: nothing is sorted but the planes, so
 * shells may hide one another in circles, fold and overlap.
 *
 * Method `slabs`. The paper draws the polygons in which planes cut prisms, with an opacity for
 * each: a point sample of the ray, of first order wherever the density jumps, and it jumps at every
 * boundary of a shell. Here a cell is drawn within a slab, from plane to plane, and the ray's
 * segment in it is integrated (shaders/slabs.frag): its length is exact, along the ray, so a
 * homogeneous medium is right at any angle and with any number of planes, and others are of second
 * order.
 *
 * Order within a slab. Parts of one slab are blended in whatever order they come, not by depth. A
 * pair of optical depths t1, t2 and colours c1, c2 on one ray, taken the wrong way round, is off by
 * t1 t2 (c1 - c2): where they are neighbours in a smooth medium the third power of the spacing, and
 * that happens once for each cell that the ray leaves. Where shells (or folds of one) overlap, the
 * truth mixes them by extinction, which is between the two orders to the third power too: half of
 * the above too much from one, too little from the other; so the order of shells, and of cells
 * within a shell, is turned around from each slab to the next, and what one does the other undoes.
 * The sum is of second order everywhere, without a pass for each slab that sums before it blends.
 *
 * Runs. Most of what a part costs is to find where the ray is in its cell, not the sample taken
 * there. So a cell is drawn once for a run of slabs (runs.h), with a step for each of them, and in
 * a run the cells of a shell are ordered by the faces that they share (shell/slab_order.h). That is
 * exact where a ray goes from cell to cell, so the error above is gone there; stretches of a ray
 * that lie in one run and do not touch are ordered by depth, and those that overlap alternate, with
 * an error (the run's slabs squared) times as large, still of second order. Several shells overlap
 * more often than not, and are drawn slab by slab.
 *
 * Nearest first. Where a medium hides what is behind it the same is done in a mirror, under what
 * was drawn before (onward.h).
 *
 * Methods `software`, `hybrid`, `hardware`: the paper's own, polygons.h; here they share the
 * planes, the lists of what a plane meets, and the alternation.
 *
 * Left out here: filtering. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/gl/context.h"
#include "renderer/path/cells.h"
#include "renderer/path/frame.h"
#include "renderer/path/lists.h"
#include "renderer/path/onward.h"
#include "renderer/path/path.h"
#include "renderer/path/polygons.h"
#include "renderer/path/runs.h"
#include "renderer/shell/slab_order.h"

enum {
    SLICES_MAX = 131072, /* as for quality.slices */
    /* The most that are taken without being asked: at 512 a ray through the middle of a sphere
     * whose shell is a tenth of its radius still meets some 25 in either side of it. */
    SLICES_DEFAULT_MAX = 512,
    /* Sums of n terms in fp32 are off by n 2^-25 at the worst, and equal terms come near that: with
     * 65,536 planes a slab seen at 85 degrees was 1.8e-4 too thin. Groups of slabs are summed
     * apart. */
    GROUP_SLABS = 512,
    BATCH_CORNERS = 1 << 19, /* drawn at a time, so that memory does not grow with the planes */
    /* Of what is drawn between two looks for what is hidden, which are not counted. */
    QUERIES = GROUP_SLABS / ONWARD_RUNS + 1,
    SQUARE = 4 /* samples along the squares by which cells outside of blocks are dropped */
};

_Static_assert((int)GROUP_SLABS == (int)PLANE_LISTS_GROUP,
               "groups are composed as they are listed");

struct slicing {
    struct prism_maps maps;
    struct cell_pass *cells;
    struct outlines outlines;
    struct slabs slabs; /* of the picture; `count` is set when drawing, as quality may change */
    GLuint queries[QUERIES], array;
    int counting;                                   /* which of them */
    struct polygon_pass *polygons[POLYGON_METHODS]; /* made when first used */
    struct polygon_pass *method;                    /* of the picture; NULL: `slabs` */
    bool nearest_first;                             /* of the draw */
    struct onward onward;
    struct plane_lists *lists; /* made when first used */
    struct gl_target group;    /* of many slabs, before it is composed; without depth of its own */
};

static void slicing_destroy(void *state) {
    struct slicing *slicing = state;
    if (!slicing)
        return;
    cell_pass_destroy(slicing->cells);
    prism_maps_finish(&slicing->maps);
    for (int i = 0; i < POLYGON_METHODS; i++)
        polygon_pass_destroy(slicing->polygons[i]);
    plane_lists_destroy(slicing->lists);
    onward_finish(&slicing->onward);
    outlines_finish(&slicing->outlines);
    glDeleteQueries(QUERIES, slicing->queries);
    glDeleteVertexArrays(1, &slicing->array);
    gl_target_finish(&slicing->group);
    free(slicing);
}

static enum status slicing_create(void **state, struct error *err) {
    struct slicing *slicing = calloc(1, sizeof *slicing);
    if (slicing) {
        prism_maps_init(&slicing->maps);
        slicing->cells = cell_pass_create(GL_PROGRAM_SLABS, &slicing->maps);
    }
    if (!slicing || !slicing->cells) {
        free(slicing);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the slicing path");
    }
    glCreateQueries(GL_SAMPLES_PASSED, QUERIES, slicing->queries);
    glCreateVertexArrays(1, &slicing->array); /* empty: the triangle comes from no buffer */
    *state = slicing;
    return gl_check("creating the slicing path", err);
}

/* Planes so close that a ray through the middle of the picture meets one for each layer of voxels.
 */
static double slices_wanted(const struct path_object *object, const struct slabs *slabs) {
    return ceil((slabs->high - slabs->low) * runs_along_ray(&object->projection.view) *
                object->layers / object->shell->thickness);
}

/* Whether two objects could be blended in either order: media of one constant colour. */
static bool same_constant(const struct volume *a, const struct volume *b) {
    for (int i = 0; i < 3; i++)
        if (a->radiance[i] != b->radiance[i])
            return false;
    bool plain = a == b || !(volume_is_filled(a) || volume_is_filled(b) || volume_is_tinted(a) ||
                             volume_is_tinted(b));
    return a->homogeneous && b->homogeneous && plain;
}

/* Shells share the planes, so what one asks for, all must. `asked`, `other`: 0, or what is asked by
 * the object and by one before it. */
static enum status check_shared(const struct path_object *object, const char *member, int asked,
                                const struct path_object *by, int other, struct error *err) {
    if (!asked || !by || asked == other)
        return STATUS_OK;
    char pointer[64];
    snprintf(pointer, sizeof pointer, "%s/quality/%s", object->pointer, member);
    return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                       "all shells of one picture share their planes, and %s asks for others",
                       by->pointer);
}

static enum status slicing_choose(struct path_object *objects, size_t count, struct error *err) {
    struct slabs slabs;
    runs_find_range(objects, count, &slabs);
    const struct path_object *slices_by = NULL, *method_by = NULL, *first = NULL;
    int slices = 0, method = SCENE_SLICING_AUTO;
    double wanted = 1;
    bool any = true;
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        if (!object->shell)
            continue;
        const struct scene_quality *quality = &object->object->quality;
        int asked = quality->method == SCENE_SLICING_AUTO ? 0 : (int)quality->method;
        enum status status =
            check_shared(object, "slices", quality->slices, slices_by, slices, err);
        if (status == STATUS_OK)
            status = check_shared(object, "method", asked, method_by, method, err);
        if (status != STATUS_OK)
            return status;
        slices = quality->slices ? quality->slices : slices;
        slices_by = quality->slices ? object : slices_by;
        method = asked ? asked : method;
        method_by = asked ? object : method_by;
        if (!path_object_drawn(object))
            continue;
        first = first ? first : object;
        any = any && same_constant(first->volume, object->volume);
        if (slabs.low < slabs.high)
            wanted = fmax(wanted, slices_wanted(object, &slabs));
    }
    method = method == SCENE_SLICING_AUTO ? SCENE_SLICING_SLABS : method;
    any = any && method == SCENE_SLICING_SLABS;
    /* One slab is enough where nothing depends on their number. */
    int chosen = slices ? slices : any ? 1 : (int)fmin(wanted, SLICES_DEFAULT_MAX);
    for (size_t i = 0; i < count; i++) {
        if (!objects[i].shell)
            continue;
        objects[i].quality = chosen;
        objects[i].quality_free = !slices && !any;
        objects[i].any_quality = any;
        objects[i].traversal[0] = objects[i].traversal[1] = SCENE_TRAVERSAL_AUTO;
        objects[i].method = (enum scene_slicing_method)method;
    }
    return STATUS_OK;
}

static void slicing_resolve(const struct path_object *object, struct scene_quality *quality) {
    quality->slices = object->quality;
    quality->method = object->method;
}

/* Makes the picture's method ready. */
static enum status find_method(struct slicing *slicing, const struct picture *picture,
                               struct error *err) {
    slicing->method = NULL;
    for (size_t i = 0; i < picture->object_count; i++) {
        const struct path_object *object = &picture->objects[i];
        int index = path_object_drawn(object) ? polygons_index(object->method) : -1;
        if (index < 0)
            continue;
        if (!slicing->polygons[index])
            slicing->polygons[index] = polygon_pass_create(object->method);
        slicing->method = slicing->polygons[index];
        if (!slicing->method)
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for slices");
    }
    return STATUS_OK;
}

static enum status slicing_prepare(void *state, struct picture *picture, struct error *err) {
    struct slicing *slicing = state;
    stage_clock_next(picture->clock, REPORT_STAGE_sort, true);
    runs_find_range(picture->objects, picture->object_count, &slicing->slabs);
    for (size_t i = 0; i < picture->object_count && picture->met; i++)
        if (path_object_drawn(&picture->objects[i]))
            slabs_mark(picture->objects[i].shell, &picture->objects[i].projection, picture->met);

    stage_clock_next(picture->clock, REPORT_STAGE_upload, false);
    cell_pass_begin_picture(slicing->cells);
    enum status status = find_method(slicing, picture, err);
    if (status == STATUS_OK)
        status = prism_maps_prepare(&slicing->maps, picture, err);
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!path_object_drawn(object))
            continue;
        const struct view *view = &object->projection.view;
        double spacing = (slicing->slabs.high - slicing->slabs.low) / object->quality;
        if (!object->volume->homogeneous)
            frame_warn_skipped(
                object, slicing->method ? spacing * runs_along_ray(view) : runs_step(view, spacing),
                "slices", picture->report);
        if (!slicing->method) {
            status = cell_pass_prepare(slicing->cells, object, picture, err);
            continue;
        }
        status = cell_pass_upload(slicing->cells, object->shell, picture, err);
        if (status == STATUS_OK)
            status = polygon_pass_prepare(slicing->method, object, picture, err);
    }
    return status;
}

/* Which squares of samples the picture's blocks touch. malloc'ed; NULL where memory ran out. */
static uint8_t *find_squares(const struct picture *picture, int *columns) {
    const struct gl_blocks *blocks = picture->blocks;
    *columns = picture->world.width / SQUARE + 1;
    size_t rows = (size_t)picture->world.height / SQUARE + 1;
    uint8_t *squares = calloc(rows * (size_t)*columns, 1);
    uint32_t k = (uint32_t)blocks->k, side = (uint32_t)blocks->side;
    for (uint32_t b = 0; b < blocks->count && squares; b++)
        for (uint32_t y = blocks->corner[b][1] * k / SQUARE;
             y <= ((blocks->corner[b][1] + side) * k - 1) / SQUARE; y++)
            for (uint32_t x = blocks->corner[b][0] * k / SQUARE;
                 x <= ((blocks->corner[b][0] + side) * k - 1) / SQUARE; x++)
                if (y < rows && x < (uint32_t)*columns)
                    squares[(size_t)y * (size_t)*columns + x] = 1;
    return squares;
}

/* The shells that take part in one of the two draws. */
struct part {
    uint32_t object;
    struct slab_cells cells;
    struct slab_order order; /* of cells with a medium */
};

static void close_parts(struct part *parts, size_t count) {
    for (size_t i = 0; i < count; i++) {
        slab_cells_finish(&parts[i].cells);
        slab_order_finish(&parts[i].order);
    }
    free(parts);
}

/* Which cells of an object are drawn; NULL: all. STATUS_OUT_OF_MEMORY. */
static enum status choose_cells(const struct path_object *object, const uint8_t *squares,
                                int columns, uint8_t **wanted, struct error *err) {
    *wanted = NULL;
    if (!squares)
        return STATUS_OK;
    *wanted = malloc(object->shell->tetra_count + (size_t)1);
    if (!*wanted)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for slabs");
    slabs_choose(object->shell, &object->projection, squares, SQUARE, columns, *wanted);
    return STATUS_OK;
}

/* Whether an object takes part in one of the two draws. */
static bool takes_part(const struct path_object *object, bool solid) {
    return object->shell &&
           (solid ? volume_has_solid(object->volume) : volume_has_medium(object->volume));
}

static enum status open_parts(const struct slicing *slicing, const struct picture *picture,
                              bool solid, struct part **out, size_t *count, struct error *err) {
    int columns = 0;
    uint8_t *squares = picture->blocks ? find_squares(picture, &columns) : NULL;
    struct part *parts = calloc(picture->object_count + 1, sizeof *parts);
    enum status status = STATUS_OK;
    *count = 0;
    if (!parts || (picture->blocks && !squares))
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for slabs");
    for (size_t i = 0; i < picture->object_count && status == STATUS_OK; i++) {
        const struct path_object *object = &picture->objects[i];
        if (!takes_part(object, solid))
            continue;
        uint8_t *wanted;
        status = choose_cells(object, squares, columns, &wanted, err);
        struct part *part = &parts[*count];
        part->object = (uint32_t)i;
        if (status == STATUS_OK)
            status =
                slab_cells_find(&part->cells, object->shell, &object->projection, &slicing->slabs,
                                slicing->method ? 3 : 1, wanted, slicing->nearest_first, err);
        if (status == STATUS_OK && object->every_plane)
            slab_cells_everywhere(&part->cells, &slicing->slabs);
        free(wanted);
        *count += status == STATUS_OK;
        if (status == STATUS_OK && !solid && !slicing->method && slicing->slabs.count > 1)
            status = slab_order_init(&part->order, object->shell, &object->projection, err);
    }
    free(squares);
    if (status != STATUS_OK) {
        close_parts(parts, parts ? *count : 0);
        parts = NULL;
    }
    *out = parts;
    return status;
}

/* Appends what slab k holds of one shell, in turned order if asked; false where memory ran out. */
static bool append_part(struct slicing *slicing, const struct picture *picture, struct part *part,
                        uint32_t k, bool turned) {
    const struct slab_cells *cells = &part->cells;
    const struct path_object *object = &picture->objects[part->object];
    double low = slabs_plane(&slicing->slabs, k), high = slabs_plane(&slicing->slabs, k + 1);
    if (part->order.shell)
        slab_order_find(&part->order, cells, low, high, turned);
    for (uint32_t m = 0; m < cells->active_count; m++) {
        uint32_t n = slicing->nearest_first ? cells->active_count - 1 - m : m;
        uint32_t at = part->order.shell ? part->order.order[n]
                                        : cells->active[turned ? cells->active_count - 1 - n : n];
        bool appended;
        if (slicing->method) {
            appended = polygon_pass_append(slicing->method, object, part->object, cells->cell[at],
                                           (low + high) / 2);
        } else {
            /* What reaches behind the eye is cut there. */
            bool open_low = k == cells->first[at] && !(k == 0 && object->projection.behind);
            struct cell_slab slab = {low, high, open_low, k == cells->last[at]};
            appended = outlines_append_slab(&slicing->outlines, object, part->object,
                                            cells->cell[at], &slab);
        }
        if (!appended)
            return false;
    }
    return true;
}

static size_t waiting(const struct slicing *slicing) {
    return slicing->method ? polygon_pass_corners(slicing->method) : slicing->outlines.corner_count;
}

static enum status flush(struct slicing *slicing, struct picture *picture, bool solid,
                         struct error *err) {
    const struct slabs *slabs = &slicing->slabs;
    if (slicing->method)
        return polygon_pass_draw(slicing->method, slicing->cells, &slicing->maps, picture,
                                 (slabs->high - slabs->low) / slabs->count, solid, err);
    picture->report->work.segments += slicing->outlines.outline_count;
    enum status status = cell_pass_draw(slicing->cells, picture, &slicing->outlines, solid, err);
    outlines_clear(&slicing->outlines);
    return status;
}

/* From here on slabs are drawn into an empty group, under the depth of the picture. */
static enum status begin_group(struct slicing *slicing, const struct picture *picture,
                               struct error *err) {
    static const float nothing[4] = {0, 0, 0, 0};
    const struct gl_target *target = picture->target;
    enum status status =
        gl_target_resize(&slicing->group, target->width, target->height, false, err);
    if (status != STATUS_OK)
        return status;
    glNamedFramebufferTexture(slicing->group.framebuffer, GL_DEPTH_ATTACHMENT, target->depth, 0);
    glClearNamedFramebufferfv(slicing->group.framebuffer, GL_COLOR, 0, nothing);
    glBindFramebuffer(GL_FRAMEBUFFER, slicing->group.framebuffer);
    return STATUS_OK;
}

static enum status end_group(struct slicing *slicing, struct picture *picture, struct error *err) {
    GLuint program;
    enum status status =
        gl_programs_get(picture->programs, GL_PROGRAM_COMPOSE, 0, &program, &picture->cold, err);
    /* The picture's depth may be gone before this is drawn to again. */
    glNamedFramebufferTexture(slicing->group.framebuffer, GL_DEPTH_ATTACHMENT, 0, 0);
    glBindFramebuffer(GL_FRAMEBUFFER, picture->target->framebuffer);
    if (status != STATUS_OK)
        return status;
    glUseProgram(program);
    glBindTextureUnit(BINDING_SAMPLES, slicing->group.color);
    glDisable(GL_DEPTH_TEST);
    gl_blocks_draw(picture->blocks, program, slicing->array);
    glBindTextureUnit(BINDING_SAMPLES, 0);
    picture->report->work.draws++;
    cell_pass_begin_media(picture);
    return gl_check("composing slabs", err);
}

static void begin_counting(struct slicing *slicing) {
    slicing->counting = 0;
    glBeginQuery(GL_SAMPLES_PASSED, slicing->queries[0]);
}

static void end_counting(const struct slicing *slicing, struct report *report) {
    glEndQuery(GL_SAMPLES_PASSED);
    for (int q = 0; q <= slicing->counting; q++) {
        GLuint64 fragments = 0;
        glGetQueryObjectui64v(slicing->queries[q], GL_QUERY_RESULT, &fragments);
        report->work.fragments += fragments;
    }
}

/* Nearest first: draws what waits, and looks for what that hides. */
static enum status hide(struct slicing *slicing, struct picture *picture, struct error *err) {
    enum status status = flush(slicing, picture, false, err);
    glEndQuery(GL_SAMPLES_PASSED);
    if (status == STATUS_OK)
        status = onward_hide(&slicing->onward, picture, err);
    glBeginQuery(GL_SAMPLES_PASSED, slicing->queries[++slicing->counting]);
    return status;
}

/* Draws the slabs from `end` - 1 down to `begin`, or the other way. */
static enum status draw_range(struct slicing *slicing, struct picture *picture, struct part *parts,
                              size_t count, uint32_t begin, uint32_t end, bool solid,
                              struct error *err) {
    enum status status = STATUS_OK;
    begin_counting(slicing);
    for (uint32_t step = 0; step < end - begin && status == STATUS_OK; step++) {
        /* Nearest first, all is as it is farthest first, seen in a mirror. */
        uint32_t k = slicing->nearest_first ? begin + step : end - 1 - step;
        bool turned = k & 1, backward = turned != slicing->nearest_first;
        if (slicing->nearest_first && step > 0 && step % ONWARD_RUNS == 0)
            status = hide(slicing, picture, err);
        for (size_t n = 0; n < count && status == STATUS_OK; n++) {
            struct part *part = &parts[backward ? count - 1 - n : n];
            slab_cells_move(&part->cells, k);
            if (!append_part(slicing, picture, part, k, turned))
                status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for outlines");
        }
        if (status == STATUS_OK && (waiting(slicing) > BATCH_CORNERS || step + 1 == end - begin))
            status = flush(slicing, picture, solid, err);
    }
    end_counting(slicing, picture->report);
    return status;
}

/* The hardware method with lists that the device makes; *drawn: whether they are used. */
static enum status draw_lists(struct slicing *slicing, struct picture *picture, bool solid,
                              bool *drawn, struct error *err) {
    uint32_t count = 0, index = 0;
    *drawn = false;
    for (size_t i = 0; i < picture->object_count; i++)
        if (takes_part(&picture->objects[i], solid)) {
            index = (uint32_t)i;
            count++;
        }
    if (!picture->device_lists || count != 1 ||
        picture->objects[index].method != SCENE_SLICING_HARDWARE)
        return STATUS_OK;
    if (!slicing->lists)
        slicing->lists = plane_lists_create();
    int columns = 0;
    uint8_t *squares = picture->blocks ? find_squares(picture, &columns) : NULL, *wanted = NULL;
    enum status status = STATUS_OK;
    if (!slicing->lists || (picture->blocks && !squares))
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for slabs");
    if (status == STATUS_OK)
        status = choose_cells(&picture->objects[index], squares, columns, &wanted, err);
    if (status == STATUS_OK)
        status =
            plane_lists_open(slicing->lists, picture, index, &slicing->slabs, wanted, drawn, err);
    free(squares);
    free(wanted);
    bool grouped = !solid && slicing->slabs.count > GROUP_SLABS && !picture->behind;
    uint32_t end = *drawn ? slicing->slabs.count : 0;
    for (uint32_t begin; end > 0 && status == STATUS_OK; end = begin) {
        begin = end > GROUP_SLABS ? end - GROUP_SLABS : 0;
        if (grouped)
            status = begin_group(slicing, picture, err);
        if (status != STATUS_OK)
            break;
        begin_counting(slicing);
        status = plane_lists_draw(slicing->lists, slicing->method, slicing->cells, &slicing->maps,
                                  picture, begin, end, solid, err);
        end_counting(slicing, picture->report);
        if (grouped && status == STATUS_OK)
            status = end_group(slicing, picture, err);
    }
    return status;
}

static enum status draw_slabs(struct slicing *slicing, struct picture *picture, bool solid,
                              struct error *err) {
    struct slabs *slabs = &slicing->slabs;
    for (size_t i = 0; i < picture->object_count; i++)
        if (path_object_drawn(&picture->objects[i]))
            slabs->count = (uint32_t)picture->objects[i].quality;
    picture->report->work.slices = slabs->count;
    slicing->outlines.spacing = (slabs->high - slabs->low) / slabs->count;
    uint32_t run =
        runs_slabs(picture->objects, picture->object_count, slicing->outlines.spacing, solid);
    slabs->count = runs_count(slabs->count, run); /* from here on: runs */
    if (!(slabs->low < slabs->high))
        return STATUS_OK; /* all of it lies behind the eye */
    struct part *parts;
    size_t count;
    /* A group keeps one optical depth: with colours of extinction there are few enough (tint.h). */
    bool drawn, grouped = !solid && slabs->count > GROUP_SLABS && !picture->behind;
    enum status status = draw_lists(slicing, picture, solid, &drawn, err);
    if (status != STATUS_OK || drawn)
        return status;
    slicing->nearest_first = !solid && !grouped && !slicing->method && !picture->behind &&
                             onward_pays(picture, slabs->count);
    if (slicing->nearest_first)
        report_pass(picture->report, "nearest-first",
                    "a medium lets little through: slabs end where nothing more can be seen");
    status = open_parts(slicing, picture, solid, &parts, &count, err);
    if (status != STATUS_OK)
        return status;
    outlines_clear(&slicing->outlines);
    uint32_t most = grouped ? GROUP_SLABS : slabs->count, end = slabs->count;
    for (uint32_t begin; end > 0 && status == STATUS_OK; end = begin) {
        begin = end > most ? end - most : 0;
        if (grouped)
            status = begin_group(slicing, picture, err);
        else if (slicing->nearest_first)
            status = onward_begin(&slicing->onward, picture, err);
        if (status == STATUS_OK)
            status = draw_range(slicing, picture, parts, count, begin, end, solid, err);
        if (grouped && status == STATUS_OK)
            status = end_group(slicing, picture, err);
        else if (slicing->nearest_first && status == STATUS_OK)
            status = onward_end(&slicing->onward, picture, err);
    }
    close_parts(parts, count);
    return status;
}

static enum status slicing_draw_solid(void *state, struct picture *picture, struct error *err) {
    cell_pass_begin_solid();
    return draw_slabs(state, picture, true, err);
}

static enum status slicing_draw_media(void *state, struct picture *picture, struct error *err) {
    cell_pass_begin_media(picture);
    enum status status = draw_slabs(state, picture, false, err);
    cell_pass_end_media();
    return status;
}

const struct path path_slicing = {
    .name = "slicing",
    .id = SCENE_PATH_SLICING,
    .quality_name = "slices",
    .quality_max = SLICES_MAX,
    .create = slicing_create,
    .destroy = slicing_destroy,
    .choose = slicing_choose,
    .resolve = slicing_resolve,
    .prepare = slicing_prepare,
    .draw_solid = slicing_draw_solid,
    .draw_media = slicing_draw_media,
};
