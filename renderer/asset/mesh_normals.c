/* Normals of vertices and corners.
 *
 * A vertex takes the mean of its corners' normals where the asset gives them, of its triangles'
 * normals where not; either mean is weighted by the corner's angle (Thuermer and Wuethrich,
 * "Computing Vertex Normals from Polygonal Facets", 1998), so that it does not depend on how a face
 * was cut into triangles: a cube's corner points along its diagonal however its sides are split.
 *
 * Where the mean vanishes (two triangles back to back), the normal of the first triangle at the
 * vertex stands in: any choice is arbitrary there, and this one is stable. */
#include "renderer/asset/mesh_build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3]) {
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

/* b - a, scaled so that its largest component is 1: lengths neither overflow nor vanish. */
static void direction(const double a[3], const double b[3], double d[3]) {
    double largest = 0;
    for (int k = 0; k < 3; k++) {
        d[k] = b[k] - a[k];
        largest = fmax(largest, fabs(d[k]));
    }
    for (int k = 0; k < 3; k++)
        d[k] /= largest;
}

/* To unit length; false where there is none to scale. */
static bool normalise(double v[3]) {
    double largest = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    if (!(largest > 0) || !isfinite(largest))
        return false;
    for (int k = 0; k < 3; k++)
        v[k] /= largest;
    double length = sqrt(dot(v, v));
    for (int k = 0; k < 3; k++)
        v[k] /= length;
    return true;
}

static void face_normal(const struct mesh *mesh, uint32_t t, double n[3]) {
    const uint32_t *v = mesh->vertex[t];
    double e1[3], e2[3];
    direction(mesh->position[v[0]], mesh->position[v[1]], e1);
    direction(mesh->position[v[0]], mesh->position[v[2]], e2);
    cross(e1, e2, n);
    normalise(n); /* cannot fail: flat triangles were dropped */
}

static double corner_angle(const struct mesh *mesh, uint32_t t, int k) {
    const uint32_t *v = mesh->vertex[t];
    double e1[3], e2[3], c[3];
    direction(mesh->position[v[k]], mesh->position[v[(k + 1) % 3]], e1);
    direction(mesh->position[v[k]], mesh->position[v[(k + 2) % 3]], e2);
    cross(e1, e2, c);
    return atan2(sqrt(dot(c, c)), dot(e1, e2)); /* well conditioned at 0 and pi, unlike acos */
}

/* The asset's normal at a corner, of unit length; false where it has none. */
static bool given_normal(const struct mesh_soup *soup, uint32_t source, int k, double n[3]) {
    if (!soup->has_normal[source])
        return false;
    for (int c = 0; c < 3; c++)
        n[c] = soup->normal[3 * (size_t)source + (size_t)k][c];
    return normalise(n);
}

/* Sums for the vertices: direction and weight apart, so that a sum that has cancelled is told from
 * one that is merely small. */
struct sums {
    double (*direction)[3];
    double *weight;
};

static void add(struct sums *sums, uint32_t v, double angle, const double n[3]) {
    for (int c = 0; c < 3; c++)
        sums->direction[v][c] += angle * n[c];
    sums->weight[v] += angle;
}

/* Shorter than this part of its weight, a sum of unit vectors is rounding: assets store normals in
 * fp32, 6e-8 each. */
static const double CANCELLED = 1e-6;

static bool settle(struct sums *sums, uint32_t v) {
    double *d = sums->direction[v];
    return dot(d, d) > CANCELLED * CANCELLED * sums->weight[v] * sums->weight[v] && normalise(d);
}

static void start_again(struct sums *sums, uint32_t v) {
    memset(sums->direction[v], 0, sizeof sums->direction[v]);
    sums->weight[v] = 0;
}

bool mesh_make_normals(struct mesh *mesh, const struct mesh_soup *soup, const uint32_t *source) {
    struct mesh_diagnosis *found = &mesh->diagnosis;
    struct sums sums = {mesh->normal, calloc(mesh->vertex_count, sizeof(double))};
    uint8_t *open = calloc(mesh->vertex_count, 1); /* vertices still without a normal */
    bool enough = sums.weight && open;
    double n[3];

    for (uint32_t t = 0; enough && t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++)
            if (given_normal(soup, source[t], k, n))
                add(&sums, mesh->vertex[t][k], corner_angle(mesh, t, k), n);
    for (uint32_t v = 0; enough && v < mesh->vertex_count; v++)
        if (!settle(&sums, v)) {
            if (!found->normals_made_count++)
                found->normals_made_first = v;
            open[v] = 1;
            start_again(&sums, v);
        }
    found->normals_made = found->normals_made_count > 0;

    for (uint32_t t = 0; enough && found->normals_made && t < mesh->triangle_count; t++) {
        const uint32_t *v = mesh->vertex[t];
        if (!open[v[0]] && !open[v[1]] && !open[v[2]])
            continue;
        face_normal(mesh, t, n);
        for (int k = 0; k < 3; k++)
            if (open[v[k]])
                add(&sums, v[k], corner_angle(mesh, t, k), n);
    }
    for (uint32_t v = 0; enough && v < mesh->vertex_count; v++)
        if (open[v] && settle(&sums, v))
            open[v] = 0;
    for (uint32_t t = 0; enough && found->normals_made && t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            uint32_t v = mesh->vertex[t][k];
            if (open[v]) {
                face_normal(mesh, t, mesh->normal[v]);
                open[v] = 0;
            }
        }

    for (uint32_t t = 0; enough && t < mesh->triangle_count; t++)
        for (int k = 0; k < 3; k++) {
            bool given = given_normal(soup, source[t], k, n);
            const double *from = given ? n : mesh->normal[mesh->vertex[t][k]];
            for (int c = 0; c < 3; c++)
                mesh->corner_normal[t][k][c] = (float)from[c];
        }
    free(sums.weight);
    free(open);
    return enough;
}
