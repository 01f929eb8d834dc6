/* Errors that a report gives, against errors that are worked out here from whole pictures; and what
 * a target makes of a scene. */
#include <math.h>
#include <stdlib.h>

#include "renderer/error/metrics.h"
#include "renderer/gl/clock.h"
#include "renderer/truth.h"
#include "tests/unit/renderer_fixture.h"

#define CLOUDS "'material': {'builtin': 'clouds', 'size': [32, 32, 16]}"
#define CHAIN  "'material': {'builtin': 'chain', 'size': [32, 32, 8]}"
#define BASE   "'base': {'color': [0.5, 0.3, 0.2]}, "
#define SHELL(mesh, rest)                                                                          \
    "{'shell': {'mesh': {" mesh "}, 'thickness': 0.25, 'tiles': [4, 3], " rest "}, 'quality': {"
#define PLANE  "'shape': 'plane', 'divisions': [3, 3]"
#define SPHERE "'shape': 'sphere', 'divisions': [12, 8]"

static void draw(struct render_result *result, int width, int height, int samples, const char *rest,
                 const char *objects) {
    assert_int_equal(support_draw(renderer, result,
                                  "{'image': {'width': %d, 'height': %d, 'samples': %d}, "
                                  "'camera': {'eye': [0.9, -2.6, 2.2], 'target': [0, 0, 0.1]}, "
                                  "'objects': [%s]%s}",
                                  width, height, samples, objects, rest),
                     STATUS_OK);
}

/* RMSE between two pictures over what either draws on. */
static double rmse_between(const struct render_result *a, const struct render_result *b) {
    struct error_metrics metrics;
    struct error err = {0};
    static const double background[4] = {0, 0, 0, 0};
    assert_int_equal(error_compare(a->pixels, b->pixels, a->width, a->height, NULL, background,
                                   NULL, &metrics, &err),
                     STATUS_OK);
    return metrics.touched.rmse;
}

/* The estimate of discretisation, from few pixels drawn by points and under masks, is that of the
 * whole picture against one with 16 times the samples: for media and solids, walked and sorted,
 * with and without an occluder, for every number of samples a pixel and sizes that no block
 * divides. */
static void test_estimate_of_discretisation(void **state) {
    (void)state;
    static const struct {
        const char *before, *after;
        int width, height, samples;
    } rows[] = {
        {SHELL(PLANE, CLOUDS) "'order': 'walk', 'samples': ", "}}", 192, 144, 1},
        {SHELL(PLANE, CLOUDS) "'order': 'sorted', 'samples': ", "}}", 192, 144, 1},
        {SHELL(PLANE, BASE CLOUDS) "'order': 'walk', 'samples': ", "}}", 163, 147, 4},
        {SHELL(PLANE, BASE CLOUDS) "'order': 'sorted', 'samples': ", "}}", 161, 133, 4},
        {SHELL(SPHERE, CHAIN) "'order': 'walk', 'traversal': 'fixed', 'samples': ", "}}", 192, 140,
         4},
        {SHELL(SPHERE, CHAIN) "'order': 'sorted', 'traversal': 'fixed', 'samples': ", "}}", 192,
         140, 1},
        {SHELL(SPHERE, BASE CLOUDS) "'samples': ", "}}", 131, 113, 9},
        {SHELL(SPHERE, BASE CLOUDS) "'samples': ", "}}", 111, 113, 16},
        {SHELL(SPHERE, CLOUDS) "'samples': ", "}}, {'mesh': {'shape': 'sphere'}}", 107, 113, 25},
        /* 24 planes, and 264. */
        {SHELL(PLANE, CLOUDS) "'slices': 2", "}}", 192, 144, 1},
        {SHELL(SPHERE, BASE CLOUDS) "'slices': 2", "}}", 131, 113, 9},
        {SHELL(SPHERE, CHAIN) "'slices': 2", "}}", 192, 140, 1},
        {SHELL(SPHERE, BASE CLOUDS) "'method': 'hybrid', 'slices': 2", "}}", 161, 133, 4},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char objects[1024];
        struct render_result coarse, fine;
        snprintf(objects, sizeof objects, "%s%d%s", rows[i].before, 4, rows[i].after);
        draw(&coarse, rows[i].width, rows[i].height, rows[i].samples,
             ", 'report': {'error': 'estimate'}", objects);
        snprintf(objects, sizeof objects, "%s%d%s", rows[i].before, 64, rows[i].after);
        draw(&fine, rows[i].width, rows[i].height, rows[i].samples, "", objects);
        const struct report_error *error = &coarse.report.error;
        assert_int_equal(error->kind, REPORT_ERROR_ESTIMATE);
        double estimate = error->discretisation;
        double true_ = rmse_between(&coarse, &fine);
        print_message("%zu: estimate %.4g, true %.4g, ratio %.2f (%llu pixels)\n", i, estimate,
                      true_, estimate / true_, (unsigned long long)error->pixels);
        if (!(estimate > 0.7 * true_ && estimate < 1.4 * true_))
            fail_msg("row %zu: estimate %.4g, true %.4g", i, estimate, true_);
        render_result_finish(&coarse);
        render_result_finish(&fine);
    }
}

/* At its own quality the few pixels are the picture's own: an estimate leaves no other trace than
 * its figures, and a medium that needs no samples has no discretisation error at all. */
static void test_estimate_changes_nothing(void **state) {
    (void)state;
    struct render_result plain, measured;
    draw(&plain, 50, 40, 4, "", SHELL(SPHERE, BASE CLOUDS) "}}");
    draw(&measured, 50, 40, 4, ", 'report': {'error': 'estimate'}",
         SHELL(SPHERE, BASE CLOUDS) "}}");
    assert_memory_equal(plain.pixels, measured.pixels, 50 * 40 * 4 * sizeof *plain.pixels);
    assert_memory_equal(&plain.report.work.draws, &measured.report.work.draws,
                        sizeof plain.report.work.draws);
    assert_int_equal(plain.report.error.kind, REPORT_ERROR_NONE);
    render_result_finish(&plain);
    render_result_finish(&measured);
    draw(&measured, 50, 40, 4, ", 'target': {'max_error': 0.5}",
         SHELL(PLANE, "'material': {'builtin': 'homogeneous'}") "}}");
    assert_true(measured.report.error.discretisation == 0);
    assert_true(measured.report.error.rmse < 1e-6); /* measured 4e-8 */
    assert_true(measured.report.error.model_pixels >= 8);
    render_result_finish(&measured);
}

/* Where all pixels are compared the figures are those of `pelt reference --compare`. */
static void test_reference_of_all_pixels(void **state) {
    (void)state;
    char json[2048];
    snprintf(json, sizeof json,
             "{'image': {'width': 40, 'height': 36, 'samples': 4}, 'camera': {'eye': [0.9, -2.6, "
             "2.2], 'target': [0, 0, 0.1]}, 'objects': [%s], 'report': {'error': 'reference'}}",
             SHELL(SPHERE, BASE CLOUDS) "'samples': 4}}");
    support_quote(json);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source source = {.open = support_no_asset};
    struct render_result result;
    struct truth truth;
    struct error_metrics metrics;
    struct reference_request request = {0};
    assert_int_equal(scene_read(json, strlen(json), &arena, &scene, &err), STATUS_OK);
    assert_int_equal(renderer_render(renderer, &scene, &source, &result, &err), STATUS_OK);
    assert_int_equal(truth_render(&scene, &source, &request, &truth, &err), STATUS_OK);
    assert_int_equal(error_compare(result.pixels, truth.pixels, 40, 36, truth.touched,
                                   scene.image.background, NULL, &metrics, &err),
                     STATUS_OK);
    const struct report_error *error = &result.report.error;
    assert_int_equal(error->kind, REPORT_ERROR_REFERENCE);
    assert_int_equal(error->pixels, 40 * 36);
    assert_int_equal(error->touched, metrics.touched.pixels);
    assert_true(error->rmse == metrics.touched.rmse && error->max_abs == metrics.touched.max_abs);
    assert_true(error->p99 == metrics.touched.p99 && error->whole_rmse == metrics.whole.rmse);
    assert_true(error->flip == metrics.flip && error->psnr_db == metrics.psnr_db);
    assert_true(error->coverage == (double)metrics.coverage / (40 * 36));
    assert_true(error->rmse_standard_error == 0);
    /* Its parts are of the size of the whole: neither is more than the two others together. */
    assert_true(error->rmse <= error->model + error->discretisation);
    assert_true(error->model <= error->rmse + error->discretisation);
    assert_true(error->discretisation <= error->rmse + error->model);
    assert_true(error->discretisation > 0 && error->model > 0);
    render_result_finish(&result);
    truth_finish(&truth);
    arena_free(&arena);
}

/* A sample of the pixels tells the error of all, within what it says of itself. */
static void test_reference_of_some_pixels(void **state) {
    (void)state;
    struct render_result all, some;
    static const char objects[] = SHELL(PLANE, CLOUDS) "'samples': 2}}";
    draw(&all, 64, 64, 1, ", 'report': {'error': 'reference'}", objects);
    draw(&some, 192, 192, 1, ", 'report': {'error': 'reference'}", objects);
    assert_int_equal(all.report.error.pixels, 4096);
    assert_in_range(some.report.error.pixels, 4000, 4200);
    print_message("all %.5f, some %.5f +- %.5f\n", all.report.error.rmse, some.report.error.rmse,
                  some.report.error.rmse_standard_error);
    assert_true(some.report.error.rmse_standard_error > 0);
    assert_true(fabs(some.report.error.rmse - all.report.error.rmse) <
                5 * some.report.error.rmse_standard_error);
    assert_true(isnan(some.report.error.flip) && isfinite(all.report.error.flip));
    render_result_finish(&all);
    render_result_finish(&some);
}

static int samples_of(const struct render_result *result, size_t object) {
    return result->report.resolved.objects[object].quality.samples;
}

/* Stricter targets take more samples, and what is promised is held. */
static void test_max_error(void **state) {
    (void)state;
    int before = 0;
    static const double goals[] = {0.05, 0.02, 0.005, 0.001};
    for (size_t i = 0; i < 4; i++) {
        char rest[64];
        struct render_result result, fine;
        snprintf(rest, sizeof rest, ", 'target': {'max_error': %g}", goals[i]);
        draw(&result, 96, 80, 1, rest, SHELL(PLANE, CLOUDS) "}}");
        draw(&fine, 96, 80, 1, "", SHELL(PLANE, CLOUDS) "'samples': 1024}}");
        const struct report_target *target = &result.report.target;
        double true_ = rmse_between(&result, &fine);
        print_message("%g: %d samples, true %.4g, %s\n", goals[i], samples_of(&result, 0), true_,
                      target->why);
        assert_int_equal(target->kind, REPORT_TARGET_MAX_ERROR);
        assert_true(target->met && target->reached <= goals[i] && target->asked == goals[i]);
        assert_true(true_ < goals[i] && samples_of(&result, 0) > before);
        before = samples_of(&result, 0);
        render_result_finish(&result);
        render_result_finish(&fine);
    }
}

/* The same of planes, which all shells share. */
static void test_max_error_of_slices(void **state) {
    (void)state;
    int before = 0;
    static const double goals[] = {0.03, 0.003};
    for (size_t i = 0; i < 2; i++) {
        char rest[64];
        struct render_result result, fine;
        snprintf(rest, sizeof rest, ", 'target': {'max_error': %g}", goals[i]);
        draw(&result, 64, 48, 1, rest,
             SHELL(PLANE, CLOUDS) "'method': 'slabs'}}, " SHELL(SPHERE, CLOUDS) "}}");
        draw(&fine, 64, 48, 1, "",
             SHELL(PLANE, CLOUDS) "'slices': 8000}}, " SHELL(SPHERE, CLOUDS) "}}");
        const struct report_target *target = &result.report.target;
        const struct scene_object *objects = result.report.resolved.objects;
        double true_ = rmse_between(&result, &fine);
        print_message("%g: %d slices, true %.4g, %s\n", goals[i], objects[0].quality.slices, true_,
                      target->why);
        assert_true(target->met && target->reached <= goals[i] && true_ < goals[i]);
        assert_int_equal(objects[0].quality.slices, objects[1].quality.slices);
        assert_true(objects[0].quality.slices > before);
        assert_non_null(strstr(target->why, "slices"));
        before = objects[0].quality.slices;
        render_result_finish(&result);
        render_result_finish(&fine);
    }
}

/* What a scene gives is held; where nothing is left out there is nothing to choose. */
static void test_what_is_given_is_held(void **state) {
    (void)state;
    struct render_result result;
    draw(&result, 64, 48, 1, ", 'target': {'max_error': 0.002}",
         SHELL(PLANE, CLOUDS) "'samples': 2}}");
    assert_int_equal(samples_of(&result, 0), 2);
    assert_false(result.report.target.met);
    assert_true(result.report.target.reached > 0.002);
    assert_int_equal(result.report.target.trials, 0);
    assert_non_null(strstr(result.report.target.why, "nothing to choose"));
    render_result_finish(&result);

    draw(&result, 64, 48, 1, ", 'target': {'deadline_ms': 60000}",
         SHELL(PLANE, CLOUDS) "'samples': 2}}, " SHELL(SPHERE, CLOUDS) "}}");
    assert_int_equal(samples_of(&result, 0), 2);
    assert_int_equal(samples_of(&result, 1), 8 * 16);
    render_result_finish(&result);
}

/* No number of samples mends what the path itself gets wrong. */
static void test_out_of_reach(void **state) {
    (void)state;
    struct render_result result;
    draw(&result, 64, 48, 1, ", 'target': {'max_error': 1e-9}",
         SHELL("'shape': 'sphere', 'divisions': [5, 4]", CLOUDS) "}}");
    const struct report_target *target = &result.report.target;
    print_message("%d samples: %s\n", samples_of(&result, 0), target->why);
    assert_false(target->met);
    assert_true(target->reached > 1e-9 && result.report.error.model > 1e-9);
    assert_non_null(strstr(target->why, "model error"));
    assert_true(samples_of(&result, 0) < 512);
    render_result_finish(&result);
}

/* Time is nothing that a test judges by; but with none at all the least is drawn, and with plenty
 * no more than is of use. */
static void test_deadline(void **state) {
    (void)state;
    struct render_result result;
    /* A plane of two triangles: nearly a tie of the paths, and only one of them has samples. */
#define TETRA "}, 'path': 'tetra'}"
    draw(&result, 64, 48, 1, ", 'target': {'deadline_ms': 1}", SHELL(PLANE, CLOUDS) TETRA);
    assert_int_equal(samples_of(&result, 0), 1);
    assert_int_equal(result.report.target.kind, REPORT_TARGET_DEADLINE_MS);
    result.report.total_ms = 1.5;
    report_settle(&result.report);
    assert_true(result.report.target.reached == 1.5 && !result.report.target.met);
    result.report.total_ms = 1;
    report_settle(&result.report);
    assert_true(result.report.target.met);
    render_result_finish(&result);

    draw(&result, 64, 48, 1, ", 'target': {'deadline_ms': 86400000}", SHELL(PLANE, CLOUDS) TETRA);
    assert_int_equal(samples_of(&result, 0), 8 * 16);
    render_result_finish(&result);

    /* A beginning long ago leaves nothing. */
    char json[] =
        "{\"objects\": [{\"shell\": {\"mesh\": {\"shape\": \"plane\"}, \"material\": "
        "{\"builtin\": \"clouds\", \"size\": [16, 16, 16]}}}], \"image\": {\"width\": 20, "
        "\"height\": 20}, \"target\": {\"deadline_ms\": 1000}}";
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source source = {.open = support_no_asset};
    struct render_limits limits = {.began_ms = clock_now_ms() - 2000};
    assert_int_equal(scene_read(json, strlen(json), &arena, &scene, &err), STATUS_OK);
    assert_int_equal(renderer_render_within(renderer, &scene, &source, &limits, &result, &err),
                     STATUS_OK);
    assert_int_equal(samples_of(&result, 0), 1);
    render_result_finish(&result);
    limits = (struct render_limits){.began_ms = clock_now_ms(), .reserve_ms = 999.999};
    assert_int_equal(renderer_render_within(renderer, &scene, &source, &limits, &result, &err),
                     STATUS_OK);
    assert_int_equal(samples_of(&result, 0), 1);
    render_result_finish(&result);
    arena_free(&arena);
}

/* A scene without shells, or with nothing in view. */
static void test_nothing_to_measure(void **state) {
    (void)state;
    struct render_result result;
    draw(&result, 48, 48, 1, ", 'target': {'max_error': 0.5}",
         "{'mesh': {'shape': 'sphere'}, 'color': [0.4, 0.5, 0.6]}");
    assert_true(result.report.error.discretisation == 0 && result.report.target.met);
    assert_true(result.report.error.model_pixels >= 8 && result.report.error.rmse < 1e-2);
    render_result_finish(&result);
    static const char *const kinds[] = {
        "'report': {'error': 'estimate'}", "'report': {'error': 'reference'}",
        "'target': {'max_error': 0.01}", "'target': {'deadline_ms': 500}"};
    for (size_t i = 0; i < 4; i++) {
        char rest[128];
        snprintf(rest, sizeof rest, ", %s", kinds[i]);
        draw(&result, 31, 17, 4, rest,
             "{'shell': {'mesh': {'shape': 'plane'}, " CLOUDS "}, 'transform': {'translate': [0, "
             "0, 900]}}");
        assert_true(i == 3 || result.report.error.rmse == 0);
        assert_true(i != 2 || result.report.target.met);
        render_result_finish(&result);
    }
    /* One pixel. */
    draw(&result, 1, 1, 1, ", 'report': {'error': 'reference'}", SHELL(PLANE, CLOUDS) "}}");
    assert_int_equal(result.report.error.pixels, 1);
    render_result_finish(&result);
    draw(&result, 1, 1, 1, ", 'target': {'max_error': 0.001}", SHELL(PLANE, CLOUDS) "}}");
    assert_int_equal(result.report.error.pixels, 1);
    render_result_finish(&result);
}

/* What no few pixels show of a solid's edges is in the model part: one sample in 8,192 on the other
 * side of the largest step of the picture. A white solid before nothing has one of 1 at the least.
 * Asked of a promise, whose model error has its pixels whatever they take: an estimate's may be
 * unknown on a machine that is busy. */
static void test_edges_are_told_of(void **state) {
    (void)state;
    struct render_result result;
    draw(&result, 192, 140, 1, ", 'target': {'max_error': 0.5}",
         SHELL(SPHERE, CHAIN) "'traversal': 'dda'}}");
    assert_true(result.report.error.model_pixels >= 256);
    double model = result.report.error.model;
    assert_true(result.report.error.discretisation == 0);
    render_result_finish(&result);
    if (!(model > 5e-3 && model < 5e-2)) /* measured 0.0108 */
        fail_msg("model %g", model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_edges_are_told_of),
        cmocka_unit_test(test_estimate_of_discretisation),
        cmocka_unit_test(test_estimate_changes_nothing),
        cmocka_unit_test(test_reference_of_all_pixels),
        cmocka_unit_test(test_reference_of_some_pixels),
        cmocka_unit_test(test_max_error),
        cmocka_unit_test(test_max_error_of_slices),
        cmocka_unit_test(test_what_is_given_is_held),
        cmocka_unit_test(test_out_of_reach),
        cmocka_unit_test(test_deadline),
        cmocka_unit_test(test_nothing_to_measure),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
