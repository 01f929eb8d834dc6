/* See footprint.h. The shader finds the same for each segment (shaders/common_filter.glsl). */
#include "renderer/path/footprint.h"

#include <math.h>
#include <stdio.h>

#include "shaders/interface.h"

enum { VIEW_MIB_MAX = 512 };

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Gradients of u, v and w in a cell, in voxels for an object unit; false where it has no volume. */
static bool find_rates(const struct shell *shell, uint32_t t, const int size[3],
                       double rates[3][3]) {
    const uint32_t *v = shell->tetra[t];
    const float(*cell)[4] = shell->cell[t];
    double e[3][3], g[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            e[k][i] = shell->position[v[k + 1]][i] - shell->position[v[0]][i];
    for (int k = 0; k < 3; k++)
        cross(e[(k + 1) % 3], e[(k + 2) % 3], g[k]);
    double volume = dot(e[0], g[0]);
    if (!(fabs(volume) > 0))
        return false;
    const double u[3][3] = {{(double)cell[2][3], (double)cell[3][3], (double)cell[4][3]},
                            {(double)cell[5][3], (double)cell[6][3], (double)cell[7][0]},
                            {(double)cell[7][1], (double)cell[7][2], (double)cell[7][3]}};
    for (int axis = 0; axis < 3; axis++) {
        double voxels = size[axis] > 1 ? size[axis] / volume : 0;
        for (int i = 0; i < 3; i++)
            rates[axis][i] =
                voxels * (u[0][axis] * g[0][i] + u[1][axis] * g[1][i] + u[2][axis] * g[2][i]);
    }
    return true;
}

static double voxels_of(double rates[3][3], const double at[3], const double by[3], double t,
                        double share) {
    double sum = 0, way[3];
    for (int i = 0; i < 3; i++)
        way[i] = (at[i] + t * by[i]) * share;
    for (int axis = 0; axis < 3; axis++)
        sum += dot(rates[axis], way) * dot(rates[axis], way);
    return sum;
}

struct footprint footprint_find(const struct path_object *object) {
    const struct shell *shell = object->shell;
    const struct view *view = &object->projection.view;
    struct footprint found = {INFINITY, 0};
    for (uint32_t cell = 0; cell < shell->tetra_count; cell++) {
        double rates[3][3], near = INFINITY, far = -INFINITY;
        if (!find_rates(shell, cell, object->volume->size, rates))
            continue;
        for (int k = 0; k < 4; k++) {
            double t =
                dot(view->h_row, shell->position[shell->tetra[cell][k]]) + view->h_row[3] - 1;
            near = fmin(near, t);
            far = fmax(far, t);
        }
        if (far <= -1)
            continue;
        double end[2] = {fmax(near, -1), far}, voxels[2];
        for (int i = 0; i < 2; i++)
            voxels[i] = fmax(voxels_of(rates, view->ou, view->du, end[i], 2.0 / view->width),
                             voxels_of(rates, view->ov, view->dv, end[i], 2.0 / view->height));
        found.least = fmin(found.least, voxels[0]);
        found.most = fmax(found.most, voxels[1]);
    }
    return (struct footprint){isfinite(found.least) ? sqrt(found.least) : 0, sqrt(found.most)};
}

static enum status refuse(const struct path_object *object, const char *why, struct error *err) {
    char pointer[64];
    snprintf(pointer, sizeof pointer, "%s/quality/filter", object->pointer);
    return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer, "%s", why);
}

/* What is seen from each side takes much more room than the voxels: levels from half the size on
 * (together 4/3 of the first), of 20 bytes a texel, and 16 for each texture of moments where lit.
 */
static double view_mib(const struct volume *volume) {
    double texels = volume->size[0] / 2.0 * (volume->size[1] / 2.0) * 4 / 3;
    int bytes = 20 + (volume->lit && !volume->strand_lit ? 16 * VIEW_MOMENTS : 0);
    return texels * volume->size[2] * VIEW_SIDES * bytes / (1 << 20);
}

/* Several media are walked through together (joint.h), which reads voxels or mips. */
static bool alone(const struct path_object *objects, size_t count) {
    size_t media = 0;
    for (size_t i = 0; i < count; i++)
        media += objects[i].shell && objects[i].walk && volume_has_medium(objects[i].volume);
    return media <= 1;
}

enum status footprint_choose_filters(struct path_object *objects, size_t count, struct error *err) {
    for (size_t i = 0; i < count; i++) {
        struct path_object *object = &objects[i];
        object->filter = SCENE_FILTER_NONE;
        enum scene_filter asked = object->object->quality.filter;
        if (!object->shell || asked == SCENE_FILTER_NONE || asked == SCENE_FILTER_AUTO)
            continue;
        if (object->object->path == SCENE_PATH_SLICING && object->method != SCENE_SLICING_SLABS)
            return refuse(object, "slices as published read the voxels themselves", err);
        if (object->object->quality.map == SCENE_MAP_AFFINE)
            return refuse(object, "footprints are found by the prisms' own map", err);
        if (object->volume->homogeneous || !volume_has_medium(object->volume))
            continue;
        if (asked == SCENE_FILTER_VIEW && object->walk && !alone(objects, count))
            return refuse(
                object,
                "several media are walked through together, which what is seen from a side "
                "does not tell of: take `mip`, or `order` `sorted`",
                err);
        object->footprint = footprint_find(object).most;
        if (asked == SCENE_FILTER_VIEW && object->footprint > 1 &&
            view_mib(object->volume) > VIEW_MIB_MAX)
            return refuse(object,
                          "what is seen from each side of so many voxels would take more than "
                          "512 MiB: take `mip`, or fewer voxels",
                          err);
        if (object->footprint > 1) {
            object->filter = asked;
            object->exact = true;
        }
    }
    return STATUS_OK;
}

struct bake_filter footprint_filter(const struct path_object *object) {
    struct bake_filter filter = {.kind = object->filter};
    for (int i = 0; i < 2; i++)
        filter.leaps[i] = path_object_leaps(object, i == 1);
    const struct shell *shell = object->shell;
    /* Texture coordinates that do not change, or that do so within nothing, have no length: far
     * beyond what a footprint can tell apart. */
    for (int i = 0; i < 2; i++)
        filter.aspect[i] = fmin(fmax(1 / (shell->tiles_rate[i] * shell->thickness), 1e-9), 1e9);
    return filter;
}
