/* The model error of a path, from few pixels: its own limit there, against the rational ray
 * (renderer/reference, at a tolerance of 1e-4). Half of estimate.h; aim.c asks it before it
 * chooses.
 */
#ifndef PELT_RENDERER_ESTIMATE_MODEL_H
#define PELT_RENDERER_ESTIMATE_MODEL_H

#include "renderer/measure.h"

struct model_error {
    double rmse, standard_error; /* NAN where there are no pixels */
    uint64_t pixels;
};

/* Looks at some of the probe's pixels, of which `limit` is the path's limit: one a block, where
 * measure->promises four; or, with `interest` (for each pixel of the picture; NULL: none), of all
 * of them by lot, more of those of interest. Spends about `budget_ms`; where measure->promises, on
 * 256 pixels at the least, if there are as many. None where the scene is too large for that, or
 * eight pixels would take longer. Statuses of reference_create() and reference_render(). Blocks. */
enum status estimate_model(const struct measure *measure, float (*limit)[4],
                           const uint8_t *met_pixels, const float *interest, double budget_ms,
                           struct model_error *model, struct error *err);

#endif
