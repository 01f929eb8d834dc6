/* UVs for triangles that come without: box projection of equal density.
 *
 * Each triangle is seen along the coordinate axis that it faces most; u x v points outwards on all
 * six sides, and v runs upwards on the four upright ones. One unit of UV is the square root of the
 * surface's area, so that the whole mesh covers about one unit of UV area, as the built-in shapes
 * do, and `tiles` means the same on both.
 *
 * Charts meet in seams, where a material that is not isotropic shows a break; an atlas without
 * seams does not exist for closed surfaces, and one with few is a subject of its own, left to the
 * asset. */
#include "renderer/asset/mesh_build.h"

#include <math.h>
#include <stdlib.h>

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

static int largest_axis(const double n[3]) {
    int axis = 0;
    for (int k = 1; k < 3; k++)
        if (fabs(n[k]) > fabs(n[axis]))
            axis = k;
    return axis;
}

/* The axis to look along. The vertices' normals decide where they can, which keeps charts in one
 * piece on bumpy surfaces; but never an axis that the triangle itself turns from by more than 60
 * degrees, which would stretch its map. */
static int axis_of(const struct mesh *mesh, uint32_t t, double unit, double n[3]) {
    area_vector(mesh, t, unit, n);
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    double smooth[3] = {0};
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++)
            smooth[c] += mesh->normal[mesh->vertex[t][k]][c];
    int axis = largest_axis(smooth);
    if (n[axis] * smooth[axis] > 0 && fabs(n[axis]) >= 0.5 * length)
        return axis;
    return largest_axis(n);
}

bool mesh_make_uvs(struct mesh *mesh, const struct mesh_soup *soup, const uint32_t *source) {
    struct mesh_diagnosis *found = &mesh->diagnosis;
    uint8_t *counted = calloc(mesh->vertex_count, 1);
    if (!counted)
        return false;
    /* Measured in units of the longest side, so that squares neither overflow nor vanish. */
    double extent = 0, area = 0, n[3], density = 0;
    for (int k = 0; k < 3; k++)
        extent = fmax(extent, mesh->bounds_max[k] - mesh->bounds_min[k]);
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        uint32_t s = source[t];
        if (soup->has_uv[s]) {
            for (int k = 0; k < 3; k++)
                for (int c = 0; c < 2; c++)
                    mesh->corner_uv[t][k][c] = soup->uv[3 * (size_t)s + (size_t)k][c];
            continue;
        }
        if (!found->uvs_made) {
            for (uint32_t i = 0; i < mesh->triangle_count; i++) {
                area_vector(mesh, i, extent, n);
                area += sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
            }
            density = 1 / sqrt(area);
            found->uvs_made = true;
            found->uvs_made_first = mesh->vertex[t][0];
        }
        int axis = axis_of(mesh, t, extent, n);
        double sign = n[axis] < 0 ? -1 : 1;
        for (int k = 0; k < 3; k++) {
            uint32_t v = mesh->vertex[t][k];
            double p[3];
            for (int c = 0; c < 3; c++)
                p[c] = (mesh->position[v][c] - mesh->bounds_min[c]) / extent * density;
            double *uv = mesh->corner_uv[t][k];
            uv[0] = axis == 0 ? sign * p[1] : axis == 1 ? -sign * p[0] : sign * p[0];
            uv[1] = axis == 2 ? p[1] : p[2];
            found->uvs_made_count += !counted[v];
            counted[v] = 1;
        }
    }
    free(counted);
    return true;
}
