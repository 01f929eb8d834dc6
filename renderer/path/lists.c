/* See lists.h. Sizes: a table holds BATCH_ENTRIES, or, where a plane may cut more, as many as all
 * prisms together may make in one plane. */
#include "renderer/path/lists.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/shell/grow.h"

enum {
    BATCH_ENTRIES = 1 << 18, /* 12 MB of tables, as much of indices */
    /* LIST_WIDE invocations share them; loops of two programs turn once for each. */
    PRISMS_MAX = 30000 * LIST_WIDE,
    PRISM_TETRA = 3
};

_Static_assert(LIST_FANS == SLICE_FANS, "what a prism makes in a plane");
_Static_assert(1 << LIST_BITS == LIST_BINS, "a bin for each digit");

struct entry {
    uint32_t prism, first, last, heights; /* `heights`: LIST_EVEN, or place of six depths */
};

struct plane_lists {
    GLuint entries[2], made[2]; /* of prisms; of a batch: sorted from one to the other */
    GLuint sums, batches, heights, fans, cuts, command, cut_texture;
    size_t room; /* of a batch's tables */
    GLint texels_max;
    GLint64 bytes_max;

    /* Of the picture. */
    struct slabs slabs;
    uint32_t index, count, capacity; /* object; entries of prisms; of a batch */
    int sorted;                      /* which of `entries` holds them in order */
    double center;
    uint64_t *group_total; /* entries in all planes of each group, the farthest group first */
};

struct plane_lists *plane_lists_create(void) {
    struct plane_lists *lists = calloc(1, sizeof *lists);
    if (!lists)
        return NULL;
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &lists->texels_max);
    glGetInteger64v(GL_MAX_SHADER_STORAGE_BLOCK_SIZE, &lists->bytes_max);
    glCreateBuffers(2, lists->entries);
    glCreateBuffers(2, lists->made);
    glCreateBuffers(1, &lists->sums);
    glCreateBuffers(1, &lists->batches);
    glCreateBuffers(1, &lists->heights);
    glCreateBuffers(1, &lists->fans);
    glCreateBuffers(1, &lists->cuts);
    glCreateBuffers(1, &lists->command);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &lists->cut_texture);
    glNamedBufferStorage(lists->batches, LIST_PLANES_MAX * 6 * sizeof(uint32_t), NULL, 0);
    glNamedBufferStorage(lists->command, 5 * sizeof(uint32_t), NULL, 0);

    struct slice_case cases[SLICE_CASES];
    uint32_t fans[SLICE_CASES][LIST_FANS] = {
        {0}}; /* 0: six times the same edge, which is nothing */
    slice_make_cases(cases);
    for (unsigned sides = 0; sides < SLICE_CASES; sides++) {
        if (slice_in_table(sides))
            fans[sides][0] = CUT_UNDECIDED;
        else
            slice_make_fans(&cases[sides], fans[sides]);
    }
    glNamedBufferStorage(lists->fans, sizeof fans, fans, 0);
    return lists;
}

void plane_lists_destroy(struct plane_lists *lists) {
    if (!lists)
        return;
    GLuint buffers[] = {lists->entries[0], lists->entries[1], lists->made[0], lists->made[1],
                        lists->sums,       lists->batches,    lists->heights, lists->fans,
                        lists->cuts,       lists->command};
    glDeleteBuffers(sizeof buffers / sizeof *buffers, buffers);
    glDeleteTextures(1, &lists->cut_texture);
    free(lists->group_total);
    free(lists);
}

/* ---- what the prisms say ---- */

struct gathered {
    struct entry *entries;
    double (*heights)[6];
    size_t height_count, height_capacity;
    uint64_t weight, most; /* entries in one plane if it cut all; in all planes of a group */
};

static void add_to_groups(struct plane_lists *lists, const struct entry *entry, uint64_t fans) {
    uint32_t planes = lists->slabs.count;
    uint32_t g0 = (planes - 1 - entry->last) / PLANE_LISTS_GROUP;
    uint32_t g1 = (planes - 1 - entry->first) / PLANE_LISTS_GROUP;
    for (uint32_t g = g0; g <= g1; g++) {
        uint32_t end = planes - g * PLANE_LISTS_GROUP;
        uint32_t begin = end > PLANE_LISTS_GROUP ? end - PLANE_LISTS_GROUP : 0;
        uint32_t low = entry->first > begin ? entry->first : begin;
        uint32_t high = entry->last + 1 < end ? entry->last + 1 : end;
        lists->group_total[g] += fans * (high - low);
    }
}

/* False where memory ran out. */
static bool gather(struct plane_lists *lists, const struct path_object *object,
                   const uint8_t *wanted, struct gathered *out) {
    uint32_t prisms = object->shell->tetra_count / PRISM_TETRA, planes = lists->slabs.count;
    uint32_t groups = (planes - 1) / PLANE_LISTS_GROUP + 1;
    out->entries = malloc((prisms + (size_t)1) * sizeof *out->entries);
    uint64_t *totals = calloc(groups, sizeof *totals);
    if (!out->entries || !totals) {
        free(totals);
        return false;
    }
    free(lists->group_total);
    lists->group_total = totals;
    for (uint32_t prism = 0; prism < prisms; prism++) {
        struct entry entry = {prism, 0, 0, LIST_EVEN};
        double height[6];
        if (!slab_cell_find(object->shell, &object->projection, &lists->slabs, PRISM_TETRA, prism,
                            wanted, &entry.first, &entry.last))
            continue;
        if (object->every_plane) {
            entry.first = 0;
            entry.last = planes - 1;
        }
        if (polygons_part(object, prism, height)) {
            void *list = out->heights;
            if (!list_grow(&list, out->height_count, 1, &out->height_capacity, sizeof height))
                return false;
            out->heights = list;
            entry.heights = (uint32_t)out->height_count;
            memcpy(out->heights[out->height_count++], height, sizeof height);
        }
        uint64_t fans = entry.heights == LIST_EVEN ? 1 : LIST_FANS;
        add_to_groups(lists, &entry, fans);
        out->weight += fans;
        out->entries[lists->count++] = entry;
    }
    for (uint32_t g = 0; g < groups; g++)
        out->most = totals[g] > out->most ? totals[g] : out->most;
    return true;
}

/* ---- the programs ---- */

static uint32_t parts(uint64_t count, uint32_t size) {
    return (uint32_t)((count + size - 1) / size);
}

static enum status use(struct picture *picture, enum gl_program_id id, GLuint *program,
                       uint32_t count, int batch, struct error *err) {
    enum status status = gl_programs_get(picture->programs, id, 0, program, &picture->cold, err);
    if (status != STATUS_OK)
        return status;
    glUseProgram(*program);
    glProgramUniform1ui(*program, 0, count);
    glProgramUniform1i(*program, 1, batch);
    return STATUS_OK;
}

static void bind(GLuint point, GLuint buffer) {
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, point, buffer);
}

static void run(uint32_t groups) {
    glDispatchCompute(groups, 1, 1);
    glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

static enum status scan(struct plane_lists *lists, struct picture *picture, uint32_t count,
                        struct error *err) {
    GLuint program;
    enum status status = use(picture, GL_PROGRAM_LISTS_SCAN, &program, count, -1, err);
    if (status != STATUS_OK)
        return status;
    bind(BINDING_LIST_SUMS, lists->sums);
    run(1);
    return STATUS_OK;
}

/* Sorts entries, of which there may be `count`, by their last plane, from `farthest` on over
 * `planes` planes; *from becomes the list that holds them. */
static enum status sort(struct plane_lists *lists, struct picture *picture, const GLuint list[2],
                        uint32_t count, int batch, uint32_t farthest, uint32_t planes, int *from,
                        struct error *err) {
    uint32_t chunks = parts(count, LIST_SORT_CHUNK);
    enum status status = STATUS_OK;
    *from = 0;
    for (uint32_t shift = 0; (planes - 1) >> shift && status == STATUS_OK; shift += LIST_BITS) {
        static const enum gl_program_id halves[2] = {GL_PROGRAM_LISTS_COUNT,
                                                     GL_PROGRAM_LISTS_SCATTER};
        for (int half = 0; half < 2 && status == STATUS_OK; half++) {
            GLuint program;
            status = use(picture, halves[half], &program, count, batch, err);
            if (status != STATUS_OK)
                break;
            glProgramUniform1ui(program, 2, farthest);
            glProgramUniform1ui(program, 3, shift);
            glProgramUniform1ui(program, 4, chunks);
            bind(BINDING_LIST_FROM, list[*from]);
            bind(BINDING_LIST_TO, list[1 - *from]);
            bind(BINDING_LIST_SUMS, lists->sums);
            bind(BINDING_LIST_BATCHES, lists->batches);
            run(parts(chunks, LIST_GROUP));
            if (half == 0)
                status = scan(lists, picture, chunks * LIST_BINS, err);
        }
        *from = 1 - *from;
    }
    return status;
}

/* ---- the picture ---- */

static void size_buffer(GLuint buffer, uint64_t bytes, const void *data) {
    glNamedBufferData(buffer, (GLsizeiptr)(bytes ? bytes : 16), data, GL_DYNAMIC_COPY);
}

/* Tables of a batch, kept for the next picture where they are large enough. */
static void make_room(struct plane_lists *lists) {
    if (lists->capacity <= lists->room)
        return;
    lists->room = lists->capacity;
    for (int i = 0; i < 2; i++)
        size_buffer(lists->made[i], lists->room * sizeof(struct entry), NULL);
    size_buffer(lists->cuts, lists->room * 3 * sizeof(uint32_t), NULL);
    glTextureBuffer(lists->cut_texture, GL_RGB32UI, lists->cuts);
}

enum status plane_lists_open(struct plane_lists *lists, struct picture *picture, uint32_t index,
                             const struct slabs *slabs, const uint8_t *wanted, bool *fit,
                             struct error *err) {
    const struct path_object *object = &picture->objects[index];
    struct gathered gathered = {0};
    enum status status = STATUS_OK;
    lists->slabs = *slabs;
    lists->index = index;
    lists->count = 0;
    lists->center = object->projection.view.h_row[3];
    *fit = object->shell->tetra_count / PRISM_TETRA <= PRISMS_MAX;
    if (!*fit)
        return STATUS_OK;
    if (!gather(lists, object, wanted, &gathered)) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for lists of prisms");
        goto done;
    }
    uint64_t capacity = gathered.most < BATCH_ENTRIES ? gathered.most : BATCH_ENTRIES;
    capacity = gathered.weight > capacity ? gathered.weight : capacity;
    /* The tables of 16 bytes an entry are the largest. */
    *fit = capacity <= (uint64_t)lists->texels_max &&
           capacity <= (uint64_t)lists->bytes_max / sizeof(struct entry) &&
           gathered.height_count <= (uint64_t)lists->bytes_max / sizeof *gathered.heights;
    if (!*fit)
        goto done;
    lists->capacity = (uint32_t)capacity;
    make_room(lists);
    size_t bytes = lists->count * sizeof *gathered.entries;
    size_t height_bytes = gathered.height_count * sizeof *gathered.heights;
    size_buffer(lists->entries[0], bytes, gathered.entries);
    size_buffer(lists->entries[1], bytes, NULL);
    size_buffer(lists->heights, height_bytes, gathered.heights);
    picture->report->work.upload_bytes += bytes + height_bytes;
    uint32_t longest = lists->count > lists->capacity ? lists->count : lists->capacity;
    uint32_t sort_sums = LIST_BINS * parts(longest, LIST_SORT_CHUNK);
    uint32_t chunk_sums = parts(lists->count, LIST_CHUNK);
    size_buffer(lists->sums, (sort_sums > chunk_sums ? sort_sums : chunk_sums) * sizeof(uint32_t),
                NULL);
    status = sort(lists, picture, lists->entries, lists->count, -1, slabs->count - 1, slabs->count,
                  &lists->sorted, err);
    if (status == STATUS_OK)
        status = gl_check("sorting prisms", err);
done:
    free(gathered.entries);
    free(gathered.heights);
    return status;
}

/* An entry for each plane of each prism, sorted by plane; *from: which of `made` holds them. */
static enum status make_batch(struct plane_lists *lists, struct picture *picture, int batch,
                              uint32_t most, uint32_t begin, uint32_t end, int *from,
                              struct error *err) {
    uint32_t chunks = parts(lists->count, LIST_CHUNK);
    enum status status = STATUS_OK;
    for (int step = 0; step < 2 && status == STATUS_OK; step++) {
        GLuint program;
        status = use(picture, step ? GL_PROGRAM_LISTS_EXPAND : GL_PROGRAM_LISTS_SUMS, &program,
                     lists->count, batch, err);
        if (status != STATUS_OK)
            break;
        bind(BINDING_LIST_FROM, lists->entries[lists->sorted]);
        bind(BINDING_LIST_TO, lists->made[0]);
        bind(BINDING_LIST_SUMS, lists->sums);
        bind(BINDING_LIST_BATCHES, lists->batches);
        run(parts(chunks, LIST_GROUP));
        if (step == 0)
            status = scan(lists, picture, chunks, err);
    }
    if (status == STATUS_OK)
        status = sort(lists, picture, lists->made, most, batch, end - 1, end - begin, from, err);
    return status;
}

static enum status finish_batch(struct plane_lists *lists, struct picture *picture, int batch,
                                uint32_t most, uint32_t begin, int from, struct error *err) {
    GLuint program;
    enum status status = use(picture, GL_PROGRAM_LISTS_FINISH, &program, most, batch, err);
    if (status != STATUS_OK)
        return status;
    glProgramUniform1ui(program, 2, begin);
    glProgramUniform1ui(program, 3, lists->slabs.count);
    glProgramUniform3d(program, LOCATION_LIST_PLANES, lists->slabs.low, lists->slabs.high,
                       lists->center);
    bind(BINDING_LIST_FROM, lists->made[from]);
    bind(BINDING_LIST_DRAW, lists->command);
    bind(BINDING_LIST_BATCHES, lists->batches);
    bind(BINDING_LIST_HEIGHTS, lists->heights);
    bind(BINDING_LIST_FANS, lists->fans);
    bind(BINDING_LIST_CUTS, lists->cuts);
    glDispatchCompute(parts(most, LIST_GROUP), 1, 1);
    glMemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_COMMAND_BARRIER_BIT |
                    GL_SHADER_STORAGE_BARRIER_BIT);
    return STATUS_OK;
}

enum status plane_lists_draw(struct plane_lists *lists, struct polygon_pass *pass,
                             struct cell_pass *tables, struct prism_maps *maps,
                             struct picture *picture, uint32_t begin, uint32_t end, bool solid,
                             struct error *err) {
    uint64_t total = lists->group_total[(lists->slabs.count - end) / PLANE_LISTS_GROUP];
    if (total == 0)
        return STATUS_OK;
    GLuint program;
    enum status status = use(picture, GL_PROGRAM_LISTS_BATCHES, &program, lists->count, -1, err);
    if (status != STATUS_OK)
        return status;
    glProgramUniform2ui(program, 2, begin, end);
    glProgramUniform1ui(program, 3, lists->capacity);
    bind(BINDING_LIST_FROM, lists->entries[lists->sorted]);
    bind(BINDING_LIST_BATCHES, lists->batches);
    run(1);

    /* A batch ends where the next plane would not fit, so two in a row hold more than `capacity`.
     */
    uint64_t batches = total <= lists->capacity ? 1 : 2 * parts(total, lists->capacity) - 1;
    uint32_t most = (uint32_t)(total < lists->capacity ? total : lists->capacity);
    batches = batches < LIST_PLANES_MAX ? batches : LIST_PLANES_MAX;
    double spacing = (lists->slabs.high - lists->slabs.low) / lists->slabs.count;
    struct polygon_list list = {lists->cut_texture, lists->command, most};
    for (uint64_t b = 0; b < batches && status == STATUS_OK; b++) {
        int from;
        status = make_batch(lists, picture, (int)b, most, begin, end, &from, err);
        if (status == STATUS_OK)
            status = finish_batch(lists, picture, (int)b, most, begin, from, err);
        if (status == STATUS_OK)
            status = polygon_pass_draw_list(pass, tables, maps, picture, lists->index, spacing,
                                            solid, &list, err);
    }
    picture->report->work.segments += total;
    return status;
}
