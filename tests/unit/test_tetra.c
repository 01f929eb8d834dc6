/* The tetra path against closed forms, walked and sorted; its order of convergence; what cannot be
 * walked. */
#include "tests/unit/asset_files.h"
#include "tests/unit/closed_forms.h"

/* Within a step extinction and colour are taken at its middle: the error against the path's own
 * limit falls with the second order of the number of steps. */
static void test_convergence(void **state) {
    (void)state;
    static const char scene[] =
        "{'image': {'width': 64, 'height': 64, 'samples': 1}, 'camera': {'eye': [0, -3, 2.2], "
        "'target': [0, 0, 0]}, 'objects': [{'shell': {'mesh': {'shape': 'torus', 'divisions': [40, "
        "20]}, 'thickness': 0.12, 'tiles': [12, 6], 'material': {'builtin': 'clouds', 'size': [16, "
        "16, 8]}}, 'path': 'tetra', 'quality': {'samples': %d, %s}}]}";
    struct render_result limit, result;
    assert_int_equal(support_draw(renderer, &limit, scene, 256, quality), STATUS_OK);
    double error[3];
    for (int i = 0; i < 3; i++) {
        assert_int_equal(support_draw(renderer, &result, scene, 8 << i, quality), STATUS_OK);
        double sum = 0, touched = 0;
        for (int p = 0; p < 64 * 64; p++) {
            touched += limit.pixels[4 * p + 3] > 0;
            for (int c = 0; c < 4; c++)
                sum += pow(result.pixels[4 * p + c] - limit.pixels[4 * p + c], 2);
        }
        error[i] = sqrt(sum / (4 * touched));
        render_result_finish(&result);
    }
    render_result_finish(&limit);
    double rate = log2(error[0] / error[2]) / 2;
    print_message("RMSE %.2e %.2e %.2e with 8, 16, 32 steps: order %.2f\n", error[0], error[1],
                  error[2], rate);
    assert_true(rate > 1.6 && error[2] < 4e-3);
}

/* Walked pictures and those of drawn cells: a glossy medium over a base, and a solid with its
 * normals. By the affine map they agree to rounding, which now and then gives a segment one step
 * more. By the prisms' own they differ where a cell is not within its prism: a walk knows
 * (shaders/walk.frag). */
static void test_orders_agree(void **state) {
    (void)state;
    static const struct {
        const char *material, *map;
        int samples;
        double rmse_most;
        int apart_most;
    } cases[] = {
        /* Cells do not know what hides them, and take more steps: measured 1.4e-5 and none. */
        {"fur", "affine", 512, 2e-5, 2},
        {"chain", "affine", 128, 2e-5, 2} /* 3.9e-6 and none */,
        {"fur", "exact", 128, 3e-3, 900} /* 1.7e-3 and 484; the affine map's model error is 0.03 */,
        {"chain", "exact", 128, 2e-2, 140} /* 1.0e-2 and 68, along silhouettes */};
    for (size_t m = 0; m < sizeof cases / sizeof *cases; m++) {
        struct render_result both[2];
        for (int i = 0; i < 2; i++)
            assert_int_equal(
                support_draw(renderer, &both[i],
                             "{'image': {'width': 96, 'height': 96, 'samples': 1}, 'objects': "
                             "[{'shell': {'mesh': {'shape': 'torus', 'divisions': [30, 16]}, "
                             "'thickness': 0.12, 'base': {'color': [0.3, 0.2, 0.1]}, 'material': "
                             "{'builtin': '%s', 'size': [64, 64, 16], 'specular': 0.4}}, 'path': "
                             "'tetra', 'quality': {'samples': %d, 'order': '%s', 'map': '%s'}}]}",
                             cases[m].material, cases[m].samples, i ? "sorted" : "walk",
                             cases[m].map),
                STATUS_OK);
        double sum = 0;
        int apart = 0;
        for (int p = 0; p < 96 * 96; p++) {
            double worst = 0;
            for (int c = 0; c < 4; c++) {
                double d = fabs((double)both[0].pixels[4 * p + c] - both[1].pixels[4 * p + c]);
                worst = fmax(worst, d);
                sum += d * d;
            }
            apart += worst > 1e-3;
        }
        double rmse = sqrt(sum / (4 * 96 * 96));
        print_message("%s, %s map: walked and drawn differ by %.1e (RMSE), %d samples by more "
                      "than 1e-3\n",
                      cases[m].material, cases[m].map, rmse, apart);
        assert_true(rmse < cases[m].rmse_most && apart <= cases[m].apart_most);
        assert_int_equal(both[0].report.resolved.objects[0].quality.order, SCENE_ORDER_WALK);
        assert_int_equal(both[1].report.resolved.objects[0].quality.order, SCENE_ORDER_SORTED);
        render_result_finish(&both[0]);
        render_result_finish(&both[1]);
    }
}

/* A mesh as it comes, with creases in which the shell is thinned: no ray loses its way, from any
 * side. */
static void test_walk_through_the_bunny(void **state) {
    (void)state;
    static const char *const eyes[] = {"2, -4, 3", "-4, 0.5, 1", "0.3, 4, 2", "0.1, 0.2, 6",
                                       "-1, -1, 0.3"};
    for (int e = 0; e < 5; e++) {
        char json[1024];
        int length = snprintf(json, sizeof json,
                              "{'image': {'width': 300, 'height': 300, 'samples': 1}, 'camera': "
                              "{'eye': [%s], 'target': "
                              "[0, 0, 1]}, 'objects': [{'shell': {'mesh': {'asset': "
                              "'api/examples/assets/bunny.glb'}, "
                              "'thickness': 0.12, 'material': {'builtin': 'homogeneous', "
                              "'extinction': 3}}, 'quality': "
                              "{'order': 'walk'}}]}",
                              eyes[e]);
        support_quote(json);
        struct arena arena = {0};
        struct scene scene;
        struct error err = {0};
        struct render_result result;
        int open = 0;
        struct asset_source source = {files_open, files_close, &open};
        assert_int_equal(scene_read(json, (size_t)length, &arena, &scene, &err), STATUS_OK);
        enum status status = renderer_render(renderer, &scene, &source, &result, &err);
        if (status != STATUS_OK)
            fail_msg("%s", err.faults[0].message);
        for (size_t w = 0; w < result.report.warning_count; w++)
            assert_string_not_equal(result.report.warnings[w].code, "not-finite");
        render_result_finish(&result);
        arena_free(&arena);
    }
}

/* What cannot be walked is refused if asked for, with its pointer: a medium among sorted ones. */
static void test_walk_refused(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(
        support_draw(
            renderer, &result,
            "{'objects': [{'shell': {'mesh': {'shape': 'sphere'}, 'material': {'builtin': "
            "'fur'}}, 'quality': {'order': 'walk'}}, {'shell': {'mesh': {'shape': 'torus'}, "
            "'material': {'builtin': 'clouds'}}, 'quality': {'order': 'sorted'}}]}"),
        STATUS_NOT_IMPLEMENTED);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        CLOSED_FORM_TESTS,
        cmocka_unit_test(test_convergence),
        cmocka_unit_test(test_orders_agree),
        cmocka_unit_test(test_walk_through_the_bunny),
        cmocka_unit_test(test_walk_refused),
    };
    quality = "'order': 'auto'";
    int failed = cmocka_run_group_tests_name("walking", tests, open_renderer, close_renderer);
    quality = "'order': 'sorted'";
    return failed + cmocka_run_group_tests_name("sorting", tests, open_renderer, close_renderer);
}
