/* The tetra path's two maps in pictures: the model error of the prisms' own and its order, planes
 * for which both are one, shells of extreme sizes, what is resolved, told and refused. */
#include <math.h>
#include <stdlib.h>

#include "tests/reference_fixture.h"
#include "tests/unit/renderer_fixture.h"

/* Of a torus with d x d/2 divisions under clouds. */
#define TORUS                                                                                      \
    "{'image': {'width': %d, 'height': %d, 'samples': 1}, 'camera': {'eye': [0, -2.6, 2.2], "      \
    "'fov_y_deg': 45}, 'objects': [{'shell': {'mesh': {'shape': 'torus', 'divisions': [%d, %d]}, " \
    "'thickness': 0.1, 'tiles': [4, 2], 'material': {'builtin': 'clouds', 'lit': %s, 'size': "     \
    "[32, "                                                                                        \
    "32, 8]}}, 'path': 'tetra', 'quality': {'samples': %d, 'map': '%s', 'order': '%s'}}]}"

enum { WIDTH = 40, PIXELS = WIDTH * WIDTH };

static double model_error(int divisions, const char *lit, const char *map, const char *order) {
    struct truth_fixture truth;
    struct render_result result;
    assert_int_equal(
        truth_open(&truth, TORUS, WIDTH, WIDTH, divisions, divisions / 2, lit, 256, map, order),
        STATUS_OK);
    reference_set_camera(truth.reference, &truth.scene.camera);
    truth_draw(&truth, 1e-6, 0);
    assert_int_equal(support_draw(renderer, &result, TORUS, WIDTH, WIDTH, divisions, divisions / 2,
                                  lit, 256, map, order),
                     STATUS_OK);
    double sum = 0;
    size_t count = 0;
    for (size_t p = 0; p < PIXELS; p++) {
        if (!truth.result.touched[p])
            continue;
        count++;
        for (size_t i = 0; i < 4; i++) {
            double difference = (double)result.pixels[4 * p + i] - truth.result.pixels[p][i];
            sum += difference * difference / 4;
        }
    }
    render_result_finish(&result);
    truth_close(&truth);
    assert_true(count > PIXELS / 4);
    return sqrt(sum / (double)count);
}

/* The affine map errs in the first order of the cells' size; by the prisms' own rounding is left at
 * any, whichever way rays go, since what they have in a cell ends where its prism does. Measured at
 * 16, 32 and 64 divisions: affine 0.026, 0.015, 0.0078; else 2.3e-6 at the most. From the plane
 * sides of cells 9.9e-4, 1.1e-4, 3.1e-5. */
static void test_order(void **state) {
    (void)state;
    static const char *const orders[] = {"walk", "sorted"};
    for (int o = 0; o < 2; o++) {
        double error[3];
        for (int d = 0; d < 3; d++)
            error[d] = model_error(16 << d, "false", "exact", orders[o]);
        print_message("%s: model error %.1e, %.1e, %.1e at 16, 32, 64 divisions\n", orders[o],
                      error[0], error[1], error[2]);
        for (int d = 0; d < 3; d++)
            assert_true(error[d] < 1e-5);
    }
    double affine[2];
    for (int d = 0; d < 2; d++)
        affine[d] = model_error(32 << d, "false", "affine", "walk");
    print_message("affine: %.1e, %.1e at 32, 64\n", affine[0], affine[1]);
    assert_true(affine[1] > 5e-3 && affine[0] < 2.5 * affine[1]);
}

/* With light: normals too are those of the map. Measured 5.3e-5 either way; from plane sides 1.2e-4
 * walked and 8.3e-4 drawn. */
static void test_normals(void **state) {
    (void)state;
    double walked = model_error(64, "true", "exact", "walk");
    double drawn = model_error(64, "true", "exact", "sorted");
    print_message("lit: model error %.1e walked, %.1e drawn\n", walked, drawn);
    assert_true(walked < 1e-4 && drawn < 1e-4);
}

#define SHELL(mesh, tiles, material)                                                               \
    "'objects': [{'shell': {'mesh': {" mesh "}, 'thickness': 0.1, 'tiles': " tiles                 \
    ", 'material': {" material ", 'size': [32, 32, 16]}}"
#define TORUS_16   "'shape': 'torus', 'divisions': [16, 8]"
#define HILLS      "'shape': 'terrain', 'divisions': [10, 10], 'seed': 543"
#define FROM_ABOVE "'camera': {'eye': [0, -2.6, 2.2], 'fov_y_deg': 45}, "
#define FROM_ASIDE "'camera': {'eye': [0.4, -2.2, 0.9], 'target': [0, 0, 0.1], 'fov_y_deg': 50}, "

/* Walked or drawn one by one, cells show the same: a medium, a lit one, a solid; coarse prisms,
 * columns that lean, borders, an opaque base, the eye within. Measured at most 4.4e-6; by plane
 * sides with the walk's own strips 3.1e-4 to 2.7e-2. */
static void test_ways_agree(void **state) {
    (void)state;
    static const char *const scenes[] = {
        FROM_ABOVE SHELL(TORUS_16, "[4, 2]", "'builtin': 'clouds', 'lit': false"),
        FROM_ABOVE SHELL(TORUS_16, "[4, 2]", "'builtin': 'clouds'"),
        FROM_ABOVE SHELL(TORUS_16, "[4, 2]", "'builtin': 'chain'"),
        FROM_ASIDE SHELL(HILLS, "[4, 3]", "'builtin': 'clouds'"),
        FROM_ASIDE SHELL(HILLS, "[4, 3]", "'builtin': 'chain'"),
        "'camera': {'eye': [0, -1.03, 0.42], 'target': [1, 0, 0.3], 'fov_y_deg': 60}, " SHELL(
            TORUS_16, "[4, 2]", "'builtin': 'clouds'"),
    };
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        struct render_result result[2];
        static const char *const orders[] = {"walk", "sorted"};
        /* Rays that a border's strip takes all of a cell from are few. */
        size_t size = i == 4 ? 384 : 64, values = size * size * 4;
        for (int o = 0; o < 2; o++)
            assert_int_equal(support_draw(renderer, &result[o],
                                          "{'image': {'width': %zu, 'height': %zu, 'samples': 1}, "
                                          "'lights': [{'direction': [1, 1, -2]}], %s, 'path': "
                                          "'tetra', 'quality': {'order': '%s', 'samples': 64}}]}",
                                          size, size, scenes[i], orders[o]),
                             STATUS_OK);
        double sum = 0, most = 0;
        for (size_t p = 0; p < values; p++) {
            double difference = (double)result[0].pixels[p] - (double)result[1].pixels[p];
            sum += difference * difference;
            most = fmax(most, fabs((double)result[0].pixels[p]));
        }
        double rmse = sqrt(sum / (double)values);
        print_message("scene %zu: walked and sorted differ by %.1e\n", i, rmse);
        assert_true(most > 0.2 && rmse < 1e-5);
        for (int o = 0; o < 2; o++)
            render_result_finish(&result[o]);
    }
}

static bool left_out(const struct report *report, const char *name, const char *why) {
    for (size_t i = 0; i < report->left_out_count; i++)
        if (strcmp(report->left_out[i].name, name) == 0)
            return strstr(report->left_out[i].why, why) != NULL;
    return false;
}

/* Planes, moved and turned, medium and solid: the same bytes, since the exact map is left out. */
static void test_planes(void **state) {
    (void)state;
    static const char *const materials[] = {"fur", "chain"}, *const maps[] = {"affine", "exact",
                                                                              "auto"};
    for (int m = 0; m < 2; m++) {
        struct render_result results[3];
        for (int i = 0; i < 3; i++)
            assert_int_equal(
                support_draw(renderer, &results[i],
                             "{'image': {'width': 48, 'height': 48, 'samples': 1}, 'objects': "
                             "[{'shell': {'mesh': {'shape': 'plane', 'divisions': [5, 7]}, "
                             "'material': {'builtin': '%s', 'size': [32, 32, 16]}}, 'transform': "
                             "{'translate': [1, 2, 3], 'rotate_deg': [20, 30, 40]}, 'quality': "
                             "{'map': '%s'}}]}",
                             materials[m], maps[i]),
                STATUS_OK);
        for (int i = 1; i < 3; i++)
            assert_memory_equal(results[0].pixels, results[i].pixels, 48 * 48 * 16);
        for (int i = 0; i < 3; i++) {
            enum scene_map resolved = results[i].report.resolved.objects[0].quality.map;
            assert_int_equal(resolved, i == 1 ? SCENE_MAP_EXACT : SCENE_MAP_AFFINE);
            assert_true(left_out(&results[i].report, "exact-map", "every prism is affine"));
            render_result_finish(&results[i]);
        }
    }
}

/* What is chosen, and told: exact where prisms are not affine, and no map where there are no
 * voxels. */
static void test_choice(void **state) {
    (void)state;
    static const struct {
        const char *material, *map;
        enum scene_map resolved;
        const char *why; /* it is left out; NULL: it is not */
    } cases[] = {
        {"fur", "auto", SCENE_MAP_EXACT, NULL},
        {"chain", "auto", SCENE_MAP_EXACT, NULL},
        {"fur", "affine", SCENE_MAP_AFFINE, "asks for"},
        {"homogeneous", "auto", SCENE_MAP_AUTO, "no shell has voxels"},
        {"homogeneous", "exact", SCENE_MAP_EXACT, "no shell has voxels"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'objects': "
                         "[{'shell': {'mesh': {'shape': 'sphere'}, 'material': {'builtin': '%s'}}, "
                         "'quality': {'map': '%s'}}]}",
                         cases[i].material, cases[i].map),
            STATUS_OK);
        const struct report *report = &result.report;
        assert_int_equal(report->resolved.objects[0].quality.map, cases[i].resolved);
        bool drawn = false;
        for (size_t k = 0; k < report->pass_count; k++)
            drawn |= strcmp(report->passes[k].name, "exact-map") == 0;
        assert_int_equal(drawn, cases[i].why == NULL);
        assert_int_equal(left_out(report, "exact-map", cases[i].why ? cases[i].why : ""), !drawn);
        render_result_finish(&result);
    }
}

/* A torus a millionth and a million units wide, and one a million of its radii from the origin, are
 * the torus; one a millionth of its edges thick has no pixel that is not finite. */
static void test_extremes(void **state) {
    (void)state;
#define SCALED                                                                                     \
    "{'image': {'width': 48, 'height': 48, 'samples': 1}, 'camera': {'eye': [%.17g, %.17g, "       \
    "%.17g], 'target': [%.17g, 0, 0]}, 'objects': [{'shell': {'mesh': {'shape': 'torus', "         \
    "'radius': %.17g, 'tube': %.17g, 'divisions': [32, 16]}, 'thickness': %.17g, 'material': "     \
    "{'builtin': '%s', 'size': [32, 32, 16], 'seed': 3}}, 'transform': {'translate': [%.17g, 0, "  \
    "0]}, 'quality': {'map': 'exact', 'order': '%s'}}]}"
    static const struct {
        double scale, away, thick;
        double most; /* RMSE against the first; 0: not compared */
    } cases[] = {{1, 0, 0.1, 0},
                 {1e-6, 0, 0.1, 1e-4},
                 {1e6, 0, 0.1, 1e-4},
                 {1, 1e6, 0.1, 1e-4},
                 {1, 0, 1e-7, 0}};
    static const char *const materials[] = {"fur", "chain"}, *const orders[] = {"walk", "sorted"};
    for (int m = 0; m < 4; m++) {
        float *first = NULL;
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            double s = cases[i].scale, x = cases[i].away;
            struct render_result result;
            assert_int_equal(support_draw(renderer, &result, SCALED, x, -2.6 * s, 2.2 * s, x, s,
                                          0.4 * s, cases[i].thick * s, materials[m & 1], x,
                                          orders[m / 2]),
                             STATUS_OK);
            double sum = 0;
            for (size_t p = 0; first && p < 48 * 48 * 4; p++)
                sum += pow((double)result.pixels[p] - (double)first[p], 2);
            double rmse = sqrt(sum / (48 * 48 * 4));
            if (cases[i].most > 0)
                print_message("%s, %s, scale %g, %g away: RMSE %.1e\n", materials[m & 1],
                              orders[m / 2], s, x, rmse);
            assert_true(cases[i].most == 0 || rmse < cases[i].most);
            for (size_t k = 0; k < result.report.warning_count; k++)
                assert_string_not_equal(result.report.warnings[k].code, "not-finite");
            if (!first) {
                first = malloc(48 * 48 * 16);
                assert_non_null(first);
                memcpy(first, result.pixels, 48 * 48 * 16);
            }
            render_result_finish(&result);
        }
        free(first);
    }
}

/* `map` is tetra's. */
static void test_refusals(void **state) {
    (void)state;
    static const struct {
        const char *path, *map, *pointer;
    } cases[] = {{"slicing", "exact", NULL},
                 {"gdm", "affine", "/objects/0/quality/map"},
                 {"tetra", "bilinear", "/objects/0/quality/map"},
                 {"tetra", "exact", NULL},
                 {"auto", "exact", NULL}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char json[512];
        int length = snprintf(json, sizeof json,
                              "{'objects': [{'shell': {'mesh': {'shape': 'torus'}, 'material': "
                              "{'builtin': 'fur'}}, 'path': '%s', 'quality': {'map': '%s'}}]}",
                              cases[i].path, cases[i].map);
        support_quote(json);
        struct arena arena = {0};
        struct scene scene;
        struct error err = {0};
        enum status status = scene_read(json, (size_t)length, &arena, &scene, &err);
        assert_int_equal(status, cases[i].pointer ? STATUS_INVALID_SCENE : STATUS_OK);
        if (cases[i].pointer)
            assert_string_equal(err.faults[0].pointer, cases[i].pointer);
        error_clear(&err);
        arena_free(&arena);
    }
}

/* Rays that enter by the border of an open mesh begin at the prism's ruled side, not at the cell's
 * plane one, whether they walk or cells are sorted. Measured 2.3e-5 and 1.1e-4; from the plane one
 * 4.1e-2 and 5.8e-2. */
static void test_borders(void **state) {
    (void)state;
    static const struct {
        const char *material, *order;
        double most;
    } cases[] = {{"chain", "walk", 1e-4},
                 {"clouds", "walk", 4e-4},
                 {"chain", "sorted", 1e-4},
                 {"clouds", "sorted", 4e-4}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct render_result result;
        assert_int_equal(
            support_draw(
                renderer, &result,
                "{'image': {'width': 48, 'height': 48, 'samples': 1}, 'camera': {'eye': [0.4, "
                "-2.2, "
                "0.9], 'target': [0, 0, 0.1], 'fov_y_deg': 50}, 'lights': [{'direction': [1, 1, "
                "-2]}], 'objects': [{'shell': {'mesh': {'shape': 'terrain', 'divisions': [10, 10], "
                "'seed': 543}, 'thickness': 0.1, 'tiles': [4, 3], 'material': {'builtin': '%s', "
                "'size': [32, 32, 16]}}, 'path': 'tetra', 'quality': {'order': '%s', 'samples': "
                "256}}], 'report': {'error': 'reference'}}",
                cases[i].material, cases[i].order),
            STATUS_OK);
        double rmse = result.report.error.rmse;
        render_result_finish(&result);
        print_message("%s, %s: RMSE %.1e\n", cases[i].material, cases[i].order, rmse);
        if (!(rmse < cases[i].most))
            fail_msg("%s, %s: rmse %.2e", cases[i].material, cases[i].order, rmse);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ways_agree), cmocka_unit_test(test_borders),
        cmocka_unit_test(test_order),      cmocka_unit_test(test_normals),
        cmocka_unit_test(test_planes),     cmocka_unit_test(test_choice),
        cmocka_unit_test(test_extremes),   cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
