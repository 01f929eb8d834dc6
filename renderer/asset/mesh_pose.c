/* A mesh in another pose: new positions and normals on the topology of the rest pose, so that its
 * adjacency, its texture coordinates (made ones too) and its welding are found once, and a shell
 * over it does not crack as it bends.
 *
 * Triangles that lose their area in a pose stay: the shell over them is flat there and holds
 * nothing. Where no normal can be made of them, the rest pose's stands. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/mesh_build.h"

static bool is_zero(const double n[3]) {
    return n[0] == 0 && n[1] == 0 && n[2] == 0;
}

static void take_positions(const struct mesh_soup *soup, struct mesh *mesh) {
    for (int c = 0; c < 3; c++) {
        mesh->bounds_min[c] = INFINITY;
        mesh->bounds_max[c] = -INFINITY;
    }
    for (uint32_t t = mesh->triangle_count; t-- > 0;) /* the first corner of a vertex is the last */
        for (int k = 2; k >= 0; k--) {
            const double *from = soup->position[3 * (size_t)mesh->source[t] + (size_t)k];
            for (int c = 0; c < 3; c++)
                mesh->position[mesh->vertex[t][k]][c] = from[c] + 0.0; /* -0 becomes 0 */
        }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        for (int c = 0; c < 3; c++) {
            mesh->bounds_min[c] = fmin(mesh->bounds_min[c], mesh->position[v][c]);
            mesh->bounds_max[c] = fmax(mesh->bounds_max[c], mesh->position[v][c]);
        }
}

static void mend_normals(struct mesh *mesh) {
    const struct mesh *rest = mesh->rest;
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        if (is_zero(mesh->normal[v]))
            memcpy(mesh->normal[v], rest->normal[v], sizeof mesh->normal[v]);
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            float *n = mesh->corner_normal[t][k];
            for (int c = 0; c < 3 && n[0] == 0 && n[1] == 0 && n[2] == 0; c++)
                n[c] = (float)mesh->normal[mesh->vertex[t][k]][c];
        }
}

enum status mesh_pose(struct mesh *rest, const struct mesh_soup *soup, const char *pointer,
                      struct mesh **result, struct error *err) {
    *result = NULL;
    struct mesh *mesh = malloc(sizeof *mesh);
    if (!mesh)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a pose");
    *mesh = *rest;
    mesh->rest = rest;
    mesh->serial = 0;
    mesh->references = 0;
    size_t v = mesh->vertex_count, t = mesh->triangle_count;
    mesh->position = calloc(v, sizeof *mesh->position);
    mesh->normal = calloc(v, sizeof *mesh->normal);
    mesh->corner_normal = calloc(t, sizeof *mesh->corner_normal);
    mesh->bytes = sizeof *mesh + v * (sizeof *mesh->position + sizeof *mesh->normal) +
                  t * sizeof *mesh->corner_normal;
    struct mesh_diagnosis *found = &mesh->diagnosis;
    found->normals_made = false;
    found->normals_made_count = found->normals_made_first = 0;
    bool enough = mesh->position && mesh->normal && mesh->corner_normal;
    if (enough) {
        take_positions(soup, mesh);
        enough = mesh_make_normals(mesh, soup, mesh->source);
    }
    if (!enough) {
        mesh_destroy(mesh);
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer,
                           "no memory for a pose of %u triangles", rest->triangle_count);
    }
    mend_normals(mesh);
    *result = mesh;
    return STATUS_OK;
}
