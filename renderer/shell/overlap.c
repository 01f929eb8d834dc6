/* Counting stretches. A stretch of a ray within a shell lies between a boundary face through which
 * the ray enters and one through which it leaves; the A-buffer gives both, sorted, for each sample.
 * Going through them with a count for each shell tells how many stretches are open at once. Entries
 * alone tell where nothing can overlap: where the ray has one, none that lies behind an opaque base
 * counting. Exits are drawn at the other samples only, so most pictures draw none.
 *
 * Shells that overlap on some ray must be walked together, and so must shells each of which lies
 * before the other on some ray: both are cycles of the relation "begins before the other has ended
 * for good". Its strongly connected components are the groups, and what is left is an order. Within
 * a group a joint walk is needed only at samples where something overlaps or several shells meet;
 * all others are drawn by plain walks. Samples are taken in blocks of 4 x 4, since a rasteriser
 * shades about as many together.
 *
 * The A-buffer lets exits be a millionth nearer than they are (abuffer.c), so that what only
 * touches does not overlap. */
#include "renderer/shell/overlap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shell/grow.h"

enum { BLOCK = 4 };

struct scan {
    const struct overlap_shell *shells;
    uint32_t count;
    uint32_t first_cell[OVERLAP_SHELLS_MAX + 1];
    int width, height;
    struct abuffer *buffer;
    struct abuffer_list list;
    struct eye_cells eye[OVERLAP_SHELLS_MAX]; /* where the eye stands */
    size_t guess[OVERLAP_SHELLS_MAX];
    uint32_t starts[OVERLAP_SHELLS_MAX], all_starts;
    uint64_t fragments[OVERLAP_SHELLS_MAX]; /* entries of each, and those in the first bands */
    uint64_t below[OVERLAP_SHELLS_MAX][ABUFFER_BANDS];
    struct entries entries[OVERLAP_SHELLS_MAX];
    uint8_t *candidate; /* samples where more than one stretch may be seen */
    uint64_t
        before[OVERLAP_SHELLS_MAX]; /* bits: shells that end, somewhere, after this one begins */
    uint32_t depth[OVERLAP_SHELLS_MAX]; /* most stretches of each that are open at once */
    int deepest;
    bool any;    /* candidates */
    bool failed; /* memory ran out */
};

static uint32_t shell_of(const struct scan *scan, uint32_t node) {
    uint32_t s = 0;
    while (node >> 2 >= scan->first_cell[s + 1])
        s++;
    return s;
}

/* Where the ray goes through an opaque base. */
static bool ends_ray(const struct scan *scan, uint32_t s, uint32_t node) {
    uint32_t cell = (node >> 2) - scan->first_cell[s];
    return scan->shells[s].has_base && IS_BOTTOM(cell, node & 3);
}

static enum status out_of_memory(struct error *err) {
    return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for where rays enter");
}

static size_t sample_count(const struct scan *scan) {
    return (size_t)scan->width * (size_t)scan->height;
}

/* Entries of a shell: its faces, and one at the eye where that stands on sides. */
static size_t entries_most(const struct scan *scan, uint32_t s) {
    return scan->fragments[s] + (scan->eye[s].count ? sample_count(scan) : 0);
}

/* What a sample's ray meets, nearest first: what it enters where the eye stands on sides of cells,
 * then the faces of the A-buffer. */
static bool gather(struct scan *scan, size_t sample) {
    struct abuffer_list *list = &scan->list;
    if (!abuffer_gather(scan->buffer, sample, list))
        return false;
    for (uint32_t s = 0; s < scan->count; s++) {
        if (scan->eye[s].count == 0)
            continue;
        uint32_t link = entries_at_eye(&scan->eye[s], &scan->shells[s].projection->view, sample,
                                       &scan->guess[s]);
        if (link == LINK_NONE)
            continue;
        void *grown = list->fragment;
        if (!list_grow(&grown, list->count, 1, &list->capacity, sizeof *list->fragment))
            return false;
        list->fragment = grown;
        memmove(list->fragment + 1, list->fragment, list->count++ * sizeof *list->fragment);
        list->fragment[0] = (struct abuffer_fragment){
            .key = -INFINITY, /* -1 / H: the eye */
            .node_enters = ((scan->first_cell[s] << 2) + link) << 1 | 1,
        };
    }
    return true;
}

/* Copies for the threads of the A-buffer's bands; NULL where memory ran out. */
static struct scan *make_parts(const struct scan *scan) {
    struct scan *part = calloc(ABUFFER_BANDS, sizeof *part);
    for (int b = 0; b < ABUFFER_BANDS && part; b++) {
        part[b] = *scan;
        part[b].list = (struct abuffer_list){0};
    }
    return part;
}

/* The entries of the samples from `begin` on. */
static bool read_samples(struct scan *scan, size_t begin, size_t end) {
    for (size_t p = begin; p < end; p++) {
        for (uint32_t s = 0; s < scan->count; s++)
            scan->entries[s].first[p] = (uint32_t)scan->entries[s].count;
        if (!gather(scan, p))
            return false;
        uint32_t seen = scan->all_starts;
        bool hidden = false;
        for (size_t i = 0; i < scan->list.count; i++) {
            uint32_t node = scan->list.fragment[i].node_enters >> 1;
            uint32_t s = scan->count == 1 ? 0 : shell_of(scan, node);
            struct entries *entries = &scan->entries[s];
            entries->entry[entries->count++] = node - (scan->first_cell[s] << 2);
            hidden = hidden || ends_ray(scan, s, node);
            seen += !hidden;
        }
        scan->candidate[p] = seen > 1;
        scan->any = scan->any || seen > 1;
    }
    return true;
}

static void band_samples(const struct scan *scan, int band, size_t *begin, size_t *end) {
    int rows[2];
    abuffer_band_rows(scan->buffer, band, &rows[0], &rows[1]);
    *begin = (size_t)rows[0] * (size_t)scan->width;
    *end = (size_t)rows[1] * (size_t)scan->width;
}

static void read_band(void *user, int band) {
    struct scan *scan = (struct scan *)user + band;
    size_t begin, end;
    band_samples(scan, band, &begin, &end);
    scan->failed = !read_samples(scan, begin, end);
    free(scan->list.fragment);
}

/* Each band's entries begin where those of the bands below it end. */
static bool read_bands(struct scan *scan) {
    struct scan *part = make_parts(scan);
    if (!part)
        return false;
    for (int b = 0; b < ABUFFER_BANDS; b++)
        for (uint32_t s = 0; s < scan->count; s++)
            part[b].entries[s].count = scan->below[s][b];
    abuffer_for_bands(scan->buffer, read_band, part);
    for (int b = 0; b < ABUFFER_BANDS; b++) {
        scan->failed = scan->failed || part[b].failed;
        scan->any = scan->any || part[b].any;
    }
    for (uint32_t s = 0; s < scan->count; s++)
        scan->entries[s].count = scan->fragments[s];
    free(part);
    return !scan->failed;
}

/* Every shell's entries, sample by sample, and the samples where more than one may be seen. */
static enum status read_entries(struct scan *scan, struct error *err) {
    size_t samples = sample_count(scan);
    bool at_eye = false; /* entries that are no fragments */
    for (uint32_t s = 0; s < scan->count; s++) {
        struct entries *entries = &scan->entries[s];
        entries->first = malloc((samples + 1) * sizeof *entries->first);
        entries->entry = malloc((entries_most(scan, s) + 1) * sizeof *entries->entry);
        if (!entries->first || !entries->entry)
            return out_of_memory(err);
        at_eye = at_eye || scan->eye[s].count > 0;
    }
    scan->candidate = calloc(samples + 1, 1);
    if (!scan->candidate)
        return out_of_memory(err);
    if (!(at_eye ? read_samples(scan, 0, samples) : read_bands(scan)))
        return out_of_memory(err);
    for (uint32_t s = 0; s < scan->count; s++)
        scan->entries[s].first[samples] = (uint32_t)scan->entries[s].count;
    return STATUS_OK;
}

/* What one sample's ray meets until it ends: bits of the shells. */
struct meeting {
    uint64_t seen;    /* shells */
    uint64_t overlap; /* shells with a stretch that overlaps another one */
};

/* Goes along a sample's ray; notes depths and relations. */
static bool follow(struct scan *scan, size_t sample, struct meeting *meeting) {
    uint32_t open[OVERLAP_SHELLS_MAX] = {0}, all_open = 0;
    uint64_t now = 0; /* shells that are open */
    *meeting = (struct meeting){0};
    if (!gather(scan, sample))
        return false;
    size_t begin = 0, end = scan->list.count + scan->all_starts;
    for (uint32_t s = 0, left = 0; begin < end; begin++) {
        bool enters = true;
        if (begin < scan->all_starts) { /* the eye stands in it */
            for (; left == scan->starts[s]; left = 0)
                s++;
            left++;
        } else {
            const struct abuffer_fragment *at = &scan->list.fragment[begin - scan->all_starts];
            uint32_t node = at->node_enters >> 1;
            enters = at->node_enters & 1;
            s = shell_of(scan, node);
            if (ends_ray(scan, s, node))
                break;
        }
        uint64_t bit = (uint64_t)1 << s;
        if (!enters) {
            /* What is left without having been entered was entered where the eye's plane cuts it.
             */
            if (open[s] > 0) {
                all_open--;
                if (--open[s] == 0)
                    now &= ~bit;
            }
            continue;
        }
        for (uint32_t other = 0; other < scan->count; other++)
            if (meeting->seen >> other & 1)
                scan->before[other] |= bit;
        meeting->seen |= bit;
        now |= bit;
        open[s]++;
        if (++all_open > 1) {
            meeting->overlap |= now;
            for (uint32_t other = 0; other < scan->count; other++)
                if (now >> other & 1)
                    scan->before[s] |= (uint64_t)1 << other;
        }
        if (open[s] > scan->depth[s])
            scan->depth[s] = open[s];
        if ((int)all_open > scan->deepest)
            scan->deepest = (int)all_open;
    }
    return true;
}

static void follow_band(void *user, int band) {
    struct scan *scan = (struct scan *)user + band;
    size_t begin, end;
    band_samples(scan, band, &begin, &end);
    struct meeting meeting;
    for (size_t p = begin; p < end && !scan->failed; p++)
        scan->failed = scan->candidate[p] && !follow(scan, p, &meeting);
    free(scan->list.fragment);
}

/* All candidates. */
static bool follow_all(struct scan *scan) {
    struct scan *part = make_parts(scan);
    if (!part)
        return false;
    abuffer_for_bands(scan->buffer, follow_band, part);
    for (int b = 0; b < ABUFFER_BANDS; b++) {
        scan->failed = scan->failed || part[b].failed;
        scan->deepest = part[b].deepest > scan->deepest ? part[b].deepest : scan->deepest;
        for (uint32_t s = 0; s < scan->count; s++) {
            scan->before[s] |= part[b].before[s];
            scan->depth[s] = part[b].depth[s] > scan->depth[s] ? part[b].depth[s] : scan->depth[s];
        }
    }
    free(part);
    return !scan->failed;
}

/* `before` made transitive (Warshall 1962). */
static void close_relation(struct scan *scan) {
    for (uint32_t k = 0; k < scan->count; k++)
        for (uint32_t i = 0; i < scan->count; i++)
            if (scan->before[i] >> k & 1)
                scan->before[i] |= scan->before[k];
}

/* The shells that must be walked together with `s`, as bits. */
static uint64_t group_of(const struct scan *scan, uint32_t s) {
    uint64_t group = (uint64_t)1 << s;
    for (uint32_t other = 0; other < scan->count; other++)
        if ((scan->before[s] >> other & 1) && (scan->before[other] >> s & 1))
            group |= (uint64_t)1 << other;
    return group;
}

/* Marks the samples, and the blocks around them, where a group needs a joint walk. */
static enum status mark_group(struct scan *scan, uint64_t group, bool at_eye, uint8_t *joint,
                              uint64_t *overlapping, struct error *err) {
    size_t width = (size_t)scan->width, height = (size_t)scan->height;
    for (size_t p = 0; p < width * height; p++) {
        if (!scan->candidate[p])
            continue;
        struct meeting meeting;
        if (!follow(scan, p, &meeting))
            return out_of_memory(err);
        uint64_t seen = meeting.seen & group;
        *overlapping += (meeting.overlap & group) != 0;
        if ((seen & (seen - 1)) == 0 && (meeting.overlap & group) == 0)
            continue;
        size_t x = p % width / BLOCK * BLOCK, y = p / width / BLOCK * BLOCK;
        size_t wide = x + BLOCK < width ? BLOCK : width - x;
        for (size_t row = y; row < y + BLOCK && row < height; row++)
            memset(joint + row * width + x, 1, wide);
    }
    if (at_eye) /* a plain walk would begin there at every sample */
        memset(joint, 1, width * height);
    return STATUS_OK;
}

/* The entries of a plain walk, without the samples of the joint one. */
static void leave_out(const struct scan *scan, const uint8_t *joint, struct entries *entries) {
    size_t samples = sample_count(scan);
    uint32_t used = 0;
    for (size_t p = 0; p < samples; p++) {
        uint32_t begin = entries->first[p], end = entries->first[p + 1];
        entries->first[p] = used;
        for (uint32_t i = begin; i < end && !joint[p]; i++)
            entries->entry[used++] = entries->entry[i];
    }
    entries->first[samples] = used;
    entries->count = used;
}

static uint32_t bits_of(float value) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* The entries of all shells of a draw, in order along each ray, at the joint samples. */
static enum status make_doors(struct scan *scan, const uint8_t *joint, struct overlap_draw *draw,
                              struct error *err) {
    size_t samples = sample_count(scan);
    bool orthographic = scan->shells[0].projection->view.orthographic;
    uint32_t local[OVERLAP_SHELLS_MAX];
    uint64_t most = 0;
    memset(local, 0xff, sizeof local);
    for (uint32_t i = 0; i < draw->shell_count; i++) {
        local[draw->shell[i]] = i;
        most += entries_most(scan, draw->shell[i]) + scan->starts[draw->shell[i]];
    }
    draw->entries.first = malloc((samples + 1) * sizeof *draw->entries.first);
    draw->door = malloc((most + 1) * sizeof *draw->door);
    if (!draw->entries.first || !draw->door)
        return out_of_memory(err);
    uint32_t used = 0;
    for (uint32_t i = 0; i < draw->shell_count; i++)
        for (uint32_t k = 0; k < scan->starts[draw->shell[i]]; k++) {
            draw->door[used][0] = ENTRY_WORD(i, scan->eye[draw->shell[i]].within[k] << 2);
            draw->door[used++][1] = bits_of(-1);
        }
    draw->starts = used;
    for (size_t p = 0; p < samples; p++) {
        draw->entries.first[p] = used;
        if (!joint[p])
            continue;
        if (!gather(scan, p))
            return out_of_memory(err);
        for (size_t i = 0; i < scan->list.count; i++) {
            const struct abuffer_fragment *at = &scan->list.fragment[i];
            uint32_t node = at->node_enters >> 1, s = shell_of(scan, node);
            if (!(at->node_enters & 1) || local[s] == UINT32_MAX)
                continue;
            double h = orthographic ? at->key : -1 / at->key;
            draw->door[used][0] = ENTRY_WORD(local[s], node - (scan->first_cell[s] << 2));
            draw->door[used++][1] = bits_of((float)(h - 1));
        }
    }
    draw->entries.first[samples] = used;
    draw->entries.count = used;
    return STATUS_OK;
}

/* The marked blocks as rectangles: runs of each row of blocks, which grow upward while they stay
 * the same. */
static enum status make_area(const struct scan *scan, const uint8_t *joint,
                             struct overlap_draw *draw, struct error *err) {
    uint32_t width = (uint32_t)scan->width, height = (uint32_t)scan->height;
    size_t capacity = 0, below = 0; /* rectangles from `below` on end at this row */
    for (uint32_t y = 0; y < height; y += BLOCK) {
        size_t row = draw->area_count, search = below;
        uint32_t top = y + BLOCK < height ? y + BLOCK : height;
        for (uint32_t x = 0; x < width;) {
            uint32_t begin = x;
            while (x < width && joint[(size_t)y * width + x])
                x++;
            if (x == begin) {
                x++;
                continue;
            }
            while (search < row && draw->area[search][0] < begin)
                search++;
            if (search < row && draw->area[search][0] == begin && draw->area[search][2] == x &&
                draw->area[search][3] == y) {
                draw->area[search][3] = top;
                continue;
            }
            if (draw->area_count == capacity) {
                capacity = capacity ? 2 * capacity : 64;
                void *grown = realloc(draw->area, capacity * sizeof *draw->area);
                if (!grown)
                    return out_of_memory(err);
                draw->area = grown;
            }
            uint32_t *area = draw->area[draw->area_count++];
            area[0] = begin;
            area[1] = y;
            area[2] = x;
            area[3] = top;
        }
        /* Those that grew stay in place: they may grow again unless newer ones were begun. */
        below = draw->area_count > row ? row : below;
    }
    return STATUS_OK;
}

/* A plain walk through a shell; what `scan` knows of its entries goes over to it. */
static void add_plain(struct scan *scan, uint32_t s, struct overlap *overlap) {
    struct entries *entries = &scan->entries[s];
    entries->start = scan->starts[s] ? scan->eye[s].within[0] << 2 : LINK_NONE;
    entries->starts = scan->starts[s];
    overlap->draw[overlap->draw_count++] = (struct overlap_draw){
        .shell_count = 1, .shell = {s}, .slots = {scan->depth[s]}, .entries = *entries};
    *entries = (struct entries){.start = LINK_NONE};
}

/* Plain walks where they do, a joint one elsewhere. */
static enum status add_joint(struct scan *scan, uint64_t group, uint32_t slots,
                             struct overlap *overlap, struct error *err) {
    struct overlap_draw draw = {.joint = true, .entries.start = LINK_NONE};
    bool at_eye = false;
    for (uint32_t s = 0; s < scan->count; s++) {
        if (!(group >> s & 1))
            continue;
        at_eye |= scan->starts[s] > 0;
        draw.slots[draw.shell_count] = scan->depth[s];
        draw.shell[draw.shell_count++] = s;
    }
    uint64_t overlapping = 0;
    uint8_t *joint = calloc(sample_count(scan) + 1, 1);
    if (!joint)
        return out_of_memory(err);
    enum status status = mark_group(scan, group, at_eye, joint, &overlapping, err);
    overlap->samples += overlapping;
    const struct overlap_shell *alone = &scan->shells[draw.shell[0]];
    if (status == STATUS_OK && draw.shell_count == 1 &&
        (slots > SLOTS_MAX || alone->fp64 || alone->solid)) {
        overlap->approximate += alone->solid ? 0 : overlapping;
        add_plain(scan, draw.shell[0], overlap);
    } else if (status == STATUS_OK) {
        for (uint32_t i = 0; i < draw.shell_count && !at_eye; i++) {
            leave_out(scan, joint, &scan->entries[draw.shell[i]]);
            if (scan->entries[draw.shell[i]].count > 0)
                add_plain(scan, draw.shell[i], overlap);
        }
        status = make_doors(scan, joint, &draw, err);
        if (status == STATUS_OK)
            status = make_area(scan, joint, &draw, err);
        overlap->draw[overlap->draw_count++] = draw;
    }
    free(joint);
    return status;
}

/* The groups, farthest first: those that begin before no other group that is left. */
static enum status make_draws(struct scan *scan, struct overlap *overlap, struct error *err) {
    uint64_t left = scan->count == 64 ? UINT64_MAX : ((uint64_t)1 << scan->count) - 1;
    uint64_t order[OVERLAP_SHELLS_MAX];
    size_t groups = 0;
    while (left) {
        uint32_t s = 0;
        while (!(left >> s & 1) || (scan->before[s] & left & ~group_of(scan, s)))
            s++;
        order[groups++] = group_of(scan, s);
        left &= ~order[groups - 1];
    }
    for (size_t g = 0; g < groups; g++) {
        uint32_t slots = 0, members = 0;
        for (uint32_t s = 0; s < scan->count; s++) {
            slots += order[g] >> s & 1 ? scan->depth[s] : 0;
            members += order[g] >> s & 1;
        }
        overlap->too_many |= members > 1 && slots > SLOTS_MAX;
    }
    enum status status = STATUS_OK;
    for (size_t g = 0; g < groups && status == STATUS_OK && !overlap->too_many; g++) {
        uint32_t slots = 0, only = 0;
        for (uint32_t s = 0; s < scan->count; s++) {
            slots += order[g] >> s & 1 ? scan->depth[s] : 0;
            only = order[g] >> s & 1 ? s : only;
        }
        if (slots == 1)
            add_plain(scan, only, overlap);
        else
            status = add_joint(scan, order[g], slots, overlap, err);
    }
    return status;
}

static enum status draw_faces(struct scan *scan, bool enters, struct error *err) {
    enum status status = STATUS_OK;
    for (uint32_t s = 0; s < scan->count && status == STATUS_OK; s++) {
        uint64_t before[ABUFFER_BANDS], below = 0;
        for (int b = 0; b < ABUFFER_BANDS; b++)
            before[b] = abuffer_band_fragments(scan->buffer, b);
        status = entries_draw(scan->shells[s].shell, scan->shells[s].projection, &scan->eye[s],
                              scan->first_cell[s], enters, scan->buffer, err);
        for (int b = 0; b < ABUFFER_BANDS && enters; b++) {
            scan->below[s][b] = below;
            below += abuffer_band_fragments(scan->buffer, b) - before[b];
            scan->fragments[s] = below;
        }
    }
    return status;
}

enum status overlap_find(const struct overlap_shell *shells, uint32_t count, uint8_t *met,
                         struct overlap *overlap, struct error *err) {
    *overlap = (struct overlap){0};
    if (count > OVERLAP_SHELLS_MAX)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "at most %d semi-transparent shells can be drawn together",
                           OVERLAP_SHELLS_MAX);
    struct scan *scan = calloc(1, sizeof *scan);
    if (!scan)
        return out_of_memory(err);
    const struct view *view = &shells[0].projection->view;
    scan->shells = shells;
    scan->count = count;
    scan->width = view->width;
    scan->height = view->height;
    scan->buffer = abuffer_create(view->width, view->height);
    /* At most two draws a group of several shells, and one more for each of them. */
    overlap->draw = calloc(2 * (size_t)count, sizeof *overlap->draw);
    enum status status = scan->buffer && overlap->draw ? STATUS_OK : out_of_memory(err);
    uint64_t cells = 0;
    bool at_eye = false;
    for (uint32_t s = 0; s < count && status == STATUS_OK; s++) {
        cells += shells[s].shell->tetra_count;
        if (cells >= 1u << 27) /* ENTRY_WORD */
            status = error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                                 "more than 2^27 tetrahedra to walk through");
        scan->first_cell[s + 1] = (uint32_t)cells;
        scan->depth[s] = 1;
        if (!entries_find_eye(shells[s].shell, shells[s].projection, &scan->eye[s]))
            status = out_of_memory(err);
        scan->starts[s] = scan->eye[s].within_count;
        scan->all_starts += scan->starts[s];
        at_eye |= scan->starts[s] > 0 || scan->eye[s].count > 0;
    }
    if (status == STATUS_OK)
        status = draw_faces(scan, true, err);
    if (status == STATUS_OK)
        status = read_entries(scan, err);
    if (status == STATUS_OK && met && at_eye)
        memset(met, 1, sample_count(scan));
    else if (status == STATUS_OK && met)
        abuffer_mark(scan->buffer, met);
    if (status == STATUS_OK && scan->any) {
        abuffer_restrict(scan->buffer, scan->candidate);
        status = draw_faces(scan, false, err);
        if (status == STATUS_OK && !follow_all(scan))
            status = out_of_memory(err);
    }
    if (status == STATUS_OK) {
        close_relation(scan);
        overlap->fragments = abuffer_fragments(scan->buffer);
        overlap->deepest = scan->deepest;
        status = make_draws(scan, overlap, err);
    }
    for (uint32_t s = 0; s < count; s++) {
        entries_finish(&scan->entries[s]);
        free(scan->eye[s].list);
    }
    free(scan->candidate);
    free(scan->list.fragment);
    abuffer_destroy(scan->buffer);
    free(scan);
    return status;
}

void overlap_finish(struct overlap *overlap) {
    for (size_t i = 0; i < overlap->draw_count; i++) {
        entries_finish(&overlap->draw[i].entries);
        free(overlap->draw[i].door);
        free(overlap->draw[i].area);
    }
    free(overlap->draw);
    *overlap = (struct overlap){0};
}
