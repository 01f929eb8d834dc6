/* FLIP: how much of a difference a viewer sees who flips between two pictures.
 *
 * Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astroem, Fairchild 2020: FLIP: A Difference
 * Evaluator for Alternating Images. The LDR version, with the paper's constants, at 67 pixels per
 * degree (0.7 m from a 0.7 m wide screen of 3840 pixels). */
#ifndef PELT_RENDERER_ERROR_FLIP_H
#define PELT_RENDERER_ERROR_FLIP_H

#include "api/status.h"

/* Fills `map` (width * height) with values in [0, 1] for two pictures in linear premultiplied RGBA,
 * which are laid over mid-grey (sRGB 0.5) and clamped to [0, 1] first. `*mean` is the map's mean.
 * Symmetric in `test` and `reference`. STATUS_OUT_OF_MEMORY. Thread: any; blocks: about 0.3 s for a
 * megapixel. */
enum status error_flip(const float *test, const float *reference, int width, int height, float *map,
                       double *mean, struct error *err);

#endif
