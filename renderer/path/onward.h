/* Slabs from the nearest on, under what was drawn before: what a pixel no longer lets through is
 * not drawn to any more. Sums are kept in a target of their own (radiance, and what is let
 * through), with depths of its own, which are set to the nearest where nothing more can be seen:
 * the rasteriser then drops what comes before it is shaded. */
#ifndef PELT_RENDERER_PATH_ONWARD_H
#define PELT_RENDERER_PATH_ONWARD_H

#include "renderer/path/path.h"

/* Runs of slabs that are drawn before what they hide is looked for again. */
enum { ONWARD_RUNS = 16 };

/* Whether that is worth it: some medium lets hardly anything through, so that what lies behind its
 * first layer cannot be seen; and there are slabs enough. */
bool onward_pays(const struct picture *picture, uint32_t runs);

struct onward {
    struct gl_target target; /* its depth is what lets through, not what is opaque */
    GLuint hiding;           /* framebuffer of that depth alone */
    GLuint array;            /* empty */
};

void onward_finish(struct onward *onward); /* takes zeroes */

/* From here on media are drawn into the target, nearest first. */
enum status onward_begin(struct onward *onward, struct picture *picture, struct error *err);
/* Where next to nothing is let through nothing more is drawn. */
enum status onward_hide(struct onward *onward, struct picture *picture, struct error *err);
/* Puts what was gathered over the picture. */
enum status onward_end(struct onward *onward, struct picture *picture, struct error *err);

#endif
