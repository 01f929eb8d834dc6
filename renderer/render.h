/* The one facade of the renderer: a scene goes in, linear pixels and a report come out.
 * Knows nothing of HTTP, JSON or files. One renderer for each process; all calls from the thread
 * that created it (the GL context is current there). */
#ifndef PELT_RENDERER_RENDER_H
#define PELT_RENDERER_RENDER_H

#include <stddef.h>

#include "api/report.h"
#include "api/scene.h"
#include "api/status.h"
#include "renderer/asset/source.h"

enum render_backend { RENDER_BACKEND_AUTO, RENDER_BACKEND_EGL, RENDER_BACKEND_OSMESA };

struct renderer_options {
    enum render_backend backend;
    int device;            /* index among the EGL devices, -1 to choose */
    bool require_hardware; /* refuse a software rasteriser */
};

struct renderer;

/* Opens the GL. STATUS_NO_GL with a message that says what to install. Blocks for tens of
 * milliseconds. `*renderer` is NULL on failure. */
enum status renderer_create(const struct renderer_options *options, struct renderer **renderer,
                            struct error *err);
void renderer_destroy(struct renderer *renderer); /* takes NULL */

struct render_result {
    int width, height;
    float *pixels;        /* width * height * 4, top row first, premultiplied linear RGBA */
    struct report report; /* queue, parse and encode are 0: their owners fill them in */
    struct arena arena;   /* owns report.resolved's arrays */
};

/* Draws. On failure `*result` is zeroed and `err` tells why. The caller calls
 * render_result_finish() after success. */
enum status renderer_render(struct renderer *renderer, const struct scene *scene,
                            const struct asset_source *assets, struct render_result *result,
                            struct error *err);

/* What a deadline runs from, and what is done after drawing. */
struct render_limits {
    double began_ms;   /* CLOCK_MONOTONIC: the last byte of the request */
    double reserve_ms; /* what the caller still has to do: encoding */
};

/* The same for a scene with target.deadline_ms: renderer_render() takes its own call for the
 * beginning, and reserves nothing. */
enum status renderer_render_within(struct renderer *renderer, const struct scene *scene,
                                   const struct asset_source *assets,
                                   const struct render_limits *limits, struct render_result *result,
                                   struct error *err);
void render_result_finish(struct render_result *result);

/* The plan alone: result->report's plan, resolved, work and warnings are filled, nothing is drawn
 * and pixels is NULL. */
enum status renderer_plan(struct renderer *renderer, const struct scene *scene,
                          const struct asset_source *assets, struct render_result *result,
                          struct error *err);

#endif
