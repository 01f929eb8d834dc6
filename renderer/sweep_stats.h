/* The arithmetic of a sweep, on numbers alone: what repeats say of a time, which points no other
 * point beats, how fast an error falls, which pixels stand for a picture. Thread: any. */
#ifndef PELT_RENDERER_SWEEP_STATS_H
#define PELT_RENDERER_SWEEP_STATS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Quantiles between two values are interpolated linearly (Hyndman & Fan 1996, type 7). */
struct sweep_spread {
    double median, p10, p90;
};

/* Of `count` >= 1 values, which it sorts. */
struct sweep_spread sweep_spread(double *values, size_t count);

/* The order p of an error that falls as C quality^-p: minus the slope of a line through the
 * logarithms, by least squares.
 *
 * The errors are differences from a picture at the quality `limit`, which is not yet the limit
 * itself: if errors of one pixel have one sign, what is seen is C (q^-p - limit^-p). Each error is
 * therefore divided by 1 - (q / limit)^p, p being found by iteration; without that an error of
 * first order at a quarter of the limit would look 25 % too small, and p too large.
 *
 * `quality` rises. Left out: points whose error is at most `floor`, is no number, or whose quality
 * is more than half the limit. */
struct sweep_fit {
    double order;          /* NAN with less than two points */
    double constant;       /* C */
    double standard_error; /* of the order, from the residuals; NAN with less than three points */
    double finest_order;   /* of the last two of the points, which the first may be too coarse for;
                              NAN with less than two */
    double floor;          /* as given */
    size_t points;         /* that the line goes through */
};
void sweep_fit(const double *quality, const double *error, size_t count, double limit, double floor,
               struct sweep_fit *fit);

/* The Pareto front: going from the fastest point to the slowest, sets front[i] where the error is
 * less by more than `tolerance` than any faster one in front, so that rounding makes no point
 * better. Of points that are equal in both the first is taken; those with what is no number are
 * never in front. */
void sweep_pareto(const double *time, const double *error, size_t count, double tolerance,
                  bool *front);

/* `count` distinct pixels (y * width + x, ascending by band) of a picture, one at random in each of
 * as many nearly square cells that cover it; the same call gives the same. 1 <= count <= width *
 * height. */
void sweep_stratify(int width, int height, size_t count, uint32_t *pixels);

#endif
