/* The first s = 1/2 along the ray, with no wall too thin.
 *
 * In a cell s is trilinear, so it lies between its least and its largest corner: cells whose
 * corners are all below 1/2 hold no surface, and most cells are such. In the others s(t) is
 * interpolated at the Chebyshev points of degree 6 (for a straight map it is a cubic, for the
 * rational one it is smooth over a cell), turned into Bernstein form, and searched: where no
 * coefficient is above 1/2 there is no root (the polynomial lies within its coefficients' hull),
 * else it is halved, nearest half first. An interval on which the interpolant misses s between its
 * nodes is halved before it is believed. The root is then closed in by bisection and regula falsi
 * on s itself. */
#include <string.h>

#include "renderer/reference/trace.h"
#include "renderer/reference/vector.h"
#include "renderer/reference/voxels.h"

enum { DEGREE = 6, SPLITS_MAX = 40, FITS_MAX = 12 };

/* An interpolant that is this close to s at the points between its nodes is believed. */
static const double FIT = 1e-7;

/* Where s is only this far below 1/2 it is taken for a surface: the rounding of voxels in fp32. */
static const double TOUCH = 1e-9;

/* s at a point that was closed in on (1e-14, or 1e-6 of a cell where the interpolant is believed)
 * and has since been through another ray's parameter. */
static const double ON_SURFACE = 1e-6;

static const double PI = 3.14159265358979323846;

struct search {
    const struct prism_ray *prism;
    const struct prism_interval *span;
    struct voxels voxels;
    uint64_t evaluations;
};

static double solid_at(struct search *search, double t) {
    double at[3], b[3], value[4];
    search->evaluations++;
    if (!voxels_place(search->prism, t, prism_w(search->prism, search->span, t), at, b))
        return 0;
    voxels_value(&search->voxels, at, value);
    return value[3];
}

/* Bernstein coefficients of the polynomial through `value` at the points (1 - cos(pi k/DEGREE))/2:
 * by Newton's divided differences, then powers, then b_i = sum_k C(i,k)/C(n,k) c_k. */
static void bernstein_through(const double point[DEGREE + 1], const double value[DEGREE + 1],
                              double bernstein[DEGREE + 1]) {
    double divided[DEGREE + 1], power[DEGREE + 1] = {0};
    memcpy(divided, value, sizeof divided);
    for (int order = 1; order <= DEGREE; order++)
        for (int k = DEGREE; k >= order; k--)
            divided[k] = (divided[k] - divided[k - 1]) / (point[k] - point[k - order]);
    for (int k = DEGREE; k >= 0; k--) {
        for (int p = DEGREE; p > 0; p--)
            power[p] = power[p - 1] - point[k] * power[p];
        power[0] = divided[k] - point[k] * power[0];
    }
    double choose_i[DEGREE + 1] = {1}, choose_n[DEGREE + 1] = {1};
    for (int k = 1; k <= DEGREE; k++)
        choose_n[k] = choose_n[k - 1] * (DEGREE - k + 1) / k;
    for (int i = 0; i <= DEGREE; i++) {
        bernstein[i] = 0;
        for (int k = 0; k <= i; k++) {
            choose_i[k] = k == 0 ? 1 : choose_i[k - 1] * (i - k + 1) / k;
            bernstein[i] += choose_i[k] / choose_n[k] * power[k];
        }
    }
}

/* The first point of [0, 1] where the polynomial reaches 1/2; INFINITY: nowhere. */
static double first_root(const double bernstein[DEGREE + 1], double from, double to, int splits) {
    double most = bernstein[0];
    for (int i = 1; i <= DEGREE; i++)
        most = fmax(most, bernstein[i]);
    if (bernstein[0] >= 0.5)
        return from;
    if (most < 0.5 - TOUCH)
        return INFINITY;
    if (splits == SPLITS_MAX)
        return bernstein[DEGREE] >= 0.5 ? to : INFINITY;
    double left[DEGREE + 1], right[DEGREE + 1];
    memcpy(right, bernstein, sizeof right);
    for (int i = 0; i <= DEGREE; i++) {
        left[i] = right[0];
        for (int k = 0; k + i < DEGREE; k++)
            right[k] = (right[k] + right[k + 1]) / 2;
    }
    double middle = from + (to - from) / 2;
    double root = first_root(left, from, middle, splits + 1);
    return isfinite(root) ? root : first_root(right, middle, to, splits + 1);
}

/* Closes in on s = 1/2 between t = low (below) and high (reached). */
static double close_in(struct search *search, double low, double high) {
    double s_low = solid_at(search, low) - 0.5, s_high = solid_at(search, high) - 0.5;
    for (int i = 0; i < 60 && high > low; i++) {
        double t = low + (high - low) / 2;
        if (i % 3 && s_high > s_low)
            t = fmin(high, fmax(low, low + (high - low) * (-s_low / (s_high - s_low))));
        double s = solid_at(search, t) - 0.5;
        if (fabs(s) < 1e-14)
            return t;
        if (s >= 0)
            high = t, s_high = s;
        else
            low = t, s_low = s;
    }
    return high;
}

static double search_interval(struct search *search, double a, double b, int fits) {
    double point[DEGREE + 1], value[DEGREE + 1], bernstein[DEGREE + 1];
    for (int k = 0; k <= DEGREE; k++) {
        point[k] = (1 - cos(PI * k / DEGREE)) / 2;
        value[k] = solid_at(search, a + (b - a) * point[k]);
    }
    bernstein_through(point, value, bernstein);
    double off = 0;
    for (int k = 0; k < DEGREE; k++) {
        double x = (point[k] + point[k + 1]) / 2, row[DEGREE + 1];
        memcpy(row, bernstein, sizeof row);
        for (int n = DEGREE; n > 0; n--)
            for (int i = 0; i < n; i++)
                row[i] += x * (row[i + 1] - row[i]);
        off = fmax(off, fabs(row[0] - solid_at(search, a + (b - a) * x)));
        if (off > FIT)
            break;
    }
    if (off > FIT && fits < FITS_MAX) {
        double middle = a + (b - a) / 2, t = search_interval(search, a, middle, fits + 1);
        return isfinite(t) ? t : search_interval(search, middle, b, fits + 1);
    }
    double root = first_root(bernstein, 0, 1, 0);
    if (!isfinite(root))
        return INFINITY;
    /* A bracket around what the interpolant says, as far as s itself agrees. */
    double t = a + (b - a) * root, reach = (b - a) * 1e-6;
    double low = fmax(a, t - reach), high = fmin(b, t + reach);
    if (solid_at(search, low) < 0.5 && solid_at(search, high) >= 0.5)
        return close_in(search, low, high);
    return t;
}

static bool stop_at(struct tracer *tracer, const struct cell *cell, struct search *search, double t,
                    bool cut, const double view[3], struct stop *stop) {
    const struct prism_ray *prism = search->prism;
    const struct volume *volume = prism->object->volume;
    double at[3], b[3], value[4], color[3], normal[3];
    double w = prism_w(prism, &cell->span, t);
    if (!voxels_place(prism, t, w, at, b))
        return true;
    voxels_value(&search->voxels, at, value);
    for (int i = 0; i < 3; i++)
        color[i] = value[3] > 0 ? value[i] / value[3] : 0;
    stop->t = t;
    memcpy(stop->color, color, sizeof color);
    if (!volume->lit)
        return true;
    double gradient[3];
    voxels_load(volume, true, true, cell->x, cell->y, cell->z, &search->voxels);
    voxels_gradient(&search->voxels, at, gradient);
    bool known = voxels_normal(volume, prism, b, w, gradient, normal);
    if (cut && !(sqrt(dot3(gradient, gradient)) > 1e-6)) {
        /* Cut open by the shell's boundary, where s need not change: the boundary's own normal. */
        double face[3];
        prism_face(prism, b, w, face);
        apply3(prism->object->world_from_gradient, face, normal);
        unit3(normal);
        if (dot3(normal, view) < 0)
            for (int i = 0; i < 3; i++)
                normal[i] = -normal[i];
        known = true;
    }
    if (!known)
        memset(normal, 0, sizeof normal);
    struct reference_incident incident;
    struct origin origin = {.object = prism->object, .solid = true};
    if (!tracer_incident(tracer, t, &origin, &incident))
        return false;
    reference_light(&tracer->world->lights, &incident, color, normal, view, 1,
                    (double)volume->specular, (double)volume->shininess, stop->color);
    return true;
}

/* Whether any corner of the cell reaches 1/2; loads its voxels. */
static bool may_be_solid(const struct cell *cell, struct search *search) {
    const struct volume *volume = search->prism->object->volume;
    if (!volume->solid)
        return false;
    voxels_load(volume, true, false, cell->x, cell->y, cell->z, &search->voxels);
    double most = 0;
    for (int c = 0; c < 8; c++)
        most = fmax(most, search->voxels.value[c][3]);
    return most >= 0.5;
}

/* From a point where s is 1/2: whether the ray goes into the solid there, or comes upon it again
 * within [a, b]. s - 1/2 = x q(x), x in [0, 1]; where b_i are the coefficients of the left side in
 * Bernstein form, b_0 = 0, those of q are b_(i+1) n / (i + 1), and what is asked is whether q
 * reaches 0: so the root that the ray begins at is divided out, not stepped over. */
static bool meets_again(struct search *search, double a, double b) {
    double point[DEGREE + 1], value[DEGREE + 1], bernstein[DEGREE + 1], rest[DEGREE + 1];
    for (int k = 0; k <= DEGREE; k++) {
        point[k] = (1 - cos(PI * k / DEGREE)) / 2;
        value[k] = k == 0 ? 0 : solid_at(search, a + (b - a) * point[k]) - 0.5;
    }
    bernstein_through(point, value, bernstein);
    /* As a polynomial of the same degree that reaches 1/2 where q reaches 0. */
    double q[DEGREE];
    for (int i = 0; i < DEGREE; i++)
        q[i] = bernstein[i + 1] * DEGREE / (i + 1);
    for (int i = 0; i <= DEGREE; i++)
        rest[i] = 0.5 + (i == 0        ? q[0]
                         : i == DEGREE ? q[DEGREE - 1]
                                       : ((double)i * q[i - 1] + (DEGREE - i) * q[i]) / DEGREE);
    return isfinite(first_root(rest, 0, 1, 0));
}

bool tracer_meets_solid(struct tracer *tracer, double t_from, const struct origin *origin) {
    for (size_t k = 0; k < tracer->cell_count; k++) {
        const struct cell *cell = &tracer->cells[k];
        const struct segment *segment = &tracer->segments[cell->segment];
        struct search search = {.prism = &tracer->prisms[segment->prism], .span = &cell->span};
        const struct object_ray *ray = search.prism->ray;
        double a = cell->span.t[0], b = cell->span.t[1];
        /* What a point on a surface has around it by rounding alone. */
        double rounding = 1e-13 * (fabs(t_from) + search.prism->object->radius / ray->speed);
        bool own =
            origin->solid && origin->object == search.prism->object && a <= t_from + rounding;
        if ((own && b - a <= rounding) || !may_be_solid(cell, &search))
            continue;
        double s = solid_at(&search, a);
        bool meets = own && fabs(s - 0.5) <= ON_SURFACE
                         ? meets_again(&search, a, b)
                         : s >= 0.5 || isfinite(search_interval(&search, a, b, 0));
        tracer->evaluations += search.evaluations;
        if (meets)
            return true;
    }
    return false;
}

bool tracer_find_solid(struct tracer *tracer, const double view[3], struct stop *stop) {
    for (size_t k = 0; k < tracer->cell_count; k++) {
        const struct cell *cell = &tracer->cells[k];
        const struct segment *segment = &tracer->segments[cell->segment];
        struct search search = {.prism = &tracer->prisms[segment->prism], .span = &cell->span};
        if (cell->span.t[0] >= stop->t)
            break; /* sorted: the rest is behind */
        if (!may_be_solid(cell, &search))
            continue;
        double begin = cell->span.t[0];
        bool already = solid_at(&search, begin) >= 0.5;
        double t = already ? begin : search_interval(&search, begin, cell->span.t[1], 0);
        tracer->evaluations += search.evaluations;
        if (t < stop->t &&
            !stop_at(tracer, cell, &search, t, already && begin == segment->span.t[0], view, stop))
            return false;
    }
    return true;
}
