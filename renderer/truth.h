/* The facade of the reference for those who have a scene and want the truth about it, without a GL:
 * renderer/reference makes the picture, renderer/error compares another with it. */
#ifndef PELT_RENDERER_TRUTH_H
#define PELT_RENDERER_TRUTH_H

#include "api/scene.h"
#include "renderer/asset/source.h"
#include "renderer/error/metrics.h"
#include "renderer/reference/reference.h"

struct truth {
    int width, height;          /* of the picture */
    size_t count;               /* pixels drawn: width * height, or as many as were asked for */
    float *pixels;              /* count * 4, linear premultiplied RGBA, in the request's order; the
                                   whole picture: as renderer_render() gives it */
    uint8_t *touched;           /* for each pixel: an object lies on one of its rays */
    struct scene_camera camera; /* as used: framed where the scene gives none */
    uint64_t folded;            /* prisms that fold */
    uint64_t unresolved;        /* of struct reference_result */
};

/* What of a scene has no true picture yet, each with its pointer: STATUS_NOT_IMPLEMENTED. */
enum status truth_check(const struct scene *scene, struct error *err);

/* One scene made ready, for drawing pixels of it more than once. */
struct truth_source;

/* Decodes and prepares everything that `scene` names, and frames the camera where it gives none.
 * `scene` and `assets` must outlive the source. Statuses as reference_create(). Blocks while assets
 * are decoded. `*source` is NULL on failure. Thread: one at a time. */
enum status truth_create(const struct scene *scene, const struct asset_source *assets,
                         struct truth_source **source, struct error *err);
void truth_destroy(struct truth_source *source); /* takes NULL */

/* The camera that is drawn with; lives as long as the source. */
const struct scene_camera *truth_camera(const struct truth_source *source);

/* Draws the pixels that `request` lists, or all; see there for threads, tolerance, progress and
 * cancel. Statuses as reference_render(); on failure `*truth` is zeroed. Blocks. The caller calls
 * truth_finish(). */
enum status truth_draw_pixels(const struct truth_source *source,
                              const struct reference_request *request, struct truth *truth,
                              struct error *err);

/* All of that for one whole picture: `request->pixels` are not read. Statuses of both. Blocks, for
 * minutes where the picture is large. The caller calls truth_finish(). */
enum status truth_render(const struct scene *scene, const struct asset_source *assets,
                         const struct reference_request *request, struct truth *truth,
                         struct error *err);
void truth_finish(struct truth *truth);

#endif
