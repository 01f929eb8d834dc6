/* Sorted cells that hide one another in a cycle: where no one order of all cells is right, each
 * sample is drawn in the order of its own ray (renderer/shell/ray_order.h), by the same shader and
 * the same blending. First all cells in their order, with those samples masked by depth; then
 * rectangles of those samples, cell by cell. */
#ifndef PELT_RENDERER_PATH_CYCLES_H
#define PELT_RENDERER_PATH_CYCLES_H

#include "renderer/path/cells.h"
#include "renderer/shell/ray_order.h"

struct cycles { /* zeroed is empty; memory is kept from picture to picture */
    struct ray_orders orders;
    struct outlines outlines;
    uint32_t box[4]; /* around the samples: x0, y0, x1, y1, upper ends excluded */
    float *depth;    /* what the mask has covered in it, bottom row first */
    size_t depth_capacity;
};

void cycles_clear(struct cycles *cycles);
void cycles_finish(struct cycles *cycles);

/* Finds the samples on whose rays `sorted` is wrong, and tells the report. `object_of`: the
 * picture's objects by the shells' numbers. Sets picture->depth where there are any.
 * STATUS_OUT_OF_MEMORY. */
enum status cycles_prepare(struct cycles *cycles, const struct sort_shell *shells,
                           const uint32_t *object_of, uint32_t shell_count,
                           const struct sort_result *sorted, struct picture *picture,
                           struct error *err);

/* After cell_pass_begin_media(): from now on nothing is drawn to those samples. Nothing, where
 * there are none. STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status cycles_mask(struct cycles *cycles, struct picture *picture, struct error *err);

/* Takes the mask away and draws them; ends in the state of cell_pass_begin_media(). Statuses of
 * cell_pass_draw(). */
enum status cycles_draw(struct cycles *cycles, struct cell_pass *pass, struct picture *picture,
                        struct error *err);

#endif
