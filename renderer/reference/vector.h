/* Three-vectors and small polynomials in doubles, as this room needs them. Its own on purpose: the
 * reference shares no geometry code with what it judges. */
#ifndef PELT_RENDERER_REFERENCE_VECTOR_H
#define PELT_RENDERER_REFERENCE_VECTOR_H

#include <math.h>

static inline double dot3(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross3(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double cross2(const double a[2], const double b[2]) {
    return a[0] * b[1] - a[1] * b[0];
}

static inline void apply3(const double m[3][3], const double v[3], double out[3]) {
    for (int r = 0; r < 3; r++)
        out[r] = dot3(m[r], v);
}

/* To unit length, whatever the length was; what has none stays as it is. */
static inline void unit3(double v[3]) {
    double largest = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    if (!(largest > 0) || isinf(largest))
        return;
    for (int i = 0; i < 3; i++)
        v[i] /= largest;
    double length = sqrt(dot3(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

static inline double quadratic_at(const double c[3], double x) {
    return c[0] + x * (c[1] + x * c[2]);
}

/* Real roots of c[0] + c[1] x + c[2] x^2, ascending; returns how many. No cancellation: the larger
 * root by the sum of what has one sign, the other by their product; the discriminant by Kahan's
 * difference of products. */
static inline int quadratic_roots(const double c[3], double root[2]) {
    if (c[2] == 0) {
        if (c[1] == 0)
            return 0;
        root[0] = -c[0] / c[1];
        return isfinite(root[0]) ? 1 : 0;
    }
    double half = c[1] / 2, product = c[2] * c[0];
    double error = fma(-c[2], c[0], product), d = fma(half, half, -product) + error;
    if (!(d >= 0))
        return 0;
    double sum = -(half + copysign(sqrt(d), half));
    double first = sum / c[2], second = sum != 0 ? c[0] / sum : first;
    int count = 0;
    double low = fmin(first, second), high = fmax(first, second);
    if (isfinite(low))
        root[count++] = low;
    if (isfinite(high) && (count == 0 || high > low))
        root[count++] = high;
    return count;
}

#endif
