/* The facade of the reference for those who have a scene and want the truth about it, without a GL:
 * renderer/reference makes the picture, renderer/error compares another with it. */
#ifndef PELT_RENDERER_TRUTH_H
#define PELT_RENDERER_TRUTH_H

#include "api/scene.h"
#include "renderer/asset/source.h"
#include "renderer/error/metrics.h"
#include "renderer/reference/reference.h"

struct truth {
    int width, height;
    float *pixels;              /* width * height * 4, as renderer_render() gives them */
    uint8_t *touched;           /* for each pixel: an object lies on one of its rays */
    struct scene_camera camera; /* as used: framed where the scene gives none */
    uint64_t folded;            /* prisms that fold */
    uint64_t unresolved;        /* of struct reference_result */
};

/* Draws the whole picture of a scene. `request` gives threads, tolerance, progress and cancel; its
 * `pixels` are not read. Statuses as reference_create() and reference_render(). Blocks, for minutes
 * where the picture is large. The caller calls truth_finish(). */
enum status truth_render(const struct scene *scene, const struct asset_source *assets,
                         const struct reference_request *request, struct truth *truth,
                         struct error *err);
void truth_finish(struct truth *truth);

#endif
