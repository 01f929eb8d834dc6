/* How far one picture is from another. On pixels alone: nothing here knows how they were drawn.
 *
 * Pictures are width * height * 4 floats, linear premultiplied RGBA, as renderer_render() gives
 * them. Thread: any. */
#ifndef PELT_RENDERER_ERROR_METRICS_H
#define PELT_RENDERER_ERROR_METRICS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/status.h"

/* Of all four channels of a set of pixels. The error of a pixel is the root of its channels' mean
 * square; `rmse` is the root of the mean square over pixels and channels; `max_abs` the largest
 * difference of any channel; `p99` the smallest pixel error that at least 99 % of the pixels do not
 * exceed. All 0 where the set is empty. `rmse_standard_error`: of `rmse`, if the pixels stand for a
 * larger picture from which they were drawn at random (stratified: at most that); squares.h. */
struct error_figures {
    size_t pixels;
    double rmse, rmse_standard_error, max_abs, p99;
};

struct error_metrics {
    struct error_figures touched; /* over the pixels that any object touches */
    struct error_figures whole;   /* over the frame */
    size_t
        coverage;   /* pixels whose silhouette differs: drawn on in one picture, not in the other */
    double psnr_db; /* of the frame, for a peak of 1; infinite where nothing differs */
    double flip;    /* mean FLIP over the frame, see flip.h */
    size_t not_finite; /* pixels of either picture that are no numbers; each counts as an error of 1
                          in every channel */
};

/* Compares `test` with `reference`. `touched` has a byte for each pixel, not 0 where any object
 * touches it, or is NULL; a pixel where one of the pictures is drawn on (error_drawn_on) counts as
 * touched in any case, or else a silhouette that is too large would cost nothing. `flip_map`
 * receives FLIP for each pixel (width * height; may be NULL). STATUS_OUT_OF_MEMORY. */
enum status error_compare(const float *test, const float *reference, int width, int height,
                          const uint8_t *touched, const double background[4], float *flip_map,
                          struct error_metrics *metrics, struct error *err);

/* The same for `count` pixels of a picture, which need not lie side by side: `flip` is NAN. */
enum status error_compare_pixels(const float *test, const float *reference, size_t count,
                                 const uint8_t *touched, const double background[4],
                                 struct error_metrics *metrics, struct error *err);

/* Whether a pixel is drawn on: a channel differs from the premultiplied `background` (straight
 * linear RGBA, as in the scene) by more than 1/512, half a code of 8 bits, or is no number. */
bool error_drawn_on(const float pixel[4], const double background[4]);

/* The absolute difference of each channel of each pixel (width * height * 4); 1 in every channel of
 * a pixel that is no number in either picture. */
void error_map(const float *test, const float *reference, int width, int height, float *map);

#endif
