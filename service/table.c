/* A report as a table for people; scripts read the JSON. */
#include "service/table.h"

#include <stdlib.h>
#include <string.h>

static void print_stages(FILE *out, const struct report *report, double start_ms) {
    if (start_ms > 0)
        fprintf(out, "  %-9s %9.1f ms  (before the clock runs)\n", "open GL", start_ms);
    double sum = 0;
    for (int stage = 0; stage < REPORT_STAGE_COUNT; stage++) {
        double ms = report->stage_ms[stage];
        sum += ms;
        if (ms > 0)
            fprintf(out, "  %-9s %9.1f ms  %4.1f %%\n", report_stage_name((enum report_stage)stage),
                    ms, report->total_ms > 0 ? 100 * ms / report->total_ms : 0.0);
    }
    fprintf(out, "  %-9s %9.1f ms  (stages add up to %.1f; clock: %s%s)\n", "total",
            report->total_ms, sum, report->clock == REPORT_CLOCK_QUERY ? "query" : "fence",
            report->cold ? "; cold" : "");
}

static void print_passes(FILE *out, const char *title, const struct report_pass *passes,
                         size_t count) {
    for (size_t i = 0; i < count; i++)
        fprintf(out, "  %-9s %s%s%s\n", i ? "" : title, passes[i].name,
                passes[i].why[0] ? ": " : "", passes[i].why);
}

static void print_error(FILE *out, const struct report_error *error) {
    fprintf(out,
            "  %-9s rmse %.3g +- %.1g (%s, %llu pixels): model %.3g +- %.1g, discretisation %.3g "
            "+- %.1g\n",
            "error", error->rmse, error->rmse_standard_error,
            error->kind == REPORT_ERROR_ESTIMATE ? "estimate" : "reference",
            (unsigned long long)error->pixels, error->model, error->model_standard_error,
            error->discretisation, error->discretisation_standard_error);
}

static void print_target(FILE *out, const struct report_target *target) {
    bool error = target->kind == REPORT_TARGET_MAX_ERROR;
    fprintf(out, "  %-9s %s %.3g%s, %s: %.3g%s; %s\n", "target", error ? "error" : "deadline",
            target->asked, error ? "" : " ms", target->met ? "met" : "missed", target->reached,
            error ? "" : " ms", target->why);
}

static void print_choice(FILE *out, const struct report_choice *choice) {
    fprintf(out, "  %-9s %s: %s\n", "path", choice->among[choice->chosen].path, choice->why);
}

void table_print_plan(FILE *out, const struct report *report) {
    if (report->choice.by != REPORT_CHOICE_NONE)
        print_choice(out, &report->choice);
    print_passes(out, "passes", report->passes, report->pass_count);
    print_passes(out, "left out", report->left_out, report->left_out_count);
    for (size_t i = 0; i < report->loaded_count; i++)
        fprintf(out, "  %-9s %s\n", i ? "" : "loaded", report->loaded[i]);
    for (size_t i = 0; i < report->warning_count; i++)
        fprintf(out, "  %-9s %s: %s\n", "warning", report->warnings[i].pointer,
                report->warnings[i].message);
    if (report->warnings_left_out)
        fprintf(out, "  %-9s %llu more\n", "warning",
                (unsigned long long)report->warnings_left_out);
}

void table_print(FILE *out, const struct report *report, double start_ms) {
    fprintf(out, "  %s, %s, %s, %d thread%s\n", report->backend, report->gl_renderer,
            report->gl_version, report->threads, report->threads == 1 ? "" : "s");
    print_stages(out, report, start_ms);
    if (report->error.kind != REPORT_ERROR_NONE)
        print_error(out, &report->error);
    if (report->target.kind != REPORT_TARGET_NONE)
        print_target(out, &report->target);
    table_print_plan(out, report);
}

void table_print_timing(FILE *out, const char *server_timing) {
    for (const char *entry = server_timing; *entry;) {
        size_t length = strcspn(entry, ",");
        size_t name = strcspn(entry, ";,");
        const char *duration = memmem(entry, length, "dur=", 4);
        if (duration)
            fprintf(out, "  %-9.*s %9.1f ms\n", (int)name, entry, strtod(duration + 4, NULL));
        entry += length;
        entry += strspn(entry, ", ");
    }
}
