/* The plan: which passes, branches, buffers and libraries a scene needs, and which are left out and
 * why. The facade drives its passes by this record alone; nothing else decides. */
#ifndef PELT_RENDERER_PLAN_H
#define PELT_RENDERER_PLAN_H

#include <stdbool.h>

#include "api/report.h"
#include "renderer/path/path.h"
#include "renderer/path/shadow.h"

struct plan {
    const struct path *path;   /* for the shells; NULL where there are none */
    bool surface;              /* opaque triangles: bases, plain meshes */
    bool solid;                /* solid parts of materials */
    bool media;                /* semi-transparent parts */
    bool walk;                 /* some shell is walked through */
    int slices;                /* planes of the slicing path; 0: of another path */
    bool measured;             /* an error estimate or a target asks which samples meet a shell */
    bool occluded;             /* something opaque may lie before a medium */
    bool depth;                /* a depth buffer: opaque things may hide one another, or media */
    struct shadow_need shadow; /* lights that throw shadows, and what of */
    uint32_t flags;            /* branches of the shaders (FLAG_*), of all draws together */
    int k;                     /* samples along a pixel's side */
    size_t warnings;           /* that the report held before there was a path to warn of */
};

/* Finds by which path the scene says that its shells are drawn, and sets it in each of them: the
 * one that a shell names, else that whose `quality` is given. One path draws all shells of a
 * picture. Where nothing says it and there are shells, they are left at SCENE_PATH_AUTO, and *open
 * is set: it is to be chosen (choice.h). STATUS_NOT_IMPLEMENTED, with its pointer, where a shell
 * asks for another path, or for another one's quality. */
enum status plan_paths(struct scene *scene, bool *open, struct error *err);

/* Decides by which map textures are read (path_object.exact): as the scene asks, else exactly
 * wherever that makes a difference. And which shells rays walk through (path_object.walk) and of
 * which the cells are drawn: as the scene asks, else walked wherever that is possible.
 * STATUS_NOT_IMPLEMENTED, with its pointer, where the scene asks for a walk that is not. Without
 * `may_walk` a walk is only what the scene asks. */
enum status plan_order(struct path_object *objects, size_t count, bool may_walk, struct error *err);

/* Warns of prisms in which an object that is `exact` is read by the affine map all the same. */
void plan_warn_uneven(const struct path_object *objects, size_t count, struct report *report);

/* `objects` are ready but for textures. */
void plan_make(const struct scene *scene, const struct path_object *objects, size_t count,
               const struct shadow_need *shadow, struct plan *plan);

/* Tells the plan in words: every pass, branch, buffer and library of the renderer is a row of the
 * report's `passes` or of its `left_out`. */
void plan_report(const struct plan *plan, const struct scene *scene,
                 const struct path_object *objects, size_t count, struct report *report);

#endif
