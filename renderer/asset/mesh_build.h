/* From a soup of triangles to the final mesh: weld, drop what has no area, normals, UVs,
 * neighbours. Internal to the asset room. Each step lives in a file of its own and works on struct
 * mesh. */
#ifndef PELT_RENDERER_ASSET_MESH_BUILD_H
#define PELT_RENDERER_ASSET_MESH_BUILD_H

#include "renderer/asset/mesh.h"
#include "renderer/asset/mesh_soup.h"

/* The mesh of a soup, owned by the caller (mesh_destroy). One white surface without images; the
 * caller replaces it. Linear in the triangles but for a counting sort; the same soup gives the same
 * mesh to the bit. STATUS_BAD_ASSET (no triangle with an area), STATUS_TOO_COMPLEX,
 * STATUS_OUT_OF_MEMORY, with `pointer`. Thread: any. */
enum status mesh_build(const struct mesh_soup *soup, const char *pointer, struct mesh **result,
                       struct error *err);
void mesh_destroy(struct mesh *mesh); /* takes NULL; the rest pose of a posed one stays */

/* The mesh of a pose: `rest`, which must live as long, with the positions and normals of a soup
 * that has the same triangles. Topology, texture coordinates and surfaces are the rest pose's;
 * corners that were one vertex there stay one, at the place of the first. Owned by the caller.
 * STATUS_OUT_OF_MEMORY. Thread: any. */
enum status mesh_pose(struct mesh *rest, const struct mesh_soup *soup, const char *pointer,
                      struct mesh **result, struct error *err);

/* Numbers the distinct positions among `count` points in the order of their first appearance:
 * id[i] is the number of position[i] and first[id] its first point. -0 equals 0; positions are
 * finite. `first` has room for `count`. *distinct is their number. False where memory ran out.
 * O(count), also for points chosen to collide. */
bool mesh_weld(const double (*position)[3], uint32_t count, uint32_t *id, uint32_t *first,
               uint32_t *distinct);

/* Whether three points enclose no area that rounding of their coordinates could not have made. */
bool mesh_triangle_is_flat(const double a[3], const double b[3], const double c[3]);

/* Fills mesh->normal and mesh->corner_normal from the soup's corners; source[t] is the soup's
 * triangle that became triangle t; mesh->normal comes in zeroed. False where memory ran out. */
bool mesh_make_normals(struct mesh *mesh, const struct mesh_soup *soup, const uint32_t *source);

/* Fills mesh->corner_uv; needs bounds and neighbours. False where memory ran out. */
bool mesh_make_uvs(struct mesh *mesh, const struct mesh_soup *soup, const uint32_t *source);

/* Fills mesh->neighbour and counts open and non-manifold edges. False where memory ran out. */
bool mesh_find_neighbours(struct mesh *mesh);

#endif
