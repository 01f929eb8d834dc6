/* How far a picture that has just been drawn is from the truth, without drawing the truth: the
 * report's `error` of kind `estimate`.
 *
 * Discretisation: an embedded pair, as adaptive solvers of ODEs have it. Some pixels of the picture
 * are drawn again f times as finely, which for an order of convergence p gives
 *
 *   e(h) - e(h/f) = e(h) (1 - f^-p),
 *
 * and so the error e(h), whatever p is, within a third (f = 4; p = 1: 0.75, p = 2: 0.94 of it;
 * divided by 1 - f^-1.7, which measured orders of 1.7 to 1.9 suggest). Pixels are drawn by lot,
 * more of them where the picture changes from pixel to pixel, and weighed accordingly. Of small
 * pictures more pixels are drawn at f = 3; for a target, of solids all of them at f = 2.
 *
 * Model: the pair's limit, extrapolated, against the rational ray (renderer/reference, at a
 * tolerance of 1e-4) in as many of those pixels as fit: both together may take a quarter of the
 * picture's time. Where not even a few do, which is so for pictures of some 20 ms, the model error
 * and with it the whole stay unknown, and a warning says so. */
#ifndef PELT_RENDERER_ESTIMATE_H
#define PELT_RENDERER_ESTIMATE_H

#include "renderer/measure.h"

/* Fills report->error; report->work is not changed. Statuses of reference_create(),
 * reference_render() and probe_draw(). Blocks. */
enum status estimate_error(const struct measure *measure, struct report *report, struct error *err);

#endif
