/* UVs for triangles that come without: box projection of equal density.
 *
 * Each triangle is seen along the coordinate axis that it faces most; u x v points outwards on all
 * six sides, and v runs upwards on the four upright ones. One unit of UV is the square root of the
 * surface's area, so that the whole mesh covers about one unit of UV area, as the built-in shapes
 * do, and `tiles` means the same on both.
 *
 * Charts meet in seams, where a material that is not isotropic shows a break. To keep seams few and
 * straight, triangles choose their side by normals smoothed over their neighbours, and then go with
 * the majority of their neighbours; but never to a side that they turn from by more than 60
 * degrees, which would stretch their map by more than 2. An atlas that cuts a surface open cleverly
 * is a subject of its own, left to the asset. */
#include "renderer/asset/mesh_build.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SMOOTHING_ROUNDS = 8, VOTING_ROUNDS = 6 };

static const double FACING_MIN = 0.5; /* cosine of 60 degrees */

static void edges(const struct mesh *mesh, uint32_t t, double unit, double e1[3], double e2[3]) {
    const uint32_t *v = mesh->vertex[t];
    for (int k = 0; k < 3; k++) {
        e1[k] = (mesh->position[v[1]][k] - mesh->position[v[0]][k]) / unit;
        e2[k] = (mesh->position[v[2]][k] - mesh->position[v[0]][k]) / unit;
    }
}

static void area_vector(const struct mesh *mesh, uint32_t t, double unit, double n[3]) {
    double a[3], b[3];
    edges(mesh, t, unit, a, b);
    n[0] = (a[1] * b[2] - a[2] * b[1]) / 2;
    n[1] = (a[2] * b[0] - a[0] * b[2]) / 2;
    n[2] = (a[0] * b[1] - a[1] * b[0]) / 2;
}

static bool normalise(double n[3]) {
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++)
        n[k] = length > 0 ? n[k] / length : 0;
    return length > 0;
}

/* Sides are numbered 2 * axis, plus 1 for the negative one. */
static int side_of(const double n[3]) {
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(n[k]) > fabs(n[axis]))
            axis = k;
    return 2 * axis + (n[axis] < 0);
}

static bool faces(const double n[3], int side) {
    return (side & 1 ? -n[side / 2] : n[side / 2]) >= FACING_MIN;
}

/* One round of smoothing: each triangle's normal and its neighbours', to unit length. */
static void smooth(const struct mesh *mesh, double (*from)[3], double (*to)[3]) {
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double sum[3];
        memcpy(sum, from[t], sizeof sum);
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3 && mesh->neighbour[t][k] != MESH_NONE; c++)
                sum[c] += from[mesh->neighbour[t][k]][c];
        if (!normalise(sum))
            memcpy(sum, from[t], sizeof sum);
        memcpy(to[t], sum, sizeof sum);
    }
}

/* One round of voting: a triangle two of whose neighbours look from one other side joins them. */
static void vote(const struct mesh *mesh, double (*face)[3], const uint8_t *from, uint8_t *to) {
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        to[t] = from[t];
        const uint32_t *other = mesh->neighbour[t];
        for (int k = 0; k < 3; k++) {
            uint32_t a = other[k], b = other[(k + 1) % 3];
            if (a != MESH_NONE && b != MESH_NONE && from[a] == from[b] && faces(face[t], from[a]))
                to[t] = from[a];
        }
    }
}

/* The side from which each triangle is seen, malloc'ed; NULL where memory ran out. */
static uint8_t *choose_sides(const struct mesh *mesh, double unit) {
    size_t count = mesh->triangle_count;
    double(*face)[3] = calloc(count, sizeof *face);
    double(*a)[3] = calloc(count, sizeof *a), (*b)[3] = calloc(count, sizeof *b);
    uint8_t *side = calloc(count, 1), *next = calloc(count, 1);
    if (face && a && b && side && next) {
        for (uint32_t t = 0; t < count; t++) {
            area_vector(mesh, t, unit, face[t]);
            normalise(face[t]);
            memcpy(a[t], face[t], sizeof a[t]);
        }
        for (int round = 0; round < SMOOTHING_ROUNDS; round += 2) {
            smooth(mesh, a, b);
            smooth(mesh, b, a);
        }
        for (uint32_t t = 0; t < count; t++) {
            int smoothed = side_of(a[t]);
            side[t] = (uint8_t)(faces(face[t], smoothed) ? smoothed : side_of(face[t]));
        }
        for (int round = 0; round < VOTING_ROUNDS; round += 2) {
            vote(mesh, face, side, next);
            vote(mesh, face, next, side);
        }
    } else {
        free(side);
        side = NULL;
    }
    free(face);
    free(a);
    free(b);
    free(next);
    return side;
}

/* The length of one unit of UV over that of one unit of `unit`. */
static double density(const struct mesh *mesh, double unit) {
    double area = 0, n[3];
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        area_vector(mesh, t, unit, n);
        area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    }
    return 1 / sqrt(area);
}

bool mesh_make_uvs(struct mesh *mesh, const struct mesh_soup *soup, const uint32_t *source) {
    struct mesh_diagnosis *found = &mesh->diagnosis;
    uint32_t missing = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        uint32_t s = source[t];
        missing += !soup->has_uv[s];
        for (int k = 0; k < 3 && soup->has_uv[s]; k++)
            memcpy(mesh->corner_uv[t][k], soup->uv[3 * (size_t)s + (size_t)k],
                   sizeof mesh->corner_uv[t][k]);
    }
    if (!missing)
        return true;

    /* Measured in units of the longest side, so that squares neither overflow nor vanish. */
    double unit = 0;
    for (int k = 0; k < 3; k++)
        unit = fmax(unit, mesh->bounds_max[k] - mesh->bounds_min[k]);
    double scale = density(mesh, unit);
    uint8_t *side = choose_sides(mesh, unit), *counted = calloc(mesh->vertex_count, 1);
    bool enough = side && counted;
    for (uint32_t t = 0; enough && t < mesh->triangle_count; t++) {
        if (soup->has_uv[source[t]])
            continue;
        if (!found->uvs_made)
            found->uvs_made_first = mesh->vertex[t][0];
        found->uvs_made = true;
        int axis = side[t] / 2;
        double sign = side[t] & 1 ? -1 : 1;
        for (int k = 0; k < 3; k++) {
            uint32_t v = mesh->vertex[t][k];
            double p[3];
            for (int c = 0; c < 3; c++)
                p[c] = (mesh->position[v][c] - mesh->bounds_min[c]) / unit * scale;
            double *uv = mesh->corner_uv[t][k];
            uv[0] = axis == 0 ? sign * p[1] : axis == 1 ? -sign * p[0] : sign * p[0];
            uv[1] = axis == 2 ? p[1] : p[2];
            found->uvs_made_count += !counted[v];
            counted[v] = 1;
        }
    }
    free(side);
    free(counted);
    return enough;
}
