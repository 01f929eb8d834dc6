/* Distances and winding numbers; see volume_distance.h.
 *
 * The nearest point of a triangle is found by the regions of its corners, edges and face (Ericson
 * 2005, "Real-Time Collision Detection", 5.1.5). A triangle looks only at the voxels within
 * DISTANCE_BAND of it: those of its box in the two axes across which it is steepest, and along the
 * third the few that lie near enough to its plane.
 *
 * Winding numbers come from one vertical line for each column of centres: a closed surface is
 * crossed upwards as often as downwards, and the centres below a crossing are what it is seen from.
 * Corners are rounded to 2^-16 voxel, so the edge functions are exact in 64 bits, and a line
 * through an edge or a corner belongs to one of the triangles there (the rasterizers' top-left
 * rule). */
#include "renderer/asset/volume_distance.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>

static const uint64_t WORK_MAX = 1ull << 29;

bool distance_init(struct distance_grid *grid, const int size[3]) {
    *grid = (struct distance_grid){.size = {size[0], size[1], size[2]}};
    size_t count = (size_t)size[0] * (size_t)size[1] * (size_t)size[2];
    grid->distance = calloc(count, sizeof *grid->distance);
    grid->nearest = calloc(count, sizeof *grid->nearest);
    grid->winding = calloc(count, sizeof *grid->winding);
    if (!grid->distance || !grid->nearest || !grid->winding)
        return false;
    for (size_t i = 0; i < count; i++) {
        grid->distance[i] = (float)DISTANCE_BAND;
        grid->nearest[i] = DISTANCE_NO_TRIANGLE;
    }
    return true;
}

void distance_finish(struct distance_grid *grid) {
    free(grid->distance);
    free(grid->nearest);
    free(grid->winding);
    *grid = (struct distance_grid){0};
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void subtract(const double a[3], const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

static double measure(const double p[3], const double corner[3][3], const double weight[3]) {
    double d2 = 0;
    for (int i = 0; i < 3; i++) {
        double q =
            weight[0] * corner[0][i] + weight[1] * corner[1][i] + weight[2] * corner[2][i] - p[i];
        d2 += q * q;
    }
    return sqrt(d2);
}

double distance_to_triangle(const double p[3], const double corner[3][3], double weight[3]) {
    double ab[3], ac[3], ap[3], bp[3], cp[3];
    subtract(corner[1], corner[0], ab);
    subtract(corner[2], corner[0], ac);
    subtract(p, corner[0], ap);
    subtract(p, corner[1], bp);
    subtract(p, corner[2], cp);
    double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp),
           d6 = dot(ac, cp);
    double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    weight[0] = weight[1] = weight[2] = 0.0;
    if (d1 <= 0 && d2 <= 0) {
        weight[0] = 1;
    } else if (d3 >= 0 && d4 <= d3) {
        weight[1] = 1;
    } else if (d6 >= 0 && d5 <= d6) {
        weight[2] = 1;
    } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
        weight[1] = d1 / (d1 - d3);
        weight[0] = 1 - weight[1];
    } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
        weight[2] = d2 / (d2 - d6);
        weight[0] = 1 - weight[2];
    } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
        weight[2] = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        weight[1] = 1 - weight[2];
    } else {
        double sum = va + vb + vc;
        weight[1] = vb / sum;
        weight[2] = vc / sum;
        weight[0] = 1 - weight[1] - weight[2];
    }
    return measure(p, corner, weight);
}

static int wrap(int i, int n) {
    int r = i % n;
    return r < 0 ? r + n : r;
}

/* The voxel of a place that may lie beside the grid along x and y; -1 above and below it. */
static ptrdiff_t voxel_at(const struct distance_grid *grid, const int at[3]) {
    if (at[2] < 0 || at[2] >= grid->size[2])
        return -1;
    return ((ptrdiff_t)at[2] * grid->size[1] + wrap(at[1], grid->size[1])) * grid->size[0] +
           wrap(at[0], grid->size[0]);
}

/* First and last voxel whose centre lies in [low, high]. */
static void range_of(double low, double high, int range[2]) {
    range[0] = (int)ceil(low - 0.5);
    range[1] = (int)floor(high - 0.5);
}

static void look_at(struct distance_grid *grid, const double corner[3][3], const int at[3],
                    uint32_t index) {
    ptrdiff_t voxel = voxel_at(grid, at);
    if (voxel < 0)
        return;
    double p[3] = {at[0] + 0.5, at[1] + 0.5, at[2] + 0.5}, weight[3];
    float d = (float)distance_to_triangle(p, corner, weight);
    if (d < grid->distance[voxel]) {
        grid->distance[voxel] = d;
        grid->nearest[voxel] = index;
    }
}

enum status distance_add(struct distance_grid *grid, const double corner[3][3], uint32_t index) {
    double ab[3], ac[3], n[3];
    subtract(corner[1], corner[0], ab);
    subtract(corner[2], corner[0], ac);
    for (int i = 0; i < 3; i++)
        n[i] = ab[(i + 1) % 3] * ac[(i + 2) % 3] - ab[(i + 2) % 3] * ac[(i + 1) % 3];
    int axis = 0; /* along which the triangle is thinnest */
    for (int i = 1; i < 3; i++)
        axis = fabs(n[i]) > fabs(n[axis]) ? i : axis;
    double length = sqrt(dot(n, n));
    int a = (axis + 1) % 3, b = (axis + 2) % 3, box[3][2];
    for (int i = 0; i < 3; i++) {
        double low = fmin(corner[0][i], fmin(corner[1][i], corner[2][i]));
        double high = fmax(corner[0][i], fmax(corner[1][i], corner[2][i]));
        range_of(low - DISTANCE_BAND, high + DISTANCE_BAND, box[i]);
    }
    for (int j = box[a][0]; j <= box[a][1]; j++)
        for (int i = box[b][0]; i <= box[b][1]; i++) {
            int near[2] = {box[axis][0], box[axis][1]};
            if (length > 0) { /* |n . (p - corner)| <= band * |n|, solved for p along the axis */
                double rest = n[a] * (j + 0.5 - corner[0][a]) + n[b] * (i + 0.5 - corner[0][b]);
                double middle = corner[0][axis] - rest / n[axis],
                       half = DISTANCE_BAND * length / fabs(n[axis]);
                int slab[2];
                range_of(fmax(middle - half, near[0]), fmin(middle + half, near[1] + 1.0), slab);
                near[0] = slab[0] > near[0] ? slab[0] : near[0];
                near[1] = slab[1] < near[1] ? slab[1] : near[1];
            }
            for (int k = near[0]; k <= near[1]; k++) {
                int at[3];
                at[axis] = k;
                at[a] = j;
                at[b] = i;
                look_at(grid, corner, at, index);
            }
            grid->work += near[1] >= near[0] ? (uint64_t)(near[1] - near[0] + 1) : 1;
            if (grid->work > WORK_MAX)
                return STATUS_TOO_COMPLEX;
        }
    return STATUS_OK;
}

/* Whether a line that lies on this edge of a triangle that turns left belongs to it. */
static bool owns_edge(int64_t dx, int64_t dy) {
    return dy > 0 || (dy == 0 && dx < 0);
}

void distance_add_winding(struct distance_grid *grid, const double corner[3][3]) {
    enum { BITS = 16 };
    const int64_t one = (int64_t)1 << BITS;
    int64_t x[3], y[3];
    for (int i = 0; i < 3; i++) {
        x[i] = (int64_t)floor(corner[i][0] * (double)one + 0.5);
        y[i] = (int64_t)floor(corner[i][1] * (double)one + 0.5);
    }
    int64_t area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
    if (area == 0)
        return;                                        /* upright: no vertical line crosses it */
    int second = area > 0 ? 1 : 2, third = 3 - second; /* so that it turns left */
    int order[3] = {0, second, third}, ranges[2][2];
    for (int i = 0; i < 2; i++) {
        double low = fmin(corner[0][i], fmin(corner[1][i], corner[2][i]));
        double high = fmax(corner[0][i], fmax(corner[1][i], corner[2][i]));
        range_of(low - 1, high + 1, ranges[i]);
        ranges[i][0] = ranges[i][0] < 0 ? 0 : ranges[i][0];
        ranges[i][1] = ranges[i][1] >= grid->size[i] ? grid->size[i] - 1 : ranges[i][1];
    }
    size_t layer = (size_t)grid->size[0] * (size_t)grid->size[1];
    for (int j = ranges[1][0]; j <= ranges[1][1]; j++)
        for (int i = ranges[0][0]; i <= ranges[0][1]; i++) {
            int64_t px = i * one + one / 2, py = j * one + one / 2;
            double height = 0;
            bool inside = true;
            for (int k = 0; k < 3 && inside; k++) {
                int from = order[k], to = order[(k + 1) % 3], opposite = order[(k + 2) % 3];
                int64_t dx = x[to] - x[from], dy = y[to] - y[from];
                int64_t side = dx * (py - y[from]) - dy * (px - x[from]);
                inside = side > 0 || (side == 0 && owns_edge(dx, dy));
                height += (double)side * corner[opposite][2];
            }
            if (!inside)
                continue;
            height /= fabs((double)area);
            /* The highest centre below the crossing; those beneath follow in distance_wind(). */
            double last = ceil(height - 0.5) - 1;
            if (last < 0)
                continue;
            int k = last >= grid->size[2] ? grid->size[2] - 1 : (int)last;
            grid->winding[layer * (size_t)k + (size_t)j * (size_t)grid->size[0] + (size_t)i] +=
                area > 0 ? 1 : -1;
        }
}

void distance_wind(struct distance_grid *grid) {
    size_t layer = (size_t)grid->size[0] * (size_t)grid->size[1];
    for (int k = grid->size[2] - 2; k >= 0; k--)
        for (size_t i = 0; i < layer; i++)
            grid->winding[layer * (size_t)k + i] += grid->winding[layer * (size_t)(k + 1) + i];
}
