/* A sweep as JSON, after api/sweep.schema.json. What is not known is null. */
#include <stdlib.h>

#include "api/report_parts.h"
#include "service/sweep_write.h"

static void text(struct json_out *out, const char *name, const char *value) {
    json_out_key(out, name);
    json_out_string(out, value);
}

static void number(struct json_out *out, const char *name, double value) {
    json_out_key(out, name);
    json_out_number(out, value);
}

static void integer(struct json_out *out, const char *name, unsigned long long value) {
    json_out_key(out, name);
    json_out_unsigned(out, value);
}

static void boolean(struct json_out *out, const char *name, bool value) {
    json_out_key(out, name);
    json_out_boolean(out, value);
}

static void open(struct json_out *out, const char *name, char bracket) {
    json_out_key(out, name);
    json_out_open(out, bracket);
}

static void reason(struct json_out *out, const char *refused) {
    text(out, "refused", *refused ? refused : NULL);
}

static void write_spread(struct json_out *out, const char *name,
                         const struct sweep_spread *spread) {
    open(out, name, '{');
    number(out, "median", spread->median);
    number(out, "p10", spread->p10);
    number(out, "p90", spread->p90);
    json_out_close(out, '}');
}

static void write_figures(struct json_out *out, const struct error_figures *figures) {
    number(out, "rmse", figures->rmse);
    number(out, "rmse_standard_error", figures->rmse_standard_error);
    number(out, "max_abs", figures->max_abs);
    number(out, "p99", figures->p99);
}

static void write_error(struct json_out *out, const struct error_metrics *error, bool sampled) {
    struct error_figures touched = error->touched;
    if (!sampled)
        touched.rmse_standard_error = 0;
    open(out, "error", '{');
    integer(out, "touched", touched.pixels);
    write_figures(out, &touched);
    number(out, "whole_rmse", error->whole.rmse);
    number(out, "psnr_db", error->psnr_db);
    number(out, "coverage", (double)error->coverage / (double)error->whole.pixels);
    number(out, "flip", error->flip);
    integer(out, "not_finite", error->not_finite);
    json_out_close(out, '}');
}

/* Model and discretisation: `rmse` null where they are not known. */
static void write_part(struct json_out *out, const char *name, struct error_figures figures,
                       bool sampled) {
    if (!sampled && figures.rmse == figures.rmse)
        figures.rmse_standard_error = 0;
    open(out, name, '{');
    write_figures(out, &figures);
    json_out_close(out, '}');
}

static void write_point(struct json_out *out, const struct sweep_point *point, bool sampled) {
    json_out_open(out, '{');
    integer(out, "quality", (unsigned long long)point->quality);
    reason(out, point->refused);
    if (point->pixels) {
        open(out, "time_ms", '{');
        write_spread(out, "total", &point->total_ms);
        write_spread(out, "draw", &point->draw_ms);
        open(out, "stages", '{');
        for (int i = 0; i < REPORT_STAGE_COUNT; i++)
            number(out, report_stage_name((enum report_stage)i), point->stage_ms[i]);
        json_out_close(out, '}');
        number(out, "first", point->cold_ms);
        json_out_close(out, '}');
        boolean(out, "cold", point->cold);
        report_write_work(out, &point->work);
        write_error(out, &point->error, sampled);
        write_part(out, "discretisation", point->discretisation, sampled);
        boolean(out, "front", point->front);
    }
    json_out_close(out, '}');
}

static void write_series(struct json_out *out, const struct sweep_series *series, bool sampled) {
    const struct sweep_row *row = series->row;
    json_out_open(out, '{');
    text(out, "name", row->name);
    text(out, "path", sweep_row_path_name(row));
    open(out, "variant", '{');
    for (int c = 0; c < SWEEP_CHOICES_MAX && row->choice[c].member; c++)
        text(out, row->choice[c].member, row->choice[c].value);
    json_out_close(out, '}');
    text(out, "quality", row->quality);
    text(out, "unit", sweep_row_unit(row));
    reason(out, series->refused);
    json_out_key(out, "limit_quality");
    if (series->limit_quality)
        json_out_integer(out, series->limit_quality);
    else
        json_out_string(out, NULL);
    write_part(out, "model", series->model, sampled);
    open(out, "order", '{');
    number(out, "value", series->fit.order);
    number(out, "standard_error", series->fit.standard_error);
    number(out, "finest", series->fit.finest_order);
    integer(out, "points", series->fit.points);
    number(out, "floor", series->fit.floor);
    json_out_close(out, '}');
    open(out, "points", '[');
    for (size_t i = 0; i < series->point_count; i++)
        write_point(out, &series->points[i], sampled);
    json_out_close(out, ']');
    json_out_close(out, '}');
}

char *sweep_json(const struct sweep *sweep) {
    struct json_out out = {0};
    bool sampled = sweep->pixels != NULL;
    json_out_open(&out, '{');
    open(&out, "image", '{');
    integer(&out, "width", (unsigned long long)sweep->width);
    integer(&out, "height", (unsigned long long)sweep->height);
    json_out_close(&out, '}');
    integer(&out, "repeats", (unsigned long long)sweep->repeats);
    open(&out, "reference", '{');
    integer(&out, "pixels", sweep->reference_count);
    boolean(&out, "all", !sampled);
    integer(&out, "samples", (unsigned long long)sweep->reference_samples);
    number(&out, "seconds", sweep->reference_s);
    json_out_close(&out, '}');
    open(&out, "series", '[');
    for (size_t i = 0; i < sweep->series_count; i++)
        write_series(&out, &sweep->series[i], sampled);
    json_out_close(&out, ']');
    report_write_warnings(&out, &sweep->report);
    text(&out, "clock", sweep->report.clock == REPORT_CLOCK_QUERY ? "query" : "fence");
    report_write_build(&out);
    report_write_renderer(&out, &sweep->report);
    json_out_key(&out, "scene");
    json_out_raw(&out, sweep->scene);
    json_out_close(&out, '}');
    return json_out_finish(&out);
}
