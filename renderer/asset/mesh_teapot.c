/* The Utah teapot from its Bezier patches (mesh_teapot_table.c), `divisions` for each patch.
 *
 * Stands upright on z = 0 with its axis along z, spout towards +x; scaled by half, which makes the
 * body's radius 1. The lid is widened by 7.7 % as in three.js, or light would show between lid and
 * rim. It is not closed: handle and spout end inside the body, the lid lies on the rim.
 *
 * Patches share edges and must agree on them to the bit, also where one runs backwards along the
 * other: Bernstein weights and sums below are symmetric under t -> 1 - t.
 *
 * UVs: u runs once around body, lid and bottom (1/6 around the spout, 1/12 around the handle), v
 * once along the profile from the middle of the bottom to the knob, both in proportion to lengths.
 */
#include "renderer/asset/mesh_teapot.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/asset/mesh_soup.h"

static const double SCALE = 0.5, LID_STRETCH = 1.077;

/* Which part of the map each ring of patches covers, in the table's order; u is shared out evenly.
 */
static const struct ring {
    int first, count;
    bool downwards; /* rows run down (and columns clockwise): both are reversed */
    double u_extent, v_low, v_high;
} rings[] = {
    {0, 4, true, 1, 0.643, 0.684},       /* rim */
    {4, 4, true, 1, 0.392, 0.643},       /* upper body */
    {8, 4, true, 1, 0.244, 0.392},       /* lower body */
    {12, 2, true, 1.0 / 12, 0.53, 0.76}, /* upper handle */
    {14, 2, true, 1.0 / 12, 0.30, 0.53}, /* lower handle */
    {16, 2, true, 1.0 / 6, 0.44, 0.768}, /* spout */
    {18, 2, true, 1.0 / 6, 0.392, 0.44}, /* tip */
    {20, 4, true, 1, 0.868, 1},          /* knob */
    {24, 4, true, 1, 0.684, 0.868},      /* lid */
    {28, 4, false, 1, 0, 0.244},         /* bottom */
};

/* Bernstein weights and their derivatives at i / n. Each is written so that reversing i gives the
 * same bits in reverse. */
static void bernstein(int i, int n, double w[4], double d[4]) {
    double t = (double)i / n, s = (double)(n - i) / n;
    w[0] = s * s * s;
    w[1] = 3 * (s * s * t);
    w[2] = 3 * (t * t * s);
    w[3] = t * t * t;
    d[0] = -3 * (s * s);
    d[1] = 3 * (s * s) - 6 * (s * t);
    d[2] = 6 * (s * t) - 3 * (t * t);
    d[3] = 3 * (t * t);
}

/* The weights sum to 1 but for rounding: where all points are one (a pole), it is met exactly. */
static double blend(const double w[4], double sum, double p0, double p1, double p2, double p3) {
    if (p0 == p1 && p0 == p2 && p0 == p3)
        return sum * p0;
    return (w[0] * p0 + w[3] * p3) + (w[1] * p1 + w[2] * p2);
}

/* `row` and `column` hold weights, which sum to 1, or derivatives of weights, which sum to 0. */
static void evaluate(double point[16][3], const double row[4], double row_sum,
                     const double column[4], double column_sum, double result[3]) {
    for (int k = 0; k < 3; k++) {
        double q[4];
        for (int c = 0; c < 4; c++)
            q[c] = blend(row, row_sum, point[c][k], point[4 + c][k], point[8 + c][k],
                         point[12 + c][k]);
        result[k] = blend(column, column_sum, q[0], q[1], q[2], q[3]);
    }
}

static void surface_point(double point[16][3], int r, int rows, int c, int columns, double p[3],
                          float normal[3]) {
    double wr[4], dr[4], wc[4], dc[4], along[3], around[3];
    bernstein(r, rows, wr, dr);
    bernstein(c, columns, wc, dc);
    evaluate(point, wr, 1, wc, 1, p);
    evaluate(point, dr, 0, wc, 1, along);
    evaluate(point, wr, 1, dc, 0, around);
    double n[3] = {around[1] * along[2] - around[2] * along[1],
                   around[2] * along[0] - around[0] * along[2],
                   around[0] * along[1] - around[1] * along[0]};
    double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    if (p[0] == 0 && p[1] == 0) { /* the poles of bottom and knob, where `around` vanishes */
        n[0] = n[1] = 0;
        n[2] = p[2] > 0.5 ? 1 : -1;
        length = 1;
    }
    for (int k = 0; k < 3; k++) {
        p[k] += 0.0;
        normal[k] = length > 0 ? (float)(n[k] / length) : 0;
    }
}

enum status mesh_teapot_make(const struct scene_mesh *spec, struct mesh_soup *soup,
                             const char *pointer, struct error *err) {
    int n = spec->divisions[0], m = spec->divisions[1];
    size_t points = ((size_t)n + 1) * ((size_t)m + 1);
    double(*position)[3] = calloc(points, sizeof *position);
    float(*normal)[3] = calloc(points, sizeof *normal);
    double(*uv)[2] = calloc(points, sizeof *uv);
    enum status status = STATUS_OK;
    if (!position || !normal || !uv)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a teapot");
    for (size_t k = 0; status == STATUS_OK && k < sizeof rings / sizeof *rings; k++) {
        const struct ring *ring = &rings[k];
        for (int patch = 0; patch < ring->count; patch++) {
            double point[16][3];
            for (int i = 0; i < 16; i++) {
                const double *from = mesh_teapot_point[mesh_teapot_patch[ring->first + patch][i]];
                bool lid = ring->first >= 20 && ring->first < 28;
                point[i][0] = from[0] * (lid ? LID_STRETCH : 1) * SCALE;
                point[i][1] = from[1] * (lid ? LID_STRETCH : 1) * SCALE;
                point[i][2] = from[2] * SCALE;
            }
            int place = ring->downwards ? ring->count - 1 - patch : patch;
            for (int j = 0; j <= m; j++)
                for (int i = 0; i <= n; i++) {
                    size_t at = (size_t)j * ((size_t)n + 1) + (size_t)i;
                    surface_point(point, ring->downwards ? m - j : j, m,
                                  ring->downwards ? n - i : i, n, position[at], normal[at]);
                    uv[at][0] = ring->u_extent * (place + (double)i / n) / ring->count;
                    uv[at][1] = ring->v_low + (ring->v_high - ring->v_low) * ((double)j / m);
                }
            mesh_soup_add_grid(soup, n, m, position, normal, uv);
        }
    }
    free(position);
    free(normal);
    free(uv);
    return status;
}
