/* SXMPVO: the graph of "lies behind", and its order. See sort.h. */
#include "renderer/shell/sort.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shell/abuffer.h"

struct graph {
    const struct sort_shell *shells;
    uint32_t shell_count;
    uint32_t first[SORT_SHELLS_MAX + 1]; /* node of each shell's tetrahedron 0 */
    uint8_t *behind;     /* for each node, a bit a face: its neighbour lies behind it */
    uint32_t *gap_first; /* [nodes + 1]: relations of the A-buffer, by front node */
    uint32_t *gap_back;
};

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

int sort_eye_side(const struct shell *shell, const double eye[3], bool orthographic, uint32_t tetra,
                  int k) {
    const uint32_t *vertex = shell->tetra[tetra];
    const double *p = shell->position[vertex[(k + 1) & 3]];
    const double *q = shell->position[vertex[(k + 2) & 3]];
    const double *r = shell->position[vertex[(k + 3) & 3]];
    const double *inside = shell->position[vertex[k]];
    double pq[3], pr[3], to_inside[3], to_eye[3], normal[3];
    for (int i = 0; i < 3; i++) {
        pq[i] = q[i] - p[i];
        pr[i] = r[i] - p[i];
        to_inside[i] = inside[i] - p[i];
        to_eye[i] = orthographic ? eye[i] : eye[i] - p[i];
    }
    cross(pq, pr, normal);
    double a = dot(normal, to_inside), b = dot(normal, to_eye);
    return ((a > 0) - (a < 0)) * ((b > 0) - (b < 0));
}

/* Relations through shared faces, and the boundary faces into the A-buffer. */
static enum status relate_faces(struct graph *graph, uint32_t s, struct abuffer *buffer,
                                struct error *err) {
    const struct shell *shell = graph->shells[s].shell;
    const struct view *view = &graph->shells[s].projection->view;
    double eye[3]; /* orthographic: the direction toward it */
    for (int i = 0; i < 3; i++)
        eye[i] = view->orthographic ? -view->d0[i] : view->o0[i] - view->d0[i];
    uint8_t *behind = graph->behind + graph->first[s];
    for (uint32_t t = 0; t < shell->tetra_count; t++)
        for (int k = 0; k < 4; k++) {
            uint32_t other = shell->neighbour[t][k];
            if (other != SHELL_NONE && other < t)
                continue; /* decided from the other side */
            int side = sort_eye_side(shell, eye, view->orthographic, t, k);
            if (side == 0)
                continue;
            if (other == SHELL_NONE) {
                uint32_t face[3];
                for (int v = 0; v < 3; v++)
                    face[v] = shell->tetra[t][(k + 1 + v) & 3];
                enum status status = abuffer_draw(buffer, graph->shells[s].projection, face,
                                                  graph->first[s] + t, side < 0, err);
                if (status != STATUS_OK)
                    return status;
            } else if (side > 0) {
                behind[t] |= (uint8_t)(1 << k);
            } else {
                behind[other] |= (uint8_t)(1 << shell_face_across(shell, t, (uint32_t)k));
            }
        }
    return STATUS_OK;
}

/* Compressed rows of the A-buffer's relations, by front node (a counting sort: stable, O(n)). */
static bool index_relations(struct graph *graph, const struct relations *relations,
                            uint32_t nodes) {
    graph->gap_first = calloc((size_t)nodes + 2, sizeof *graph->gap_first);
    graph->gap_back = malloc((relations->count + 1) * sizeof *graph->gap_back);
    if (!graph->gap_first || !graph->gap_back)
        return false;
    uint32_t *start = graph->gap_first + 1;
    for (uint64_t i = 0; i < relations->count; i++)
        start[relations->front[i] + 1]++;
    for (uint32_t n = 0; n < nodes; n++)
        start[n + 1] += start[n];
    for (uint64_t i = 0; i < relations->count; i++)
        graph->gap_back[start[relations->front[i]]++] = relations->back[i];
    return true; /* start[n] has moved to the end of row n, so gap_first[n] is its beginning */
}

static uint32_t shell_of(const struct graph *graph, uint32_t node) {
    uint32_t s = 0;
    while (node >= graph->first[s + 1])
        s++;
    return s;
}

/* The next node behind `node`, from *cursor on: faces 0..3, then the gaps. SHELL_NONE: no more. */
static uint32_t next_behind(const struct graph *graph, const struct shell *shell, uint32_t first,
                            uint32_t node, uint32_t *cursor) {
    for (; *cursor < 4; ++*cursor)
        if (graph->behind[node] & (1 << *cursor))
            return first + shell->neighbour[node - first][(*cursor)++];
    uint32_t gap = graph->gap_first[node] + *cursor - 4;
    if (gap < graph->gap_first[node + 1]) {
        ++*cursor;
        return graph->gap_back[gap];
    }
    return SHELL_NONE;
}

struct by_depth {
    double depth;
    uint32_t node;
};

static int farther(const void *a, const void *b) {
    const struct by_depth *x = a, *y = b;
    if (x->depth != y->depth)
        return x->depth > y->depth ? -1 : 1;
    return (x->node > y->node) - (x->node < y->node);
}

/* A max-heap by farther(): the farthest is at 0. */
static void heap_push(struct by_depth *heap, size_t count, struct by_depth item) {
    size_t at = count;
    for (; at > 0 && farther(&item, &heap[(at - 1) / 2]) < 0; at = (at - 1) / 2)
        heap[at] = heap[(at - 1) / 2];
    heap[at] = item;
}

static struct by_depth heap_pop(struct by_depth *heap, size_t count) {
    struct by_depth top = heap[0], item = heap[count - 1];
    size_t at = 0;
    for (;;) {
        size_t child = 2 * at + 1;
        if (child + 1 < count - 1 && farther(&heap[child + 1], &heap[child]) < 0)
            child++;
        if (child >= count - 1 || farther(&heap[child], &item) >= 0)
            break;
        heap[at] = heap[child];
        at = child;
    }
    heap[at] = item;
    return top;
}

static int by_node(const void *a, const void *b) {
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static double depth_of(const struct graph *graph, uint32_t node) {
    uint32_t s = shell_of(graph, node);
    const uint32_t *vertex = graph->shells[s].shell->tetra[node - graph->first[s]];
    double depth = 0;
    for (int v = 0; v < 4; v++)
        depth += graph->shells[s].projection->clip[vertex[v]][2];
    return depth;
}

/* What `node` hides across its face k, if that is among the members; -1: nothing. */
static ptrdiff_t hidden_across(const struct graph *graph, const uint32_t *members, size_t count,
                               uint32_t node, uint32_t k, bool hides) {
    uint32_t s = shell_of(graph, node), t = node - graph->first[s];
    const struct shell *shell = graph->shells[s].shell;
    uint32_t other = shell->neighbour[t][k];
    if (other == SHELL_NONE)
        return -1;
    uint32_t across = graph->first[s] + other;
    uint8_t bits = hides ? graph->behind[node] : graph->behind[across];
    uint32_t face = hides ? k : shell_face_across(shell, t, k);
    if (!(bits & (1 << face)))
        return -1;
    const uint32_t *found = bsearch(&across, members, count, sizeof *members, by_node);
    return found ? found - members : -1;
}

/* A cycle has no order that is right for all rays. Its tetrahedra are ordered by the faces that
 * they share, so that at least what one prism shows of itself is right, and where these leave a
 * choice, or make a cycle among themselves, by the depth of their centres, farthest first. */
static bool order_cycle(const struct graph *graph, uint32_t *node, size_t count) {
    struct by_depth *all = malloc(count * sizeof *all), *ready = malloc(count * sizeof *ready);
    uint32_t *members = malloc(count * sizeof *members);
    uint8_t *waits = calloc(count, 1); /* members behind it that are not drawn yet; DRAWN */
    enum { DRAWN = 255 };
    bool good = all && ready && members && waits;
    if (!good)
        goto done;
    memcpy(members, node, count * sizeof *members);
    qsort(members, count, sizeof *members, by_node);
    size_t heap = 0, next = 0, drawn = 0;
    for (size_t i = 0; i < count; i++) {
        for (uint32_t k = 0; k < 4; k++)
            waits[i] += hidden_across(graph, members, count, members[i], k, true) >= 0;
        all[i] = (struct by_depth){depth_of(graph, members[i]), (uint32_t)i};
        if (waits[i] == 0)
            heap_push(ready, heap++, all[i]);
    }
    qsort(all, count, sizeof *all, farther);
    while (drawn < count) {
        while (heap == 0 && waits[all[next].node] == DRAWN)
            next++;
        uint32_t i = heap ? heap_pop(ready, heap--).node : all[next].node;
        if (waits[i] == DRAWN)
            continue;
        waits[i] = DRAWN;
        node[drawn++] = members[i];
        for (uint32_t k = 0; k < 4; k++) {
            ptrdiff_t before = hidden_across(graph, members, count, members[i], k, false);
            if (before >= 0 && waits[before] != DRAWN && --waits[before] == 0)
                heap_push(ready, heap++,
                          (struct by_depth){depth_of(graph, members[before]), (uint32_t)before});
        }
    }
done:
    free(all);
    free(ready);
    free(members);
    free(waits);
    return good;
}

static bool add_cycle(struct sort_result *result, uint64_t first, uint64_t count) {
    if (result->cycles == result->cycle_capacity) {
        uint64_t wanted = result->cycle_capacity ? 2 * result->cycle_capacity : 16;
        struct sort_cycle *grown = realloc(result->cycle, wanted * sizeof *grown);
        if (!grown)
            return false;
        result->cycle = grown;
        result->cycle_capacity = wanted;
    }
    result->cycle[result->cycles++] = (struct sort_cycle){first, count};
    return true;
}

/* Tarjan 1972, iterative. A component is complete once everything behind it is, so components come
 * out back to front. `rank` is 0 for unseen nodes, DONE for those already in the order. */
static enum status walk(const struct graph *graph, uint32_t nodes, struct sort_result *result,
                        struct error *err) {
    const uint32_t DONE = UINT32_MAX;
    struct frame {
        uint32_t node, cursor;
    };
    uint32_t *rank = calloc((size_t)nodes + 1, sizeof *rank);
    uint32_t *low = malloc(((size_t)nodes + 1) * sizeof *low);
    uint32_t *open = malloc(((size_t)nodes + 1) * sizeof *open);
    struct frame *frames = malloc(((size_t)nodes + 1) * sizeof *frames);
    uint32_t *out = malloc(((size_t)nodes + 1) * sizeof *out);
    enum status status = STATUS_OK;
    if (!rank || !low || !open || !frames || !out) {
        status =
            error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to sort %u tetrahedra", nodes);
        goto done;
    }
    uint32_t seen = 0, opened = 0, done = 0;
    for (uint32_t root = 0; root < nodes; root++) {
        if (rank[root])
            continue;
        size_t depth = 0;
        frames[depth++] = (struct frame){root, 0};
        rank[root] = low[root] = ++seen;
        open[opened++] = root;
        while (depth) {
            struct frame *frame = &frames[depth - 1];
            uint32_t node = frame->node, s = shell_of(graph, node);
            uint32_t next =
                next_behind(graph, graph->shells[s].shell, graph->first[s], node, &frame->cursor);
            if (next != SHELL_NONE) {
                if (rank[next] == 0) {
                    rank[next] = low[next] = ++seen;
                    open[opened++] = next;
                    frames[depth++] = (struct frame){next, 0};
                } else if (rank[next] != DONE && rank[next] < low[node]) {
                    low[node] = rank[next];
                }
                continue;
            }
            depth--;
            if (depth && low[node] < low[frames[depth - 1].node])
                low[frames[depth - 1].node] = low[node];
            if (low[node] != rank[node])
                continue;
            uint32_t begin = done;
            do {
                /* NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign): ends at `node` */
                uint32_t member = open[--opened];
                rank[member] = DONE;
                out[done++] = member;
            } while (out[done - 1] != node);
            if (done - begin > 1) {
                if (!order_cycle(graph, out + begin, done - begin) ||
                    !add_cycle(result, begin, done - begin)) {
                    status =
                        error_fault(err, STATUS_OUT_OF_MEMORY, NULL,
                                    "no memory to order a cycle of %u tetrahedra", done - begin);
                    goto done;
                }
            }
        }
    }
    for (uint32_t i = 0; i < nodes; i++) {
        /* NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): every node was a root or reached */
        uint32_t s = shell_of(graph, out[i]);
        result->order[i] = (uint64_t)s << 32 | (out[i] - graph->first[s]);
    }
    result->count = nodes;
done:
    free(rank);
    free(low);
    free(open);
    free(frames);
    free(out);
    return status;
}

enum status sort_tetrahedra(const struct sort_shell *shells, uint32_t shell_count, uint8_t *met,
                            struct sort_result *result, struct error *err) {
    *result = (struct sort_result){0};
    if (shell_count > SORT_SHELLS_MAX)
        return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                           "at most %d semi-transparent shells can be sorted together",
                           SORT_SHELLS_MAX);
    struct graph graph = {.shells = shells, .shell_count = shell_count};
    uint64_t nodes = 0;
    for (uint32_t s = 0; s < shell_count; s++) {
        graph.first[s] = (uint32_t)nodes;
        nodes += shells[s].shell->tetra_count;
        if (nodes >= 1u << 30)
            return error_fault(err, STATUS_TOO_COMPLEX, "/objects",
                               "more than 2^30 tetrahedra to sort");
    }
    graph.first[shell_count] = (uint32_t)nodes;
    if (nodes == 0)
        return STATUS_OK;

    const struct view *view = &shells[0].projection->view;
    struct abuffer *buffer = abuffer_create(view->width, view->height);
    struct relations relations = {0};
    enum status status = STATUS_OK;
    graph.behind = calloc(nodes, 1);
    result->order = malloc(nodes * sizeof *result->order);
    if (!buffer || !graph.behind || !result->order) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to sort %llu tetrahedra",
                             (unsigned long long)nodes);
        goto done;
    }
    for (uint32_t s = 0; s < shell_count; s++)
        if ((status = relate_faces(&graph, s, buffer, err)) != STATUS_OK)
            goto done;
    if ((status = abuffer_relations(buffer, &relations, err)) != STATUS_OK)
        goto done;
    if (met)
        abuffer_mark(buffer, met);
    result->fragments = abuffer_fragments(buffer);
    result->edges = relations.count;
    result->overlaps = relations.overlaps;
    abuffer_destroy(buffer);
    buffer = NULL;
    if (!index_relations(&graph, &relations, (uint32_t)nodes)) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the visibility graph");
        goto done;
    }
    relations_finish(&relations);
    status = walk(&graph, (uint32_t)nodes, result, err);
done:
    abuffer_destroy(buffer);
    relations_finish(&relations);
    free(graph.behind);
    free(graph.gap_first);
    free(graph.gap_back);
    if (status != STATUS_OK)
        sort_result_finish(result);
    return status;
}

void sort_result_finish(struct sort_result *result) {
    free(result->order);
    free(result->cycle);
    *result = (struct sort_result){0};
}
