/* For measuring alone (tests/bench/bench_plan.c, tests/unit/test_plan.c): puts into a picture what
 * its scene does not need, so that what leaving it out saves can be seen; counts texture fetches;
 * lists what was compiled. No scene, request or option of the program reaches any of this. */
#ifndef PELT_RENDERER_FORCE_H
#define PELT_RENDERER_FORCE_H

#include "renderer/plan.h"
#include "renderer/prepare.h"
#include "renderer/render.h"

/* Parts to put in; none of them changes a picture by more than rounding. */
enum {
    FORCE_DEPTH = 0x001,       /* a depth buffer */
    FORCE_OCCLUDED = 0x002,    /* media clipped at it; with FORCE_DEPTH */
    FORCE_EYE_INSIDE = 0x004,  /* segments clipped at the eye; of cells drawn one by one */
    FORCE_LIGHT = 0x008,       /* normals and a loop over lights, of which there may be none; unlit
                                  materials are as under an ambient light of 1 */
    FORCE_SPECULAR = 0x010,    /* a highlight, which may be 0; where materials are lit */
    FORCE_TEXTURED = 0x020,    /* a white base colour texture */
    FORCE_MEDIUM = 0x040,      /* an empty medium beside a solid */
    FORCE_SOLID = 0x080,       /* an empty solid beside a medium */
    FORCE_VOXELS = 0x100,      /* homogeneous media as voxels */
    FORCE_SORT = 0x200,        /* cells in order, though rays could walk */
    FORCE_SAMPLES = 0x400,     /* 4 samples a pixel; not the same picture but where it is even */
    FORCE_SHADOW = 0x2000,     /* maps of the first light, and all that asks them, for no shadow */
    FORCE_EVERY_PLANE = 0x800, /* planes of the slicing path look at every prism */
    FORCE_DEVICE_LISTS = 0x4000,    /* the device finds what planes cut (renderer/path/lists.h) */
    FORCE_HOST_LISTS = 0x8000,      /* the processor does */
    FORCE_NEAREST_FIRST = 0x10000,  /* slabs are drawn so (renderer/path/onward.h), */
    FORCE_FARTHEST_FIRST = 0x20000, /* or so */
    FORCE_COST = 0x1000, /* report.choice tells the cost of the path that the scene names */
};

/* From the next picture on; 0 for what scenes need and no more. */
void renderer_force(struct renderer *renderer, uint32_t force);

/* Whether shaders count the texture fetches that they execute, discarded samples included; how many
 * they were since this was called. Counting slows drawing down. STATUS_GL_ERROR. */
enum status renderer_count_fetches(struct renderer *renderer, bool on, struct error *err);
uint64_t renderer_fetches(const struct renderer *renderer);

/* The programs compiled so far, in order: their names (static) and FLAG_*. False past the last. */
bool renderer_variant(const struct renderer *renderer, size_t index, const char **program,
                      uint32_t *variant);

/* The facade's own: what force means for prepared objects (undone by prepared_finish()) and for the
 * plan. STATUS_OUT_OF_MEMORY. */
enum status force_objects(uint32_t force, struct prepared *prepared, struct error *err);
void force_plan(uint32_t force, struct plan *plan);

#endif
