/* How thick a shell over a mesh may be at each vertex before its prisms fold over.
 *
 * Part of the truth that all paths and the reference share: h_i of the design's shell map
 * P(b, w) = sum b_i (p_i + w h_i n_i) is what this says. */
#ifndef PELT_RENDERER_ASSET_MESH_THICKNESS_H
#define PELT_RENDERER_ASSET_MESH_THICKNESS_H

#include "renderer/asset/mesh.h"

struct mesh_thickness {
    double *height;                    /* h_i for each vertex, object units; malloc'ed */
    uint64_t folded, folded_first;     /* prisms that fold at the full thickness; triangle index */
    uint64_t limited;                  /* vertices whose h_i is less than the full thickness */
    double least;                      /* the smallest h_i */
    uint64_t inverted, inverted_first; /* prisms that no thickness mends: a normal points below
                                          its own triangle */
};

/* Limits the thickness where normals converge: STATUS_OUT_OF_MEMORY. O(triangles) where nothing
 * folds. mesh_thickness_finish() frees. */
enum status mesh_thickness_limit(const struct mesh *mesh, double thickness,
                                 struct mesh_thickness *result, struct error *err);
void mesh_thickness_finish(struct mesh_thickness *result);

#endif
