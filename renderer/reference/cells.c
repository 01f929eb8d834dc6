/* Splitting a segment where it crosses from one voxel cell to the next.
 *
 * Along a ray u(w) = U(w) / S(w) with U = sum u_i B_i, so u is the constant c where U - c S = 0: a
 * quadratic; it turns where U'S - US' = 0, another one (the cubic terms cancel). So each axis gives
 * at most three monotone pieces, and within a piece each voxel plane is crossed once. Where the ray
 * is nearly in one layer, w hardly changes and its quadratics lose their digits: there u is all but
 * linear in t, and its crossings are found by regula falsi (Illinois) in t.
 *
 * A crossing that is out by some digits costs nothing: the material is continuous there, and only
 * its slope changes. */
#include <stdlib.h>

#include "renderer/reference/trace.h"
#include "renderer/reference/vector.h"
#include "renderer/reference/voxels.h"

enum { BREAKS_MAX = 1 << 20, ILLINOIS_MAX = 60 };

/* Below this change of w over a segment its crossings are sought by t. */
static const double THIN = 1e-5;

static bool add_break(struct tracer *tracer, double t) {
    void *list = tracer->breaks;
    if (tracer->break_count >= BREAKS_MAX) {
        tracer->status = STATUS_TOO_COMPLEX;
        return false;
    }
    if (!tracer_grow(tracer, &list, tracer->break_count, &tracer->break_capacity,
                     sizeof *tracer->breaks))
        return false;
    tracer->breaks = list;
    tracer->breaks[tracer->break_count++] = t;
    return true;
}

static double coordinate(const struct prism_ray *prism, const struct prism_interval *span, int axis,
                         double t) {
    double at[3], b[3];
    if (!voxels_place(prism, t, prism_w(prism, span, t), at, b))
        return 0;
    return at[axis];
}

static double illinois(const struct prism_ray *prism, const struct prism_interval *span, int axis,
                       double wanted, double low, double high) {
    double f_low = coordinate(prism, span, axis, low) - wanted;
    double f_high = coordinate(prism, span, axis, high) - wanted, t = low;
    int side = 0;
    for (int i = 0; i < ILLINOIS_MAX && f_low * f_high < 0; i++) {
        t = (low * f_high - high * f_low) / (f_high - f_low);
        double f = coordinate(prism, span, axis, t) - wanted;
        if (fabs(f) < 1e-10)
            return t;
        if ((f < 0) == (f_high < 0)) {
            high = t, f_high = f;
            f_low = side == 1 ? f_low / 2 : f_low;
            side = 1;
        } else {
            low = t, f_low = f;
            f_high = side == -1 ? f_high / 2 : f_high;
            side = -1;
        }
    }
    return t;
}

/* The crossing of one plane on a monotone piece. */
static double crossing(const struct prism_ray *prism, const struct prism_interval *piece, int axis,
                       const double u[3], double wanted, bool thin) {
    double low = fmin(piece->w[0], piece->w[1]), high = fmax(piece->w[0], piece->w[1]);
    if (axis == 2)
        return prism_t(prism, piece, (wanted + 0.5) / prism->object->volume->size[2]);
    double root[2] = {0, 0}, c[3], s[3] = {0, 0, 0};
    if (!thin) {
        for (int p = 0; p < 3; p++) {
            for (int i = 0; i < 3; i++)
                s[p] += prism->side[i][p];
            c[p] = u[p] - (wanted + 0.5) * s[p];
        }
        int roots = quadratic_roots(c, root);
        for (int r = 0; r < roots; r++)
            if (root[r] >= low && root[r] <= high)
                return prism_t(prism, piece, root[r]);
    }
    return illinois(prism, piece, axis, wanted, piece->t[0], piece->t[1]);
}

/* All crossings of one axis. */
static bool add_crossings(struct tracer *tracer, const struct prism_ray *prism,
                          const struct prism_interval *span, int axis) {
    bool thin = fabs(span->w[1] - span->w[0]) < THIN;
    double turn[4], u[3] = {0, 0, 0};
    int pieces = 1;
    turn[0] = span->t[0];
    if (axis < 2) {
        double s[3] = {0, 0, 0}, slope[3], root[2] = {0, 0};
        int n = prism->object->volume->size[axis];
        for (int p = 0; p < 3; p++)
            for (int i = 0; i < 3; i++) {
                s[p] += prism->side[i][p];
                u[p] += prism->uv[i][axis] * n * prism->side[i][p];
            }
        slope[0] = u[1] * s[0] - u[0] * s[1];
        slope[1] = 2 * (u[2] * s[0] - u[0] * s[2]);
        slope[2] = u[2] * s[1] - u[1] * s[2];
        int roots = thin ? 0 : quadratic_roots(slope, root);
        double low = fmin(span->w[0], span->w[1]), high = fmax(span->w[0], span->w[1]);
        for (int r = 0; r < roots; r++)
            if (root[r] > low && root[r] < high)
                turn[pieces++] = prism_t(prism, span, root[r]);
    }
    turn[pieces] = span->t[1];
    if (pieces == 3 && turn[1] > turn[2]) {
        double spare = turn[1];
        turn[1] = turn[2];
        turn[2] = spare;
    }
    for (int k = 0; k < pieces; k++) {
        struct prism_interval piece = {
            {turn[k], turn[k + 1]},
            {prism_w(prism, span, turn[k]), prism_w(prism, span, turn[k + 1])}};
        if (k > 0 && !add_break(tracer, turn[k]))
            return false;
        double first = coordinate(prism, span, axis, turn[k]);
        double last = coordinate(prism, span, axis, turn[k + 1]);
        double low = fmin(first, last), high = fmax(first, last);
        if (!(high - low < BREAKS_MAX)) {
            tracer->status = STATUS_TOO_COMPLEX;
            return false;
        }
        long planes = (long)(ceil(high) - floor(low)) - 1; /* whole numbers between the two */
        for (long n = 1; n <= planes; n++)
            if (!add_break(tracer, crossing(prism, &piece, axis, u, floor(low) + (double)n, thin)))
                return false;
    }
    return true;
}

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static bool add_cell(struct tracer *tracer, const struct cell *cell) {
    void *list = tracer->cells;
    if (!tracer_grow(tracer, &list, tracer->cell_count, &tracer->cell_capacity,
                     sizeof *tracer->cells))
        return false;
    tracer->cells = list;
    tracer->cells[tracer->cell_count++] = *cell;
    return true;
}

static int whole(double x, int low, int high) {
    return x >= high ? high : x > low ? (int)floor(x) : low;
}

bool tracer_split(struct tracer *tracer, uint32_t index) {
    const struct segment *segment = &tracer->segments[index];
    const struct prism_ray *prism = &tracer->prisms[segment->prism];
    const struct prism_interval *span = &segment->span;
    const struct volume *volume = prism->object->volume;
    struct cell cell = {.span = *span, .segment = index};
    if (volume->homogeneous)
        return add_cell(tracer, &cell);
    tracer->break_count = 0;
    for (int axis = 0; axis < 3; axis++)
        if ((volume->size[axis] > 1 || axis < 2) && !add_crossings(tracer, prism, span, axis))
            return false;
    if (!add_break(tracer, span->t[0]) || !add_break(tracer, span->t[1]))
        return false;
    qsort(tracer->breaks, tracer->break_count, sizeof *tracer->breaks, compare_doubles);
    for (size_t i = 0; i + 1 < tracer->break_count; i++) {
        double t0 = tracer->breaks[i], t1 = tracer->breaks[i + 1], at[3], b[3];
        if (!(t1 > t0))
            continue;
        cell.span =
            (struct prism_interval){{t0, t1}, {prism_w(prism, span, t0), prism_w(prism, span, t1)}};
        double middle = t0 + (t1 - t0) / 2;
        if (!voxels_place(prism, middle, prism_w(prism, &cell.span, middle), at, b))
            continue; /* a triangle without area holds nothing */
        cell.x = whole(at[0], -(1 << 30), 1 << 30);
        cell.y = whole(at[1], -(1 << 30), 1 << 30);
        cell.z = whole(at[2], -1, volume->size[2] - 1);
        if (!add_cell(tracer, &cell))
            return false;
    }
    return true;
}
