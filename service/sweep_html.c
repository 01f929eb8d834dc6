/* The page of a sweep: www/sweep.html with its {{names}} filled in. Whatever comes from a scene or
 * a driver is escaped; the page asks for nothing from elsewhere. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/embedded.h"
#include "api/json_utf8.h"
#include "api/report_parts.h"
#include "service/sweep_page.h"
#include "service/sweep_write.h"

/* One character of ASCII. */
static void escape_ascii(FILE *out, char c) {
    if ((c >= 0 && c < 0x20 && c != '\n' && c != '\t') || c == 0x7f)
        fputs("\xEF\xBF\xBD", out);
    else if (c && strchr("&<>\"'", c))
        fprintf(out, "&#%d;", c);
    else
        fputc(c, out);
}

void sweep_escape(FILE *out, const char *text) {
    for (const char *end = text + strlen(text); text < end;) {
        size_t length = json_utf8_length(text, (size_t)(end - text));
        if (length == 0)
            fputs("\xEF\xBF\xBD", out);
        else if (length == 1)
            escape_ascii(out, *text);
        else
            fwrite(text, 1, length, out);
        text += length ? length : 1;
    }
}

void sweep_figure(FILE *out, double value) {
    if (!isfinite(value)) {
        fputs("–", out);
        return;
    }
    double size = fabs(value);
    if (size == 0 || (size >= 999.5 && size < 1e6)) {
        fprintf(out, "%.0f", value);
        return;
    }
    if (size >= 0.0995 && size < 999.5) {
        fprintf(out, "%.*f", size >= 99.95 ? 0 : size >= 9.995 ? 1 : size >= 0.9995 ? 2 : 3, value);
        return;
    }
    int exponent = (int)floor(log10(fabs(value)));
    double digits = value / pow(10, exponent);
    if (fabs(digits) >= 9.995) {
        digits /= 10;
        exponent++;
    }
    fprintf(out, "%.2fe%d", digits, exponent);
}

void sweep_time(FILE *out, double ms) {
    fprintf(out, "%.*f", ms >= 99.95 ? 0 : ms >= 9.995 ? 1 : ms >= 0.9995 ? 2 : 3, ms);
}

static void summary(FILE *out, const struct sweep *sweep) {
    size_t all = (size_t)sweep->width * (size_t)sweep->height;
    double per_pixel = (double)sweep->report.work.samples / (double)all;
    fprintf(out, "%d &times; %d pixels of %.0f sample%s each; median of %d interleaved repeats. ",
            sweep->width, sweep->height, per_pixel, per_pixel == 1 ? "" : "s", sweep->repeats);
    if (sweep->pixels)
        fprintf(out, "Reference: %zu of %zu pixels, stratified", sweep->reference_count, all);
    else
        fprintf(out, "Reference: all %zu pixels", all);
    fprintf(out, ", in double precision, drawn in %.3g s.", sweep->reference_s);
    if (sweep->reference_samples > per_pixel)
        fprintf(out,
                " A filtered sample stands for its whole pixel, so the reference of all series is "
                "the mean of %d samples of each pixel: the error of unfiltered ones holds what "
                "aliases.",
                sweep->reference_samples);
}

static void warnings(FILE *out, const struct sweep *sweep) {
    const struct report *report = &sweep->report;
    for (size_t i = 0; i < report->warning_count; i++) {
        const struct report_warning *warning = &report->warnings[i];
        fputs("<p class=\"warning\"><b>Warning:</b> ", out);
        if (*warning->pointer) {
            fputs("<code>", out);
            sweep_escape(out, warning->pointer);
            fputs("</code> ", out);
        }
        sweep_escape(out, warning->message);
        fprintf(out, " (%llu)</p>\n", (unsigned long long)warning->count);
    }
}

static void bars(FILE *out, const struct sweep *sweep) {
    fputs(sweep->pixels ? "Horizontal bars: p10 to p90 of the time; vertical: standard error of "
                          "the RMSE, which is of a sample."
                        : "Bars: p10 to p90 of the time.",
          out);
}

/* An RMSE, of a sample with its standard error: "(5.78 ± 0.09)e-2". */
static void measured(FILE *out, const struct error_figures *figures, bool sampled) {
    if (!sampled || !(figures->rmse > 0)) {
        sweep_figure(out, figures->rmse);
        return;
    }
    int exponent = (int)floor(log10(figures->rmse));
    double unit = pow(10, exponent);
    fprintf(out, "(%.2f &plusmn; %.2f)e%d", figures->rmse / unit,
            figures->rmse_standard_error / unit, exponent);
}

static void legend(FILE *out, const struct sweep *sweep) {
    for (size_t s = 0; s < sweep->series_count; s++) {
        const struct sweep_series *series = &sweep->series[s];
        fputs("<li>", out);
        sweep_mark(out, s);
        fprintf(out, "<b>%s</b>, %s", series->row->name, series->row->text);
        if (*series->refused) {
            fputs("; not drawn: ", out);
            sweep_escape(out, series->refused);
        } else if (isfinite(series->fit.order)) {
            fprintf(out, "; order of convergence <b>%.2f", series->fit.order);
            if (isfinite(series->fit.standard_error))
                fprintf(out, " &plusmn; %.2f", series->fit.standard_error);
            fprintf(out, "</b> (%zu points", series->fit.points);
            if (series->fit.points > 2)
                fprintf(out, "; %.2f by the finest two", series->fit.finest_order);
            fputs(")", out);
        } else {
            fprintf(out, "; no order of convergence (%zu points above the noise floor)",
                    series->fit.points);
        }
        if (series->limit_quality) {
            fputs("; model error <b>", out);
            measured(out, &series->model, sweep->pixels != NULL);
            fprintf(out, "</b> (limit: %s %d)", series->row->quality, series->limit_quality);
        }
        fputs("</li>\n", out);
    }
}

static void cell(FILE *out, double value) {
    fputs("<td>", out);
    sweep_figure(out, value);
    fputs("</td>", out);
}

static void time_cell(FILE *out, double ms) {
    fputs("<td>", out);
    sweep_time(out, ms);
    fputs("</td>", out);
}

/* Opens a row: the series and its quality. */
static void row_head(FILE *out, const struct sweep_series *series, size_t i) {
    fprintf(out, "<tr class=\"%s%s\"><th scope=\"row\">%s %d</th>", i ? "" : "first ",
            series->points[i].front ? "front" : "", series->row->name, series->points[i].quality);
}

static void row_figures(FILE *out, const struct sweep *sweep, const struct sweep_point *point) {
    const struct error_metrics *error = &point->error;
    time_cell(out, point->total_ms.median);
    fputs("<td>", out);
    sweep_time(out, point->total_ms.p10);
    fputs(" – ", out);
    sweep_time(out, point->total_ms.p90);
    fputs("</td>", out);
    time_cell(out, point->draw_ms.median);
    fputs("<td>", out);
    sweep_time(out, point->cold_ms);
    fprintf(out, "%s</td><td>", point->cold ? " cold" : "");
    measured(out, &error->touched, sweep->pixels != NULL);
    fputs("</td>", out);
    cell(out, error->touched.p99);
    cell(out, error->touched.max_abs);
    cell(out, point->discretisation.rmse);
    isfinite(error->psnr_db) ? (void)fprintf(out, "<td>%.1f</td>", error->psnr_db)
                             : (void)fputs("<td>–</td>", out);
    fprintf(out, "<td>%.2f</td>", 100 * (double)error->coverage / (double)error->whole.pixels);
    if (!sweep->pixels)
        cell(out, error->flip);
}

static void table(FILE *out, const struct sweep *sweep) {
    fputs("<table><thead><tr><th>series, quality</th><th>total<small>ms, median</small></th>"
          "<th>p10 – p90<small>ms</small></th><th>draw<small>ms, median</small></th>"
          "<th>first<small>ms</small></th><th>RMSE</th><th>p99</th><th>largest</th>"
          "<th>discreti-<br>sation</th><th>PSNR<small>dB</small></th>"
          "<th>coverage<small>%</small></th>",
          out);
    fputs(sweep->pixels ? "" : "<th>FLIP<small>mean</small></th>", out);
    fputs("</tr></thead><tbody>\n", out);
    for (size_t s = 0; s < sweep->series_count; s++)
        for (size_t i = 0; i < sweep->series[s].point_count; i++) {
            const struct sweep_series *series = &sweep->series[s];
            const struct sweep_point *point = &series->points[i];
            row_head(out, series, i);
            if (point->pixels) {
                row_figures(out, sweep, point);
            } else {
                fputs("<td class=\"reason\" colspan=\"11\">not drawn: ", out);
                sweep_escape(out, *series->refused ? series->refused : point->refused);
                fputs("</td>", out);
            }
            fputs("</tr>\n", out);
        }
    fputs("</tbody></table>", out);
}

static void stages(FILE *out, const struct sweep *sweep) {
    bool used[REPORT_STAGE_COUNT] = {false};
    for (size_t s = 0; s < sweep->series_count; s++)
        for (size_t i = 0; i < sweep->series[s].point_count; i++)
            for (int stage = 0; stage < REPORT_STAGE_COUNT; stage++)
                used[stage] |= sweep->series[s].points[i].stage_ms[stage] > 0;
    fputs("<table><thead><tr><th>series, quality</th>", out);
    for (int stage = 0; stage < REPORT_STAGE_COUNT; stage++)
        if (used[stage])
            fprintf(out, "<th>%s</th>", report_stage_name((enum report_stage)stage));
    fputs("<th>total</th></tr></thead><tbody>\n", out);
    for (size_t s = 0; s < sweep->series_count; s++)
        for (size_t i = 0; i < sweep->series[s].point_count; i++) {
            const struct sweep_point *point = &sweep->series[s].points[i];
            if (!point->pixels)
                continue;
            row_head(out, &sweep->series[s], i);
            for (int stage = 0; stage < REPORT_STAGE_COUNT; stage++)
                if (used[stage])
                    time_cell(out, point->stage_ms[stage]);
            time_cell(out, point->total_ms.median);
            fputs("</tr>\n", out);
        }
    fputs("</tbody></table>", out);
}

static void sampling(FILE *out, const struct sweep *sweep) {
    if (sweep->pixels)
        fprintf(out,
                "<p><b>Sample.</b> The reference drew %zu pixels, one at random in each of as many "
                "cells of the frame; every figure above is over these. Standard errors are those "
                "of a simple random sample, which a stratified one does not exceed. FLIP and maps "
                "of errors need all pixels (<code>--pixels all</code>).</p>",
                sweep->reference_count);
}

static void term(FILE *out, const char *name, const char *value) {
    fprintf(out, "<dt>%s</dt><dd>", name);
    sweep_escape(out, value);
    fputs("</dd>\n", out);
}

static void machine(FILE *out, const struct sweep *sweep) {
    const struct report *report = &sweep->report;
    term(out, "OpenGL", report->gl_version);
    term(out, "renderer", report->gl_renderer);
    term(out, "opened by", report->backend);
    term(out, "device", report->device);
    term(out, "CPU", report->cpu);
    fprintf(out, "<dt>threads</dt><dd>%d</dd>\n", report->threads);
    term(out, "clock", report->clock == REPORT_CLOCK_QUERY ? "query" : "fence");
    fputs("<dt>libraries opened</dt><dd>", out);
    for (size_t i = 0; i < report->loaded_count; i++) {
        fputs(i ? ", " : "", out);
        sweep_escape(out, report->loaded[i]);
    }
    fputs(report->loaded_count ? "</dd>\n" : "none</dd>\n", out);
    fputs("<dt>Pelt</dt><dd>" PELT_VERSION ", commit ", out);
    sweep_escape(out, report_commit());
    fputs("</dd>\n", out);
}

/* The scene's JSON with a line for each member; arrays of plain values stay on theirs. */
static void scene(FILE *out, const struct sweep *sweep) {
    int depth = 0;
    bool in_string = false, flat = false;
    for (const char *at = sweep->scene; *at; at++) {
        char c = *at;
        if (in_string) {
            in_string = *at != '"';
            if (*at == '\\' && at[1]) {
                escape_ascii(out, c);
                c = *++at;
            }
        } else if (*at == '"') {
            in_string = true;
        } else if (*at == '[' && !strpbrk(at + 1, "[{]")) {
            flat = true;
        } else if (*at == '[') {
            flat = *strpbrk(at + 1, "[{]") == ']';
        }
        bool empty = at[0] == '{' && at[1] == '}';
        bool opens = !in_string && !empty && (*at == '{' || (*at == '[' && !flat));
        bool closes = !in_string && (*at == '}' || (*at == ']' && !flat));
        if (!in_string && empty) {
            fputs("{}", out);
            at++;
            continue;
        }
        if (closes)
            fprintf(out, "\n%*s", 2 * --depth, "");
        /* Bytes of a longer character pass as they are: the text is UTF-8 throughout. */
        if ((unsigned char)c >= 0x80)
            fputc(c, out);
        else
            escape_ascii(out, c);
        if (!in_string && *at == ']')
            flat = false;
        if (opens)
            fprintf(out, "\n%*s", 2 * ++depth, "");
        else if (!in_string && *at == ',' && !flat)
            fprintf(out, "\n%*s", 2 * depth, "");
        else if (!in_string && (*at == ':' || *at == ','))
            fputc(' ', out);
    }
}

/* ---- the template ---- */

static const struct part {
    const char *name;
    void (*write)(FILE *out, const struct sweep *sweep);
} parts[] = {
    {"summary", summary},
    {"warnings", warnings},
    {"chart_time", sweep_chart_time},
    {"chart_order", sweep_chart_order},
    {"bars", bars},
    {"legend", legend},
    {"table", table},
    {"stages", stages},
    {"sampling", sampling},
    {"machine", machine},
    {"scene", scene},
};

/* False where memory ran out. */
static bool fill(FILE *out, const char *part, size_t length, const struct sweep *sweep,
                 const char *name) {
    if (length == 4 && strncmp(part, "name", length) == 0)
        sweep_escape(out, name);
    if (length == 7 && strncmp(part, "gallery", length) == 0)
        return sweep_gallery(out, sweep);
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++)
        if (strlen(parts[i].name) == length && strncmp(part, parts[i].name, length) == 0)
            parts[i].write(out, sweep);
    return true;
}

char *sweep_html(const struct sweep *sweep, const char *name) {
    char *text = NULL;
    size_t bytes = 0;
    const struct embedded *page = embedded_find("service/www/sweep.html");
    FILE *out = page ? open_memstream(&text, &bytes) : NULL;
    if (!out)
        return NULL;
    bool good = true;
    const char *at = page->begin;
    for (const char *next; good && (next = strstr(at, "{{")) != NULL;) {
        const char *end = strstr(next, "}}");
        if (!end)
            break;
        fwrite(at, 1, (size_t)(next - at), out);
        good = fill(out, next + 2, (size_t)(end - next - 2), sweep, name);
        at = end + 2;
    }
    fwrite(at, 1, (size_t)(page->end - at), out);
    good &= ferror(out) == 0;
    good &= fclose(out) == 0;
    if (!good) {
        free(text);
        return NULL;
    }
    return text;
}
