/* A sweep as it might have come out, made by hand: for tests of what is written about one. Two
 * points that were drawn, one that was refused, and a series of which all were. */
#ifndef PELT_TESTS_SWEEP_FIXTURE_H
#define PELT_TESTS_SWEEP_FIXTURE_H

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/sweep.h"

enum { SWEEP_FIXTURE_W = 6, SWEEP_FIXTURE_H = 4, SWEEP_FIXTURE_PIXELS = 24 };

struct sweep_fixture {
    struct sweep sweep;
    struct sweep_series series[2];
    struct sweep_point points[2][3];
    float pixels[2][SWEEP_FIXTURE_PIXELS * 4], reference[SWEEP_FIXTURE_PIXELS * 4];
    float flip[2][SWEEP_FIXTURE_PIXELS];
    uint8_t touched[SWEEP_FIXTURE_PIXELS];
    uint32_t sample[SWEEP_FIXTURE_PIXELS];
    char scene[1024];
};

static inline void sweep_fixture_point(struct sweep_point *point, int quality, double ms,
                                       double rmse) {
    point->quality = quality;
    point->cold_ms = 10 * ms;
    point->cold = quality == 4;
    point->total_ms = (struct sweep_spread){ms, 0.9 * ms, 1.25 * ms};
    point->draw_ms = (struct sweep_spread){0.5 * ms, 0.4 * ms, 0.6 * ms};
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        point->stage_ms[i] = i == REPORT_STAGE_queue ? 0 : ms / REPORT_STAGE_COUNT;
    point->work.samples = 96;
    point->error.touched = (struct error_figures){20, rmse, rmse / 50, 4 * rmse, 3 * rmse};
    point->error.whole = (struct error_figures){24, rmse * 0.9, rmse / 50, 4 * rmse, 3 * rmse};
    point->error.psnr_db = -20 * log10(0.9 * rmse);
    point->error.coverage = 3;
    point->error.flip = rmse / 2;
    point->discretisation = (struct error_figures){20, rmse / 2, rmse / 90, 2 * rmse, rmse};
    point->front = true;
}

/* `sampled`: the reference drew half of the pixels. The fixture must outlive the sweep, which is
 * not to be destroyed. */
static inline void sweep_fixture_make(struct sweep_fixture *fixture, bool sampled) {
    memset(fixture, 0, sizeof *fixture);
    struct sweep *sweep = &fixture->sweep;
    snprintf(fixture->scene, sizeof fixture->scene, "%s",
             "{\"objects\":[{\"shell\":{\"mesh\":{\"asset\":\"<b>&\\\"'.glb\"},\"material\":"
             "{\"builtin\":\"fur\"}},\"transform\":{\"scale\":[1,2,3]},\"quality\":{}}]}");
    *sweep = (struct sweep){.width = SWEEP_FIXTURE_W,
                            .height = SWEEP_FIXTURE_H,
                            .repeats = 3,
                            .scene = fixture->scene,
                            .series_count = 2,
                            .series = fixture->series,
                            .pixels = sampled ? fixture->sample : NULL,
                            .reference_samples = 64,
                            .reference_count = sampled ? 12 : SWEEP_FIXTURE_PIXELS,
                            .reference = fixture->reference,
                            .touched = fixture->touched,
                            .reference_s = 1.5};
    snprintf(sweep->report.gl_renderer, sizeof sweep->report.gl_renderer,
             "</pre><script>alert(1)</script>");
    snprintf(sweep->report.backend, sizeof sweep->report.backend, "egl");
    sweep->report.threads = 2;
    sweep->report.work.samples = 96;
    report_warn(&sweep->report, "overlap-approximate", "/objects/<0>", 2, 0, "bounds \"overlap\"");
    const struct error_figures unknown = {0, NAN, NAN, NAN, NAN};
    for (int s = 0; s < 2; s++) {
        fixture->series[s] = (struct sweep_series){.row = &sweep_rows[s],
                                                   .point_count = 3,
                                                   .points = fixture->points[s],
                                                   .model = unknown,
                                                   .fit = {.order = NAN,
                                                           .constant = NAN,
                                                           .standard_error = NAN,
                                                           .finest_order = NAN,
                                                           .floor = NAN}};
        for (int i = 0; i < 3; i++) {
            struct sweep_point *point = &fixture->points[s][i];
            point->quality = 4 << i;
            point->discretisation = unknown;
        }
    }
    for (int i = 0; i < 2; i++) {
        struct sweep_point *point = &fixture->points[0][i];
        sweep_fixture_point(point, 4 << i, 20 + 10 * i, 0.04 / (1 + 3 * i));
        point->pixels = fixture->pixels[i];
        point->flip = sampled ? NULL : fixture->flip[i];
        if (sampled)
            point->error.flip = NAN;
        for (int p = 0; p < 4 * SWEEP_FIXTURE_PIXELS; p++)
            fixture->pixels[i][p] = i ? 0.5f : 0.25f;
    }
    for (int p = 0; p < SWEEP_FIXTURE_PIXELS; p++) {
        fixture->flip[1][p] = 1;
        fixture->sample[p] = (uint32_t)(2 * p % SWEEP_FIXTURE_PIXELS);
    }
    snprintf(fixture->points[0][2].refused, SWEEP_REASON_BYTES, "/image: too much, \"really\"");
    fixture->series[0].limit_quality = 32;
    fixture->series[0].model = (struct error_figures){20, 0.003, 0.0001, 0.02, 0.01};
    fixture->series[0].fit = (struct sweep_fit){1.75, 0.2, 0.11, 1.9, 1e-6, 3};
    snprintf(fixture->series[1].refused, SWEEP_REASON_BYTES,
             "/objects/0/quality/order: cannot walk: <several>, & more");
}

#endif
