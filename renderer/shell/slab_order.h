/* The order of a shell's cells within a run of slabs, back to front.
 *
 * Cells of one shell that the run holds are ordered by the faces that they share: of two neighbours
 * the one on the eye's side hides the other, exactly, since both are convex and the face's plane
 * parts them (Williams 1992, MPVO). Where no chain of neighbours within the run leads from one cell
 * to another the farther middle of what the run holds of them goes first, and where those are equal
 * the order turns around from run to run: cells that overlap in space fill their runs alike, and
 * what one run does the next undoes (slicing.c). A walk in depth for each run, linear in its cells
 * but for the sort by depth; no A-buffer, since a wrong guess is bound to one run.
 *
 * Cycles (sort.h) are cut wherever the walk meets them. */
#ifndef PELT_RENDERER_SHELL_SLAB_ORDER_H
#define PELT_RENDERER_SHELL_SLAB_ORDER_H

#include "renderer/shell/slabs.h"

struct slab_order {
    const struct shell *shell;
    const struct projection *projection;
    uint8_t *behind;   /* for each cell a bit a face: its neighbour lies behind it */
    uint32_t *waiting; /* for each cell: 1 + its index in cells->cell[] while it waits, else 0 */
    uint32_t *order;   /* indices into cells->cell[], after slab_order_find() */
    uint32_t *stack;
    uint8_t *cursor; /* the next face of each cell on the stack */
    struct slab_seed {
        double depth;
        uint32_t at, tetra; /* ties are broken by the latter: the same from either end */
    } * seeds;
};

/* Shell and projection are the caller's, and stay. STATUS_OUT_OF_MEMORY. */
enum status slab_order_init(struct slab_order *order, const struct shell *shell,
                            const struct projection *projection, struct error *err);
void slab_order_finish(struct slab_order *order); /* takes zeroes */

/* Orders cells->active, single tetrahedra, in the run between the depths `low` and `high`:
 * order[0 .. active_count - 1] are then its indices, the farthest first. */
void slab_order_find(struct slab_order *order, const struct slab_cells *cells, double low,
                     double high, bool turned);

#endif
