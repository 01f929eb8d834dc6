/* The charts of a sweep's page, as static SVG: they print, need no script and scale. Series differ
 * by colour (Okabe & Ito's, told apart by the colour-blind), by the shape of their marks and by the
 * dashes of their lines, so that grey paper shows them too. Sizes of text are the page's style's,
 * which enlarges them on small screens. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "service/sweep_page.h"

enum { WIDTH = 720, HEIGHT = 500, LEFT = 92, RIGHT = 702, TOP = 44, BOTTOM = 428, MARKS = 6 };

static const struct look {
    const char *colour, *dash;
} looks[] = {
    {"#0072b2", ""},        {"#d55e00", "7 4"},  {"#009e73", "2 3"},
    {"#a0468f", "9 3 2 3"}, {"#8a6d00", "12 4"}, {"#333333", "4 2"},
};
_Static_assert(sizeof looks / sizeof *looks == MARKS, "a look for each mark");

/* ---- axes ---- */

/* Logarithmic: decades `low` to `high` lie from `from` to `to`. */
struct axis {
    double low, high, from, to;
};

static double place(const struct axis *axis, double value) {
    double at = (log10(value) - axis->low) / (axis->high - axis->low);
    return axis->from + fmin(fmax(at, 0), 1) * (axis->to - axis->from);
}

static void include(struct axis *axis, double value) {
    if (!(value > 0) || !isfinite(value))
        return;
    axis->low = fmin(axis->low, log10(value));
    axis->high = fmax(axis->high, log10(value));
}

/* Room around what was included; something to show where nothing was. */
static void widen(struct axis *axis) {
    if (!(axis->low <= axis->high))
        axis->low = axis->high = 0;
    double room = fmax(0.07 * (axis->high - axis->low), 0.08);
    axis->low -= room;
    axis->high += room;
}

static const char *const superscripts[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};

static void power_of_ten(FILE *out, int exponent) {
    fprintf(out, "10%s", exponent < 0 ? "⁻" : "");
    int size = abs(exponent);
    if (size >= 100)
        fputs(superscripts[size / 100 % 10], out);
    if (size >= 10)
        fputs(superscripts[size / 10 % 10], out);
    fputs(superscripts[size % 10], out);
}

static void tick_label(FILE *out, double digits, int exponent) {
    if (exponent >= -3 && exponent <= 4) {
        fprintf(out, "%.5g", digits * pow(10, exponent));
        return;
    }
    if (digits > 1)
        fprintf(out, "%g·", digits);
    power_of_ten(out, exponent);
}

/* What may be labelled within each decade, from coarse to fine: the first that gives three labels
 * is taken. Ends with 0. */
static const double label_sets[][12] = {
    {1},
    {1, 2, 5},
    {1, 2, 3, 4, 6, 8},
    {1, 1.2, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 8},
    {1, 1.2, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3.1, 3.5},
};
enum { LABEL_SETS = sizeof label_sets / sizeof *label_sets };

static bool on_axis(const struct axis *axis, double digits, int exponent) {
    double at = exponent + log10(digits);
    return at >= axis->low && at <= axis->high;
}

static const double *choose_labels(const struct axis *axis) {
    int first = (int)floor(axis->low), last = (int)ceil(axis->high);
    for (int set = 0; set < LABEL_SETS; set++) {
        int count = 0;
        for (int exponent = first; exponent <= last; exponent++)
            for (const double *digits = label_sets[set]; *digits > 0; digits++)
                count += on_axis(axis, *digits, exponent);
        if (count >= 3)
            return label_sets[set];
    }
    return label_sets[LABEL_SETS - 1];
}

static void draw_line_at(FILE *out, const struct axis *axis, double digits, int exponent,
                         bool horizontal) {
    double where = place(axis, digits * pow(10, exponent));
    const char *kind = digits > 1 ? "grid" : "ten";
    if (horizontal)
        fprintf(out, "<path class=\"%s\" d=\"M%.1f %dV%d\"/>", kind, where, TOP, BOTTOM);
    else
        fprintf(out, "<path class=\"%s\" d=\"M%d %.1fH%d\"/>", kind, LEFT, where, RIGHT);
}

static void draw_label(FILE *out, const struct axis *axis, double digits, int exponent,
                       bool horizontal) {
    double where = place(axis, digits * pow(10, exponent));
    if (horizontal)
        fprintf(out, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">", where, BOTTOM + 24);
    else
        fprintf(out, "<text x=\"%d\" y=\"%.1f\" dy=\"0.35em\" text-anchor=\"end\">", LEFT - 7,
                where);
    tick_label(out, digits, exponent);
    fputs("</text>\n", out);
}

/* Lines at 1 to 9 times each power of ten (at the powers alone where there are many). */
static void draw_grid(FILE *out, const struct axis *axis, bool horizontal) {
    int first = (int)floor(axis->low), last = (int)ceil(axis->high);
    int fine = axis->high - axis->low > 6 ? 1 : 9;
    for (int exponent = first; exponent <= last; exponent++)
        for (int digit = 1; digit <= fine; digit++)
            if (on_axis(axis, digit, exponent))
                draw_line_at(out, axis, digit, exponent, horizontal);
    fputc('\n', out);
}

static void draw_labels(FILE *out, const struct axis *axis, bool horizontal) {
    int first = (int)floor(axis->low), last = (int)ceil(axis->high);
    const double *labels = choose_labels(axis);
    int every = last - first > 12 ? (last - first) / 6 : 1;
    for (int exponent = first; exponent <= last; exponent++)
        for (const double *digits = labels; *digits > 0 && exponent % every == 0; digits++)
            if (on_axis(axis, *digits, exponent))
                draw_label(out, axis, *digits, exponent, horizontal);
}

static void begin_chart(FILE *out, const struct axis *x, const struct axis *y, const char *label,
                        const char *name_y) {
    fprintf(out, "<svg class=\"chart\" viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"%s\">\n",
            WIDTH, HEIGHT, label);
    draw_grid(out, x, true);
    draw_grid(out, y, false);
    draw_labels(out, y, false);
    fprintf(out, "<path class=\"frame\" d=\"M%d %dV%dH%d\"/>\n", LEFT, TOP, BOTTOM, RIGHT);
    fprintf(out, "<text class=\"name\" x=\"4\" y=\"%d\">%s</text>\n", TOP - 20, name_y);
}

static void end_chart(FILE *out, const char *name_x) {
    fprintf(out,
            "<text class=\"name\" x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>\n</svg>\n",
            (LEFT + RIGHT) / 2, HEIGHT - 12, name_x);
}

/* ---- marks ---- */

/* `hollow` marks of later series are larger, so that those of series that agree lie around one
 * another. */
static void draw_mark(FILE *out, size_t s, double x, double y, bool hollow) {
    static const char *const shapes[MARKS] = {
        "M-5.5 0A5.5 5.5 0 1 1 5.5 0A5.5 5.5 0 1 1 -5.5 0Z",
        "M-5 -5H5V5H-5Z",
        "M0 -6.5L6 5H-6Z",
        "M0 -7L6 0L0 7L-6 0Z",
        "M0 6.5L6 -5H-6Z",
        "M-2 -6H2V-2H6V2H2V6H-2V2H-6V-2H-2Z",
    };
    const char *colour = looks[s % MARKS].colour;
    fprintf(out, "<path d=\"%s\"", shapes[s % MARKS]);
    if (hollow)
        fprintf(out,
                " transform=\"translate(%.1f %.1f) scale(%.2f)\" class=\"hollow\" stroke=\"%s\"/>",
                x, y, 0.7 + 0.45 * (double)(s % MARKS), colour);
    else
        fprintf(out, " transform=\"translate(%.1f %.1f)\" class=\"solid\" style=\"fill:%s\"/>", x,
                y, colour);
}

void sweep_mark(FILE *out, size_t s) {
    const struct look *look = &looks[s % MARKS];
    fputs("<svg class=\"mark\" viewBox=\"0 0 48 16\" aria-hidden=\"true\">", out);
    fprintf(out, "<path d=\"M1 8H47\" stroke=\"%s\" stroke-width=\"1.8\" stroke-dasharray=\"%s\"/>",
            look->colour, look->dash);
    draw_mark(out, s, 24, 8, false);
    fputs("</svg>", out);
}

/* ---- points ---- */

/* One point in the chart's own units. */
struct spot {
    const struct sweep_point *point; /* NULL: not to be drawn */
    double x, y, x_low, x_high, y_low, y_high;
};

static void title(FILE *out, const struct sweep_series *series, const struct sweep_point *point) {
    fprintf(out, "<title>%s, %s %d\ntotal ", series->row->name, series->row->quality,
            point->quality);
    sweep_time(out, point->total_ms.median);
    fputs(" ms (p10 ", out);
    sweep_time(out, point->total_ms.p10);
    fputs(", p90 ", out);
    sweep_time(out, point->total_ms.p90);
    fputs("), draw ", out);
    sweep_time(out, point->draw_ms.median);
    fputs(" ms\nRMSE ", out);
    sweep_figure(out, point->error.touched.rmse);
    fputs(", p99 ", out);
    sweep_figure(out, point->error.touched.p99);
    fputs(", largest ", out);
    sweep_figure(out, point->error.touched.max_abs);
    fputs(", FLIP ", out);
    sweep_figure(out, point->error.flip);
    fputs("\ndiscretisation ", out);
    sweep_figure(out, point->discretisation.rmse);
    fprintf(out, "%s</title>", point->front ? "\non the Pareto front" : "");
}

static void draw_line(FILE *out, const struct axis *x, const struct axis *y,
                      const struct spot *spots, size_t count, size_t s) {
    bool begun = false;
    for (size_t i = 0; i < count; i++) {
        if (!spots[i].point)
            continue;
        if (!begun)
            fputs("<path class=\"line\" d=\"", out);
        fprintf(out, "%c%.1f %.1f", begun ? 'L' : 'M', place(x, spots[i].x), place(y, spots[i].y));
        begun = true;
    }
    if (begun)
        fprintf(out, "\" stroke=\"%s\" stroke-dasharray=\"%s\"/>\n", looks[s % MARKS].colour,
                looks[s % MARKS].dash);
}

static void draw_bar(FILE *out, double x0, double y0, double x1, double y1, const char *colour) {
    bool flat = fabs(y1 - y0) < fabs(x1 - x0);
    double dx = flat ? 0 : 4, dy = flat ? 4 : 0;
    if (hypot(x1 - x0, y1 - y0) < 0.5)
        return;
    fprintf(out,
            "<path class=\"bar\" stroke=\"%s\" d=\"M%.1f %.1fL%.1f %.1fM%.1f %.1fL%.1f %.1f"
            "M%.1f %.1fL%.1f %.1f\"/>",
            colour, x0, y0, x1, y1, x0 - dx, y0 - dy, x0 + dx, y0 + dy, x1 - dx, y1 - dy, x1 + dx,
            y1 + dy);
}

static void draw_spot(FILE *out, const struct axis *x, const struct axis *y,
                      const struct spot *spot, const struct sweep_series *series, size_t s,
                      bool hollow) {
    if (!spot->point)
        return;
    double at_x = place(x, spot->x), at_y = place(y, spot->y);
    fputs("<g>", out);
    title(out, series, spot->point);
    draw_bar(out, place(x, spot->x_low), at_y, place(x, spot->x_high), at_y,
             looks[s % MARKS].colour);
    draw_bar(out, at_x, place(y, spot->y_low), at_x, place(y, spot->y_high),
             looks[s % MARKS].colour);
    if (spot->point->front && !hollow)
        fprintf(out, "<circle class=\"front\" cx=\"%.1f\" cy=\"%.1f\" r=\"10.5\"/>", at_x, at_y);
    fprintf(out, "<circle class=\"touch\" cx=\"%.1f\" cy=\"%.1f\" r=\"14\"/>", at_x, at_y);
    draw_mark(out, s, at_x, at_y, hollow);
    fputs("</g>\n", out);
}

/* ---- error against time ---- */

static void time_spots(const struct sweep *sweep, const struct sweep_series *series,
                       struct spot *spots) {
    for (size_t i = 0; i < series->point_count; i++) {
        const struct sweep_point *point = &series->points[i];
        double error = point->error.touched.rmse;
        double off = sweep->pixels ? point->error.touched.rmse_standard_error : 0;
        spots[i] = (struct spot){point->pixels ? point : NULL,
                                 point->total_ms.median,
                                 error,
                                 point->total_ms.p10,
                                 point->total_ms.p90,
                                 fmax(error - off, error / 10),
                                 error + off};
    }
}

static int compare_spots(const void *a, const void *b) {
    double x = ((const struct spot *)a)->x, y = ((const struct spot *)b)->x;
    return (x > y) - (x < y);
}

/* A broad line beneath all, through the points that no other beats. */
static void draw_front(FILE *out, const struct axis *x, const struct axis *y,
                       const struct sweep *sweep) {
    struct spot front[SWEEP_SERIES_MAX * SWEEP_QUALITIES_MAX], spots[SWEEP_QUALITIES_MAX];
    size_t count = 0;
    for (size_t s = 0; s < sweep->series_count; s++) {
        time_spots(sweep, &sweep->series[s], spots);
        for (size_t i = 0; i < sweep->series[s].point_count; i++)
            if (spots[i].point && spots[i].point->front)
                front[count++] = spots[i];
    }
    qsort(front, count, sizeof *front, compare_spots);
    for (size_t i = 0; i < count; i++)
        fprintf(out, "%s%.1f %.1f", i ? "L" : "<path class=\"beneath\" d=\"M", place(x, front[i].x),
                place(y, front[i].y));
    if (count)
        fputs("\"/>\n", out);
}

void sweep_chart_time(FILE *out, const struct sweep *sweep) {
    struct axis x = {INFINITY, -INFINITY, LEFT, RIGHT}, y = {INFINITY, -INFINITY, BOTTOM, TOP};
    struct spot spots[SWEEP_QUALITIES_MAX];
    for (size_t s = 0; s < sweep->series_count; s++) {
        const struct sweep_series *series = &sweep->series[s];
        time_spots(sweep, series, spots);
        for (size_t i = 0; i < series->point_count; i++) {
            if (!spots[i].point)
                continue;
            include(&x, spots[i].x_low);
            include(&x, spots[i].x_high);
            include(&y, spots[i].y_low);
            include(&y, spots[i].y_high);
        }
        include(&y, series->model.rmse);
    }
    widen(&x);
    widen(&y);
    begin_chart(out, &x, &y, "Error against run time", "RMSE against the reference");
    for (size_t s = 0; s < sweep->series_count; s++)
        if (sweep->series[s].model.rmse > 0) {
            double at = place(&y, sweep->series[s].model.rmse);
            fprintf(out, "<path class=\"model\" stroke=\"%s\" d=\"M%d %.1fH%d\"><title>",
                    looks[s % MARKS].colour, LEFT, at, RIGHT);
            fprintf(out, "%s: model error ", sweep->series[s].row->name);
            sweep_figure(out, sweep->series[s].model.rmse);
            fputs("</title></path>\n", out);
        }
    draw_labels(out, &x, true);
    draw_front(out, &x, &y, sweep);
    for (size_t s = 0; s < sweep->series_count; s++) {
        time_spots(sweep, &sweep->series[s], spots);
        draw_line(out, &x, &y, spots, sweep->series[s].point_count, s);
    }
    for (size_t s = 0; s < sweep->series_count; s++) {
        time_spots(sweep, &sweep->series[s], spots);
        for (size_t i = 0; i < sweep->series[s].point_count; i++)
            draw_spot(out, &x, &y, &spots[i], &sweep->series[s], s, false);
    }
    end_chart(out, "total time, ms (median; bars: p10 to p90)");
}

/* ---- discretisation against quality ---- */

static void order_spots(const struct sweep_series *series, struct spot *spots) {
    for (size_t i = 0; i < series->point_count; i++) {
        const struct sweep_point *point = &series->points[i];
        double error = point->discretisation.rmse;
        double quality = point->quality;
        spots[i] = (struct spot){point->pixels && isfinite(error) ? point : NULL,
                                 quality,
                                 error,
                                 quality,
                                 quality,
                                 error,
                                 error};
    }
}

/* What was fitted: C (q^-p - limit^-p), from the lowest to the highest quality. */
static void draw_fit(FILE *out, const struct axis *x, const struct axis *y,
                     const struct sweep_series *series, size_t s) {
    enum { STEPS = 32 };
    const struct sweep_fit *fit = &series->fit;
    if (!isfinite(fit->order))
        return;
    double low = log(series->points[0].quality);
    double high = log(series->points[series->point_count - 1].quality);
    bool begun = false;
    for (int i = 0; i <= STEPS; i++) {
        double q = exp(low + (high - low) * i / STEPS);
        double e = fit->constant * (pow(q, -fit->order) - pow(series->limit_quality, -fit->order));
        if (!(e > 0))
            continue;
        fprintf(out, "%s%.1f %.1f", begun ? "L" : "<path class=\"fit\" d=\"M", place(x, q),
                place(y, e));
        begun = true;
    }
    if (begun)
        fprintf(out, "\" stroke=\"%s\"/>\n", looks[s % MARKS].colour);
}

/* The qualities themselves, where they are few enough to be read. */
static void draw_qualities(FILE *out, const struct axis *x, const struct sweep *sweep) {
    enum { LABELS_MAX = 8 };
    int values[LABELS_MAX], count = 0;
    for (size_t s = 0; s < sweep->series_count; s++)
        for (size_t i = 0; i < sweep->series[s].point_count; i++) {
            int quality = sweep->series[s].points[i].quality;
            bool known = false;
            for (int k = 0; k < count; k++)
                known |= values[k] == quality;
            if (!known && count == LABELS_MAX) {
                draw_labels(out, x, true);
                return;
            }
            if (!known)
                values[count++] = quality;
        }
    for (int k = 0; k < count; k++)
        fprintf(out, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%d</text>\n",
                place(x, values[k]), BOTTOM + 24, values[k]);
}

/* "samples", or "samples, slices" where series move different members. */
static void quality_names(const struct sweep *sweep, char *names, size_t bytes) {
    int used = snprintf(names, bytes, "quality: ");
    for (size_t s = 0; s < sweep->series_count; s++) {
        const struct sweep_row *row = sweep->series[s].row;
        bool known = false;
        for (size_t k = 0; k < s; k++)
            known |= strcmp(sweep->series[k].row->quality, row->quality) == 0;
        if (!known && used >= 0 && (size_t)used < bytes)
            used += snprintf(names + used, bytes - (size_t)used, "%s%s (%s)", s ? ", " : "",
                             row->quality, sweep_row_unit(row));
    }
}

void sweep_chart_order(FILE *out, const struct sweep *sweep) {
    struct axis x = {INFINITY, -INFINITY, LEFT, RIGHT}, y = {INFINITY, -INFINITY, BOTTOM, TOP};
    struct spot spots[SWEEP_QUALITIES_MAX];
    char names[256];
    double floor_of_all = INFINITY;
    for (size_t s = 0; s < sweep->series_count; s++) {
        order_spots(&sweep->series[s], spots);
        for (size_t i = 0; i < sweep->series[s].point_count; i++) {
            include(&x, spots[i].x);
            if (spots[i].point)
                include(&y, spots[i].y);
        }
        if (isfinite(sweep->series[s].fit.floor))
            floor_of_all = fmin(floor_of_all, sweep->series[s].fit.floor);
    }
    widen(&x);
    widen(&y);
    begin_chart(out, &x, &y, "Discretisation error against quality", "discretisation error, RMSE");
    draw_qualities(out, &x, sweep);
    if (isfinite(floor_of_all) && log10(floor_of_all) > y.low) {
        double at = place(&y, floor_of_all);
        fprintf(out, "<rect class=\"noise\" x=\"%d\" y=\"%.1f\" width=\"%d\" height=\"%.1f\">",
                LEFT, at, RIGHT - LEFT, BOTTOM - at);
        fputs("<title>below the noise floor</title></rect>\n", out);
    }
    for (size_t s = 0; s < sweep->series_count; s++)
        draw_fit(out, &x, &y, &sweep->series[s], s);
    for (size_t s = 0; s < sweep->series_count; s++) {
        order_spots(&sweep->series[s], spots);
        for (size_t i = 0; i < sweep->series[s].point_count; i++)
            draw_spot(out, &x, &y, &spots[i], &sweep->series[s], s, true);
    }
    quality_names(sweep, names, sizeof names);
    end_chart(out, names);
}
