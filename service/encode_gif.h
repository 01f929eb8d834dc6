/* Pictures to an animated GIF, one by one. */
#ifndef PELT_SERVICE_ENCODE_GIF_H
#define PELT_SERVICE_ENCODE_GIF_H

#include <stddef.h>

#include "api/status.h"

struct encode_gif;

/* Begins one of width * height pixels at `fps`: GIF keeps whole hundredths of a second, the nearest
 * to 1 / fps is taken, 2 at the least (viewers take less for 10). Loads the OpenImageIO module.
 * STATUS_IO_ERROR where it is not installed, STATUS_OUT_OF_MEMORY, STATUS_INTERNAL. */
enum status encode_gif_begin(int width, int height, double fps, struct encode_gif **gif,
                             struct error *err);

/* Adds a picture, as encode_png() takes one. GIF knows no part of transparency, and here none at
 * all: what is transparent shows `background` (straight linear RGBA, of which the colour counts).
 * STATUS_OUT_OF_MEMORY, STATUS_INTERNAL. */
enum status encode_gif_add(struct encode_gif *gif, const float *rgba, const double background[4],
                           struct error *err);

/* The file, malloc'ed (caller frees), NULL on failure. Ends *gif, whatever comes of it. */
enum status encode_gif_end(struct encode_gif *gif, unsigned char **data, size_t *bytes,
                           struct error *err);
void encode_gif_abandon(struct encode_gif *gif); /* takes NULL */

#endif
