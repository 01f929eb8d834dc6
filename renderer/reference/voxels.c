/* DESIGN, 'Material' and 'Light': trilinear between voxel centres at (k + 1/2)/n, periodic in u and
 * v, clamped in w. Normals come from central differences of opacity (of one voxel's own depth), or
 * of s for a solid, at the voxels; beyond the first and the last layer the field and its gradient
 * go on with their values. */
#include "renderer/reference/voxels.h"

#include "renderer/reference/vector.h"

static size_t wrap(long long k, int n) {
    long long r = k % n;
    return (size_t)(r < 0 ? r + n : r);
}

static const float *voxel_at(const struct volume *volume, bool solid, long long x, long long y,
                             long long z) {
    const int *n = volume->size;
    size_t layer = (size_t)(z < 0 ? 0 : z >= n[2] ? n[2] - 1 : z);
    size_t index = (layer * (size_t)n[1] + wrap(y, n[1])) * (size_t)n[0] + wrap(x, n[0]);
    return (solid ? volume->solid : volume->medium) + 4 * index;
}

/* The field whose gradient gives the normal. */
static double field_at(const struct volume *volume, bool solid, long long x, long long y,
                       long long z) {
    double value = voxel_at(volume, solid, x, y, z)[3];
    return solid ? value : value > 0 ? -expm1(-value / volume->size[2]) : 0;
}

void voxels_load(const struct volume *volume, bool solid, bool lit, int x, int y, int z,
                 struct voxels *voxels) {
    voxels->volume = volume;
    voxels->x = x;
    voxels->y = y;
    voxels->z = z;
    for (int c = 0; c < 8; c++) {
        const float *from = voxel_at(volume, solid, x + (c & 1), (long long)y + (c >> 1 & 1),
                                     (long long)z + (c >> 2));
        for (int i = 0; i < 4; i++)
            voxels->value[c][i] = from[i];
    }
    if (!lit)
        return;
    double field[4][4][4]; /* the corners of a face's neighbours are not needed, but cost little */
    int last = volume->size[2] - 1;
    for (int k = 0; k < 4; k++)
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++) {
                int outer = (k == 0 || k == 3) + (j == 0 || j == 3) + (i == 0 || i == 3);
                field[k][j][i] = outer > 1 ? 0
                                           : field_at(volume, solid, (long long)x + i - 1,
                                                      (long long)y + j - 1, (long long)z + k - 1);
            }
    for (int c = 0; c < 8; c++) {
        int i = 1 + (c & 1), j = 1 + (c >> 1 & 1), k = 1 + (c >> 2);
        /* A voxel that is not there has the gradient of the nearest that is, as it has its value.
         */
        if (z + k - 1 < 0)
            k++;
        if (z + k - 1 > last)
            k--;
        voxels->gradient[c][0] = (field[k][j][i - 1] - field[k][j][i + 1]) / 2;
        voxels->gradient[c][1] = (field[k][j - 1][i] - field[k][j + 1][i]) / 2;
        voxels->gradient[c][2] = (field[k - 1][j][i] - field[k + 1][j][i]) / 2;
    }
}

bool voxels_place(const struct prism_ray *prism, double t, double w, double at[3], double b[3]) {
    const int *n = prism->object->volume->size;
    if (!prism_barycentric(prism, t, w, b))
        return false;
    for (int i = 0; i < 2; i++)
        at[i] =
            (b[0] * prism->uv[0][i] + b[1] * prism->uv[1][i] + b[2] * prism->uv[2][i]) * n[i] - 0.5;
    at[2] = w * n[2] - 0.5;
    return true;
}

static void weights_at(const struct voxels *voxels, const double at[3], double weight[8]) {
    double x = at[0] - voxels->x, y = at[1] - voxels->y, z = at[2] - voxels->z;
    for (int c = 0; c < 8; c++)
        weight[c] = (c & 1 ? x : 1 - x) * (c >> 1 & 1 ? y : 1 - y) * (c >> 2 ? z : 1 - z);
}

void voxels_value(const struct voxels *voxels, const double at[3], double value[4]) {
    double weight[8];
    weights_at(voxels, at, weight);
    for (int i = 0; i < 4; i++) {
        value[i] = 0;
        for (int c = 0; c < 8; c++)
            value[i] += weight[c] * voxels->value[c][i];
    }
}

void voxels_gradient(const struct voxels *voxels, const double at[3], double gradient[3]) {
    double weight[8];
    weights_at(voxels, at, weight);
    for (int i = 0; i < 3; i++) {
        gradient[i] = 0;
        for (int c = 0; c < 8; c++)
            gradient[i] += weight[c] * voxels->gradient[c][i];
    }
}

bool voxels_normal(const struct volume *volume, const struct prism_ray *prism, const double b[3],
                   double w, const double gradient[3], double normal[3]) {
    double over_uv[2] = {gradient[0] * volume->size[0], gradient[1] * volume->size[1]};
    double object_gradient[3];
    prism_gradient(prism, b, w, over_uv, gradient[2] * volume->size[2], object_gradient);
    unit3(object_gradient); /* so that objects of any size stay within range */
    apply3(prism->object->world_from_gradient, object_gradient, normal);
    unit3(normal);
    return dot3(normal, normal) > 0.5;
}

/* Strands along w, where the material tells of none: their mean is (0, 0, 1). */
void voxels_load_strands(struct voxels *voxels) {
    const struct volume *volume = voxels->volume;
    for (int c = 0; c < 8; c++) {
        const float *medium = volume->medium;
        const float *own =
            voxel_at(volume, false, voxels->x + (c & 1), (long long)voxels->y + (c >> 1 & 1),
                     (long long)voxels->z + (c >> 2));
        for (int i = 0; i < 3; i++)
            voxels->strand[c][i] = volume->strands ? (double)volume->strands[own - medium + i]
                                   : i == 2        ? voxels->value[c][3]
                                                   : 0;
    }
}

void voxels_strand(const struct voxels *voxels, const double at[3], double weight,
                   double tangent[3]) {
    double share[8];
    weights_at(voxels, at, share);
    for (int i = 0; i < 3; i++) {
        tangent[i] = 0;
        for (int c = 0; c < 8; c++)
            tangent[i] += share[c] * voxels->strand[c][i] / weight;
    }
}

bool voxels_tangent(const struct prism_ray *prism, const double b[3], double w,
                    const double tangent[3], double world[3]) {
    double layer[2][3], height[2][3]; /* in the object, in the world */
    if (!prism_tangents(prism, b, w, tangent, layer[0], height[0]))
        return false;
    const double *m = prism->object->spec->transform;
    double largest = 0;
    for (int k = 0; k < 12; k++)
        largest = fmax(largest, fabs(m[k]));
    for (int i = 0; i < 3; i++) {
        layer[1][i] = height[1][i] = 0;
        for (int k = 0; k < 3; k++) {
            layer[1][i] += m[4 * k + i] / largest * layer[0][k];
            height[1][i] += m[4 * k + i] / largest * height[0][k];
        }
    }
    double square = dot3(height[1], height[1]), along = dot3(layer[1], height[1]);
    for (int i = 0; i < 3; i++)
        world[i] =
            layer[1][i] +
            (tangent[2] / VOLUME_TILE_DEPTH - (square > 0 ? along / square : 0)) * height[1][i];
    unit3(world);
    return dot3(world, world) > 0.5;
}
