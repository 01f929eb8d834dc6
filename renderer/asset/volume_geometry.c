/* A tile of real geometry, voxelised: a mesh whose bounding box is the tile, x along u, y along v
 * and z from the base up, as a solid with the colours of its triangles.
 *
 * The field is s = clamp(1/2 + d/2, 0, 1) with d the exact distance to the nearest triangle in
 * voxel coordinates, positive where the mesh winds around the voxel's centre (volume_distance.c),
 * so that normals are the mesh's own and nothing terraces. The tile repeats along u and v: the
 * nearest triangle may be one of the tile beside it. Parts that overlap are one solid.
 *
 * A part of the mesh with open edges has no inside: its triangles are sheets that reach one voxel
 * to either side, d = 1 - distance, and the report says so. Parts are what adjacency connects.
 *
 * Colours are the base colour, times the texture at the nearest point (bilinear, repeated). Left
 * out: smooth shading normals, opacity, metalness; a part that is thinner than a voxel may vanish.
 */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/mesh.h"
#include "renderer/asset/volume_distance.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_resample.h"

/* The mesh in voxel coordinates. */
struct tile {
    const struct mesh *mesh;
    double origin[3], scale[3];
    uint8_t *open; /* for each triangle, whether its part has an open edge */
};

static void corners_of(const struct tile *tile, uint32_t triangle, double corner[3][3]) {
    for (int k = 0; k < 3; k++) {
        const double *p = tile->mesh->position[tile->mesh->vertex[triangle][k]];
        for (int i = 0; i < 3; i++)
            corner[k][i] = (p[i] - tile->origin[i]) * tile->scale[i];
    }
}

/* Marks the triangles of open parts: floods from the triangles at a border. NULL: no memory. */
static uint8_t *find_open(const struct mesh *mesh) {
    uint32_t count = mesh->triangle_count, top = 0;
    uint8_t *open = calloc(count ? count : 1, 1);
    uint32_t *stack = calloc(count ? count : 1, sizeof *stack);
    if (!open || !stack) {
        free(open);
        free(stack);
        return NULL;
    }
    bool borders = mesh->diagnosis.open_edges > 0; /* else only edges of more than two triangles */
    for (uint32_t t = 0; borders && t < count; t++)
        for (int k = 0; k < 3 && !open[t]; k++)
            if (mesh->neighbour[t][k] == MESH_NONE) {
                open[t] = 1;
                stack[top++] = t;
            }
    while (top) {
        const uint32_t *next = mesh->neighbour[stack[--top]];
        for (int k = 0; k < 3; k++)
            if (next[k] != MESH_NONE && !open[next[k]]) {
                open[next[k]] = 1;
                stack[top++] = next[k];
            }
    }
    free(stack);
    return open;
}

static float texel(const struct mesh_image *image, int x, int y, int c) {
    x = x % image->width;
    y = y % image->height;
    x += x < 0 ? image->width : 0;
    y += y < 0 ? image->height : 0;
    size_t at = ((size_t)y * (size_t)image->width + (size_t)x) * 4 + (size_t)c;
    return resample_linear_from_srgb((float)image->rgba[at] / 255.0f);
}

/* Linear colour of a triangle at a point of it. */
static void color_at(const struct mesh *mesh, uint32_t triangle, const double weight[3],
                     float color[3]) {
    const struct mesh_surface *surface = &mesh->surfaces[mesh->surface[triangle]];
    memcpy(color, surface->base_color, 3 * sizeof *color);
    if (surface->image < 0 || mesh->images[surface->image].width < 1)
        return;
    const struct mesh_image *image = &mesh->images[surface->image];
    double uv[2];
    for (int i = 0; i < 2; i++) {
        uv[i] = 0;
        for (int k = 0; k < 3; k++)
            uv[i] += weight[k] * mesh->corner_uv[triangle][k][i];
        uv[i] -= floor(uv[i]);
    }
    double x = uv[0] * image->width - 0.5, y = uv[1] * image->height - 0.5;
    int ix = (int)floor(x), iy = (int)floor(y);
    float fx = (float)(x - ix), fy = (float)(y - iy);
    for (int c = 0; c < 3; c++) {
        float low = texel(image, ix, iy, c) * (1 - fx) + texel(image, ix + 1, iy, c) * fx;
        float high = texel(image, ix, iy + 1, c) * (1 - fx) + texel(image, ix + 1, iy + 1, c) * fx;
        color[c] *= low * (1 - fy) + high * fy;
    }
}

/* The colour at a voxel's centre: that of the nearest triangle where the nearest copy of it is. */
static void color_voxel(const struct tile *tile, const int size[3], const int at[3],
                        uint32_t triangle, float color[3]) {
    double corner[3][3], weight[3], best[3] = {1, 0, 0}, least = INFINITY;
    corners_of(tile, triangle, corner);
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++) {
            double p[3] = {at[0] + 0.5 + i * size[0], at[1] + 0.5 + j * size[1], at[2] + 0.5};
            if (p[0] < -DISTANCE_BAND || p[0] > size[0] + DISTANCE_BAND || p[1] < -DISTANCE_BAND ||
                p[1] > size[1] + DISTANCE_BAND)
                continue; /* the tile's own triangles lie within [0, size] */
            double d = distance_to_triangle(p, corner, weight);
            if (d < least) {
                least = d;
                memcpy(best, weight, sizeof best);
            }
        }
    color_at(tile->mesh, triangle, best, color);
}

static void fill(const struct tile *tile, const struct distance_grid *grid, struct volume *volume) {
    const int *size = volume->size;
    float *voxel = volume->solid;
    size_t index = 0;
    for (int z = 0; z < size[2]; z++)
        for (int y = 0; y < size[1]; y++)
            for (int x = 0; x < size[0]; x++, voxel += 4, index++) {
                uint32_t triangle = grid->nearest[index];
                bool inside = grid->winding[index] != 0;
                float d = inside ? grid->distance[index] : -grid->distance[index];
                if (triangle != DISTANCE_NO_TRIANGLE && tile->open[triangle])
                    d = fmaxf(1.0f - grid->distance[index], inside ? 1.0f : -1.0f);
                float s = fminf(fmaxf(0.5f + 0.5f * d, 0.0f), 1.0f);
                if (!(s > 0.0f))
                    continue;
                float color[3] = {1, 1, 1}; /* deep inside: no surface reads it */
                int at[3] = {x, y, z};
                if (triangle != DISTANCE_NO_TRIANGLE)
                    color_voxel(tile, size, at, triangle, color);
                for (int c = 0; c < 3; c++)
                    voxel[c] = s * fminf(fmaxf(color[c], 0.0f), 1.0f);
                voxel[3] = s;
            }
}

static enum status voxelise(const struct mesh *mesh, const char *pointer, struct volume *volume,
                            struct error *err) {
    struct tile tile = {.mesh = mesh};
    struct distance_grid grid = {0};
    enum status status = STATUS_OK;
    for (int i = 0; i < 3; i++) {
        double extent = mesh->bounds_max[i] - mesh->bounds_min[i];
        int free_layers = i == 2 && volume->size[2] > 2 ? 1 : 0;
        tile.scale[i] = (volume->size[i] - 2 * free_layers) / extent;
        tile.origin[i] = mesh->bounds_min[i] - free_layers / tile.scale[i];
        if (!(extent > 0) || !isfinite(tile.scale[i]))
            return error_fault(err, STATUS_BAD_ASSET, pointer,
                               "the tile's mesh has no extent along %c: its bounding box is the "
                               "tile",
                               "xyz"[i]);
    }
    tile.open = find_open(mesh);
    volume->solid = volume_alloc_voxels(volume->size);
    if (!tile.open || !volume->solid || !distance_init(&grid, volume->size)) {
        status =
            error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a tile of geometry");
        goto done;
    }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double corner[3][3];
        corners_of(&tile, t, corner);
        status = distance_add(&grid, (const double(*)[3])corner, t);
        if (status != STATUS_OK) {
            error_fault(err, status, pointer,
                        "the tile's %u triangles lie near too many voxels; fewer of either can be "
                        "made",
                        mesh->triangle_count);
            goto done;
        }
        if (!tile.open[t])
            distance_add_winding(&grid, (const double(*)[3])corner);
    }
    distance_wind(&grid);
    fill(&tile, &grid, volume);
    volume->notes.open_edges = mesh->diagnosis.open_edges;
done:
    distance_finish(&grid);
    free(tile.open);
    return status;
}

enum status volume_make_geometry(const struct scene_material *spec,
                                 const struct asset_source *source, const char *pointer,
                                 struct volume *volume, struct error *err) {
    char path[256];
    snprintf(path, sizeof path, "%s/geometry", pointer);
    struct mesh_cache *cache = mesh_cache_create(0); /* nobody wants the mesh again */
    if (!cache)
        return error_fault(err, STATUS_OUT_OF_MEMORY, path, "no memory for a tile of geometry");
    const struct mesh *mesh = NULL;
    enum status status = mesh_acquire(cache, &spec->geometry, true, path, source, &mesh, err);
    if (status == STATUS_OK) {
        status = voxelise(mesh, path, volume, err);
        mesh_release(cache, mesh);
    }
    mesh_cache_destroy(cache);
    return status;
}
