/* What drawing the shells of a picture by a path is expected to take, before anything is drawn: for
 * choosing between paths (choice.h), where ratios matter more than milliseconds.
 *
 * Three figures are counted on a few prisms of each shell, spread over it (so that the counting
 * takes no time that could be measured), and scaled up:
 *
 *   outlines    polygons that the CPU makes and the rasteriser sets up: cells, or their parts in
 *               runs of slabs (path/runs.h)
 *   fragments   samples times the cells, or parts, that each sample's ray meets: outlines' areas
 *   steps       voxels fetched: samples times length along the ray over the length of a step, or
 *               times the slabs that it passes; of which every fragment has one at least
 *
 * and the time is linear in them and in the samples of the frame, by constants that
 * tests/bench/bench_choice.c measures and prints.
 *
 * Left out on purpose: what the rays do not reach. A walk ends where nothing more can be seen and
 * at the first solid, cells and slabs are drawn behind that too; how much of a picture that is
 * depends on voxels that nobody has looked at yet. The constants hold what it is in the scenes that
 * they were fitted to. */
#ifndef PELT_RENDERER_COST_H
#define PELT_RENDERER_COST_H

#include "renderer/path/path.h"

struct cost {
    double samples; /* of the frame */
    double outlines, fragments, steps;
    double ms; /* sorting and drawing, everything on the device; no surfaces, no readback */
};

/* Of the shells of a picture by the path that they name, with the qualities, orders and methods
 * that the objects hold: after path.choose() and plan_order(). Needs no context. */
void cost_find(const struct path_object *objects, size_t count, const struct view *world,
               bool lights, struct cost *cost);

#endif
