/* Projection of a shell, and the outlines of its tetrahedra. See project.h for why outlines. */
#include "renderer/shell/project.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum status project_shell(const struct shell *shell, const struct view *view,
                          struct projection *projection, struct error *err) {
    projection->view = *view;
    projection->behind = false;
    projection->clip = malloc((shell->vertex_count + (size_t)1) * sizeof *projection->clip);
    if (!projection->clip)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to project %u vertices",
                           shell->vertex_count);
    const double *rows[3] = {view->x_row, view->y_row, view->h_row};
    for (uint32_t v = 0; v < shell->vertex_count; v++) {
        const double *p = shell->position[v];
        for (int r = 0; r < 3; r++)
            projection->clip[v][r] =
                rows[r][0] * p[0] + rows[r][1] * p[1] + rows[r][2] * p[2] + rows[r][3];
        projection->behind |= !(projection->clip[v][2] > PROJECT_DEPTH_MIN);
    }
    return STATUS_OK;
}

void projection_finish(struct projection *projection) {
    free(projection->clip);
    *projection = (struct projection){0};
}

static void to_grid(const struct view *view, const double clip[3], double out[2]) {
    double w = view->orthographic ? 1 : clip[2];
    out[0] = (clip[0] / w + 1) * view->width / 2;
    out[1] = (clip[1] / w + 1) * view->height / 2;
}

/* The point where the edge from a to b, on either side of the depth h, passes it. */
static void cut_edge(const double a[3], const double b[3], double h, double out[3]) {
    double s = (a[2] - h) / (a[2] - b[2]);
    for (int i = 0; i < 3; i++)
        out[i] = a[i] + s * (b[i] - a[i]);
    out[2] = h;
}

/* Andrew's monotone chain over at most 8 points, counter-clockwise, collinear ones left out. */
static int convex_hull(double point[][2], int count, double hull[][2]) {
    for (int i = 1; i < count; i++)
        for (int j = i; j > 0; j--) {
            double *a = point[j - 1], *b = point[j];
            if (a[0] < b[0] || (a[0] == b[0] && a[1] <= b[1]))
                break;
            double swap[2] = {a[0], a[1]};
            a[0] = b[0], a[1] = b[1];
            b[0] = swap[0], b[1] = swap[1];
        }
    int used = 0;
    for (int half = 0; half < 2; half++) {
        int floor = half ? used + 1 : 2;
        for (int step = half ? 1 : 0; step < count; step++) {
            const double *p = point[half ? count - 1 - step : step];
            while (used >= floor) {
                const double *a = hull[used - 2], *b = hull[used - 1];
                if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0)
                    break;
                used--;
            }
            hull[used][0] = p[0];
            hull[used++][1] = p[1];
        }
    }
    return used - 1; /* the last point repeats the first */
}

/* Moves every edge outward by OUTLINE_MARGIN. A corner becomes its mitre, unless that is longer
 * than a sample is wide: then it is cut off square a margin beyond its tip. */
static int enlarge(const double hull[][2], int count, double out[][2]) {
    double along[8][2];
    for (int i = 0; i < count; i++) {
        const double *a = hull[i], *b = hull[(i + 1) % count];
        double d[2] = {b[0] - a[0], b[1] - a[1]}, length = hypot(d[0], d[1]);
        if (!(length > 0) || !isfinite(length))
            return 0;
        along[i][0] = d[0] / length;
        along[i][1] = d[1] / length;
    }
    int used = 0;
    for (int i = 0; i < count; i++) {
        const double *p = hull[i], *d1 = along[(i + count - 1) % count], *d2 = along[i];
        double n1[2] = {d1[1], -d1[0]}, n2[2] = {d2[1], -d2[0]};
        double cosine = n1[0] * n2[0] + n1[1] * n2[1];
        if (1 + cosine > 2 * OUTLINE_MARGIN * OUTLINE_MARGIN) {
            for (int k = 0; k < 2; k++)
                out[used][k] = p[k] + OUTLINE_MARGIN * (n1[k] + n2[k]) / (1 + cosine);
            used++;
        } else {
            for (int k = 0; k < 2; k++) {
                out[used][k] = p[k] + OUTLINE_MARGIN * (n1[k] + d1[k]);
                out[used + 1][k] = p[k] + OUTLINE_MARGIN * (n2[k] - d2[k]);
            }
            used += 2;
        }
    }
    return used;
}

/* Sutherland-Hodgman against one side of the grid: keep where sign * (p[axis] - limit) <= 0. */
static int clip_side(double polygon[][2], int count, int axis, double sign, double limit) {
    double out[OUTLINE_MAX][2];
    int used = 0;
    for (int i = 0; i < count && used < OUTLINE_MAX - 1; i++) {
        const double *a = polygon[i], *b = polygon[(i + 1) % count];
        double da = sign * (a[axis] - limit), db = sign * (b[axis] - limit);
        if (da <= 0) {
            out[used][0] = a[0];
            out[used++][1] = a[1];
        }
        if ((da <= 0) != (db <= 0)) {
            double s = da / (da - db);
            out[used][1 - axis] = a[1 - axis] + s * (b[1 - axis] - a[1 - axis]);
            out[used++][axis] = limit;
        }
    }
    memcpy(polygon, out, sizeof out[0] * (size_t)used);
    return used;
}

static const uint8_t tetra_edges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

/* The enlarged outline around at most 8 points on the grid, clipped to it. */
static int outline_around(const struct view *view, double point[8][2], int count,
                          double outline[OUTLINE_MAX][2]) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 2; k++) {
            low[k] = fmin(low[k], point[i][k]);
            high[k] = fmax(high[k], point[i][k]);
        }
    const double size[2] = {view->width, view->height};
    bool outside = false;
    for (int k = 0; k < 2; k++) {
        /* Sample centres lie at i + 1/2. */
        double first = fmax(0, ceil(low[k] - 2 * OUTLINE_MARGIN - 0.5));
        double last = fmin(size[k] - 1, floor(high[k] + 2 * OUTLINE_MARGIN - 0.5));
        if (!(first <= last))
            return 0;
        outside |= low[k] < -size[k] || high[k] > 2 * size[k];
    }
    double hull[9][2];
    int corners = convex_hull(point, count, hull);
    if (corners < 3)
        return 0;
    corners = enlarge(hull, corners, outline);
    if (outside)
        for (int k = 0; k < 2 && corners; k++) {
            corners = clip_side(outline, corners, k, -1, -1);
            corners = clip_side(outline, corners, k, 1, size[k] + 1);
        }
    return corners < 3 ? 0 : corners;
}

int project_outline(const struct shell *shell, const struct projection *projection, uint32_t tetra,
                    double outline[OUTLINE_MAX][2]) {
    const struct view *view = &projection->view;
    double point[8][2];
    int count = 0;
    const double *clip[4];
    bool front[4];
    int fronts = 0;
    for (int v = 0; v < 4; v++) {
        clip[v] = projection->clip[shell->tetra[tetra][v]];
        front[v] = view->orthographic || clip[v][2] > PROJECT_DEPTH_MIN;
        if (front[v])
            to_grid(view, clip[v], point[count++]);
        fronts += front[v];
    }
    if (fronts == 0)
        return 0;
    if (fronts < 4)
        for (int e = 0; e < 6; e++) {
            int a = tetra_edges[e][0], b = tetra_edges[e][1];
            if (front[a] == front[b])
                continue;
            double cut[3];
            cut_edge(clip[front[a] ? a : b], clip[front[a] ? b : a], PROJECT_DEPTH_MIN, cut);
            to_grid(view, cut, point[count++]);
        }
    return outline_around(view, point, count, outline);
}

/* A tetrahedron between two parallel planes has at most 8 vertices: with i of its own behind the
 * first plane and j <= i of them behind the second, i (4 - i) + j (4 - j) lie on cut edges and i -
 * j between the planes; the sum is 8 for (2, 1), (2, 2), (3, 1), (3, 2), and 6 at most for all
 * others.
 */
int project_slab_outline(const struct shell *shell, const struct projection *projection,
                         uint32_t tetra, double low, double high, double outline[OUTLINE_MAX][2]) {
    const struct view *view = &projection->view;
    if (!view->orthographic)
        low = fmax(low, PROJECT_DEPTH_MIN);
    if (!(low <= high))
        return 0;
    double point[8][2];
    int count = 0, side[4]; /* -1 before the slab, 0 within, 1 behind */
    const double *clip[4];
    for (int v = 0; v < 4; v++) {
        clip[v] = projection->clip[shell->tetra[tetra][v]];
        side[v] = clip[v][2] < low ? -1 : clip[v][2] > high ? 1 : 0;
        if (side[v] == 0)
            to_grid(view, clip[v], point[count++]);
    }
    for (int e = 0; e < 6; e++) {
        int a = tetra_edges[e][0], b = tetra_edges[e][1];
        double cut[3];
        if ((side[a] < 0) != (side[b] < 0)) {
            cut_edge(clip[side[a] < 0 ? b : a], clip[side[a] < 0 ? a : b], low, cut);
            to_grid(view, cut, point[count++]);
        }
        if ((side[a] > 0) != (side[b] > 0)) {
            cut_edge(clip[side[a] > 0 ? b : a], clip[side[a] > 0 ? a : b], high, cut);
            to_grid(view, cut, point[count++]);
        }
    }
    return count < 3 ? 0 : outline_around(view, point, count, outline);
}

int project_face(const struct projection *projection, const uint32_t vertex[3],
                 double corner[4][3]) {
    const struct view *view = &projection->view;
    double kept[4][3];
    int count = 0;
    for (int i = 0; i < 3; i++) {
        const double *a = projection->clip[vertex[i]];
        const double *b = projection->clip[vertex[(i + 1) % 3]];
        bool a_front = view->orthographic || a[2] > PROJECT_DEPTH_MIN;
        bool b_front = view->orthographic || b[2] > PROJECT_DEPTH_MIN;
        if (a_front)
            memcpy(kept[count++], a, sizeof kept[0]);
        if (a_front != b_front)
            cut_edge(a_front ? a : b, a_front ? b : a, PROJECT_DEPTH_MIN, kept[count++]);
    }
    if (count < 3)
        return 0;
    for (int i = 0; i < count; i++) {
        to_grid(view, kept[i], corner[i]);
        corner[i][2] = view->orthographic ? kept[i][2] : -1 / kept[i][2];
    }
    return count;
}
