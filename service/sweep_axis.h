/* The logarithmic axes of a sweep's charts, and the plot that they enclose. In units of the SVG's
 * own (CHART_WIDTH x CHART_HEIGHT); each function writes elements to `out` and leaves errors to it.
 */
#ifndef PELT_SERVICE_SWEEP_AXIS_H
#define PELT_SERVICE_SWEEP_AXIS_H

#include <stdbool.h>
#include <stdio.h>

enum {
    CHART_WIDTH = 720,
    CHART_HEIGHT = 500,
    CHART_LEFT = 92,
    CHART_RIGHT = 702,
    CHART_TOP = 44,
    CHART_BOTTOM = 428,
    LABEL_BYTES = 64
};

/* Decades `low` to `high` lie from `from` to `to`. Begins with low = INFINITY, high = -INFINITY. */
struct axis {
    double low, high, from, to;
};

/* Makes room for a value, if it is above 0 and finite. */
void axis_include(struct axis *axis, double value);

/* After that: room around what was included; something to show where nothing was. */
void axis_widen(struct axis *axis);

/* Where a value lies; what is beyond an end, at the end. */
double axis_place(const struct axis *axis, double value);

/* Lines at 1 to 9 times each power of ten (at the powers alone where there are many). */
void axis_grid(FILE *out, const struct axis *axis, bool horizontal);

void axis_labels(FILE *out, const struct axis *axis, bool horizontal);

/* A label below the plot, unless it would touch the one before it, which ended at *taken. */
void axis_label_x(FILE *out, double where, const char *text, double *taken);

#endif
