/* See drawing.h. */
#include "renderer/drawing.h"

#include "renderer/gl/resolve.h"

enum status drawing_run(const struct drawing *drawing, struct error *err) {
    const struct plan *plan = drawing->plan;
    struct picture *picture = drawing->picture;
    gl_target_begin(picture->target, picture->behind, picture->shares);
    enum status status = STATUS_OK;
    if (picture->blocks && picture->target->depth)
        status = gl_blocks_mask(picture->blocks, picture->target, err);
    if (status == STATUS_OK && plan->surface)
        status = surface_pass_draw(drawing->surface, picture, err);
    if (status == STATUS_OK && plan->solid)
        status = plan->path->draw_solid(drawing->path_state, picture, err);
    if (status == STATUS_OK && plan->media)
        status = plan->path->draw_media(drawing->path_state, picture, err);
    return status;
}
