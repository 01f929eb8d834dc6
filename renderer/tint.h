/* Extinction with colours (`extinction_color`): which pictures have it, and what cannot be drawn.
 *
 * A sample keeps one optical depth, beside a colour behind it that each channel is let through of.
 * Where all media have one colour of extinction it is that of the channel that loses most, and the
 * others' are shares of it: so alpha, the mean over the channels, is right by every way. Where
 * colours differ it is right where all media of a sample are one draw (walks, joint ones too), and
 * where it is 1 in any case, over an opaque background. */
#ifndef PELT_RENDERER_TINT_H
#define PELT_RENDERER_TINT_H

#include "renderer/path/path.h"

/* Whether any medium that is drawn has it. */
bool tint_wanted(const struct path_object *objects, size_t count);

/* Whether a background that is not opaque is seen through media that all have one colour. Sets each
 * channel's share of the optical depth of the channel that loses most. */
bool tint_shared(const struct scene *scene, const struct path_object *objects, size_t count,
                 double shares[3]);

/* After plan_order(). STATUS_NOT_IMPLEMENTED, with the pointer of an `extinction_color`, where
 * cells are drawn one by one over a background that is not opaque and colours of extinction differ,
 * and where there are more than 4096 slabs. */
enum status tint_check(const struct scene *scene, const struct path_object *objects, size_t count,
                       struct error *err);

#endif
