/* A sweep as a table for people. */
#include <math.h>

#include "service/sweep_write.h"

static void put_figure(FILE *out, double value) {
    if (isfinite(value))
        fprintf(out, " %9.2e", value);
    else
        fprintf(out, " %9s", "-");
}

static void print_series(FILE *out, const struct sweep_series *series) {
    if (*series->refused) {
        fprintf(out, "%-13s refused: %s\n", series->row->name, series->refused);
        return;
    }
    for (size_t i = 0; i < series->point_count; i++) {
        const struct sweep_point *point = &series->points[i];
        if (*point->refused) {
            fprintf(out, "%-13s %7d  refused: %s\n", series->row->name, point->quality,
                    point->refused);
            continue;
        }
        fprintf(out, "%-13s %7d %8.1f %8.1f %8.1f %8.1f", series->row->name, point->quality,
                point->total_ms.median, point->total_ms.p10, point->total_ms.p90,
                point->draw_ms.median);
        put_figure(out, point->error.touched.rmse);
        put_figure(out, point->error.touched.p99);
        put_figure(out, point->error.touched.max_abs);
        put_figure(out, point->discretisation.rmse);
        if (isfinite(point->error.flip))
            fprintf(out, " %7.4f", point->error.flip);
        else
            fprintf(out, " %7s", "-");
        fprintf(out, "%s\n", point->front ? "  *" : "");
    }
}

static void print_fit(FILE *out, const struct sweep_series *series) {
    if (*series->refused)
        return;
    fprintf(out, "%s: ", series->row->name);
    if (isfinite(series->fit.order))
        fprintf(out, "order of convergence %.2f", series->fit.order);
    else
        fprintf(out, "no order of convergence");
    if (isfinite(series->fit.standard_error))
        fprintf(out, " +- %.2f", series->fit.standard_error);
    fprintf(out, " (%zu points", series->fit.points);
    if (series->fit.points > 2)
        fprintf(out, "; %.2f by the finest two", series->fit.finest_order);
    fputs(")", out);
    if (series->limit_quality)
        fprintf(out, ", model error %.2e (limit: %s %d)\n", series->model.rmse,
                series->row->quality, series->limit_quality);
    else
        fprintf(out, ", no limit\n");
}

void sweep_print(FILE *out, const struct sweep *sweep) {
    size_t all = (size_t)sweep->width * (size_t)sweep->height;
    const struct report *report = &sweep->report;
    fprintf(out, "  %d x %d, %s, %s, %d thread%s, %s\n", sweep->width, sweep->height,
            report->backend, report->gl_renderer, report->threads, report->threads == 1 ? "" : "s",
            report->cpu);
    fprintf(out, "  median of %d, interleaved; reference: %zu of %zu pixels, %.1f s\n\n",
            sweep->repeats, sweep->reference_count, all, sweep->reference_s);
    fprintf(out, "%-13s %7s %8s %8s %8s %8s %9s %9s %9s %9s %7s\n", "series", "quality", "total ms",
            "p10", "p90", "draw ms", "rmse", "p99", "largest", "discr.", "flip");
    for (size_t s = 0; s < sweep->series_count; s++)
        print_series(out, &sweep->series[s]);
    fputs("  * on the Pareto front: no other point is both as fast and as good\n\n", out);
    for (size_t s = 0; s < sweep->series_count; s++)
        print_fit(out, &sweep->series[s]);
    for (size_t i = 0; i < report->warning_count; i++)
        fprintf(out, "warning: %s%s%s (%llu)\n", report->warnings[i].pointer,
                *report->warnings[i].pointer ? ": " : "", report->warnings[i].message,
                (unsigned long long)report->warnings[i].count);
}
