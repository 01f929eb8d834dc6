/* A sweep as CSV (RFC 4180, lines end in CR LF): one line for each point, for spreadsheets and
 * plotting scripts. Names carry their units. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_out.h"
#include "service/sweep_write.h"

void sweep_csv_field(FILE *out, const char *text) {
    bool quoted = text[strcspn(text, "\",\r\n")] != 0 || *text == ' ' ||
                  (*text && text[strlen(text) - 1] == ' ');
    if (!quoted) {
        fputs(text, out);
        return;
    }
    fputc('"', out);
    for (; *text; text++) {
        if (*text == '"')
            fputc('"', out);
        fputc(*text, out);
    }
    fputc('"', out);
}

static void put_number(FILE *out, double value) {
    char text[JSON_NUMBER_BYTES] = "";
    if (isfinite(value))
        json_number_text(value, text);
    fprintf(out, ",%s", text);
}

static void put_count(FILE *out, uint64_t count) {
    fprintf(out, ",%llu", (unsigned long long)count);
}

/* The columns behind those that every point has, in the order of put_figures(). */
static const char *const columns[] = {
    "total_ms",
    "total_p10_ms",
    "total_p90_ms",
    "draw_ms",
    "draw_p10_ms",
    "draw_p90_ms",
    "first_ms",
    "first_cold",
    "rmse",
    "rmse_standard_error",
    "max_abs",
    "p99",
    "whole_rmse",
    "psnr_db",
    "coverage",
    "flip",
    "touched_pixels",
    "not_finite_pixels",
    "discretisation",
    "model",
    "order",
    "order_standard_error",
    "order_finest",
    "order_points",
    "front",
    "work_tetrahedra",
    "work_segments",
    "work_fragments",
    "work_samples",
    "work_draws",
    "reference_pixels",
    "reference_samples",
};
enum { COLUMNS = sizeof columns / sizeof *columns };

static void put_figures(FILE *out, const struct sweep *sweep, const struct sweep_series *series,
                        const struct sweep_point *point) {
    const struct error_metrics *error = &point->error;
    put_number(out, point->total_ms.median);
    put_number(out, point->total_ms.p10);
    put_number(out, point->total_ms.p90);
    put_number(out, point->draw_ms.median);
    put_number(out, point->draw_ms.p10);
    put_number(out, point->draw_ms.p90);
    put_number(out, point->cold_ms);
    put_count(out, point->cold);
    put_number(out, error->touched.rmse);
    put_number(out, sweep->pixels ? error->touched.rmse_standard_error : 0);
    put_number(out, error->touched.max_abs);
    put_number(out, error->touched.p99);
    put_number(out, error->whole.rmse);
    put_number(out, error->psnr_db);
    put_number(out, (double)error->coverage / (double)error->whole.pixels);
    put_number(out, error->flip);
    put_count(out, error->touched.pixels);
    put_count(out, error->not_finite);
    put_number(out, point->discretisation.rmse);
    put_number(out, series->model.rmse);
    put_number(out, series->fit.order);
    put_number(out, series->fit.standard_error);
    put_number(out, series->fit.finest_order);
    put_count(out, series->fit.points);
    put_count(out, point->front);
    put_count(out, point->work.tetrahedra);
    put_count(out, point->work.segments);
    put_count(out, point->work.fragments);
    put_count(out, point->work.samples);
    put_count(out, point->work.draws);
    put_count(out, sweep->reference_count);
    put_count(out, (size_t)sweep->reference_samples);
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        put_number(out, point->stage_ms[i]);
}

char *sweep_csv(const struct sweep *sweep) {
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    if (!out)
        return NULL;
    fputs("series,path,quality_name,quality,refused", out);
    for (int i = 0; i < COLUMNS; i++)
        fprintf(out, ",%s", columns[i]);
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        fprintf(out, ",stage_%s_ms", report_stage_name((enum report_stage)i));
    fputs("\r\n", out);
    for (size_t s = 0; s < sweep->series_count; s++)
        for (size_t i = 0; i < sweep->series[s].point_count; i++) {
            const struct sweep_series *series = &sweep->series[s];
            const struct sweep_point *point = &series->points[i];
            fprintf(out, "%s,%s,%s,%d,", series->row->name, sweep_row_path_name(series->row),
                    series->row->quality, point->quality);
            sweep_csv_field(out, *series->refused ? series->refused : point->refused);
            if (point->pixels)
                put_figures(out, sweep, series, point);
            else
                for (int k = 0; k < COLUMNS + REPORT_STAGE_COUNT; k++)
                    fputc(',', out);
            fputs("\r\n", out);
        }
    bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed) {
        free(text);
        return NULL;
    }
    return text;
}
