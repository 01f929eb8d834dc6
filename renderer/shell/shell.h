/* A shell: prisms over every triangle of a mesh, three tetrahedra in each.
 * After Dufort, Leblanc & Poulin 2005, section 3.
 *
 * The tetrahedra of a prism over the welded vertices v0 < v1 < v2 (b below, t above) are
 *   T0 = (b0, b1, b2, t2)   T1 = (b0, b1, t1, t2)   T2 = (b0, t0, t1, t2).
 * Every side is cut from the lower-numbered vertex's bottom to the higher-numbered one's top, so
 * neighbours share diagonals without looking at one another (Dompierre et al. 1999). */
#ifndef PELT_RENDERER_SHELL_SHELL_H
#define PELT_RENDERER_SHELL_SHELL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/report.h"
#include "api/status.h"
#include "renderer/asset/mesh.h"
#include "shaders/interface.h"

#define SHELL_NONE UINT32_MAX

/* What the shaders need of one tetrahedron: CELL_TEXELS texels of four floats (interface.h). With
 * v_k its vertices relative to `center`, e_k = v_k - v_0 (rounded from fp64, so that thin cells far
 * from the centre keep their shape) and u_k = uvw_k - uvw_0:
 *   (v_0, uvw_0.x) (v_1, uvw_0.y) (v_2, u_1.x) (v_3, u_1.y)
 *   (e_1, u_1.z) (e_2, u_2.x) (e_3, u_2.y) (u_2.z, u_3)
 * uvw_0.z is not there: every first vertex is a bottom, w = 0. Neighbours hold the same bits for
 * the vertices they share, in the same order along every shared edge. */
struct shell {
    uint64_t serial;       /* from 1, unique among all shells that one cache ever made */
    uint32_t vertex_count; /* twice the mesh's: bottoms, then tops */
    double (*position)[3]; /* relative to center */
    double center[3];      /* of the bounds, object space */
    double bounds_min[3], bounds_max[3];
    uint32_t tetra_count;
    uint32_t (*tetra)[4];          /* vertices; face k lies opposite vertex k */
    uint32_t (*neighbour)[4];      /* tetrahedron behind face k, SHELL_NONE on the boundary: of the
                                      mesh, and where cells overlap or have no volume */
    float (*cell)[CELL_TEXELS][4]; /* for the shaders */
    float longest; /* longest edge of any tetrahedron, object units: bounds every loop */
    double thickness;
    double tiles_rate[2]; /* tiles along u and v that a unit of length on the mesh passes at the
                             steepest: the root of the mean square over its area */
    double flatness; /* length of the sum of the triangles' vectors over their area: 1 where the
                        mesh is flat, 0 where it is closed */
    bool affine;     /* every prism is affine to what fp32 can tell (prism_map.h) */
    bool ruled;      /* sides of prisms are bent by what shows (prism_map_bend()) */
    struct shell_diagnosis {
        uint64_t folded, folded_first;     /* prisms thinned so as not to fold; mesh triangle */
        uint64_t limited;                  /* vertices that are lower for it */
        double least;                      /* the lowest, object units */
        uint64_t inverted, inverted_first; /* prisms that no thickness mends */
        uint64_t flat, flat_first;         /* tetrahedra without volume: they hold nothing */
        uint64_t uneven, uneven_first;     /* prisms too uneven for their own map (prism_map.h) */
    } diagnosis;
    size_t bytes;
    int references;
};

struct shell_cache; /* keyed by the mesh's serial, thickness and tiles; least recently used goes */
struct shell_cache *shell_cache_create(size_t bytes_max); /* NULL where memory ran out */
void shell_cache_destroy(struct shell_cache *cache);      /* takes NULL */

/* Builds, or finds, the shell over a mesh, which is only read during the call. Given back with
 * shell_release(). STATUS_OUT_OF_MEMORY. */
enum status shell_acquire(struct shell_cache *cache, const struct mesh *mesh, double thickness,
                          const double tiles[2], const char *pointer, const struct shell **shell,
                          struct error *err);
void shell_release(struct shell_cache *cache, const struct shell *shell);

/* Builds one outside any cache; shell_destroy() frees it. */
enum status shell_build(const struct mesh *mesh, double thickness, const double tiles[2],
                        const char *pointer, struct shell **shell, struct error *err);
void shell_destroy(struct shell *shell); /* takes NULL */

/* The face of tetrahedron `t`'s neighbour across face k, which must exist, that is the same
 * triangle: told by its vertices, since two tetrahedra may share two faces. */
uint32_t shell_face_across(const struct shell *shell, uint32_t t, uint32_t k);

void shell_warn(const struct shell *shell, const char *pointer, struct report *report);

#endif
