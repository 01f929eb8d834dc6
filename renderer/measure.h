/* How far a picture that has just been drawn is from the truth: the report's `error`.
 *
 * Two ways. `reference`: 4,096 pixels, spread over the frame, against the fp64 reference, to its
 * full tolerance. `estimate`: an embedded pair, as adaptive solvers of ODEs have it: some pixels of
 * the picture are drawn again four times as finely, which for an order of convergence p gives
 *
 *   e(h) - e(h/4) = e(h) (1 - 4^-p),
 *
 * and so the discretisation error e(h), whatever p is, within a third (p = 1: 0.75, p = 2: 0.94 of
 * it; divided by 1 - 4^-1.7, which measured orders of 1.7 to 1.9 suggest). The model error is that
 * of the pair's limit, extrapolated, against the rational ray (renderer/reference, at a tolerance
 * of 1e-4) in as many of those pixels as a tenth of the picture's time allows. */
#ifndef PELT_RENDERER_MEASURE_H
#define PELT_RENDERER_MEASURE_H

#include "renderer/asset/source.h"
#include "renderer/prepare.h"
#include "renderer/probe.h"

struct measure {
    const struct scene *scene;         /* as asked for; the reference's */
    const struct scene_camera *camera; /* as drawn */
    const struct asset_source *assets;
    const struct caches *caches; /* where the reference finds the meshes and voxels again */
    const struct drawing *drawing;
    struct probe *probe;
    const uint8_t *met;  /* of the samples, as in struct picture; NULL where there are no shells */
    const float *pixels; /* the picture, as in struct render_result */
    int threads;         /* of the reference */
    double spent_ms;     /* what the picture took so far: the measure of what may be spent */
};

/* Fills `error`; report->work is not changed. Statuses of reference_create(), reference_render()
 * and probe_draw(). Blocks. */
enum status measure_reference(const struct measure *measure, struct report *report,
                              struct error *err);
enum status measure_estimate(const struct measure *measure, struct report *report,
                             struct error *err);

/* Whether the path's quality has any effect on this picture: nothing is marched through. */
bool measure_is_exact(const struct picture *picture);

/* Samples that are met (NULL: none), condensed to pixels; the top row first. NULL where memory ran
 * out. */
uint8_t *measure_met_pixels(const uint8_t *met, int width, int height, int k);

/* The model error in some of the probe's pixels, of which `limit` is the path's own limit: RMSE
 * over them, its standard error, how many. Spends about `budget_ms`. Of 0 pixels where the scene is
 * too large for that. */
struct measure_model {
    double rmse, standard_error;
    uint64_t pixels;
};
enum status measure_model(const struct measure *measure, float (*limit)[4],
                          const uint8_t *met_pixels, double budget_ms, struct measure_model *model,
                          struct error *err);

#endif
