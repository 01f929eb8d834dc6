/* See polygons.h. */
#include "renderer/path/polygons.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/gl/context.h"
#include "renderer/path/frame.h"
#include "renderer/path/shadow.h"
#include "renderer/path/variant.h"
#include "renderer/shell/grow.h"

/* What the CPU has worked out of a corner, in full. */
struct full_corner {
    float position[3], uvw[3];
    uint32_t prism;
};

struct named_corner {
    uint32_t item; /* prism << 4 | edge */
    float plane;   /* relative to the shell's centre */
};

/* What the hardware method draws as a fan of six corners, whose indices are always the same:
 * CUT_CORNERS in interface.h. */
struct cut {
    uint32_t prism;
    float plane;
    uint32_t edges;
};
enum { CUT_INDICES = 3 * (CUT_CORNERS - 2) };

struct polygon_pass {
    enum scene_slicing_method method;
    enum gl_program_id program;
    struct slice_case cases[SLICE_CASES];
    /* Of these, what the method needs: software, hybrid, hardware. */
    struct full_corner *full;
    struct named_corner *named;
    struct cut *cuts;
    uint32_t *indices; /* hardware: of all cuts that were ever drawn at once */
    struct cell_run *runs;
    size_t count, capacity, index_count, index_capacity, run_count, run_capacity, polygon_count;
    GLint texels_max;
    size_t indexed; /* cuts that `elements` holds the indices of */
    GLuint array, vertices, elements, frame_buffer, cut_texture;
};

int polygons_index(enum scene_slicing_method method) {
    switch (method) {
    case SCENE_SLICING_SOFTWARE:
        return 0;
    case SCENE_SLICING_HYBRID:
        return 1;
    case SCENE_SLICING_HARDWARE:
        return 2;
    default:
        return -1;
    }
}

static void describe_corners(struct polygon_pass *pass) {
    bool full = pass->method == SCENE_SLICING_SOFTWARE;
    glVertexArrayVertexBuffer(
        pass->array, 0, pass->vertices, 0,
        (GLsizei)(full ? sizeof(struct full_corner) : sizeof(struct named_corner)));
    for (GLuint a = 0; a < (full ? 3u : 2u); a++) {
        glEnableVertexArrayAttrib(pass->array, a);
        glVertexArrayAttribBinding(pass->array, a, 0);
    }
    if (full) {
        glVertexArrayAttribFormat(pass->array, 0, 3, GL_FLOAT, GL_FALSE,
                                  offsetof(struct full_corner, position));
        glVertexArrayAttribFormat(pass->array, 1, 3, GL_FLOAT, GL_FALSE,
                                  offsetof(struct full_corner, uvw));
        glVertexArrayAttribIFormat(pass->array, 2, 1, GL_UNSIGNED_INT,
                                   offsetof(struct full_corner, prism));
    } else {
        glVertexArrayAttribIFormat(pass->array, 0, 1, GL_UNSIGNED_INT,
                                   offsetof(struct named_corner, item));
        glVertexArrayAttribFormat(pass->array, 1, 1, GL_FLOAT, GL_FALSE,
                                  offsetof(struct named_corner, plane));
    }
}

struct polygon_pass *polygon_pass_create(enum scene_slicing_method method) {
    int index = polygons_index(method);
    struct polygon_pass *pass = index < 0 ? NULL : calloc(1, sizeof *pass);
    if (!pass)
        return NULL;
    static const enum gl_program_id programs[POLYGON_METHODS] = {
        GL_PROGRAM_SLICES_SOFTWARE, GL_PROGRAM_SLICES_HYBRID, GL_PROGRAM_SLICES_HARDWARE};
    pass->method = method;
    pass->program = programs[index];
    slice_make_cases(pass->cases);
    glCreateBuffers(1, &pass->vertices);
    glCreateBuffers(1, &pass->elements);
    glCreateVertexArrays(1, &pass->array);
    glVertexArrayElementBuffer(pass->array, pass->elements);
    if (method == SCENE_SLICING_HARDWARE) {
        glCreateTextures(GL_TEXTURE_BUFFER, 1, &pass->cut_texture);
        glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &pass->texels_max);
    } else {
        describe_corners(pass);
    }
    return pass;
}

void polygon_pass_destroy(struct polygon_pass *pass) {
    if (!pass)
        return;
    glDeleteVertexArrays(1, &pass->array);
    glDeleteBuffers(1, &pass->vertices);
    glDeleteBuffers(1, &pass->elements);
    glDeleteBuffers(1, &pass->frame_buffer);
    glDeleteTextures(1, &pass->cut_texture);
    free(pass->full);
    free(pass->named);
    free(pass->cuts);
    free(pass->indices);
    free(pass->runs);
    free(pass);
}

enum status polygon_pass_prepare(const struct polygon_pass *pass, const struct path_object *object,
                                 struct picture *picture, struct error *err) {
    enum status status = STATUS_OK;
    for (int solid = 0; solid < 2 && status == STATUS_OK; solid++) {
        GLuint program;
        if (solid ? volume_has_solid(object->volume) : volume_has_medium(object->volume))
            status = gl_programs_get(picture->programs, pass->program,
                                     variant_in_picture(object, picture, solid), &program,
                                     &picture->cold, err);
    }
    return status;
}

/* ---- polygons ---- */

/* The shell's vertex of a prism's vertex 0..5 (slice.h). */
static uint32_t vertex_of(const struct shell *shell, uint32_t prism, int v) {
    return v < 3 ? shell->tetra[3 * (size_t)prism][v] : shell->tetra[3 * (size_t)prism + 2][v - 2];
}

/* Where the plane cuts an edge, on the sample grid, and its texture coordinates there: of an exact
 * object (b1, b2, w). */
static struct full_corner intersect(const struct path_object *object, uint32_t prism, int edge,
                                    double h) {
    const struct shell *shell = object->shell;
    const struct projection *projection = &object->projection;
    int end[2] = {slice_edge[edge][0], slice_edge[edge][1]};
    const double *a = projection->clip[vertex_of(shell, prism, end[0])];
    const double *b = projection->clip[vertex_of(shell, prism, end[1])];
    double s = (a[2] - h) / (a[2] - b[2]); /* the ends lie on either side */
    double w = projection->view.orthographic ? 1 : h;
    const float(*cell)[4] = shell->cell[3 * (size_t)prism];
    bool exact = object->exact;
    const double u[3] = {0, exact ? 1 : (double)cell[2][3], exact ? 0 : (double)cell[5][3]};
    const double v[3] = {0, exact ? 0 : (double)cell[3][3], exact ? 1 : (double)cell[6][3]};
    const double uv0[2] = {exact ? 0 : (double)cell[0][3], exact ? 0 : (double)cell[1][3]};
    int i = end[0] % 3, j = end[1] % 3;
    double w_a = end[0] >= 3, w_b = end[1] >= 3;
    return (struct full_corner){
        {(float)((a[0] + s * (b[0] - a[0])) / w), (float)((a[1] + s * (b[1] - a[1])) / w),
         (float)DEPTH_OF_T(h - 1, projection->view.depth_scale)},
        {(float)(uv0[0] + u[i] + s * (u[j] - u[i])), (float)(uv0[1] + v[i] + s * (v[j] - v[i])),
         (float)(w_a + s * (w_b - w_a))},
        prism};
}

/* The run that an object's next polygon belongs to; false where memory ran out. */
static bool reserve_run(struct polygon_pass *pass, uint32_t index) {
    if (pass->run_count && pass->runs[pass->run_count - 1].object == index)
        return true;
    void *list = pass->runs;
    if (!list_grow(&list, pass->run_count, 1, &pass->run_capacity, sizeof *pass->runs))
        return false;
    pass->runs = list;
    pass->runs[pass->run_count++] = (struct cell_run){index, (uint32_t)pass->index_count, 0};
    return true;
}

static void extend_run(struct polygon_pass *pass) {
    struct cell_run *run = &pass->runs[pass->run_count - 1];
    run->count = (uint32_t)pass->index_count - run->first;
    pass->polygon_count++;
}

static bool reserve(struct polygon_pass *pass, uint32_t index) {
    bool full = pass->method == SCENE_SLICING_SOFTWARE;
    void *list = full ? (void *)pass->full : (void *)pass->named;
    if (!list_grow(&list, pass->count, SLICE_EDGES, &pass->capacity,
                   full ? sizeof *pass->full : sizeof *pass->named))
        return false;
    if (full)
        pass->full = list;
    else
        pass->named = list;
    list = pass->indices;
    if (!list_grow(&list, pass->index_count, 3 * (size_t)SLICE_EDGES, &pass->index_capacity,
                   sizeof *pass->indices))
        return false;
    pass->indices = list;
    return reserve_run(pass, index);
}

/* A fan over the corners [first, first + corners) that were just appended. */
static void append_fan(struct polygon_pass *pass, size_t first, size_t corners) {
    for (size_t i = 1; i + 1 < corners; i++) {
        pass->indices[pass->index_count++] = (uint32_t)first;
        pass->indices[pass->index_count++] = (uint32_t)(first + i);
        pass->indices[pass->index_count++] = (uint32_t)(first + i + 1);
    }
    extend_run(pass);
}

/* Which vertices lie behind the plane. A shader that rounds a vertex to its other side moves a
 * corner by no more than that rounding. */
static unsigned sides_of(const struct path_object *object, uint32_t prism, double h) {
    unsigned sides = 0;
    for (int v = 0; v < 6; v++)
        sides |= (unsigned)(object->projection.clip[vertex_of(object->shell, prism, v)][2] >= h)
                 << v;
    return sides;
}

bool polygons_part(const struct path_object *object, uint32_t prism, double height[6]) {
    bool onward = false, back = false;
    for (int v = 0; v < 6; v++)
        height[v] = object->projection.clip[vertex_of(object->shell, prism, v)][2];
    for (int v = 0; v < 3; v++) {
        onward |= height[v] < height[v + 3];
        back |= height[v] > height[v + 3];
    }
    return onward && back;
}

static void append_cut(struct polygon_pass *pass, uint32_t prism, float plane, uint32_t edges) {
    pass->cuts[pass->count++] = (struct cut){prism, plane, edges};
    pass->index_count += CUT_INDICES;
    extend_run(pass);
}

/* The shader decides. Only where the paper's six corners cannot say what is cut are edges named. */
static bool append_hardware(struct polygon_pass *pass, const struct path_object *object,
                            uint32_t index, uint32_t prism, double h) {
    void *list = pass->cuts;
    if (!list_grow(&list, pass->count, 4, &pass->capacity, sizeof *pass->cuts))
        return false;
    pass->cuts = list;
    if (!reserve_run(pass, index))
        return false;
    float plane = (float)(h - object->projection.view.h_row[3]);
    unsigned sides = 0;
    double height[6];
    bool named =
        polygons_part(object, prism, height) && !slice_in_table(sides = sides_of(object, prism, h));
    const struct slice_case *cut = &pass->cases[sides];
    if (!named) {
        append_cut(pass, prism, plane, CUT_UNDECIDED);
    } else {
        uint32_t fan[SLICE_FANS];
        int fans = slice_make_fans(cut, fan);
        for (int i = 0; i < fans; i++)
            append_cut(pass, prism, plane, fan[i]);
    }
    return true;
}

bool polygon_pass_append(struct polygon_pass *pass, const struct path_object *object,
                         uint32_t index, uint32_t prism, double h) {
    if (pass->method == SCENE_SLICING_HARDWARE)
        return append_hardware(pass, object, index, prism, h);
    const struct slice_case *cut = &pass->cases[sides_of(object, prism, h)];
    if (cut->count == 0)
        return true;
    if (!reserve(pass, index))
        return false;
    float plane = (float)(h - object->projection.view.h_row[3]);
    size_t first = pass->count;
    for (int i = 0; i < cut->count; i++) {
        if (pass->method == SCENE_SLICING_SOFTWARE)
            pass->full[pass->count++] = intersect(object, prism, cut->edge[i], h);
        else
            pass->named[pass->count++] = (struct named_corner){prism << 4 | cut->edge[i], plane};
    }
    append_fan(pass, first, cut->first);
    if (cut->first < cut->count)
        append_fan(pass, first + cut->first, (size_t)(cut->count - cut->first));
    return true;
}

size_t polygon_pass_corners(const struct polygon_pass *pass) {
    return pass->method == SCENE_SLICING_HARDWARE ? CUT_INDICES * pass->count : pass->count;
}

/* Indices of `cuts` fans. They do not depend on what is cut, and stay on the device. */
static enum status index_cuts(struct polygon_pass *pass, size_t cuts, struct report *report,
                              struct error *err) {
    if (cuts <= pass->indexed)
        return STATUS_OK;
    void *list = pass->indices;
    if (!list_grow(&list, 0, CUT_INDICES * cuts, &pass->index_capacity, sizeof *pass->indices))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for slices");
    pass->indices = list;
    size_t n = 0;
    for (uint32_t c = 0; n < pass->index_capacity - pass->index_capacity % CUT_INDICES; c++)
        for (uint32_t i = 1; i + 1 < CUT_CORNERS; i++) {
            pass->indices[n++] = CUT_CORNERS * c;
            pass->indices[n++] = CUT_CORNERS * c + i;
            pass->indices[n++] = CUT_CORNERS * c + i + 1;
        }
    pass->indexed = n / CUT_INDICES;
    glNamedBufferData(pass->elements, (GLsizeiptr)(n * sizeof *pass->indices), pass->indices,
                      GL_STATIC_DRAW);
    report->work.upload_bytes += n * sizeof *pass->indices;
    return STATUS_OK;
}

static enum status upload_cuts(struct polygon_pass *pass, struct report *report,
                               struct error *err) {
    if (pass->count > (size_t)pass->texels_max)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "a plane that cuts some %zu prisms: this GL holds %d in one table",
                           pass->count, (int)pass->texels_max);
    size_t bytes = pass->count * sizeof *pass->cuts;
    glNamedBufferData(pass->vertices, (GLsizeiptr)bytes, pass->cuts, GL_STREAM_DRAW);
    glTextureBuffer(pass->cut_texture, GL_RGB32UI, pass->vertices);
    report->work.upload_bytes += bytes;
    return index_cuts(pass, pass->count, report, err);
}

static void upload_corners(struct polygon_pass *pass, struct report *report) {
    bool full = pass->method == SCENE_SLICING_SOFTWARE;
    size_t vertex_bytes = pass->count * (full ? sizeof *pass->full : sizeof *pass->named);
    size_t index_bytes = pass->index_count * sizeof *pass->indices;
    const void *data = full ? (const void *)pass->full : (const void *)pass->named;
    glNamedBufferData(pass->vertices, (GLsizeiptr)vertex_bytes, data, GL_STREAM_DRAW);
    glNamedBufferData(pass->elements, (GLsizeiptr)index_bytes, pass->indices, GL_STREAM_DRAW);
    report->work.upload_bytes += vertex_bytes + index_bytes;
}

/* All that a draw of one object needs but its corners. */
static enum status bind_object(struct polygon_pass *pass, struct cell_pass *tables,
                               struct prism_maps *maps, struct picture *picture, uint32_t index,
                               double spacing, bool solid, struct error *err) {
    const struct path_object *object = &picture->objects[index];
    GLuint program;
    enum status status =
        gl_programs_get(picture->programs, pass->program,
                        variant_in_picture(object, picture, solid), &program, &picture->cold, err);
    if (status != STATUS_OK)
        return status;
    struct frame frame;
    frame_clear(&frame);
    frame_set_view(&frame, picture, &object->projection.view, object);
    frame_set_shell(&frame, object);
    frame.v[FRAME_STEP][0] = 0; /* one step from plane to plane */
    frame_bind(&frame, &pass->frame_buffer);
    shadow_bind(picture, &object->projection.view, object);
    glUseProgram(program);
    if (!solid)
        glProgramUniform1f(program, 0, (float)spacing);
    glBindTextureUnit(BINDING_CELLS, cell_pass_table(tables, object->shell));
    prism_maps_bind(maps, object);
    cells_bind_textures(object, solid);
    return STATUS_OK;
}

enum status polygon_pass_draw(struct polygon_pass *pass, struct cell_pass *tables,
                              struct prism_maps *maps, struct picture *picture, double spacing,
                              bool solid, struct error *err) {
    enum status status = STATUS_OK;
    bool hardware = pass->method == SCENE_SLICING_HARDWARE;
    if (pass->count && !hardware)
        upload_corners(pass, picture->report);
    else if (pass->count)
        status = upload_cuts(pass, picture->report, err);
    picture->report->work.segments += pass->polygon_count;
    if (hardware)
        glBindTextureUnit(BINDING_CUTS, pass->cut_texture);
    glBindVertexArray(pass->array);
    glDisable(GL_CULL_FACE);
    uint32_t bound = UINT32_MAX;
    for (size_t r = 0; r < pass->run_count && status == STATUS_OK; r++) {
        const struct cell_run *run = &pass->runs[r];
        if (run->object != bound) {
            status = bind_object(pass, tables, maps, picture, run->object, spacing, solid, err);
            if (status != STATUS_OK)
                break;
            bound = run->object;
        }
        glDrawElements(GL_TRIANGLES, (GLsizei)run->count, GL_UNSIGNED_INT,
                       (const void *)(uintptr_t)(run->first * sizeof *pass->indices));
        picture->report->work.draws++;
    }
    pass->count = pass->index_count = pass->run_count = pass->polygon_count = 0;
    return status == STATUS_OK ? gl_check("drawing slices", err) : status;
}

enum status polygon_pass_draw_list(struct polygon_pass *pass, struct cell_pass *tables,
                                   struct prism_maps *maps, struct picture *picture, uint32_t index,
                                   double spacing, bool solid, const struct polygon_list *list,
                                   struct error *err) {
    enum status status = index_cuts(pass, list->most, picture->report, err);
    if (status == STATUS_OK)
        status = bind_object(pass, tables, maps, picture, index, spacing, solid, err);
    if (status != STATUS_OK)
        return status;
    glBindTextureUnit(BINDING_CUTS, list->cuts);
    glBindVertexArray(pass->array);
    glDisable(GL_CULL_FACE);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, list->command);
    glDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT, NULL);
    glBindBuffer(GL_DRAW_INDIRECT_BUFFER, 0);
    picture->report->work.draws++;
    return gl_check("drawing slices", err);
}
