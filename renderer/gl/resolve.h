/* From the sample grid to the picture: the box mean of each pixel's samples over the background. */
#ifndef PELT_RENDERER_GL_RESOLVE_H
#define PELT_RENDERER_GL_RESOLVE_H

#include <stdbool.h>

#include "renderer/gl/blocks.h"
#include "renderer/gl/program.h"
#include "renderer/gl/target.h"

/* What of a target is emptied before drawing: colour to nothing, or to a background (straight
 * linear RGBA) where that is not NULL; depth to infinitely far (0). Makes it the target of what
 * follows, over its whole size. `shares`: NULL, or of a sample's optical depth each channel's. */
void gl_target_begin(struct gl_target *target, const double background[4], const double shares[3]);

/* Draws `samples` (radiance and optical depth, k x k for each pixel) into `picture`, whose size
 * times k is that of `samples`. `background`: straight linear RGBA. *compiled as in
 * gl_programs_get(). STATUS_GL_ERROR. */
enum status gl_resolve(struct gl_programs *programs, const struct gl_target *samples, int k,
                       const double background[4], const struct gl_target *picture, bool *compiled,
                       struct error *err);

/* The same for blocks of pixels alone, into blocks->gathered, one pixel after another. */
enum status gl_resolve_blocks(struct gl_programs *programs, const struct gl_target *samples,
                              const struct gl_blocks *blocks, const double background[4],
                              bool *compiled, struct error *err);

#endif
