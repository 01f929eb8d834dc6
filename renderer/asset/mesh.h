/* The final mesh, as every other room uses it: welded, with normals, UVs at corners, adjacency.
 *
 * "Welded" means that corners at the same position (to the bit, after node transforms) are one
 * vertex, whatever UV seams or hard edges lie between them, so that a shell extruded along the
 * vertex normals does not crack. Shading normals and UVs stay with the corners. */
#ifndef PELT_RENDERER_ASSET_MESH_H
#define PELT_RENDERER_ASSET_MESH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/report.h"
#include "api/scene.h"
#include "renderer/asset/source.h"

#define MESH_NONE UINT32_MAX
enum { MESH_TRIANGLES_MAX = 4000000 };

/* 8-bit sRGB RGBA image, top-left origin. */
struct mesh_image {
    int width, height;
    uint8_t *rgba; /* width * height * 4 */
};

/* What a triangle of an asset looks like where the scene gives no colour. */
struct mesh_surface {
    float base_color[4]; /* linear */
    int image;           /* index into images, -1: none; multiplied with base_color */
};

/* Face k of a triangle is the edge from corner k to corner (k + 1) % 3. */
struct mesh {
    uint64_t serial; /* from 1, unique among all meshes that one cache ever made */
    uint32_t vertex_count;
    double (*position)[3]; /* object space, Z up */
    double (*normal)[3];   /* unit; angle-weighted mean of the normals that the asset gives at this
                              vertex, or of its triangles' normals where it gives none. Never zero */
    uint32_t triangle_count;
    uint32_t (*vertex)[3];        /* welded vertex of each corner; never two alike */
    float (*corner_normal)[3][3]; /* unit shading normals */
    double (*corner_uv)[3][2]; /* before `tiles` is applied; an asset's are as in its file: (0, 0)
                                  is the top left corner of its images */
    uint32_t (*neighbour)[3];  /* triangle across each edge, MESH_NONE at a border or a
                                  non-manifold edge */
    uint16_t *surface;         /* index into surfaces for each triangle */
    uint32_t surface_count, image_count;
    struct mesh_surface *surfaces;
    struct mesh_image *images;
    double bounds_min[3], bounds_max[3];

    /* Pre-flight diagnosis: how many, and the first one's index (triangle, or edge as triangle). */
    struct mesh_diagnosis {
        uint64_t zero_area, zero_area_first;       /* dropped from the triangles above */
        uint64_t non_manifold, non_manifold_first; /* edges with more than two triangles, or two of
                                                      opposite orientation */
        uint64_t open_edges;                       /* borders: not a fault, told in `work` */
        bool normals_made, uvs_made;
        uint64_t normals_made_count, uvs_made_count; /* vertices concerned */
        uint64_t normals_made_first, uvs_made_first; /* the first such vertex */
    } diagnosis;

    /* Of an asset: the triangle of its file that became each; NULL where the mesh cannot be posed.
     */
    uint32_t *source;
    uint64_t source_count; /* triangles of the file */
    /* Of a posed mesh: the rest pose, whose arrays it shares but for position, normal and
     * corner_normal; it is held while this one lives. Else NULL. */
    struct mesh *rest;

    size_t bytes; /* of memory, for the cache */
    int references;
};

struct mesh_cache; /* keyed by shape parameters or by the asset's SHA-256; counts references */
struct mesh_cache *mesh_cache_create(size_t bytes_max);
void mesh_cache_destroy(struct mesh_cache *cache);

/* The mesh that `spec` describes, made or taken from the cache. `pointer` is that of the mesh in
 * the scene. The caller gives it back with mesh_release(). Loads the tinygltf module for an asset,
 * and the OpenImageIO module only if the asset carries textures and `want_textures`.
 * STATUS_BAD_ASSET, STATUS_ASSET_NOT_FOUND, STATUS_TOO_COMPLEX, STATUS_OUT_OF_MEMORY. */
enum status mesh_acquire(struct mesh_cache *cache, const struct scene_mesh *spec,
                         bool want_textures, const char *pointer, const struct asset_source *source,
                         const struct mesh **mesh, struct error *err);
void mesh_release(struct mesh_cache *cache, const struct mesh *mesh);

/* Adds the diagnosis to the report, one warning for each kind found. */
void mesh_warn(const struct mesh *mesh, const char *pointer, struct report *report);

#endif
