/* See ray_order.h. The picture is swept row by row over the boxes of the cells' outlines, so that
 * no more is held than what the rays of one row meet. */
#include "renderer/shell/ray_order.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shell/grow.h"

/* A cell met for less than this, in units of the eye's distance, shows nothing: no order of it is
 * wrong. */
static const double LENGTH_MIN = 1e-12;

/* A cell whose outline holds the centres of samples in this box (upper ends excluded). */
struct candidate {
    uint32_t x0, y0, x1, y1;
    uint64_t node; /* shell << 32 | tetrahedron */
    uint64_t rank; /* in the order of all; 0 where that is not asked */
};

struct candidates {
    struct candidate *list;
    size_t count, capacity;
};

/* A cell on a ray. */
struct hit {
    uint32_t x;
    double depth; /* H (view.h) in the middle of what it has of the ray */
    uint64_t node, rank;
};

struct row {
    struct hit *hit;
    size_t count, capacity;
};

/* Samples of a row, ascending: x[first[y]] to x[first[y + 1] - 1]. */
struct marked {
    size_t *first;
    uint32_t *x;
    size_t count, capacity;
    struct ray_rectangle box; /* around all of them */
};

struct search {
    const struct sort_shell *shells;
    uint32_t shell_count, width, height;
    struct ray_rectangle box; /* what is looked at */
    struct candidates found;
    size_t *active; /* candidates whose box holds the row */
    struct row row;
    struct marked marked;
};

/* The side of an edge on which the ray passes, ties broken as in shaders/tetra.frag. */
static double edge_function(const double a[2], const double b[2], bool *positive) {
    double e = a[0] * b[1] - b[0] * a[1], dx = b[0] - a[0], dy = b[1] - a[1];
    *positive = e != 0 ? e > 0 : dy != 0 ? dy > 0 : dx < 0;
    return e;
}

static void meet_face(bool pierced, const double e[3], const double h[3], double *low,
                      double *high) {
    double sum = fabs(e[0]) + fabs(e[1]) + fabs(e[2]);
    if (!pierced || !(sum > 0))
        return;
    double depth = (fabs(e[0]) * h[0] + fabs(e[1]) * h[1] + fabs(e[2]) * h[2]) / sum;
    *low = fmin(*low, depth);
    *high = fmax(*high, depth);
}

/* The depths at which the ray through (x, y) in [-1, 1] enters and leaves a cell, in front of the
 * eye; false: it does not meet it there. By the edge functions of shaders/tetra.frag, in doubles.
 */
static bool meet_cell(const struct sort_shell *shell, uint32_t tetra, double x, double y,
                      double *enters, double *leaves) {
    double q[4][2], h[4];
    for (int v = 0; v < 4; v++) {
        const double *clip = shell->projection->clip[shell->shell->tetra[tetra][v]];
        double w = shell->projection->view.orthographic ? 1 : clip[2];
        q[v][0] = clip[0] - x * w;
        q[v][1] = clip[1] - y * w;
        h[v] = clip[2];
    }
    bool p01, p02, p03, p12, p13, p23;
    double e01 = edge_function(q[0], q[1], &p01), e02 = edge_function(q[0], q[2], &p02);
    double e03 = edge_function(q[0], q[3], &p03), e12 = edge_function(q[1], q[2], &p12);
    double e13 = edge_function(q[1], q[3], &p13), e23 = edge_function(q[2], q[3], &p23);
    double low = INFINITY, high = -INFINITY;
    meet_face(p12 == p23 && p12 != p13, (double[]){e23, e13, e12}, (double[]){h[1], h[2], h[3]},
              &low, &high);
    meet_face(p02 == p23 && p02 != p03, (double[]){e23, e03, e02}, (double[]){h[0], h[2], h[3]},
              &low, &high);
    meet_face(p01 == p13 && p01 != p03, (double[]){e13, e03, e01}, (double[]){h[0], h[1], h[3]},
              &low, &high);
    meet_face(p01 == p12 && p01 != p02, (double[]){e12, e02, e01}, (double[]){h[0], h[1], h[2]},
              &low, &high);
    *enters = fmax(low, 0);
    *leaves = high;
    return *enters < *leaves;
}

/* The samples whose rays may meet a cell: bounds of its projection, on the grid. */
static void bound_cell(const struct sort_shell *shell, uint32_t tetra, double low[2],
                       double high[2]) {
    const struct view *view = &shell->projection->view;
    double point[OUTLINE_MAX][2];
    int count = 0;
    for (; count < 4; count++) {
        const double *clip = shell->projection->clip[shell->shell->tetra[tetra][count]];
        double w = view->orthographic ? 1 : clip[2];
        if (!(w > PROJECT_DEPTH_MIN))
            break;
        point[count][0] = (clip[0] / w + 1) * view->width / 2;
        point[count][1] = (clip[1] / w + 1) * view->height / 2;
    }
    if (count < 4) /* the eye's plane cuts it */
        count = project_outline(shell->shell, shell->projection, tetra, point);
    for (int k = 0; k < 2; k++) {
        low[k] = INFINITY;
        high[k] = -INFINITY;
        for (int i = 0; i < count; i++) {
            low[k] = fmin(low[k], point[i][k] - OUTLINE_MARGIN);
            high[k] = fmax(high[k], point[i][k] + OUTLINE_MARGIN);
        }
    }
}

/* Adds a cell unless it lies wholly outside the samples that are looked at. */
static bool add_candidate(struct search *search, uint64_t node, uint64_t rank) {
    double low[2], high[2];
    bound_cell(&search->shells[node >> 32], (uint32_t)node, low, high);
    const struct ray_rectangle *box = &search->box;
    double x0 = fmax(box->x0, ceil(low[0] - 0.5)), x1 = fmin(box->x1, floor(high[0] + 0.5));
    double y0 = fmax(box->y0, ceil(low[1] - 0.5)), y1 = fmin(box->y1, floor(high[1] + 0.5));
    if (!(x0 < x1) || !(y0 < y1))
        return true;
    struct candidates *found = &search->found;
    void *list = found->list;
    if (!list_grow(&list, found->count, 1, &found->capacity, sizeof *found->list))
        return false;
    found->list = list;
    found->list[found->count++] =
        (struct candidate){(uint32_t)x0, (uint32_t)y0, (uint32_t)x1, (uint32_t)y1, node, rank};
    return true;
}

static int by_row(const void *a, const void *b) {
    const struct candidate *p = a, *q = b;
    if (p->y0 != q->y0)
        return p->y0 < q->y0 ? -1 : 1;
    return (p->node > q->node) - (p->node < q->node);
}

/* Column, then farthest first. */
static int by_depth(const void *a, const void *b) {
    const struct hit *p = a, *q = b;
    if (p->x != q->x)
        return p->x < q->x ? -1 : 1;
    if (p->depth != q->depth)
        return p->depth > q->depth ? -1 : 1;
    return (p->node > q->node) - (p->node < q->node);
}

static bool add_hit(struct search *search, const struct candidate *candidate, uint32_t x,
                    uint32_t y, double least) {
    double enters, leaves;
    if (!meet_cell(&search->shells[candidate->node >> 32], (uint32_t)candidate->node,
                   (x + 0.5) * 2 / search->width - 1, (y + 0.5) * 2 / search->height - 1, &enters,
                   &leaves) ||
        leaves - enters < least * fmax(1, leaves))
        return true;
    struct row *row = &search->row;
    void *list = row->hit;
    if (!list_grow(&list, row->count, 1, &row->capacity, sizeof *row->hit))
        return false;
    row->hit = list;
    row->hit[row->count++] =
        (struct hit){x, enters + (leaves - enters) / 2, candidate->node, candidate->rank};
    return true;
}

/* The first sample of row y that is not left of x. */
static size_t first_from(const struct marked *marked, uint32_t y, uint32_t x) {
    size_t low = marked->first[y], high = marked->first[y + 1];
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (marked->x[middle] < x)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* What is done with the hits of a row, sorted by column and depth. */
typedef bool each_row(struct search *search, uint32_t y, void *user);

/* Meets the candidates at all samples of their boxes, or, with `only`, at those that it holds. */
static bool sweep(struct search *search, const struct marked *only, double least, each_row *each,
                  void *user) {
    struct candidates *found = &search->found;
    if (found->count)
        qsort(found->list, found->count, sizeof *found->list, by_row);
    search->active = malloc((found->count + 1) * sizeof *search->active);
    if (!search->active)
        return false;
    size_t active = 0, next = 0;
    for (uint32_t y = 0; y < search->height; y++) {
        while (next < found->count && found->list[next].y0 <= y)
            search->active[active++] = next++;
        search->row.count = 0;
        for (size_t i = 0; i < active;) {
            const struct candidate *candidate = &found->list[search->active[i]];
            if (candidate->y1 <= y) {
                search->active[i] = search->active[--active];
                continue;
            }
            i++;
            if (!only) {
                for (uint32_t x = candidate->x0; x < candidate->x1; x++)
                    if (!add_hit(search, candidate, x, y, least))
                        return false;
                continue;
            }
            for (size_t m = first_from(only, y, candidate->x0);
                 m < only->first[y + 1] && only->x[m] < candidate->x1; m++)
                if (!add_hit(search, candidate, only->x[m], y, least))
                    return false;
        }
        if (search->row.count)
            qsort(search->row.hit, search->row.count, sizeof *search->row.hit, by_depth);
        if (!each(search, y, user))
            return false;
    }
    free(search->active);
    search->active = NULL;
    return true;
}

/* Marks the samples at which the order of all turns two cells around. */
static bool mark_row(struct search *search, uint32_t y, void *user) {
    (void)user;
    struct marked *marked = &search->marked;
    marked->first[y] = marked->count;
    for (size_t i = 1; i < search->row.count; i++) {
        const struct hit *far = &search->row.hit[i - 1], *near = far + 1;
        if (far->x != near->x || far->rank < near->rank)
            continue;
        if (marked->count > marked->first[y] && marked->x[marked->count - 1] == far->x)
            continue;
        void *list = marked->x;
        if (!list_grow(&list, marked->count, 1, &marked->capacity, sizeof *marked->x))
            return false;
        marked->x = list;
        marked->x[marked->count++] = far->x;
        struct ray_rectangle *box = &marked->box;
        box->x0 = far->x < box->x0 ? far->x : box->x0;
        box->x1 = far->x + 1 > box->x1 ? far->x + 1 : box->x1;
        box->y0 = y < box->y0 ? y : box->y0;
        box->y1 = y + 1;
    }
    marked->first[y + 1] = marked->count;
    return true;
}

/* Whether `count` cells from the row's hit `at` on are those of a rectangle. */
static bool same_cells(const struct ray_orders *orders, const struct ray_rectangle *rectangle,
                       const struct hit *hit, size_t count) {
    if (rectangle->count != count)
        return false;
    for (size_t i = 0; i < count; i++)
        if (orders->cell[rectangle->first + i] != hit[i].node)
            return false;
    return true;
}

/* A sample's cells: one more for the rectangle to its left, or a rectangle of its own. */
static bool add_sample(struct ray_orders *orders, size_t row_first, const struct hit *hit,
                       size_t count, uint32_t y) {
    struct ray_rectangle *last = orders->rectangle_count > row_first
                                     ? &orders->rectangle[orders->rectangle_count - 1]
                                     : NULL;
    if (last && last->x1 == hit->x && same_cells(orders, last, hit, count)) {
        last->x1++;
        orders->samples++;
        return true;
    }
    if (orders->cell_count + count > RAY_ORDER_CELLS_MAX) {
        orders->left_over++;
        return true;
    }
    void *cells = orders->cell, *list = orders->rectangle;
    if (!list_grow(&cells, orders->cell_count, count, &orders->cell_capacity, sizeof *orders->cell))
        return false;
    orders->cell = cells;
    if (!list_grow(&list, orders->rectangle_count, 1, &orders->rectangle_capacity,
                   sizeof *orders->rectangle))
        return false;
    orders->rectangle = list;
    orders->rectangle[orders->rectangle_count++] =
        (struct ray_rectangle){hit->x, y, hit->x + 1, y + 1, orders->cell_count, (uint32_t)count};
    for (size_t i = 0; i < count; i++)
        orders->cell[orders->cell_count++] = hit[i].node;
    orders->samples++;
    return true;
}

/* Rectangles that end above the last row, from left to right. */
struct open_rectangles {
    size_t *list, *next; /* width elements each */
    size_t count;
    struct ray_orders *orders;
};

/* A row's rectangles, from `row_first` on, onto those below that are as wide and hold the same
 * cells; the others move up into the places of those. */
static void join_row(struct open_rectangles *open, size_t row_first) {
    struct ray_orders *orders = open->orders;
    size_t kept = row_first, below = 0, count = 0;
    if (row_first == orders->rectangle_count) {
        open->count = 0;
        return;
    }
    size_t cells = orders->rectangle[row_first].first;
    for (size_t i = row_first; i < orders->rectangle_count; i++) {
        struct ray_rectangle one = orders->rectangle[i];
        while (below < open->count && orders->rectangle[open->list[below]].x0 < one.x0)
            below++;
        struct ray_rectangle *under =
            below < open->count ? &orders->rectangle[open->list[below]] : NULL;
        const uint64_t *held = orders->cell + one.first;
        if (under && under->x0 == one.x0 && under->x1 == one.x1 && under->count == one.count &&
            memcmp(orders->cell + under->first, held, one.count * sizeof *held) == 0) {
            under->y1++;
            open->next[count++] = open->list[below];
            continue;
        }
        memmove(orders->cell + cells, held, one.count * sizeof *held);
        one.first = cells;
        cells += one.count;
        open->next[count++] = kept;
        orders->rectangle[kept++] = one;
    }
    orders->rectangle_count = kept;
    orders->cell_count = cells;
    size_t *swap = open->list;
    open->list = open->next;
    open->next = swap;
    open->count = count;
}

static bool order_row(struct search *search, uint32_t y, void *user) {
    struct open_rectangles *open = user;
    size_t row_first = open->orders->rectangle_count;
    for (size_t i = 0, next; i < search->row.count; i = next) {
        const struct hit *hit = &search->row.hit[i];
        for (next = i + 1; next < search->row.count && search->row.hit[next].x == hit->x;)
            next++;
        if (!add_sample(open->orders, row_first, hit, next - i, y))
            return false;
    }
    join_row(open, row_first);
    return true;
}

static bool find_marked(struct search *search, const struct sort_result *sorted) {
    for (uint64_t c = 0; c < sorted->cycles; c++)
        for (uint64_t i = 0; i < sorted->cycle[c].count; i++) {
            uint64_t rank = sorted->cycle[c].first + i;
            if (!add_candidate(search, sorted->order[rank], rank))
                return false;
        }
    search->marked.box = (struct ray_rectangle){.x0 = UINT32_MAX, .y0 = UINT32_MAX};
    search->marked.first = calloc((size_t)search->height + 1, sizeof *search->marked.first);
    return search->marked.first && sweep(search, NULL, LENGTH_MIN, mark_row, NULL);
}

static bool order_marked(struct search *search, struct ray_orders *orders) {
    search->found.count = 0;
    search->box = search->marked.box;
    for (uint32_t s = 0; s < search->shell_count; s++)
        for (uint32_t t = 0; t < search->shells[s].shell->tetra_count; t++)
            if (!add_candidate(search, (uint64_t)s << 32 | t, 0))
                return false;
    struct open_rectangles open = {.orders = orders};
    open.list = malloc(search->width * sizeof *open.list);
    open.next = malloc(search->width * sizeof *open.next);
    bool good = open.list && open.next && sweep(search, &search->marked, 0, order_row, &open);
    free(open.list);
    free(open.next);
    return good;
}

enum status ray_orders_find(const struct sort_shell *shells, uint32_t shell_count,
                            const struct sort_result *sorted, struct ray_orders *orders,
                            struct error *err) {
    orders->rectangle_count = orders->cell_count = 0;
    orders->samples = orders->left_over = 0;
    if (sorted->cycles == 0)
        return STATUS_OK;
    const struct view *view = &shells[0].projection->view;
    struct search search = {.shells = shells,
                            .shell_count = shell_count,
                            .width = (uint32_t)view->width,
                            .height = (uint32_t)view->height};
    search.box = (struct ray_rectangle){.x1 = search.width, .y1 = search.height};
    bool good =
        find_marked(&search, sorted) && (search.marked.count == 0 || order_marked(&search, orders));
    free(search.found.list);
    free(search.active);
    free(search.row.hit);
    free(search.marked.first);
    free(search.marked.x);
    return good ? STATUS_OK
                : error_fault(err, STATUS_OUT_OF_MEMORY, NULL,
                              "no memory to order the cells of single rays");
}

void ray_orders_finish(struct ray_orders *orders) {
    free(orders->rectangle);
    free(orders->cell);
    *orders = (struct ray_orders){0};
}
