/* A-buffer over boundary faces (Cook et al. 2004, section 3.2).
 *
 * Only an exit followed by an entry is a relation: whatever lies between an entry and an exit is
 * ordered by shared faces. Faces that touch (where neighbours could not be linked) meet at one
 * depth up to rounding, so exits count as nearer by a billionth: some 1e6 roundings of a key, and
 * far less than the thinnest shell. (With a millionth, rays that leave a shell after less than that
 * left it before they entered it, and cells that lie in order were a cycle: 6 of a sphere's 6,624
 * near its pole at 4096 x 4096 samples.) */
#include "renderer/shell/abuffer.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shell/grow.h"

#define EXIT_BIAS 1e-9

/* Below this many samples a thread costs more than it gains. */
enum { THREADS_FROM = 1 << 16 };

struct abuffer {
    int width, height;
    const uint8_t *only; /* NULL: every sample is drawn to */
    uint32_t *head;      /* of each sample, the index + 1 in its band; 0: none */
    struct band {
        int begin, end; /* rows */
        struct abuffer_fragment *fragment;
        uint64_t count, capacity;
    } band[ABUFFER_BANDS];
};

struct abuffer *abuffer_create(int width, int height) {
    struct abuffer *buffer = calloc(1, sizeof *buffer);
    if (!buffer)
        return NULL;
    buffer->width = width;
    buffer->height = height;
    for (int b = 0; b < ABUFFER_BANDS; b++) {
        buffer->band[b].begin = (int)((int64_t)height * b / ABUFFER_BANDS);
        buffer->band[b].end = (int)((int64_t)height * (b + 1) / ABUFFER_BANDS);
    }
    buffer->head = calloc((size_t)width * (size_t)height, sizeof *buffer->head);
    if (!buffer->head) {
        free(buffer);
        return NULL;
    }
    return buffer;
}

void abuffer_destroy(struct abuffer *buffer) {
    if (!buffer)
        return;
    free(buffer->head);
    for (int b = 0; b < ABUFFER_BANDS; b++)
        free(buffer->band[b].fragment);
    free(buffer);
}

void abuffer_restrict(struct abuffer *buffer, const uint8_t *only) {
    buffer->only = only;
}

uint64_t abuffer_fragments(const struct abuffer *buffer) {
    uint64_t count = 0;
    for (int b = 0; b < ABUFFER_BANDS; b++)
        count += buffer->band[b].count;
    return count;
}

uint64_t abuffer_band_fragments(const struct abuffer *buffer, int band) {
    return buffer->band[band].count;
}

void abuffer_band_rows(const struct abuffer *buffer, int band, int *begin, int *end) {
    *begin = buffer->band[band].begin;
    *end = buffer->band[band].end;
}

void abuffer_mark(const struct abuffer *buffer, uint8_t *met) {
    size_t samples = (size_t)buffer->width * (size_t)buffer->height;
    for (size_t i = 0; i < samples; i++)
        met[i] |= buffer->head[i] != 0;
}

struct band_call {
    void (*work)(void *user, int band);
    void *user;
    int band;
};

static void *call_band(void *data) {
    struct band_call *call = data;
    call->work(call->user, call->band);
    return NULL;
}

void abuffer_for_bands(const struct abuffer *buffer, void (*work)(void *user, int band),
                       void *user) {
    struct band_call call[ABUFFER_BANDS];
    pthread_t thread[ABUFFER_BANDS];
    bool started[ABUFFER_BANDS] = {false};
    bool large = (size_t)buffer->width * (size_t)buffer->height >= THREADS_FROM;
    for (int b = 1; b < ABUFFER_BANDS; b++) {
        call[b] = (struct band_call){work, user, b};
        started[b] = large && pthread_create(&thread[b], NULL, call_band, &call[b]) == 0;
    }
    work(user, 0);
    for (int b = 1; b < ABUFFER_BANDS; b++)
        if (started[b])
            pthread_join(thread[b], NULL);
        else
            work(user, b); /* small, or no thread to be had: the same work, later */
}

static bool reserve(struct band *band, uint64_t more) {
    if (band->count + more <= band->capacity)
        return true;
    uint64_t capacity = band->capacity ? band->capacity * 2 : 1 << 15;
    while (capacity < band->count + more)
        capacity *= 2;
    if (capacity >= UINT32_MAX)
        return false;
    struct abuffer_fragment *grown = realloc(band->fragment, capacity * sizeof *grown);
    if (!grown)
        return false;
    band->fragment = grown;
    band->capacity = capacity;
    return true;
}

/* A convex polygon's edges, ordered from the lower end, so that faces sharing an edge share the
 * crossing to the bit. */
struct edge {
    double x, y, top, slope;
};

static void find_edges(double corner[4][3], int count, struct edge edge[4]) {
    for (int i = 0; i < count; i++) {
        const double *a = corner[i], *b = corner[i + 1 < count ? i + 1 : 0];
        const double *lower = a[1] <= b[1] ? a : b, *upper = a[1] <= b[1] ? b : a;
        edge[i] = (struct edge){lower[0], lower[1], upper[1],
                                (upper[0] - lower[0]) / (upper[1] - lower[1])};
    }
}

/* The sample centres y + 1/2 = `row` of a polygon's scan line, as a half-open range. */
static void scan_range(const struct edge edge[4], int count, double row, double *low,
                       double *high) {
    *low = INFINITY;
    *high = -INFINITY;
    for (int i = 0; i < count; i++) {
        const struct edge *e = &edge[i];
        if (!(e->y <= row && row < e->top))
            continue;
        double x = e->x + (row - e->y) * e->slope;
        *low = x < *low ? x : *low;
        *high = x > *high ? x : *high;
    }
}

enum status abuffer_draw(struct abuffer *buffer, const struct projection *projection,
                         const uint32_t vertex[3], uint32_t node, bool enters, struct error *err) {
    enum status status = STATUS_OK;
    for (int b = 0; b < ABUFFER_BANDS && status == STATUS_OK; b++)
        status = abuffer_draw_band(buffer, b, projection, vertex, node, enters, err);
    return status;
}

enum status abuffer_draw_band(struct abuffer *buffer, int index,
                              const struct projection *projection, const uint32_t vertex[3],
                              uint32_t node, bool enters, struct error *err) {
    struct band *band = &buffer->band[index];
    double corner[4][3];
    int count = project_face(projection, vertex, corner);
    if (count == 0)
        return STATUS_OK;
    double y_low = INFINITY, y_high = -INFINITY, x_low = INFINITY, x_high = -INFINITY;
    for (int i = 0; i < count; i++) {
        x_low = corner[i][0] < x_low ? corner[i][0] : x_low;
        x_high = corner[i][0] > x_high ? corner[i][0] : x_high;
        y_low = corner[i][1] < y_low ? corner[i][1] : y_low;
        y_high = corner[i][1] > y_high ? corner[i][1] : y_high;
    }
    double first_y = fmax(band->begin, ceil(y_low - 0.5));
    double last_y = fmin(band->end, ceil(y_high - 0.5));
    double first_x = fmax(0, ceil(x_low - 0.5)), last_x = fmin(buffer->width, ceil(x_high - 0.5));
    if (!(first_y < last_y) || !(first_x < last_x))
        return STATUS_OK;

    /* The key is affine over the grid: its slopes from the polygon's largest corner triangle. */
    double area = 0, slope_x = 0, slope_y = 0;
    for (int i = 1; i + 1 < count; i++) {
        double ax = corner[i][0] - corner[0][0], ay = corner[i][1] - corner[0][1];
        double bx = corner[i + 1][0] - corner[0][0], by = corner[i + 1][1] - corner[0][1];
        double ak = corner[i][2] - corner[0][2], bk = corner[i + 1][2] - corner[0][2];
        double twice = ax * by - ay * bx;
        if (fabs(twice) > fabs(area)) {
            area = twice;
            slope_x = (ak * by - bk * ay) / twice;
            slope_y = (bk * ax - ak * bx) / twice;
        }
    }
    if (area == 0)
        return STATUS_OK;
    uint32_t tag = node << 1 | (enters ? 1 : 0);
    struct edge edge[4];
    find_edges(corner, count, edge);
    for (int y = (int)first_y; y < (int)last_y; y++) {
        double low, high;
        scan_range(edge, count, y + 0.5, &low, &high);
        if (!(low < high))
            continue;
        low = ceil(low - 0.5);
        high = ceil(high - 0.5);
        int begin = (int)(low > first_x ? low : first_x);
        int end = (int)(high < last_x ? high : last_x);
        if (begin >= end)
            continue;
        if (!reserve(band, (uint64_t)(end - begin)))
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL,
                               "no memory for the A-buffer past %llu fragments",
                               (unsigned long long)band->count);
        uint32_t *head = buffer->head + (size_t)y * (size_t)buffer->width;
        double key =
            corner[0][2] + slope_y * (y + 0.5 - corner[0][1]) - slope_x * (corner[0][0] - 0.5);
        const uint8_t *only =
            buffer->only ? buffer->only + (size_t)y * (size_t)buffer->width : NULL;
        for (int x = begin; x < end; x++) {
            if (only && !only[x])
                continue;
            double k = key + slope_x * x;
            if (!enters)
                k -= EXIT_BIAS * fabs(k);
            band->fragment[band->count] = (struct abuffer_fragment){k, tag, head[x]};
            head[x] = (uint32_t)++band->count;
        }
    }
    return STATUS_OK;
}

static int nearer(const void *a, const void *b) {
    double ka = ((const struct abuffer_fragment *)a)->key,
           kb = ((const struct abuffer_fragment *)b)->key;
    return (ka > kb) - (ka < kb);
}

static bool relate(struct relations *relations, uint32_t front, uint32_t back) {
    if (relations->count == relations->capacity) {
        uint64_t capacity = relations->capacity ? relations->capacity * 2 : 1 << 14;
        uint32_t *grown_front = realloc(relations->front, capacity * sizeof *grown_front);
        if (grown_front)
            relations->front = grown_front;
        uint32_t *grown_back = realloc(relations->back, capacity * sizeof *grown_back);
        if (grown_back)
            relations->back = grown_back;
        if (!grown_front || !grown_back)
            return false;
        relations->capacity = capacity;
    }
    relations->front[relations->count] = front;
    relations->back[relations->count++] = back;
    return true;
}

bool abuffer_gather(const struct abuffer *buffer, size_t pixel, struct abuffer_list *list) {
    list->count = 0;
    uint32_t at = buffer->head[pixel];
    if (!at)
        return true;
    int index = 0;
    while (pixel >= (size_t)buffer->band[index].end * (size_t)buffer->width)
        index++;
    const struct abuffer_fragment *fragment = buffer->band[index].fragment;
    for (; at; at = fragment[at - 1].next) {
        void *grown = list->fragment;
        if (!list_grow(&grown, list->count, 1, &list->capacity, sizeof *list->fragment))
            return false;
        list->fragment = grown;
        list->fragment[list->count++] = fragment[at - 1];
    }
    if (list->count > 32) {
        qsort(list->fragment, list->count, sizeof *list->fragment, nearer);
        return true;
    }
    for (size_t i = 1; i < list->count; i++) {
        struct abuffer_fragment moved = list->fragment[i];
        size_t j = i;
        for (; j > 0 && list->fragment[j - 1].key > moved.key; j--)
            list->fragment[j] = list->fragment[j - 1];
        list->fragment[j] = moved;
    }
    return true;
}

/* Samples beside one another mostly repeat the same relations: those of the last one are kept, so
 * that few repeats reach the graph. */
enum { RECENT = 16 };

/* How many stretches lie over one another at most. The ray begins within as many as are left
 * without having been entered. */
static int deepest(const struct abuffer_list *list) {
    int depth = 0, least = 0, most = 0;
    for (size_t i = 0; i < list->count; i++) {
        depth += list->fragment[i].node_enters & 1 ? 1 : -1;
        least = depth < least ? depth : least;
        most = depth > most ? depth : most;
    }
    return most - least;
}

enum status abuffer_relations(struct abuffer *buffer, struct relations *relations,
                              struct error *err) {
    struct abuffer_list list = {0};
    uint64_t recent[RECENT];
    memset(recent, 0xff, sizeof recent);
    size_t pixels = (size_t)buffer->width * (size_t)buffer->height;
    bool good = true;
    for (size_t pixel = 0; good && pixel < pixels; pixel++) {
        good = abuffer_gather(buffer, pixel, &list);
        relations->overlaps += good && deepest(&list) > 1;
        for (size_t i = 0, gap = 0; good && i + 1 < list.count; i++) {
            uint32_t a = list.fragment[i].node_enters, b = list.fragment[i + 1].node_enters;
            if ((a & 1) || !(b & 1) || a >> 1 == b >> 1)
                continue;
            uint64_t pair = (uint64_t)a << 32 | b;
            uint64_t *slot = &recent[gap++ % RECENT];
            if (*slot == pair)
                continue;
            *slot = pair;
            good = relate(relations, a >> 1, b >> 1);
        }
    }
    free(list.fragment);
    return good
               ? STATUS_OK
               : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the visibility graph");
}

enum status abuffer_entries(struct abuffer *buffer, uint32_t **first, uint32_t **entry,
                            struct error *err) {
    struct abuffer_list list = {0};
    size_t pixels = (size_t)buffer->width * (size_t)buffer->height, used = 0;
    *first = malloc((pixels + 1) * sizeof **first);
    *entry = malloc((abuffer_fragments(buffer) + 1) * sizeof **entry);
    bool good = *first && *entry;
    for (size_t pixel = 0; good && pixel < pixels; pixel++) {
        (*first)[pixel] = (uint32_t)used;
        good = abuffer_gather(buffer, pixel, &list);
        for (size_t i = 0; good && i < list.count; i++)
            if (list.fragment[i].node_enters & 1)
                (*entry)[used++] = list.fragment[i].node_enters >> 1;
    }
    free(list.fragment);
    if (good) {
        (*first)[pixels] = (uint32_t)used;
        return STATUS_OK;
    }
    free(*first);
    free(*entry);
    *first = *entry = NULL;
    return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for where rays enter");
}

void relations_finish(struct relations *relations) {
    free(relations->front);
    free(relations->back);
    *relations = (struct relations){0};
}
