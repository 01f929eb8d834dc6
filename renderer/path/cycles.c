/* See cycles.h. */
#include "renderer/path/cycles.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/shell/grow.h"

void cycles_clear(struct cycles *cycles) {
    outlines_clear(&cycles->outlines);
    cycles->orders.rectangle_count = cycles->orders.cell_count = 0;
    cycles->orders.samples = cycles->orders.left_over = 0;
}

void cycles_finish(struct cycles *cycles) {
    outlines_finish(&cycles->outlines);
    ray_orders_finish(&cycles->orders);
    free(cycles->depth);
    *cycles = (struct cycles){0};
}

static void tell(const struct sort_result *sorted, const struct ray_orders *orders,
                 struct report *report) {
    uint64_t cells = 0;
    for (uint64_t c = 0; c < sorted->cycles; c++)
        cells += sorted->cycle[c].count;
    if (orders->samples) { /* the plan has it that there are none (renderer/plan.c) */
        char why[160];
        snprintf(why, sizeof why,
                 "%llu cells hide one another in circles: %llu samples are drawn in an order of "
                 "their own",
                 (unsigned long long)cells, (unsigned long long)orders->samples);
        report_pass(report, "cycles", why);
    }
    if (orders->left_over)
        report_warn(
            report, "cycles", "/objects", orders->left_over, 0,
            "samples on whose rays cells that hide one another in a circle are drawn by the "
            "depth of their centres: more than %d cells would have to be drawn sample by "
            "sample",
            RAY_ORDER_CELLS_MAX);
}

/* Layer by layer, object by object, so that a program is bound once for each of both and not for
 * each rectangle. */
static bool append_layers(struct cycles *cycles, const uint32_t *object_of, uint32_t shell_count,
                          const struct picture *picture) {
    const struct ray_orders *orders = &cycles->orders;
    uint32_t layers = 0;
    for (size_t r = 0; r < orders->rectangle_count; r++)
        layers = orders->rectangle[r].count > layers ? orders->rectangle[r].count : layers;
    for (uint32_t layer = 0; layer < layers; layer++)
        for (uint32_t s = 0; s < shell_count; s++)
            for (size_t r = 0; r < orders->rectangle_count; r++) {
                const struct ray_rectangle *rectangle = &orders->rectangle[r];
                if (layer >= rectangle->count)
                    continue;
                uint64_t cell = orders->cell[rectangle->first + layer];
                if (cell >> 32 == s &&
                    !outlines_append_rectangle(&cycles->outlines, &picture->objects[object_of[s]],
                                               object_of[s], (uint32_t)cell,
                                               (const uint32_t[]){rectangle->x0, rectangle->y0,
                                                                  rectangle->x1, rectangle->y1}))
                    return false;
            }
    return true;
}

enum status cycles_prepare(struct cycles *cycles, const struct sort_shell *shells,
                           const uint32_t *object_of, uint32_t shell_count,
                           const struct sort_result *sorted, struct picture *picture,
                           struct error *err) {
    struct ray_orders *orders = &cycles->orders;
    enum status status = ray_orders_find(shells, shell_count, sorted, orders, err);
    if (status != STATUS_OK)
        return status;
    tell(sorted, orders, picture->report);
    if (orders->samples == 0)
        return STATUS_OK;
    memcpy(cycles->box, (uint32_t[4]){UINT32_MAX, UINT32_MAX, 0, 0}, sizeof cycles->box);
    for (size_t r = 0; r < orders->rectangle_count; r++) {
        const struct ray_rectangle *one = &orders->rectangle[r];
        uint32_t *box = cycles->box;
        box[0] = one->x0 < box[0] ? one->x0 : box[0];
        box[1] = one->y0 < box[1] ? one->y0 : box[1];
        box[2] = one->x1 > box[2] ? one->x1 : box[2];
        box[3] = one->y1 > box[3] ? one->y1 : box[3];
    }
    if (!append_layers(cycles, object_of, shell_count, picture))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for outlines");
    report_pass(picture->report, "depth", "samples that are drawn by themselves are masked by it");
    picture->depth = true;
    picture->report->work.segments += cycles->outlines.outline_count;
    return STATUS_OK;
}

static void upload_depth(const struct cycles *cycles, const struct gl_target *target,
                         const float *depth) {
    const uint32_t *box = cycles->box;
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTextureSubImage2D(target->depth, 0, (GLint)box[0], (GLint)box[1], (GLsizei)(box[2] - box[0]),
                        (GLsizei)(box[3] - box[1]), GL_DEPTH_COMPONENT, GL_FLOAT, depth);
}

enum status cycles_mask(struct cycles *cycles, struct picture *picture, struct error *err) {
    const struct ray_orders *orders = &cycles->orders;
    if (orders->samples == 0)
        return STATUS_OK;
    const uint32_t *box = cycles->box;
    size_t width = box[2] - box[0], height = box[3] - box[1];
    void *depth = cycles->depth;
    if (!list_grow(&depth, 0, 2 * width * height, &cycles->depth_capacity, sizeof *cycles->depth))
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to mask samples");
    cycles->depth = depth;
    float *masked = cycles->depth + width * height;
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    glGetTextureSubImage(picture->target->depth, 0, (GLint)box[0], (GLint)box[1], 0, (GLsizei)width,
                         (GLsizei)height, 1, GL_DEPTH_COMPONENT, GL_FLOAT,
                         (GLsizei)(width * height * sizeof *masked), cycles->depth);
    memcpy(masked, cycles->depth, width * height * sizeof *masked);
    for (size_t r = 0; r < orders->rectangle_count; r++) {
        const struct ray_rectangle *one = &orders->rectangle[r];
        for (uint32_t y = one->y0; y < one->y1; y++)
            for (uint32_t x = one->x0; x < one->x1; x++)
                masked[(y - box[1]) * width + x - box[0]] = 1; /* the nearest there is */
    }
    upload_depth(cycles, picture->target, masked);
    picture->report->work.upload_bytes += 2 * width * height * sizeof *masked;
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    return gl_check("masking samples", err);
}

enum status cycles_draw(struct cycles *cycles, struct cell_pass *pass, struct picture *picture,
                        struct error *err) {
    if (cycles->orders.samples == 0)
        return STATUS_OK;
    upload_depth(cycles, picture->target, cycles->depth);
    cell_pass_begin_media(picture);
    return cell_pass_draw(pass, picture, &cycles->outlines, false, err);
}
