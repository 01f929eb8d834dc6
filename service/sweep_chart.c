/* The charts of a sweep's page, as static SVG: they print, need no script and scale. Series differ
 * by colour (Okabe & Ito's, told apart by the colour-blind), by the shape of their marks and by the
 * dashes of their lines, so that grey paper shows them too. Sizes of text are the page's style's,
 * which enlarges them on small screens. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "service/sweep_axis.h"
#include "service/sweep_page.h"

enum { MARKS = 6 };

static const struct look {
    const char *colour, *dash;
} looks[] = {
    {"#0072b2", ""},        {"#d55e00", "7 4"},  {"#009e73", "2 3"},
    {"#a0468f", "9 3 2 3"}, {"#8a6d00", "12 4"}, {"#333333", "4 2"},
};
_Static_assert(sizeof looks / sizeof *looks == MARKS, "a look for each mark");

static void begin_chart(FILE *out, const struct axis *x, const struct axis *y, const char *label,
                        const char *name_y) {
    fprintf(out, "<svg class=\"chart\" viewBox=\"0 0 %d %d\" role=\"img\" aria-label=\"%s\">\n",
            CHART_WIDTH, CHART_HEIGHT, label);
    axis_grid(out, x, true);
    axis_grid(out, y, false);
    axis_labels(out, y, false);
    fprintf(out, "<path class=\"frame\" d=\"M%d %dV%dH%d\"/>\n", CHART_LEFT, CHART_TOP,
            CHART_BOTTOM, CHART_RIGHT);
    fprintf(out, "<text class=\"name\" x=\"4\" y=\"%d\">%s</text>\n", CHART_TOP - 20, name_y);
}

static void end_chart(FILE *out, const char *name_x) {
    fprintf(out,
            "<text class=\"name\" x=\"%d\" y=\"%d\" text-anchor=\"middle\">%s</text>\n</svg>\n",
            (CHART_LEFT + CHART_RIGHT) / 2, CHART_HEIGHT - 12, name_x);
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
        fprintf(out, "%c%.1f %.1f", begun ? 'L' : 'M', axis_place(x, spots[i].x),
                axis_place(y, spots[i].y));
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
    double at_x = axis_place(x, spot->x), at_y = axis_place(y, spot->y);
    fputs("<g>", out);
    title(out, series, spot->point);
    draw_bar(out, axis_place(x, spot->x_low), at_y, axis_place(x, spot->x_high), at_y,
             looks[s % MARKS].colour);
    draw_bar(out, at_x, axis_place(y, spot->y_low), at_x, axis_place(y, spot->y_high),
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
        fprintf(out, "%s%.1f %.1f", i ? "L" : "<path class=\"beneath\" d=\"M",
                axis_place(x, front[i].x), axis_place(y, front[i].y));
    if (count)
        fputs("\"/>\n", out);
}

void sweep_chart_time(FILE *out, const struct sweep *sweep) {
    struct axis x = {INFINITY, -INFINITY, CHART_LEFT, CHART_RIGHT},
                y = {INFINITY, -INFINITY, CHART_BOTTOM, CHART_TOP};
    struct spot spots[SWEEP_QUALITIES_MAX];
    for (size_t s = 0; s < sweep->series_count; s++) {
        const struct sweep_series *series = &sweep->series[s];
        time_spots(sweep, series, spots);
        for (size_t i = 0; i < series->point_count; i++) {
            if (!spots[i].point)
                continue;
            axis_include(&x, spots[i].x_low);
            axis_include(&x, spots[i].x_high);
            axis_include(&y, spots[i].y_low);
            axis_include(&y, spots[i].y_high);
        }
        axis_include(&y, series->model.rmse);
    }
    axis_widen(&x);
    axis_widen(&y);
    begin_chart(out, &x, &y, "Error against run time", "RMSE against the reference");
    for (size_t s = 0; s < sweep->series_count; s++)
        if (sweep->series[s].model.rmse > 0) {
            double at = axis_place(&y, sweep->series[s].model.rmse);
            fprintf(out, "<path class=\"model\" stroke=\"%s\" d=\"M%d %.1fH%d\"><title>",
                    looks[s % MARKS].colour, CHART_LEFT, at, CHART_RIGHT);
            fprintf(out, "%s: model error ", sweep->series[s].row->name);
            sweep_figure(out, sweep->series[s].model.rmse);
            fputs("</title></path>\n", out);
        }
    axis_labels(out, &x, true);
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
        if (!(e > 0) || log10(e) < y->low || log10(e) > y->high)
            continue;
        fprintf(out, "%s%.1f %.1f", begun ? "L" : "<path class=\"fit\" d=\"M", axis_place(x, q),
                axis_place(y, e));
        begun = true;
    }
    if (begun)
        fprintf(out, "\" stroke=\"%s\"/>\n", looks[s % MARKS].colour);
}

static int compare_integers(const void *a, const void *b) {
    int x = *(const int *)a, y = *(const int *)b;
    return (x > y) - (x < y);
}

/* The qualities themselves, as many as can be read. */
static void draw_qualities(FILE *out, const struct axis *x, const struct sweep *sweep) {
    int values[SWEEP_SERIES_MAX * SWEEP_QUALITIES_MAX];
    size_t count = 0;
    double taken = 0;
    for (size_t s = 0; s < sweep->series_count; s++)
        for (size_t i = 0; i < sweep->series[s].point_count; i++)
            values[count++] = sweep->series[s].points[i].quality;
    qsort(values, count, sizeof *values, compare_integers);
    for (size_t k = 0; k < count; k++) {
        char text[LABEL_BYTES];
        snprintf(text, sizeof text, "%d", values[k]);
        if (k == 0 || values[k] > values[k - 1])
            axis_label_x(out, axis_place(x, values[k]), text, &taken);
    }
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
    struct axis x = {INFINITY, -INFINITY, CHART_LEFT, CHART_RIGHT},
                y = {INFINITY, -INFINITY, CHART_BOTTOM, CHART_TOP};
    struct spot spots[SWEEP_QUALITIES_MAX];
    char names[256];
    double floor_of_all = INFINITY;
    for (size_t s = 0; s < sweep->series_count; s++) {
        order_spots(&sweep->series[s], spots);
        for (size_t i = 0; i < sweep->series[s].point_count; i++) {
            axis_include(&x, spots[i].x);
            if (spots[i].point)
                axis_include(&y, spots[i].y);
        }
        if (isfinite(sweep->series[s].fit.floor))
            floor_of_all = fmin(floor_of_all, sweep->series[s].fit.floor);
    }
    axis_widen(&x);
    axis_widen(&y);
    begin_chart(out, &x, &y, "Discretisation error against quality", "discretisation error, RMSE");
    draw_qualities(out, &x, sweep);
    if (isfinite(floor_of_all) && log10(floor_of_all) > y.low) {
        double at = axis_place(&y, floor_of_all);
        fprintf(out, "<rect class=\"noise\" x=\"%d\" y=\"%.1f\" width=\"%d\" height=\"%.1f\">",
                CHART_LEFT, at, CHART_RIGHT - CHART_LEFT, CHART_BOTTOM - at);
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
