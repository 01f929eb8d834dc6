/* The pictures of a sweep: what was drawn, and its errors in colours. */
#ifndef PELT_SERVICE_SWEEP_PICTURE_H
#define PELT_SERVICE_SWEEP_PICTURE_H

#include "renderer/sweep.h"

enum sweep_view {
    SWEEP_VIEW_PICTURE,
    SWEEP_VIEW_DIFFERENCE, /* each pixel's RMS over its channels: logarithmic, 1e-4 to 1 */
    SWEEP_VIEW_FLIP        /* linear, 0 to 1 */
};

/* The decades of SWEEP_VIEW_DIFFERENCE: 10^-4 and less is black, 1 and more is the brightest. */
enum { SWEEP_DECADES = 4 };

/* The colour of a share from 0 to 1: magma (van der Walt & Smith 2015, CC0), whose lightness rises
 * evenly, so that it prints in grey. sRGB, 0 to 255. */
void sweep_colour(double share, double srgb[3]);

/* A view of a point, or of the reference (`point` NULL; only as a picture): width * height * 4
 * floats for encode_image(), reduced by the least whole factor that makes no side longer than
 * `side_max` (0: not at all); *width and *height are what came out. malloc'ed; NULL where memory
 * ran out. The reference and the errors are there only where all pixels were drawn
 * (sweep->pixels is NULL). */
float *sweep_picture(const struct sweep *sweep, const struct sweep_point *point,
                     enum sweep_view view, int side_max, int *width, int *height);

#endif
