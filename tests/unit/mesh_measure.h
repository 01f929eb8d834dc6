/* What tests measure on a mesh. */
#ifndef PELT_TESTS_UNIT_MESH_MEASURE_H
#define PELT_TESTS_UNIT_MESH_MEASURE_H

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "renderer/asset/mesh.h"

/* Area times unit normal of a triangle. */
static inline void measure_area_vector(const struct mesh *mesh, uint32_t t, double n[3]) {
    const uint32_t *v = mesh->vertex[t];
    double a[3], b[3];
    for (int k = 0; k < 3; k++) {
        a[k] = mesh->position[v[1]][k] - mesh->position[v[0]][k];
        b[k] = mesh->position[v[2]][k] - mesh->position[v[0]][k];
    }
    for (int k = 0; k < 3; k++)
        n[k] = (a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]) / 2;
}

static inline double measure_area(const struct mesh *mesh) {
    double sum = 0, n[3];
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        measure_area_vector(mesh, t, n);
        sum += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    }
    return sum;
}

/* By the divergence theorem; positive where triangles face outwards. */
static inline double measure_volume(const struct mesh *mesh) {
    double sum = 0, n[3];
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        measure_area_vector(mesh, t, n);
        const double *p = mesh->position[mesh->vertex[t][0]];
        sum += (n[0] * p[0] + n[1] * p[1] + n[2] * p[2]) / 3;
    }
    return sum;
}

/* V - E + F: 2 for each sphere, 0 for each torus, 1 for each disc. */
static inline long measure_euler(const struct mesh *mesh) {
    long shared = 0, open = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            *(mesh->neighbour[t][k] == MESH_NONE ? &open : &shared) += 1;
    return (long)mesh->vertex_count - shared / 2 - open + (long)mesh->triangle_count;
}

#endif
