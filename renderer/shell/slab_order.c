/* See slab_order.h. */
#include "renderer/shell/slab_order.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/shell/sort.h"

static void find_behind(const struct shell *shell, const struct view *view, uint8_t *behind) {
    double eye[3]; /* orthographic: the direction toward it */
    for (int i = 0; i < 3; i++)
        eye[i] = view->orthographic ? -view->d0[i] : view->o0[i] - view->d0[i];
    for (uint32_t t = 0; t < shell->tetra_count; t++)
        for (int k = 0; k < 4; k++) {
            uint32_t other = shell->neighbour[t][k];
            if (other == SHELL_NONE || other < t)
                continue; /* a boundary, or decided from the other side */
            int side = sort_eye_side(shell, eye, view->orthographic, t, k);
            if (side > 0)
                behind[t] |= (uint8_t)(1 << k);
            else if (side < 0)
                behind[other] |= (uint8_t)(1 << shell_face_across(shell, t, (uint32_t)k));
        }
}

enum status slab_order_init(struct slab_order *order, const struct shell *shell,
                            const struct projection *projection, struct error *err) {
    size_t room = shell->tetra_count + (size_t)1;
    *order = (struct slab_order){
        .shell = shell,
        .projection = projection,
        .behind = calloc(room, sizeof *order->behind),
        .waiting = calloc(room, sizeof *order->waiting),
        .order = malloc(room * sizeof *order->order),
        .stack = malloc(room * sizeof *order->stack),
        .cursor = malloc(room * sizeof *order->cursor),
        .seeds = malloc(room * sizeof *order->seeds),
    };
    if (!order->behind || !order->waiting || !order->order || !order->stack || !order->cursor ||
        !order->seeds) {
        slab_order_finish(order);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to order %u cells",
                           shell->tetra_count);
    }
    find_behind(shell, &projection->view, order->behind);
    return STATUS_OK;
}

void slab_order_finish(struct slab_order *order) {
    free(order->behind);
    free(order->waiting);
    free(order->order);
    free(order->stack);
    free(order->cursor);
    free(order->seeds);
    *order = (struct slab_order){0};
}

static int farther(const void *a, const void *b) {
    const struct slab_seed *x = a, *y = b;
    if (x->depth != y->depth)
        return x->depth > y->depth ? -1 : 1;
    return (x->tetra > y->tetra) - (x->tetra < y->tetra);
}

static int farther_turned(const void *a, const void *b) {
    const struct slab_seed *x = a, *y = b;
    if (x->depth != y->depth)
        return x->depth > y->depth ? -1 : 1;
    return (x->tetra < y->tetra) - (x->tetra > y->tetra);
}

static double middle_of(const struct slab_order *order, uint32_t tetra, double low, double high) {
    double nearest = INFINITY, farthest = -INFINITY;
    for (int v = 0; v < 4; v++) {
        double h = order->projection->clip[order->shell->tetra[tetra][v]][2];
        nearest = fmin(nearest, h);
        farthest = fmax(farthest, h);
    }
    return fmax(nearest, low) + fmin(farthest, high);
}

/* What waits behind a cell, from its face *cursor on; 0: nothing more, else 1 + its index. */
static uint32_t next_behind(const struct slab_order *order, uint32_t tetra, uint8_t *cursor) {
    while (*cursor < 4) {
        int k = (*cursor)++;
        if (!(order->behind[tetra] & (1 << k)))
            continue;
        uint32_t found = order->waiting[order->shell->neighbour[tetra][k]];
        if (found)
            return found;
    }
    return 0;
}

void slab_order_find(struct slab_order *order, const struct slab_cells *cells, double low,
                     double high, bool turned) {
    uint32_t count = cells->active_count, placed = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t at = cells->active[i], tetra = cells->cell[at];
        order->seeds[i] = (struct slab_seed){middle_of(order, tetra, low, high), at, tetra};
        order->waiting[tetra] = at + 1;
    }
    qsort(order->seeds, count, sizeof *order->seeds, turned ? farther_turned : farther);
    for (uint32_t i = 0; i < count; i++) {
        if (!order->waiting[cells->cell[order->seeds[i].at]])
            continue;
        uint32_t depth = 0, next = order->seeds[i].at + 1;
        /* A cell goes on the stack once, and is placed when nothing behind it waits. */
        for (;;) {
            if (next) {
                order->waiting[cells->cell[next - 1]] = 0;
                order->stack[depth] = next - 1;
                order->cursor[depth++] = 0;
            } else {
                order->order[placed++] = order->stack[--depth];
                if (depth == 0)
                    break;
            }
            next =
                next_behind(order, cells->cell[order->stack[depth - 1]], &order->cursor[depth - 1]);
        }
    }
}
