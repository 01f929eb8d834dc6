/* The passes of one prepared picture, in the order that the plan gives: everything between
 * `prepare` and the resolve. It may run more than once: whole, or over a few blocks of pixels, and
 * with other qualities, since these are read when a path draws (path_object.samples). */
#ifndef PELT_RENDERER_DRAWING_H
#define PELT_RENDERER_DRAWING_H

#include "renderer/path/path.h"
#include "renderer/path/surface.h"
#include "renderer/plan.h"

struct drawing {
    const struct plan *plan;
    struct surface_pass *surface;
    void *path_state;        /* of plan->path; NULL where there are no shells */
    struct picture *picture; /* picture->target is drawn into */
};

/* Draws all of the picture, or picture->blocks of it. STATUS_GL_ERROR, STATUS_OUT_OF_MEMORY. */
enum status drawing_run(const struct drawing *drawing, struct error *err);

#endif
