/* The order of cells on single rays, where no one order of all cells is right for every ray: in a
 * cycle of tetrahedra (sort.h) each hides the next one somewhere, though on no ray all do.
 *
 * Two cells that follow one another on a ray are related, so an order of all is right on a ray
 * unless it turns two of them around; and it can do that to members of one cycle alone. So only
 * those are looked at to find the samples in question, and of those that hold two of them in the
 * wrong order the whole ray is put in order by itself. */
#ifndef PELT_RENDERER_SHELL_RAY_ORDER_H
#define PELT_RENDERER_SHELL_RAY_ORDER_H

#include <stddef.h>
#include <stdint.h>

#include "api/status.h"
#include "renderer/shell/sort.h"

/* Samples x0 <= x < x1, y0 <= y < y1 (the bottom row being 0) whose rays meet the same cells in the
 * same order. */
struct ray_rectangle {
    uint32_t x0, y0, x1, y1;
    uint64_t first; /* its cells: ray_orders.cell[first] to cell[first + count - 1] */
    uint32_t count;
};

struct ray_orders {
    struct ray_rectangle *rectangle; /* apart from one another */
    size_t rectangle_count, rectangle_capacity;
    uint64_t *cell; /* shell << 32 | tetrahedron, farthest first */
    size_t cell_count, cell_capacity;
    uint64_t samples;   /* in the rectangles */
    uint64_t left_over; /* samples on whose rays the order is wrong, past RAY_ORDER_CELLS_MAX */
};

/* Of all rectangles together; each is an outline of its own. */
enum { RAY_ORDER_CELLS_MAX = 1 << 21 };

/* The samples on whose rays `sorted`, the order of these shells, is wrong. Zeroed, or what a call
 * before this left, whose memory is used again. Without cycles it finds none and does nothing.
 * STATUS_OUT_OF_MEMORY. */
enum status ray_orders_find(const struct sort_shell *shells, uint32_t shell_count,
                            const struct sort_result *sorted, struct ray_orders *orders,
                            struct error *err);
void ray_orders_finish(struct ray_orders *orders);

#endif
