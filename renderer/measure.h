/* How far a picture that has just been drawn is from the truth: the report's `error`, by comparing
 * 4,096 pixels, spread over the frame, with the fp64 reference at its full tolerance. What the
 * other way (estimate.h) shares with it is here too. */
#ifndef PELT_RENDERER_MEASURE_H
#define PELT_RENDERER_MEASURE_H

#include "renderer/asset/source.h"
#include "renderer/prepare.h"
#include "renderer/probe.h"

struct measure {
    const struct scene *scene;         /* as asked for; the reference's */
    const struct scene *truth;         /* what the reference draws: measure_truth() */
    const struct scene_camera *camera; /* as drawn */
    const struct asset_source *assets;
    const struct caches *caches; /* where the reference finds the meshes and voxels again */
    const struct drawing *drawing;
    struct probe *probe;
    const uint8_t *met;  /* of the samples, as in struct picture; NULL where there are no shells */
    const float *pixels; /* the picture, as in struct render_result */
    int threads;         /* of the reference */
    bool promises;       /* a target stands on the estimate: look at four times as many pixels */
    double spent_ms;     /* what the picture took so far: the measure of what may be spent */
};

/* Fills report->error. Statuses of reference_create(), reference_render() and probe_draw(). Blocks,
 * for seconds. */
enum status measure_reference(const struct measure *measure, struct report *report,
                              struct error *err);

/* The scene that tells the truth of a picture. A filter is to give what many samples would, so a
 * filtered picture is held to their mean: it is the scene with MEASURE_SAMPLES positions a pixel,
 * if it has not more, and lies in *filtered. Of any other picture, the scene itself. */
enum { MEASURE_SAMPLES = 64 };
const struct scene *measure_truth(const struct scene *scene, const struct path_object *objects,
                                  size_t count, struct scene *filtered);

/* ---- for estimate.c and aim.c ---- */

struct report_error measure_unknown(void); /* every figure NAN */
bool measure_finite(const float pixel[4]);

/* Whether the path's quality has no effect on this picture: nothing is marched through. */
bool measure_is_exact(const struct picture *picture);

/* Samples that are met (NULL: none), condensed to pixels; the top row first. NULL where memory ran
 * out. */
uint8_t *measure_met_pixels(const uint8_t *met, int width, int height, int k);

/* Draws the probe's pixels with `factor` times the picture's quality; report->work stays what the
 * picture itself took. Statuses of probe_draw(). */
enum status measure_draw_again(const struct measure *measure, double factor, struct error *err);

/* The reference of the scene, with the picture's camera; reference_destroy() is the caller's. */
struct reference;
enum status measure_open_reference(const struct measure *measure, struct reference **reference,
                                   struct error *err);

#endif
