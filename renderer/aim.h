/* The quality that a scene's target asks for: the cheapest whose estimated error is within
 * `max_error`, or the best that fits in what is left of `deadline_ms`.
 *
 * Everything is found on the picture itself, prepared and not yet drawn: a few of its pixels are
 * drawn at several qualities (renderer/probe.h), compared and timed. What the scene gives is held:
 * only objects without `quality` are chosen for, all by one factor on their path's default. */
#ifndef PELT_RENDERER_AIM_H
#define PELT_RENDERER_AIM_H

#include "renderer/estimate_model.h"

struct aim {
    const struct measure *measure; /* its `pixels` are not read */
    double left_ms; /* for drawing: what is left of the deadline when all else is taken off */
};

/* Whether there is anything to choose. */
bool aim_is_free(const struct measure *measure);

/* Sets path_object.quality of every object that leaves it open, and fills report->target but for
 * `met` and `reached`. Statuses of probe_draw() and estimate_model(). Blocks: some per cent of what
 * drawing takes. */
enum status aim_choose(const struct aim *aim, struct report *report, struct error *err);

/* After the picture was drawn and report->error holds its estimate, for `max_error`: fills
 * report->target. True where the target was missed and a better quality, which is then set, may
 * meet it: the picture is to be drawn again. */
bool aim_again(const struct aim *aim, struct report *report);

#endif
