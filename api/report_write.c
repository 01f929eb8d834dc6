/* A report as JSON, after report.schema.json. */
#include <math.h>
#include <stdlib.h>

#include "api/report_parts.h"

static void write_text(struct json_out *out, const char *name, const char *text) {
    json_out_key(out, name);
    json_out_string(out, text);
}

void report_write_timing(struct json_out *out, const struct report *report) {
    json_out_key(out, "timing_ms");
    json_out_open(out, '{');
    json_out_key(out, "total");
    json_out_number(out, report->total_ms);
    for (int i = 0; i < REPORT_STAGE_COUNT; i++) {
        json_out_key(out, report_stage_name((enum report_stage)i));
        json_out_number(out, report->stage_ms[i]);
    }
    json_out_close(out, '}');
}

const char *report_commit(void) {
    return PELT_COMMIT;
}

void report_write_build(struct json_out *out) {
    json_out_key(out, "build");
    json_out_open(out, '{');
    write_text(out, "version", PELT_VERSION);
    write_text(out, "commit", PELT_COMMIT);
    json_out_close(out, '}');
}

void report_write_renderer(struct json_out *out, const struct report *report) {
    json_out_key(out, "renderer");
    json_out_open(out, '{');
    write_text(out, "backend", report->backend);
    write_text(out, "device", report->device);
    write_text(out, "gl_renderer", report->gl_renderer);
    write_text(out, "gl_version", report->gl_version);
    json_out_key(out, "threads");
    json_out_integer(out, report->threads);
    write_text(out, "cpu", report->cpu);
    json_out_key(out, "loaded");
    json_out_open(out, '[');
    for (size_t i = 0; i < report->loaded_count; i++)
        json_out_string(out, report->loaded[i]);
    json_out_close(out, ']');
    json_out_close(out, '}');
}

static void write_passes(struct json_out *out, const char *name, const struct report_pass *passes,
                         size_t count) {
    json_out_key(out, name);
    json_out_open(out, '[');
    for (size_t i = 0; i < count; i++) {
        json_out_open(out, '{');
        write_text(out, "pass", passes[i].name);
        write_text(out, "why", passes[i].why);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
}

void report_write_reuse(struct json_out *out, const struct report *report) {
    json_out_key(out, "reuse");
    json_out_open(out, '{');
    for (int i = 0; i < REPORT_PART_COUNT; i++) {
        json_out_key(out, report_part_name((enum report_part)i));
        json_out_open(out, '{');
        json_out_key(out, "kept");
        json_out_unsigned(out, report->reuse[i].kept);
        json_out_key(out, "renewed");
        json_out_unsigned(out, report->reuse[i].renewed);
        json_out_close(out, '}');
    }
    json_out_close(out, '}');
}

void report_write_work(struct json_out *out, const struct report_work *work) {
    const struct {
        const char *name;
        uint64_t count;
    } rows[] = {
        {"triangles", work->triangles},       {"prisms", work->prisms},
        {"tetrahedra", work->tetrahedra},     {"slices", work->slices},
        {"segments", work->segments},         {"fragments", work->fragments},
        {"samples", work->samples},           {"draws", work->draws},
        {"upload_bytes", work->upload_bytes}, {"cycles", work->cycles},
        {"sort_nodes", work->sort_nodes},     {"sort_edges", work->sort_edges},
    };
    json_out_key(out, "work");
    json_out_open(out, '{');
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        json_out_key(out, rows[i].name);
        json_out_unsigned(out, rows[i].count);
    }
    json_out_close(out, '}');
}

static void write_error(struct json_out *out, const struct report_error *error) {
    const struct {
        const char *name;
        double figure;
    } rows[] = {
        {"rmse", error->rmse},
        {"rmse_standard_error", error->rmse_standard_error},
        {"max_abs", error->max_abs},
        {"p99", error->p99},
        {"whole_rmse", error->whole_rmse},
        {"psnr_db", error->psnr_db},
        {"flip", error->flip},
        {"coverage", error->coverage},
        {"model", error->model},
        {"model_standard_error", error->model_standard_error},
        {"discretisation", error->discretisation},
        {"discretisation_standard_error", error->discretisation_standard_error},
    };
    json_out_key(out, "error");
    json_out_open(out, '{');
    write_text(out, "kind", error->kind == REPORT_ERROR_ESTIMATE ? "estimate" : "reference");
    json_out_key(out, "pixels");
    json_out_unsigned(out, error->pixels);
    json_out_key(out, "touched");
    json_out_unsigned(out, error->touched);
    json_out_key(out, "model_pixels");
    json_out_unsigned(out, error->model_pixels);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        json_out_key(out, rows[i].name);
        json_out_number(out, rows[i].figure); /* null where it is not known */
    }
    json_out_close(out, '}');
}

static void write_target(struct json_out *out, const struct report_target *target) {
    json_out_key(out, "target");
    json_out_open(out, '{');
    json_out_key(out, target->kind == REPORT_TARGET_MAX_ERROR ? "max_error" : "deadline_ms");
    json_out_number(out, target->asked);
    json_out_key(out, "reached");
    json_out_number(out, target->reached);
    if (target->kind == REPORT_TARGET_MAX_ERROR) {
        json_out_key(out, "model");
        json_out_number(out, target->model);
    }
    json_out_key(out, "met");
    json_out_boolean(out, target->met);
    json_out_key(out, "trials");
    json_out_unsigned(out, target->trials);
    json_out_key(out, "redrawn");
    json_out_unsigned(out, target->redrawn);
    write_text(out, "why", target->why);
    json_out_close(out, '}');
}

static void write_choice(struct json_out *out, const struct report_choice *choice) {
    static const char *const by[] = {[REPORT_CHOICE_ONLY] = "only",
                                     [REPORT_CHOICE_MODEL] = "model",
                                     [REPORT_CHOICE_TRIALS] = "trials",
                                     [REPORT_CHOICE_PREPARE] = "prepare"};
    json_out_key(out, "choice");
    json_out_open(out, '{');
    write_text(out, "path", choice->among[choice->chosen].path);
    write_text(out, "by", by[choice->by]);
    json_out_key(out, "among");
    json_out_open(out, '[');
    for (size_t i = 0; i < choice->count; i++) {
        const struct report_candidate *candidate = &choice->among[i];
        json_out_open(out, '{');
        write_text(out, "path", candidate->path);
        if (!candidate->able)
            write_text(out, "refused", candidate->why);
        const struct {
            const char *name;
            double figure;
        } rows[] = {
            {"expected_ms", candidate->expected_ms}, {"outlines", candidate->outlines},
            {"fragments", candidate->fragments},     {"steps", candidate->steps},
            {"measured_ms", candidate->measured_ms}, {"error", candidate->error},
        };
        for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
            if (!isfinite(rows[k].figure)) /* not found */
                continue;
            json_out_key(out, rows[k].name);
            json_out_number(out, rows[k].figure);
        }
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
    write_text(out, "why", choice->why);
    json_out_close(out, '}');
}

void report_write_warnings(struct json_out *out, const struct report *report) {
    json_out_key(out, "warnings");
    json_out_open(out, '[');
    for (size_t i = 0; i < report->warning_count; i++) {
        const struct report_warning *warning = &report->warnings[i];
        json_out_open(out, '{');
        write_text(out, "code", warning->code);
        write_text(out, "pointer", warning->pointer);
        write_text(out, "message", warning->message);
        json_out_key(out, "count");
        json_out_unsigned(out, warning->count);
        json_out_key(out, "first");
        json_out_unsigned(out, warning->first);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
    json_out_key(out, "warnings_left_out");
    json_out_unsigned(out, report->warnings_left_out);
}

char *report_write(const struct report *report) {
    char *scene = scene_write(&report->resolved);
    if (!scene)
        return NULL;
    struct json_out out = {0};
    json_out_open(&out, '{');
    report_write_timing(&out, report);
    write_text(&out, "clock", report->clock == REPORT_CLOCK_QUERY ? "query" : "fence");
    json_out_key(&out, "cold");
    json_out_boolean(&out, report->cold);
    report_write_build(&out);
    report_write_renderer(&out, report);
    json_out_key(&out, "plan");
    json_out_open(&out, '{');
    write_passes(&out, "passes", report->passes, report->pass_count);
    write_passes(&out, "left_out", report->left_out, report->left_out_count);
    json_out_close(&out, '}');
    report_write_work(&out, &report->work);
    if (report->choice.by != REPORT_CHOICE_NONE)
        write_choice(&out, &report->choice);
    report_write_reuse(&out, report);
    if (report->error.kind != REPORT_ERROR_NONE)
        write_error(&out, &report->error);
    if (report->target.kind != REPORT_TARGET_NONE)
        write_target(&out, &report->target);
    report_write_warnings(&out, report);
    json_out_key(&out, "resolved");
    json_out_raw(&out, scene);
    json_out_close(&out, '}');
    free(scene);
    return json_out_finish(&out);
}
