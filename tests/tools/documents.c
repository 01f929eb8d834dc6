/* Writes reports, sweeps and problem documents of every sort, for the test that holds them to their
 * schemas. One line each: "report", "sweep" or "problem", a space, the document. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/problem_write.h"
#include "api/report.h"
#include "service/sweep_write.h"
#include "tests/sweep_fixture.h"

static void print(const char *what, char *document) {
    if (!document)
        exit(1);
    printf("%s %s\n", what, document);
    free(document);
}

static void read_scene(struct arena *arena, struct scene *scene, const char *json) {
    if (scene_read(json, strlen(json), arena, scene, NULL) != STATUS_OK)
        exit(1);
}

static void print_reports(void) {
    struct arena arena = {0};
    static struct report report;
    read_scene(&arena, &report.resolved, "{\"objects\": [{\"mesh\": {\"shape\": \"plane\"}}]}");
    print("report", report_write(&report));
    report.error = (struct report_error){.kind = REPORT_ERROR_REFERENCE, .psnr_db = INFINITY};
    report.target =
        (struct report_target){.kind = REPORT_TARGET_DEADLINE_MS, .asked = 20, .reached = 21};
    print("report", report_write(&report));

    /* Everything at its fullest, with texts that are too long or not UTF-8. */
    char longest[600];
    memset(longest, 'x', sizeof longest - 1);
    longest[sizeof longest - 1] = 0;
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        report.stage_ms[i] = 0.1 * i;
    report.total_ms = 1e9;
    report.error = (struct report_error){.kind = REPORT_ERROR_ESTIMATE,
                                         .pixels = UINT64_MAX,
                                         .rmse = 0.1,
                                         .max_abs = INFINITY,
                                         .p99 = NAN,
                                         .psnr_db = -3,
                                         .model_pixels = 9};
    report.target =
        (struct report_target){.kind = REPORT_TARGET_MAX_ERROR, .asked = 0.01, .met = true};
    memset(report.target.why, 'y', sizeof report.target.why - 1);
    report.choice = (struct report_choice){.by = REPORT_CHOICE_TRIALS, .count = REPORT_CHOICE_MAX};
    for (int i = 0; i < REPORT_CHOICE_MAX; i++) {
        struct report_candidate *candidate = &report.choice.among[i];
        *candidate = (struct report_candidate){.able = i > 0,
                                               .expected_ms = i,
                                               .steps = 1e12,
                                               .measured_ms = i > 1 ? 1.5 : NAN,
                                               .error = i > 1 ? 0.25 : INFINITY};
        memset(candidate->path, 'p', sizeof candidate->path - 1);
        memset(candidate->why, 'w', sizeof candidate->why - 1);
    }
    memset(report.choice.why, 'z', sizeof report.choice.why - 1);
    report.clock = REPORT_CLOCK_QUERY;
    report.cold = true;
    strcpy(report.backend, "egl");
    strcpy(report.device, "device \"0\"\n");
    strcpy(report.gl_renderer, "bad \xFF bytes \xC3");
    report.threads = 64;
    report.loaded_count = REPORT_LOADED_MAX;
    memset(&report.work, 0xFF, sizeof report.work);
    for (int i = 0; i < REPORT_PASSES_MAX; i++) {
        report_pass(&report, i ? "tetra" : longest, longest);
        report_left_out(&report, "shadow", "no light casts a shadow");
    }
    for (int i = 0; i < REPORT_WARNINGS_MAX + 5; i++)
        report_warn(&report, "zero-area-triangles", i ? "/objects/0/shell/mesh" : NULL, UINT64_MAX,
                    7, "%d %s", i, longest);
    report.resolved.camera.given = true;
    report.resolved.camera.eye[1] = -3;
    print("report", report_write(&report));
    arena_free(&arena);
}

static void print_problems(void) {
    for (int status = 0; status < STATUS_COUNT; status++) {
        struct error err = {.status = (enum status)status};
        print("problem", problem_write(&err, NULL));
        if (status == STATUS_OK)
            continue;
        err.status = STATUS_OK;
        error_fault(&err, (enum status)status, NULL, "%s", "no scene is involved");
        print("problem", problem_write(&err, "0123456789abcdef"));
        error_fault(&err, (enum status)status, "/a~1b~0c/0/\xC3\xA9", "quoted \"%s\"", "\x01");
        for (int i = 0; i < ERROR_FAULTS_MAX + 3; i++)
            error_fault(&err, (enum status)status, "", "fault %d", i);
        print("problem", problem_write(&err, "id"));
        error_clear(&err);
    }
}

static void print_sweeps(void) {
    static struct sweep_fixture fixture;
    struct arena arena = {0};
    struct scene scene;
    read_scene(&arena, &scene, "{\"objects\": [{\"mesh\": {\"shape\": \"plane\"}}]}");
    char *text = scene_write(&scene);
    for (int sampled = 0; sampled < 2; sampled++) {
        sweep_fixture_make(&fixture, sampled);
        fixture.sweep.scene = text;
        print("sweep", sweep_json(&fixture.sweep));
    }
    free(text);
    arena_free(&arena);
}

int main(void) {
    print_reports();
    print_sweeps();
    print_problems();
    return 0;
}
