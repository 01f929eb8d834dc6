/* The derivation is at the top of prism.h.
 *
 * Neighbours share their sides to the bit: q_i depends on the vertex and the ray alone, and B_i
 * changes nothing but its sign when the side is seen from across. So no ray is lost between two
 * prisms or counted twice, also where it runs within their common side: there B_i is 0 throughout,
 * and the tie is broken as if the ray were shifted by (epsilon, epsilon^2) (Edelsbrunner & Muecke
 * 1990). */
#include "renderer/reference/prism.h"

#include <string.h>

#include "renderer/reference/vector.h"

enum { HITS_MAX = 8, NEWTON_MAX = 60 };

/* Hits this far outside a side or a cap are kept: they cost an interval that is then found to be
 * outside, and a hit that is lost would cost more. */
static const double SLACK = 1e-9;

/* A point of a layer this near to an edge, relative to its distance from the edge's end, is on it.
 */
static const double ON_EDGE = 1e-12;

void object_ray_init(const struct world_object *object, const double o[3], const double d[3],
                     struct object_ray *ray) {
    double moved[3];
    for (int i = 0; i < 3; i++)
        moved[i] = o[i] - object->shift[i];
    apply3(object->object_from_world, moved, ray->o);
    apply3(object->object_from_world, d, ray->d);
    double largest = fmax(fabs(ray->d[0]), fmax(fabs(ray->d[1]), fabs(ray->d[2])));
    double unit[3] = {ray->d[0] / largest, ray->d[1] / largest, ray->d[2] / largest};
    ray->speed = largest * sqrt(dot3(unit, unit));
    unit3(unit);
    int least = 0;
    for (int i = 1; i < 3; i++)
        if (fabs(unit[i]) < fabs(unit[least]))
            least = i;
    double axis[3] = {0, 0, 0};
    axis[least] = 1;
    cross3(unit, axis, ray->a);
    unit3(ray->a);
    cross3(unit, ray->a, ray->b);
    unit3(ray->b);
}

/* A vertex as the ray sees it: in the plane across, and along in t; with its change over w. */
struct seen {
    double q[2], qw[2], t, tw;
};

static void see(const struct world_object *object, const struct object_ray *ray, uint32_t vertex,
                struct seen *seen) {
    const double *offset = object->offset[vertex];
    double r[3], along = ray->speed * ray->speed;
    for (int i = 0; i < 3; i++)
        r[i] = object->bottom[vertex][i] - ray->o[i];
    seen->q[0] = dot3(r, ray->a);
    seen->q[1] = dot3(r, ray->b);
    seen->t = dot3(r, ray->d) / along;
    seen->qw[0] = dot3(offset, ray->a);
    seen->qw[1] = dot3(offset, ray->b);
    seen->tw = dot3(offset, ray->d) / along;
}

static void at_layer(const struct seen *seen, double w, double q[2]) {
    q[0] = seen->q[0] + w * seen->qw[0];
    q[1] = seen->q[1] + w * seen->qw[1];
}

static void make_sides(const struct seen seen[3], double side[3][3]) {
    for (int i = 0; i < 3; i++) {
        const struct seen *j = &seen[(i + 1) % 3], *k = &seen[(i + 2) % 3];
        side[i][0] = cross2(j->q, k->q);
        side[i][1] = cross2(j->q, k->qw) + cross2(j->qw, k->q);
        side[i][2] = cross2(j->qw, k->qw);
    }
}

static void make_layers(const struct world_object *object, const uint32_t v[3],
                        const struct object_ray *ray, struct prism_ray *prism) {
    double part[3], r[3];
    for (int i = 0; i < 3; i++) {
        prism->p0[i] = object->bottom[v[0]][i];
        prism->pw[i] = object->offset[v[0]][i];
        prism->e1[i] = object->bottom[v[1]][i] - prism->p0[i];
        prism->e2[i] = object->bottom[v[2]][i] - prism->p0[i];
        prism->g1[i] = object->offset[v[1]][i] - prism->pw[i];
        prism->g2[i] = object->offset[v[2]][i] - prism->pw[i];
        r[i] = ray->o[i] - prism->p0[i];
    }
    cross3(prism->e1, prism->e2, prism->n[0]);
    cross3(prism->e1, prism->g2, prism->n[1]);
    cross3(prism->g1, prism->e2, part);
    for (int i = 0; i < 3; i++)
        prism->n[1][i] += part[i];
    cross3(prism->g1, prism->g2, prism->n[2]);
    for (int p = 0; p < 4; p++) {
        prism->a[p] = p < 3 ? dot3(prism->n[p], r) : 0;
        if (p > 0)
            prism->a[p] -= dot3(prism->n[p - 1], prism->pw);
        if (p < 3)
            prism->s[p] = dot3(prism->n[p], ray->d);
    }
}

static void make_uv(const struct world_object *object, uint32_t index, struct prism_ray *prism) {
    const double *tiles = object->spec->shell.tiles;
    for (int i = 0; i < 2; i++) {
        /* Periodic: whole tiles go first, so that many of them cost no digits. */
        double whole = floor(object->mesh->corner_uv[index][0][i] * tiles[i]);
        for (int c = 0; c < 3; c++)
            prism->uv[c][i] = object->mesh->corner_uv[index][c][i] * tiles[i] - whole;
    }
}

/* ---- F ---- */

static double f_at(const struct prism_ray *prism, double w, double t, double *slope) {
    const double *a = prism->a, *s = prism->s;
    double c0 = a[0] + t * s[0], c1 = a[1] + t * s[1], c2 = a[2] + t * s[2], c3 = a[3];
    *slope = c1 + w * (2 * c2 + w * 3 * c3);
    return c0 + w * (c1 + w * (c2 + w * c3));
}

double prism_w(const struct prism_ray *prism, const struct prism_interval *within, double t) {
    double low = fmin(within->w[0], within->w[1]), high = fmax(within->w[0], within->w[1]);
    double span = within->t[1] - within->t[0];
    if (!(high > low) || !(span > 0))
        return within->w[0];
    double slope, w = within->w[0] +
                      (within->w[1] - within->w[0]) * fmin(1, fmax(0, (t - within->t[0]) / span));
    bool rising = f_at(prism, high, t, &slope) > f_at(prism, low, t, &slope);
    for (int i = 0; i < NEWTON_MAX; i++) {
        double f = f_at(prism, w, t, &slope);
        if (f == 0)
            return w;
        *((f > 0) == rising ? &high : &low) = w;
        double next = w - f / slope;
        if (!(next > low && next < high)) {
            /* At the bracket's end by rounding, or Newton leapt: halve. */
            if (fabs(next - w) <= 4e-16)
                return w;
            next = low + (high - low) / 2;
        }
        if (fabs(next - w) <= 4e-16 || !(high - low > 4e-16))
            return next;
        w = next;
    }
    return w;
}

double prism_t(const struct prism_ray *prism, const struct prism_interval *within, double w) {
    const double *a = prism->a;
    double t = -(a[0] + w * (a[1] + w * (a[2] + w * a[3]))) / quadratic_at(prism->s, w);
    if (!isfinite(t)) /* the ray lies in this layer */
        t = within->t[0] + (within->t[1] - within->t[0]) / 2;
    return fmin(fmax(t, within->t[0]), within->t[1]);
}

static void normal_at(const struct prism_ray *prism, double w, double n[3]) {
    for (int i = 0; i < 3; i++)
        n[i] = prism->n[0][i] + w * (prism->n[1][i] + w * prism->n[2][i]);
}

bool prism_barycentric(const struct prism_ray *prism, double t, double w, double b[3]) {
    double n[3], r[3], e1[3], e2[3], x[3], y[3];
    normal_at(prism, w, n);
    for (int i = 0; i < 3; i++) {
        r[i] = prism->o[i] - prism->p0[i] + t * prism->d[i] - w * prism->pw[i];
        e1[i] = prism->e1[i] + w * prism->g1[i];
        e2[i] = prism->e2[i] + w * prism->g2[i];
    }
    double n2 = dot3(n, n);
    cross3(r, e2, x);
    cross3(e1, r, y);
    b[1] = dot3(x, n) / n2;
    b[2] = dot3(y, n) / n2;
    b[0] = 1 - b[1] - b[2];
    return n2 > 0 && isfinite(b[1] + b[2]);
}

/* ---- where the ray enters and leaves ---- */

struct hit {
    double t, w;
};

/* The same where the layer is seen edge on: on which side of each edge, in the layer, the point is.
 * A ray that runs along an edge is taken for shifted too: by epsilon along a, then b. */
static bool inside_layer(const struct prism_ray *prism, double t, double w) {
    double n[3], p[3][3];
    normal_at(prism, w, n);
    for (int i = 0; i < 3; i++) {
        p[0][i] = prism->p0[i] + w * prism->pw[i];
        p[1][i] = p[0][i] + prism->e1[i] + w * prism->g1[i];
        p[2][i] = p[0][i] + prism->e2[i] + w * prism->g2[i];
    }
    for (int side = 0; side < 3; side++) {
        const double *from = p[(side + 1) % 3], *to = p[(side + 2) % 3];
        double e[3], r[3], m[3];
        for (int i = 0; i < 3; i++) {
            e[i] = to[i] - from[i];
            r[i] = prism->o[i] + t * prism->d[i] - from[i];
        }
        cross3(n, e, m); /* in the layer, inward */
        double reach = sqrt(dot3(m, m)), value = dot3(m, r);
        bool on_edge = fabs(value) <= ON_EDGE * reach * sqrt(dot3(r, r));
        if (on_edge)
            value = dot3(m, prism->ray->a);
        if (on_edge && fabs(value) <= ON_EDGE * reach)
            value = dot3(m, prism->ray->b);
        if (!(value > 0))
            return false;
    }
    return true;
}

/* Whether (t, w) of the ray is inside the prism's sides. */
static bool inside(const struct prism_ray *prism, const struct seen seen[3], double t, double w) {
    double q[3][2], size = 0, area = 0, value[3];
    for (int i = 0; i < 3; i++) {
        at_layer(&seen[i], w, q[i]);
        size = fmax(size, fmax(fabs(q[i][0]), fabs(q[i][1])));
        value[i] = quadratic_at(prism->side[i], w);
        area += value[i];
    }
    if (!(fabs(area) > 1e-9 * size * size))
        return inside_layer(prism, t, w);
    for (int i = 0; i < 3; i++) {
        const double *j = q[(i + 1) % 3], *k = q[(i + 2) % 3];
        bool positive = value[i] > 0;
        if (value[i] == 0)
            positive = k[1] != j[1] ? k[1] > j[1] : k[0] < j[0];
        if (positive != (area > 0))
            return false;
    }
    return true;
}

static int find_hits(const struct prism_ray *prism, const struct seen seen[3], struct hit *hits) {
    int count = 0;
    for (int i = 0; i < 3; i++) {
        double root[2] = {0, 0};
        int roots = quadratic_roots(prism->side[i], root);
        const struct seen *j = &seen[(i + 1) % 3], *k = &seen[(i + 2) % 3];
        for (int r = 0; r < roots; r++) {
            double w = root[r], qj[2], qk[2];
            if (!(w >= -SLACK && w <= 1 + SLACK))
                continue;
            w = fmin(1, fmax(0, w));
            at_layer(j, w, qj);
            at_layer(k, w, qk);
            double e[2] = {qk[0] - qj[0], qk[1] - qj[1]};
            double f = -(qj[0] * e[0] + qj[1] * e[1]) / (e[0] * e[0] + e[1] * e[1]);
            if (!(f >= -SLACK && f <= 1 + SLACK))
                continue;
            double tj = j->t + w * j->tw, tk = k->t + w * k->tw;
            hits[count++] = (struct hit){tj + f * (tk - tj), w};
        }
    }
    for (int w = 0; w < 2; w++) {
        double b[3], area = 0, t = 0;
        for (int i = 0; i < 3; i++) {
            b[i] = quadratic_at(prism->side[i], w);
            area += b[i];
        }
        bool within = area != 0;
        for (int i = 0; i < 3; i++) {
            within &= b[i] / area >= -SLACK;
            t += b[i] / area * (seen[i].t + w * seen[i].tw);
        }
        if (within && isfinite(t))
            hits[count++] = (struct hit){t, w};
    }
    return count;
}

static void sort_hits(struct hit *hits, int count) {
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && hits[k].t < hits[k - 1].t; k--) {
            struct hit spare = hits[k];
            hits[k] = hits[k - 1];
            hits[k - 1] = spare;
        }
}

/* A prism that does not fold: by t. Between two hits the ray is either inside or outside. */
static int meet_by_t(const struct prism_ray *prism, const struct seen seen[3],
                     struct prism_interval *intervals) {
    struct hit hits[HITS_MAX];
    int hit_count = find_hits(prism, seen, hits), count = 0;
    sort_hits(hits, hit_count);
    for (int i = 0; i + 1 < hit_count; i++) {
        struct prism_interval *last = count ? &intervals[count - 1] : NULL;
        struct prism_interval next = {{hits[i].t, hits[i + 1].t}, {hits[i].w, hits[i + 1].w}};
        if (!(next.t[1] > next.t[0]))
            continue;
        double middle = next.t[0] + (next.t[1] - next.t[0]) / 2;
        if (!inside(prism, seen, middle, prism_w(prism, &next, middle)))
            continue;
        if (last && last->t[1] == next.t[0] && last->w[1] == next.w[0]) {
            last->t[1] = next.t[1]; /* a hit beside the prism lay between */
            last->w[1] = next.w[1];
        } else {
            intervals[count++] = next;
        }
    }
    return count;
}

static int sort_layers(double *w, int count) {
    for (int i = 1; i < count; i++)
        for (int k = i; k > 0 && w[k] < w[k - 1]; k--) {
            double spare = w[k];
            w[k] = w[k - 1];
            w[k - 1] = spare;
        }
    return count;
}

/* Roots within (low, high) of a polynomial of degree at most 4, given that it is monotone between
 * the points of `cuts`. */
static int roots_between(const double *c, int degree, const double *cuts, int cut_count,
                         double *root) {
    int count = 0;
    for (int i = 0; i + 1 < cut_count; i++) {
        double low = cuts[i], high = cuts[i + 1], value[2] = {0, 0};
        for (int p = degree; p >= 0; p--) {
            value[0] = value[0] * low + c[p];
            value[1] = value[1] * high + c[p];
        }
        if (!((value[0] < 0 && value[1] > 0) || (value[0] > 0 && value[1] < 0)))
            continue;
        for (int k = 0; k < 100 && high - low > 1e-16; k++) {
            double middle = low + (high - low) / 2, v = 0;
            for (int p = degree; p >= 0; p--)
                v = v * middle + c[p];
            *((v > 0) == (value[0] > 0) ? &low : &high) = middle;
        }
        root[count++] = low + (high - low) / 2;
    }
    return count;
}

/* All roots in (0, 1): between the roots of the derivative a polynomial is monotone. */
static int roots_of(const double *c, int degree, double *root) {
    double cuts[8] = {0};
    int cut_count = 1;
    if (degree > 1) {
        double slope[5];
        for (int p = 1; p <= degree; p++)
            slope[p - 1] = p * c[p];
        cut_count += roots_of(slope, degree - 1, cuts + 1);
    }
    cuts[cut_count++] = 1;
    return roots_between(c, degree, cuts, cut_count, root);
}

/* A prism that folds: by w. Every sheet counts; t(w) = -A/D turns where A'D - AD' = 0. */
static int meet_by_w(const struct prism_ray *prism, const struct seen seen[3],
                     struct prism_interval *intervals) {
    double w[16] = {0, 1};
    int cuts = 2, count = 0;
    for (int i = 0; i < 3; i++)
        cuts += roots_of(prism->side[i], 2, w + cuts);
    cuts += roots_of(prism->s, 2, w + cuts);
    const double *a = prism->a, *s = prism->s;
    const double turn[5] = {a[1] * s[0] - a[0] * s[1], 2 * (a[2] * s[0] - a[0] * s[2]),
                            3 * a[3] * s[0] + a[2] * s[1] - a[1] * s[2], 2 * a[3] * s[1],
                            a[3] * s[2]};
    cuts += roots_of(turn, 4, w + cuts);
    sort_layers(w, cuts);
    for (int i = 0; i + 1 < cuts && count < PRISM_INTERVALS_MAX; i++) {
        double middle = w[i] + (w[i + 1] - w[i]) / 2;
        const struct prism_interval anywhere = {{-INFINITY, INFINITY}, {0, 0}};
        double t = prism_t(prism, &anywhere, middle);
        if (!(w[i + 1] > w[i]) || !isfinite(t) || !inside(prism, seen, t, middle))
            continue;
        double t0 = prism_t(prism, &anywhere, w[i]), t1 = prism_t(prism, &anywhere, w[i + 1]);
        bool forward = t1 > t0;
        struct prism_interval next = {{forward ? t0 : t1, forward ? t1 : t0},
                                      {w[forward ? i : i + 1], w[forward ? i + 1 : i]}};
        if (isfinite(t0 - t1) && t0 != t1)
            intervals[count++] = next;
    }
    return count;
}

int prism_meet(const struct world_object *object, uint32_t index, const struct object_ray *ray,
               struct prism_ray *prism, struct prism_interval *intervals) {
    const uint32_t *v = object->mesh->vertex[index];
    struct seen seen[3];
    for (int k = 0; k < 3; k++)
        see(object, ray, v[k], &seen[k]);
    /* Passed by where all six vertices lie on one side of the ray, in the plane across: the prism
     * is within their hull. */
    for (int axis = 0; axis < 2; axis++) {
        double low = INFINITY, high = -INFINITY;
        for (int k = 0; k < 3; k++) {
            low = fmin(low, fmin(seen[k].q[axis], seen[k].q[axis] + seen[k].qw[axis]));
            high = fmax(high, fmax(seen[k].q[axis], seen[k].q[axis] + seen[k].qw[axis]));
        }
        if (low > 0 || high < 0)
            return 0;
    }
    prism->object = object;
    prism->prism = index;
    prism->ray = ray;
    memcpy(prism->o, ray->o, sizeof prism->o);
    memcpy(prism->d, ray->d, sizeof prism->d);
    make_sides(seen, prism->side);
    make_layers(object, v, ray, prism);
    int count = object->folds[index] ? meet_by_w(prism, seen, intervals)
                                     : meet_by_t(prism, seen, intervals);
    if (count)
        make_uv(object, index, prism);
    return count;
}

/* ---- directions ---- */

static void offset_at(const struct prism_ray *prism, const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = prism->pw[i] + b[1] * prism->g1[i] + b[2] * prism->g2[i];
}

void prism_gradient(const struct prism_ray *prism, const double b[3], double w,
                    const double over_uv[2], double over_w, double gradient[3]) {
    double e1[3], e2[3], o[3], x[3], y[3], z[3];
    for (int i = 0; i < 3; i++) {
        e1[i] = prism->e1[i] + w * prism->g1[i];
        e2[i] = prism->e2[i] + w * prism->g2[i];
    }
    offset_at(prism, b, o);
    cross3(e2, o, x);
    cross3(o, e1, y);
    cross3(e1, e2, z);
    double sign = dot3(z, o) < 0 ? -1 : 1, over[2];
    for (int k = 0; k < 2; k++)
        over[k] = over_uv[0] * (prism->uv[k + 1][0] - prism->uv[0][0]) +
                  over_uv[1] * (prism->uv[k + 1][1] - prism->uv[0][1]);
    for (int i = 0; i < 3; i++)
        gradient[i] = sign * (over[0] * x[i] + over[1] * y[i] + over_w * z[i]);
}

bool prism_tangents(const struct prism_ray *prism, const double b[3], double w, const double uv[2],
                    double layer[3], double height[3]) {
    double step[2][2];
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 2; i++)
            step[k][i] = prism->uv[k + 1][i] - prism->uv[0][i];
    double det = step[0][0] * step[1][1] - step[0][1] * step[1][0];
    if (!(fabs(det) > 0))
        return false;
    double b1 = (uv[0] * step[1][1] - uv[1] * step[1][0]) / det;
    double b2 = (uv[1] * step[0][0] - uv[0] * step[0][1]) / det;
    offset_at(prism, b, height);
    for (int i = 0; i < 3; i++)
        layer[i] = b1 * (prism->e1[i] + w * prism->g1[i]) + b2 * (prism->e2[i] + w * prism->g2[i]);
    return true;
}

void prism_face(const struct prism_ray *prism, const double b[3], double w, double normal[3]) {
    double o[3], e[3];
    int nearest = 0;
    for (int i = 1; i < 3; i++)
        if (b[i] < b[nearest])
            nearest = i;
    if (fmin(w, 1 - w) <= b[nearest]) {
        normal_at(prism, w, normal);
        return;
    }
    for (int i = 0; i < 3; i++) {
        double e1 = prism->e1[i] + w * prism->g1[i], e2 = prism->e2[i] + w * prism->g2[i];
        e[i] = nearest == 0 ? e2 - e1 : nearest == 1 ? e2 : e1;
    }
    offset_at(prism, b, o);
    cross3(e, o, normal);
}
