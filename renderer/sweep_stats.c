/* See sweep_stats.h. */
#include "renderer/sweep_stats.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double quantile(const double *sorted, size_t count, double share) {
    double at = share * (double)(count - 1);
    size_t below = (size_t)at;
    if (below + 1 >= count)
        return sorted[count - 1];
    return sorted[below] + (at - (double)below) * (sorted[below + 1] - sorted[below]);
}

struct sweep_spread sweep_spread(double *values, size_t count) {
    assert(count > 0);
    qsort(values, count, sizeof *values, compare_doubles);
    return (struct sweep_spread){quantile(values, count, 0.5), quantile(values, count, 0.1),
                                 quantile(values, count, 0.9)};
}

/* ---- order ---- */

/* Iteration ends where p moves by less than a thousandth of what is ever printed. */
static const double ORDER_STEP_MIN = 1e-6;
enum { ORDER_ROUNDS_MAX = 100 };

/* The correction is made with an order from this range: a slower fall than by a quarter cannot be
 * told from none over a factor of four, and a faster one than by eight needs no correction. */
static const double ORDER_MIN = 0.25, ORDER_MAX = 8;

struct line {
    double slope, height, standard_error; /* height: at log q = 0 */
};

/* Through (log q, log e), each e corrected for the order p (0: not at all). */
static struct line fit_line(const double *quality, const double *error, const bool *used,
                            size_t count, double limit, double p) {
    double n = 0, mean_x = 0, mean_y = 0, xx = 0, xy = 0, residue = 0;
    for (int pass = 0; pass < 3; pass++) {
        for (size_t i = 0; i < count; i++) {
            if (!used[i])
                continue;
            double x = log(quality[i]);
            double y = log(error[i]) - (p > 0 ? log1p(-pow(quality[i] / limit, p)) : 0);
            if (pass == 0) {
                n++;
                mean_x += (x - mean_x) / n;
                mean_y += (y - mean_y) / n;
            } else if (pass == 1) {
                xx += (x - mean_x) * (x - mean_x);
                xy += (x - mean_x) * (y - mean_y);
            } else {
                double off = y - mean_y - xy / xx * (x - mean_x);
                residue += off * off;
            }
        }
        if (pass == 1 && xx == 0)
            return (struct line){NAN, NAN, NAN};
    }
    return (struct line){xy / xx, mean_y - xy / xx * mean_x,
                         n > 2 ? sqrt(residue / (n - 2) / xx) : NAN};
}

/* The same, corrected for the order that comes out. */
static struct line fit_corrected(const double *quality, const double *error, const bool *used,
                                 size_t count, double limit) {
    struct line line = fit_line(quality, error, used, count, limit, 0);
    /* Where the error does not fall there is no order to correct for. */
    for (int round = 0; round < ORDER_ROUNDS_MAX && line.slope < 0; round++) {
        double p = fmin(fmax(-line.slope, ORDER_MIN), ORDER_MAX), before = line.slope;
        line = fit_line(quality, error, used, count, limit, p);
        if (fabs(line.slope - before) < ORDER_STEP_MIN)
            break;
    }
    return line;
}

void sweep_fit(const double *quality, const double *error, size_t count, double limit, double floor,
               struct sweep_fit *fit) {
    *fit = (struct sweep_fit){
        .order = NAN, .constant = NAN, .standard_error = NAN, .finest_order = NAN, .floor = floor};
    bool *used = calloc(count + 1, sizeof *used);
    if (!used) /* an order is not worth the sweep: it is unknown then */
        return;
    for (size_t i = 0; i < count; i++) {
        used[i] = error[i] > floor && error[i] > 0 && isfinite(error[i]) && quality[i] > 0 &&
                  2 * quality[i] <= limit;
        fit->points += used[i];
    }
    if (fit->points >= 2) {
        struct line line = fit_corrected(quality, error, used, count, limit);
        fit->order = -line.slope;
        fit->constant = exp(line.height);
        fit->standard_error = line.standard_error;
        size_t left = fit->points;
        for (size_t i = 0; i < count && left > 2; i++) {
            left -= used[i];
            used[i] = false;
        }
        fit->finest_order = -fit_corrected(quality, error, used, count, limit).slope;
    }
    free(used);
}

/* ---- the front ---- */

void sweep_pareto(const double *time, const double *error, size_t count, double tolerance,
                  bool *front) {
    for (size_t i = 0; i < count; i++)
        front[i] = false;
    double least = INFINITY, after = -INFINITY;
    for (;;) {
        /* The best of the fastest points that are slower than the last one looked at. */
        size_t next = count;
        for (size_t i = 0; i < count; i++) {
            if (!isfinite(time[i]) || !isfinite(error[i]) || time[i] <= after)
                continue;
            if (next == count || time[i] < time[next] ||
                (time[i] == time[next] && error[i] < error[next]))
                next = i;
        }
        if (next == count)
            return;
        after = time[next];
        front[next] = error[next] < least - tolerance;
        if (front[next])
            least = error[next];
    }
}

/* ---- pixels ---- */

/* Steele, Lea & Flood 2014: Fast Splittable Pseudorandom Number Generators (splitmix64). */
static uint64_t next_random(uint64_t *state) {
    uint64_t z = *state += UINT64_C(0x9e3779b97f4a7c15);
    z = (z ^ z >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ z >> 27) * UINT64_C(0x94d049bb133111eb);
    return z ^ z >> 31;
}

/* Of [from, to); a modulo of 64 bits favours no pixel by more than 2^-50. */
static size_t random_between(uint64_t *state, size_t from, size_t to) {
    return from + (size_t)(next_random(state) % (to - from));
}

void sweep_stratify(int width, int height, size_t count, uint32_t *pixels) {
    size_t columns = (size_t)width, rows = (size_t)height;
    assert(count > 0 && count <= columns * rows);
    /* Bands of rows, each cut into cells: as many bands as make the cells square, but at least so
     * many that no band needs more cells than it has columns. */
    size_t bands = (size_t)lround(sqrt((double)count * (double)rows / (double)columns));
    size_t least = (count + columns - 1) / columns;
    bands = bands < least ? least : bands;
    bands = bands > rows ? rows : bands;
    bands = bands > count ? count : bands;
    uint64_t state = 1;
    for (size_t band = 0, n = 0; band < bands; band++) {
        size_t top = band * rows / bands, bottom = (band + 1) * rows / bands;
        size_t end = (band + 1) * count / bands, cells = end - n;
        for (size_t cell = 0; cell < cells; cell++) {
            size_t y = random_between(&state, top, bottom);
            size_t x = random_between(&state, cell * columns / cells, (cell + 1) * columns / cells);
            pixels[n++] = (uint32_t)(y * columns + x);
        }
    }
}
