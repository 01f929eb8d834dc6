/* Filling a report: names of stages, warnings, passes. Texts that do not fit are cut; whatever
 * there are too many of is counted or dropped, never written past the end. */
#include "api/report.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *report_stage_name(enum report_stage stage) {
    static const char *const names[REPORT_STAGE_COUNT] = {
#define NAME(name) #name,
        REPORT_STAGES(NAME)
#undef NAME
    };
    assert(stage < REPORT_STAGE_COUNT);
    return names[stage];
}

const char *report_part_name(enum report_part part) {
    static const char *const names[REPORT_PART_COUNT] = {
#define NAME(name) #name,
        REPORT_PARTS(NAME)
#undef NAME
    };
    assert(part < REPORT_PART_COUNT);
    return names[part];
}

void report_reuse(struct report *report, enum report_part part, bool kept) {
    struct report_reuse *reuse = &report->reuse[part];
    *(kept ? &reuse->kept : &reuse->renewed) += 1;
}

void report_warn(struct report *report, const char *code, const char *pointer, uint64_t count,
                 uint64_t first, const char *format, ...) {
    if (report->warning_count == REPORT_WARNINGS_MAX) {
        report->warnings_left_out++;
        return;
    }
    struct report_warning *warning = &report->warnings[report->warning_count++];
    snprintf(warning->code, sizeof warning->code, "%s", code);
    snprintf(warning->pointer, sizeof warning->pointer, "%s", pointer ? pointer : "");
    warning->count = count;
    warning->first = first;
    va_list args;
    va_start(args, format);
    vsnprintf(warning->message, sizeof warning->message, format, args);
    va_end(args);
}

void report_settle(struct report *report) {
    struct report_target *target = &report->target;
    if (target->kind != REPORT_TARGET_DEADLINE_MS)
        return;
    target->reached = report->total_ms;
    target->met = target->reached <= target->asked;
}

static void append(struct report_pass passes[REPORT_PASSES_MAX], size_t *count, const char *name,
                   const char *why) {
    size_t i = 0;
    while (i < *count && strcmp(passes[i].name, name) != 0)
        i++;
    assert(i < REPORT_PASSES_MAX);
    if (i == REPORT_PASSES_MAX)
        return;
    *count += i == *count;
    snprintf(passes[i].name, sizeof passes[i].name, "%s", name);
    snprintf(passes[i].why, sizeof passes[i].why, "%s", why ? why : "");
}

void report_pass(struct report *report, const char *name, const char *why) {
    size_t kept = 0;
    for (size_t i = 0; i < report->left_out_count; i++)
        if (strcmp(report->left_out[i].name, name) != 0)
            report->left_out[kept++] = report->left_out[i];
    report->left_out_count = kept;
    append(report->passes, &report->pass_count, name, why);
}

void report_left_out(struct report *report, const char *name, const char *why) {
    append(report->left_out, &report->left_out_count, name, why);
}

void report_keep_drawn(const struct report *report, struct report_drawn *drawn) {
    drawn->work = report->work;
    drawn->pass_count = report->pass_count;
    drawn->left_out_count = report->left_out_count;
    memcpy(drawn->passes, report->passes, sizeof drawn->passes);
    memcpy(drawn->left_out, report->left_out, sizeof drawn->left_out);
}

void report_restore_drawn(struct report *report, const struct report_drawn *drawn) {
    report->work = drawn->work;
    report->pass_count = drawn->pass_count;
    report->left_out_count = drawn->left_out_count;
    memcpy(report->passes, drawn->passes, sizeof report->passes);
    memcpy(report->left_out, drawn->left_out, sizeof report->left_out);
}
