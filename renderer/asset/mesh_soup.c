/* Storage of a soup, and the grid that every built-in shape is made of. */
#include "renderer/asset/mesh_soup.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const double PI = 3.14159265358979323846;

bool mesh_soup_init(struct mesh_soup *soup, uint64_t capacity) {
    *soup = (struct mesh_soup){0};
    size_t n = capacity ? (size_t)capacity : 1;
    if (n > SIZE_MAX / 3) /* calloc checks the rest of the product */
        return false;
    soup->position = calloc(3 * n, sizeof *soup->position);
    soup->normal = calloc(3 * n, sizeof *soup->normal);
    soup->uv = calloc(3 * n, sizeof *soup->uv);
    soup->has_normal = calloc(n, 1);
    soup->has_uv = calloc(n, 1);
    soup->surface = calloc(n, sizeof *soup->surface);
    if (soup->position && soup->normal && soup->uv && soup->has_normal && soup->has_uv &&
        soup->surface)
        return true;
    mesh_soup_finish(soup);
    return false;
}

void mesh_soup_finish(struct mesh_soup *soup) {
    free(soup->position);
    free(soup->normal);
    free(soup->uv);
    free(soup->has_normal);
    free(soup->has_uv);
    free(soup->surface);
    *soup = (struct mesh_soup){0};
}

/* One corner of a quad: a grid point, and the u that it takes there. */
struct corner {
    size_t point;
    double u;
};

static void add_triangle(struct mesh_soup *soup, const struct corner corner[3],
                         double (*position)[3], float (*normal)[3], double (*uv)[2]) {
    uint64_t t = soup->triangle_count++;
    for (int k = 0; k < 3; k++) {
        size_t from = corner[k].point, to = 3 * t + (size_t)k;
        memcpy(soup->position[to], position[from], sizeof soup->position[to]);
        memcpy(soup->normal[to], normal[from], sizeof soup->normal[to]);
        soup->uv[to][0] = corner[k].u;
        soup->uv[to][1] = uv[from][1];
    }
    soup->has_normal[t] = soup->has_uv[t] = 1;
}

static bool same_point(const double a[3], const double b[3]) {
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

void mesh_soup_add_grid(struct mesh_soup *soup, int n, int m, double (*position)[3],
                        float (*normal)[3], double (*uv)[2]) {
    size_t row = (size_t)n + 1;
    for (int j = 0; j < m; j++)
        for (int i = 0; i < n; i++) {
            size_t at = (size_t)j * row + (size_t)i;
            struct corner a = {at, uv[at][0]}, b = {at + 1, uv[at + 1][0]};
            struct corner c = {at + row + 1, uv[at + row + 1][0]}, d = {at + row, uv[at + row][0]};
            bool low = same_point(position[a.point], position[b.point]);
            bool high = same_point(position[c.point], position[d.point]);
            if (low)
                a.u = (a.u + b.u) / 2;
            if (high)
                c.u = (c.u + d.u) / 2;
            if (!low)
                add_triangle(soup, (struct corner[3]){a, b, c}, position, normal, uv);
            if (!high)
                add_triangle(soup, (struct corner[3]){a, c, d}, position, normal, uv);
        }
}

void mesh_circle_point(int i, int n, double *cosine, double *sine) {
    int64_t eighths = (int64_t)8 * (i % n);
    int octant = (int)(eighths / n);
    int64_t rest = eighths - (int64_t)octant * n; /* in [0, n) */
    if (octant & 1)
        rest = n - rest; /* odd octants run backwards from the diagonal */
    double angle = PI / 4 * ((double)rest / n);
    double x = cos(angle), y = sin(angle);
    if (octant & 1 ? octant == 1 || octant == 5 : octant == 2 || octant == 6) {
        double swap = x;
        x = y;
        y = swap;
    }
    *cosine = (octant >= 2 && octant <= 5 ? -x : x) + 0.0;
    *sine = (octant >= 4 ? -y : y) + 0.0;
}
