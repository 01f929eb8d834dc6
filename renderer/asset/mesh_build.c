/* The order of the steps from soup to mesh, and the memory of a mesh. */
#include "renderer/asset/mesh_build.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A triangle is flat where its area could be the rounding of its coordinates alone: an error of one
 * unit in the last place of the largest coordinate, M eps, moves the doubled area by up to M eps L,
 * L the longest edge. Four such errors are allowed for. Slivers are kept: at a million to one the
 * area is 1e-6 L^2, and 4 eps M L reaches that only a billion edge lengths from the origin. */
bool mesh_triangle_is_flat(const double a[3], const double b[3], const double c[3]) {
    double reach = 0, e1[3], e2[3], length = 0;
    for (int k = 0; k < 3; k++) {
        reach = fmax(reach, fmax(fabs(a[k]), fmax(fabs(b[k]), fabs(c[k]))));
        e1[k] = b[k] - a[k];
        e2[k] = c[k] - a[k];
        length = fmax(length, fmax(fabs(e1[k]), fmax(fabs(e2[k]), fabs(e2[k] - e1[k]))));
    }
    if (length == 0)
        return true;
    for (int k = 0; k < 3; k++) {
        e1[k] /= length;
        e2[k] /= length;
    }
    double x = e1[1] * e2[2] - e1[2] * e2[1];
    double y = e1[2] * e2[0] - e1[0] * e2[2];
    double z = e1[0] * e2[1] - e1[1] * e2[0];
    return sqrt(x * x + y * y + z * z) <= 4 * DBL_EPSILON * (reach / length);
}

void mesh_destroy(struct mesh *mesh) {
    if (!mesh)
        return;
    free(mesh->position);
    free(mesh->normal);
    free(mesh->corner_normal);
    if (!mesh->rest) {
        for (uint32_t i = 0; i < mesh->image_count; i++)
            free(mesh->images[i].rgba);
        free(mesh->images);
        free(mesh->surfaces);
        free(mesh->vertex);
        free(mesh->corner_uv);
        free(mesh->neighbour);
        free(mesh->surface);
        free(mesh->source);
    }
    free(mesh);
}

/* What lives only while a mesh is built. */
struct work {
    uint32_t *id;    /* welded number of each of the soup's corners */
    uint32_t *first; /* of each welded position: its first corner */
    uint32_t
        *vertex; /* of each welded position: its vertex, MESH_NONE if no triangle is left there */
    uint32_t *source; /* of each triangle: the soup's */
};

/* Sorts out the flat triangles, numbers the rest and their vertices in the soup's order. */
static void keep_triangles(const struct mesh_soup *soup, struct work *work, uint32_t distinct,
                           struct mesh *mesh) {
    memset(work->vertex, 0xff, (size_t)distinct * sizeof *work->vertex);
    for (uint32_t t = 0; t < soup->triangle_count; t++) {
        const uint32_t *id = &work->id[3 * (size_t)t];
        if (mesh_triangle_is_flat(soup->position[work->first[id[0]]],
                                  soup->position[work->first[id[1]]],
                                  soup->position[work->first[id[2]]])) {
            if (!mesh->diagnosis.zero_area++)
                mesh->diagnosis.zero_area_first = t;
            continue;
        }
        for (int k = 0; k < 3; k++)
            if (work->vertex[id[k]] == MESH_NONE)
                work->vertex[id[k]] = mesh->vertex_count++;
        work->source[mesh->triangle_count++] = t;
    }
}

static bool allocate(struct mesh *mesh) {
    size_t v = mesh->vertex_count, t = mesh->triangle_count;
    assert(v > 0 && t > 0);
    mesh->position = calloc(v, sizeof *mesh->position);
    mesh->normal = calloc(v, sizeof *mesh->normal);
    mesh->vertex = calloc(t, sizeof *mesh->vertex);
    mesh->corner_normal = calloc(t, sizeof *mesh->corner_normal);
    mesh->corner_uv = calloc(t, sizeof *mesh->corner_uv);
    mesh->neighbour = calloc(t, sizeof *mesh->neighbour);
    mesh->surface = calloc(t, sizeof *mesh->surface);
    mesh->surfaces = calloc(1, sizeof *mesh->surfaces);
    mesh->bytes = sizeof *mesh + v * (sizeof *mesh->position + sizeof *mesh->normal) +
                  t * (sizeof *mesh->vertex + sizeof *mesh->corner_normal +
                       sizeof *mesh->corner_uv + sizeof *mesh->neighbour + sizeof *mesh->surface) +
                  sizeof *mesh->surfaces;
    return mesh->position && mesh->normal && mesh->vertex && mesh->corner_normal &&
           mesh->corner_uv && mesh->neighbour && mesh->surface && mesh->surfaces;
}

static void fill_vertices(const struct mesh_soup *soup, const struct work *work,
                          struct mesh *mesh) {
    for (int k = 0; k < 3; k++) {
        mesh->bounds_min[k] = INFINITY;
        mesh->bounds_max[k] = -INFINITY;
    }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        mesh->surface[t] = soup->surface[work->source[t]];
        for (int k = 0; k < 3; k++) {
            uint32_t id = work->id[3 * (size_t)work->source[t] + (size_t)k];
            uint32_t v = mesh->vertex[t][k] = work->vertex[id];
            for (int c = 0; c < 3; c++) {
                double x = soup->position[work->first[id]][c] + 0.0; /* -0 becomes 0 */
                mesh->position[v][c] = x;
                mesh->bounds_min[c] = fmin(mesh->bounds_min[c], x);
                mesh->bounds_max[c] = fmax(mesh->bounds_max[c], x);
            }
        }
    }
}

static bool weld(const struct mesh_soup *soup, uint32_t corners, struct work *work,
                 uint32_t *distinct) {
    const double(*position)[3] = (const double(*)[3])soup->position;
    if (soup->part_count == 0)
        return mesh_weld(position, corners, work->id, work->first, distinct);
    *distinct = 0;
    uint32_t begin = 0;
    for (uint32_t p = 0; p < soup->part_count; p++) {
        uint32_t end = 3 * (uint32_t)soup->part_end[p], found = 0;
        uint32_t *id = work->id + begin, *first = work->first + *distinct;
        if (!mesh_weld(position + begin, end - begin, id, first, &found))
            return false;
        for (uint32_t i = 0; i < end - begin; i++)
            id[i] += *distinct;
        for (uint32_t i = 0; i < found; i++)
            first[i] += begin;
        *distinct += found;
        begin = end;
    }
    return true;
}

enum status mesh_build(const struct mesh_soup *soup, const char *pointer, struct mesh **result,
                       struct error *err) {
    *result = NULL;
    if (soup->triangle_count > MESH_TRIANGLES_MAX)
        return error_fault(err, STATUS_TOO_COMPLEX, pointer,
                           "the mesh has %llu triangles; at most %d are drawn",
                           (unsigned long long)soup->triangle_count, MESH_TRIANGLES_MAX);
    uint32_t corners = 3 * (uint32_t)soup->triangle_count, distinct = 0;
    size_t room = corners ? corners : 1;
    struct work work = {malloc(room * sizeof(uint32_t)), malloc(room * sizeof(uint32_t)), NULL,
                        malloc(room / 3 * sizeof(uint32_t) + sizeof(uint32_t))};
    struct mesh *mesh = calloc(1, sizeof *mesh);
    enum status status = STATUS_OUT_OF_MEMORY;
    if (!mesh || !work.id || !work.first || !work.source || !weld(soup, corners, &work, &distinct))
        goto fail;
    work.vertex = malloc(((size_t)distinct + 1) * sizeof *work.vertex);
    if (!work.vertex)
        goto fail;
    keep_triangles(soup, &work, distinct, mesh);
    if (mesh->triangle_count == 0) {
        status = STATUS_BAD_ASSET;
        goto fail;
    }
    if (!allocate(mesh))
        goto fail;
    mesh->surface_count = 1;
    mesh->surfaces[0] = (struct mesh_surface){{1, 1, 1, 1}, -1};
    fill_vertices(soup, &work, mesh);
    if (!mesh_find_neighbours(mesh) || !mesh_make_normals(mesh, soup, work.source) ||
        !mesh_make_uvs(mesh, soup, work.source))
        goto fail;
    mesh->source = work.source;
    mesh->source_count = soup->triangle_count;
    mesh->bytes += (room / 3 + 1) * sizeof *mesh->source;
    work.source = NULL;
    *result = mesh;
    status = STATUS_OK;
fail:
    free(work.id);
    free(work.first);
    free(work.vertex);
    free(work.source);
    if (status == STATUS_OK)
        return STATUS_OK;
    mesh_destroy(mesh);
    if (status == STATUS_BAD_ASSET)
        return error_fault(err, status, pointer, "none of the mesh's %llu triangles has an area",
                           (unsigned long long)soup->triangle_count);
    return error_fault(err, status, pointer, "no memory for a mesh of %llu triangles",
                       (unsigned long long)soup->triangle_count);
}
