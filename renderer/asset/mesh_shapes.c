/* Built-in shapes: plane, sphere, torus, cylinder, terrain (and the dispatch to the teapot).
 *
 * Every shape is a grid of points in closed form, so that refining `divisions` converges to the
 * analytic surface at second order. Angles come from mesh_circle_point(), periodic to the bit:
 * seams and poles weld without a tolerance. UVs run once over the shape, u x v outwards:
 *
 *   plane     z = 0, centred, normal +z; u along x, v along y
 *   terrain   the plane, raised by a seeded noise into 0 <= z <= height
 *   sphere    u eastwards from +x, v from the south pole to the north pole
 *   torus     axis z; u around the axis from +x, v around the tube, its seam on the inside
 *   cylinder  axis z, centred; u around, v from bottom to top. An open tube: what a shell is
 * wrapped around (a sleeve, a trunk). Caps would need a rim, where the prisms of side and cap splay
 * by 45 degrees, and a map of their own.
 */
#include "renderer/asset/mesh_soup.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/asset/mesh.h"

/* What a grid of points needs; the shapes fill it. */
struct grid {
    int n, m;
    double (*position)[3];
    float (*normal)[3];
    double (*uv)[2];
};

static bool grid_init(struct grid *grid, int n, int m) {
    size_t points = ((size_t)n + 1) * ((size_t)m + 1);
    *grid = (struct grid){.n = n, .m = m};
    grid->position = calloc(points, sizeof *grid->position);
    grid->normal = calloc(points, sizeof *grid->normal);
    grid->uv = calloc(points, sizeof *grid->uv);
    return grid->position && grid->normal && grid->uv;
}

static void grid_finish(struct grid *grid) {
    free(grid->position);
    free(grid->normal);
    free(grid->uv);
}

static void grid_set(struct grid *grid, int i, int j, const double position[3],
                     const double normal[3]) {
    size_t at = (size_t)j * ((size_t)grid->n + 1) + (size_t)i;
    for (int k = 0; k < 3; k++) {
        grid->position[at][k] = position[k] + 0.0; /* no negative zeros */
        grid->normal[at][k] = (float)normal[k];
    }
    grid->uv[at][0] = (double)i / grid->n;
    grid->uv[at][1] = (double)j / grid->m;
}

static void fill_plane(struct grid *grid, const struct scene_mesh *spec) {
    for (int j = 0; j <= grid->m; j++)
        for (int i = 0; i <= grid->n; i++)
            grid_set(grid, i, j,
                     (double[3]){spec->size[0] * ((double)i / grid->n - 0.5),
                                 spec->size[1] * ((double)j / grid->m - 0.5), 0},
                     (double[3]){0, 0, 1});
}

static void fill_terrain(struct grid *grid, const struct scene_mesh *spec) {
    /* The noise lives in units of the shorter side, so that hills are round on any rectangle. */
    double unit = fmin(spec->size[0], spec->size[1]);
    double cell = fmax(spec->size[0] / grid->n, spec->size[1] / grid->m) / unit;
    int cells = cell > 1e-6 && cell < 1 ? (int)(1 / cell) : 1;
    for (int j = 0; j <= grid->m; j++)
        for (int i = 0; i <= grid->n; i++) {
            double u = (double)i / grid->n, v = (double)j / grid->m, slope[2];
            double f = mesh_terrain_height(u * (spec->size[0] / unit), v * (spec->size[1] / unit),
                                           cells, spec->seed, slope);
            double dx = slope[0] * (spec->height / unit), dy = slope[1] * (spec->height / unit);
            double length = sqrt(dx * dx + dy * dy + 1);
            grid_set(
                grid, i, j,
                (double[3]){spec->size[0] * (u - 0.5), spec->size[1] * (v - 0.5), spec->height * f},
                (double[3]){-dx / length, -dy / length, 1 / length});
        }
}

static void fill_sphere(struct grid *grid, const struct scene_mesh *spec) {
    for (int j = 0; j <= grid->m; j++) {
        double down, ring; /* cosine and sine of the angle from the south pole */
        mesh_circle_point(j, 2 * grid->m, &down, &ring);
        for (int i = 0; i <= grid->n; i++) {
            double x, y;
            mesh_circle_point(i, grid->n, &x, &y);
            double normal[3] = {ring * x, ring * y, -down};
            grid_set(grid, i, j,
                     (double[3]){spec->radius * normal[0], spec->radius * normal[1],
                                 spec->radius * normal[2]},
                     normal);
        }
    }
}

static void fill_torus(struct grid *grid, const struct scene_mesh *spec) {
    for (int j = 0; j <= grid->m; j++) {
        double inwards, down; /* the angle around the tube starts on the inside */
        mesh_circle_point(j, grid->m, &inwards, &down);
        double ring = spec->radius - spec->tube * inwards;
        for (int i = 0; i <= grid->n; i++) {
            double x, y;
            mesh_circle_point(i, grid->n, &x, &y);
            grid_set(grid, i, j, (double[3]){ring * x, ring * y, -spec->tube * down},
                     (double[3]){-inwards * x, -inwards * y, -down});
        }
    }
}

static void fill_cylinder(struct grid *grid, const struct scene_mesh *spec) {
    for (int j = 0; j <= grid->m; j++)
        for (int i = 0; i <= grid->n; i++) {
            double x, y;
            mesh_circle_point(i, grid->n, &x, &y);
            grid_set(grid, i, j,
                     (double[3]){spec->radius * x, spec->radius * y,
                                 spec->height * ((double)j / grid->m - 0.5)},
                     (double[3]){x, y, 0});
        }
}

static const struct {
    void (*fill)(struct grid *grid, const struct scene_mesh *spec);
    const char *name;
    int divisions_min[2]; /* fewer enclose nothing */
} shapes[] = {
    [SCENE_MESH_PLANE] = {fill_plane, "plane", {1, 1}},
    [SCENE_MESH_TERRAIN] = {fill_terrain, "terrain", {1, 1}},
    [SCENE_MESH_SPHERE] = {fill_sphere, "sphere", {3, 2}},
    [SCENE_MESH_TORUS] = {fill_torus, "torus", {3, 3}},
    [SCENE_MESH_CYLINDER] = {fill_cylinder, "cylinder", {3, 1}},
    [SCENE_MESH_TEAPOT] = {NULL, "teapot", {1, 1}},
};

enum status mesh_shape_make(const struct scene_mesh *spec, const char *pointer,
                            struct mesh_soup *soup, struct error *err) {
    *soup = (struct mesh_soup){0};
    int n = spec->divisions[0], m = spec->divisions[1];
    char at[256];
    for (int k = 0; k < 2; k++)
        if (spec->divisions[k] < shapes[spec->kind].divisions_min[k]) {
            snprintf(at, sizeof at, "%s/divisions/%d", pointer, k);
            return error_fault(err, STATUS_INVALID_SCENE, at,
                               "a %s needs at least %d divisions here", shapes[spec->kind].name,
                               shapes[spec->kind].divisions_min[k]);
        }
    uint64_t patches = spec->kind == SCENE_MESH_TEAPOT ? 32 : 1;
    uint64_t triangles = 2 * patches * (uint64_t)n * (uint64_t)m; /* ints: cannot overflow */
    if (triangles > MESH_TRIANGLES_MAX) {
        snprintf(at, sizeof at, "%s/divisions", pointer);
        return error_fault(err, STATUS_TOO_COMPLEX, at,
                           "%d x %d divisions of a %s make %llu "
                           "triangles; at most %d are drawn",
                           n, m, shapes[spec->kind].name, (unsigned long long)triangles,
                           MESH_TRIANGLES_MAX);
    }
    if (!mesh_soup_init(soup, triangles))
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for %llu triangles",
                           (unsigned long long)triangles);
    if (spec->kind == SCENE_MESH_TEAPOT)
        return mesh_teapot_make(spec, soup, pointer, err);
    struct grid grid;
    enum status status = STATUS_OK;
    if (grid_init(&grid, n, m)) {
        shapes[spec->kind].fill(&grid, spec);
        mesh_soup_add_grid(soup, n, m, grid.position, grid.normal, grid.uv);
    } else {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for %d x %d divisions",
                             n, m);
    }
    grid_finish(&grid);
    return status;
}
