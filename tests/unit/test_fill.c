/* Absorption, emission and glow: homogeneous media against the closed form, in the reference to
 * 1e-9 and by every way of drawing; the same through voxels that hold nothing; what glow adds;
 * shadow that is thrown by what only absorbs; lit media against the reference. */
#include <math.h>
#include <stdlib.h>

#include "renderer/truth.h"
#include "tests/reference_fixture.h"
#include "tests/unit/renderer_fixture.h"

/* What a ray of the length s brings through a slab: radiance and alpha. */
static void slab(double sigma, const double c[3], double absorption, const double q[3], double s,
                 double rgba[4]) {
    double kappa = sigma + absorption, tau = kappa * s;
    double mean = tau > 0 ? -expm1(-tau) / tau : 1;
    for (int i = 0; i < 3; i++)
        rgba[i] = (sigma * c[i] + q[i]) * s * mean;
    rgba[3] = -expm1(-tau);
}

static const char *const qualities[] = {"'order': 'walk'", "'order': 'sorted'", "'slices': 37",
                                        "'slices': 1000, 'method': 'hybrid'"};
enum { QUALITIES = sizeof qualities / sizeof *qualities, POINTS_FROM = 3 };

#define SLANT                                                                                      \
    "{'image': {'width': 4, 'height': 4, 'samples': 1}, 'camera': {'eye': [%.17g, 0, %.17g], "     \
    "'ortho_height': %.17g}, 'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [%.17g, "   \
    "%.17g]}, 'thickness': %.17g, 'material': {"

/* At 60 degrees, at any scale, from nothing to what lets nothing through; homogeneous, and as
 * voxels of fur that has not grown. */
static void test_closed_form(void **state) {
    (void)state;
    static const struct {
        double sigma, absorption, q[3], scale;
    } rows[] = {
        {2, 0, {0, 0, 0}, 1},       {2, 1.5, {0, 0, 0}, 1},         {0, 3, {0, 0, 0}, 1},
        {0, 0, {1, 0.5, 0.25}, 1},  {0, 1e-7, {1, 0.5, 0.25}, 1},   {2, 1.5, {1, 0.5, 0.25}, 1},
        {0, 1e6, {1e3, 5, 0.2}, 1}, {1e-9, 1e9, {1e6, 0, 1e6}, 1},  {2e6, 1e6, {1e5, 0, 1}, 1e-6},
        {0, 0, {1e6, 1, 0}, 1e-6},  {2e-6, 1e-6, {1e-6, 0, 1}, 1e6}};
    static const double c[3] = {0.25, 0.5, 1};
    double worst[QUALITIES] = {0}, worst_truth = 0;
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++)
        for (int voxels = 0; voxels < 2; voxels++) {
            double scale = rows[r].scale, depth = 0.5 * scale, sigma = voxels ? 0 : rows[r].sigma;
            char material[512], json[2048];
            if (voxels)
                snprintf(material, sizeof material,
                         "'builtin': 'fur', 'size': [4, 4, 2], "
                         "'growth': 0");
            else
                snprintf(material, sizeof material,
                         "'builtin': 'homogeneous', 'extinction': %.17g, 'color': [0.25, 0.5, 1]",
                         sigma);
            for (size_t q = 0; q <= QUALITIES; q++) {
                snprintf(json, sizeof json,
                         SLANT "%s, 'absorption': %.17g, 'emission': [%.17g, %.17g, %.17g]}}, "
                               "'quality': {%s}}]}",
                         5 * sqrt(3) * scale, 5 * scale, 0.5 * scale, 3 * scale, 3 * scale, depth,
                         material, rows[r].absorption, rows[r].q[0], rows[r].q[1], rows[r].q[2],
                         q < QUALITIES ? qualities[q] : "");
                double expected[4];
                slab(sigma, c, rows[r].absorption, rows[r].q, 2 * depth, expected);
                struct truth_fixture truth;
                struct render_result result;
                if (q == QUALITIES) {
                    assert_int_equal(truth_open(&truth, "%s", json), STATUS_OK);
                    truth_draw(&truth, 1e-12, 1);
                } else {
                    assert_int_equal(support_draw(renderer, &result, "%s", json), STATUS_OK);
                }
                for (int p = 0; p < 16; p++)
                    for (int i = 0; i < 4; i++) {
                        double found = q == QUALITIES ? truth.result.pixels[p][i]
                                                      : (double)result.pixels[4 * p + i];
                        /* Relative, but below this absolute. */
                        double least = q == QUALITIES ? 1 : i < 3 ? 1e-7 : 1e-4;
                        double off = fabs(found - expected[i]) / fmax(expected[i], least);
                        double *most = q == QUALITIES ? &worst_truth : &worst[q];
                        /* Planes are points: their sum is off by one of some 300 that cut the ray.
                         */
                        double bound = q == QUALITIES ? 1e-9 : q >= POINTS_FROM ? 1e-2 : 1e-4;
                        *most = fmax(*most, off);
                        if (!(off < bound))
                            fail_msg("row %zu, voxels %d, %s, channel %d: %.9g, not %.9g", r,
                                     voxels, q < QUALITIES ? qualities[q] : "reference", i, found,
                                     expected[i]);
                    }
                if (q == QUALITIES)
                    truth_close(&truth);
                else
                    render_result_finish(&result);
            }
        }
    for (size_t q = 0; q < QUALITIES; q++)
        print_message("%s: off by %.1e\n", qualities[q], worst[q]);
    print_message("reference: off by %.1e\n", worst_truth);
}

#define VIEW(beside)                                                                               \
    "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': {'eye': [0, -4, 1.5], "        \
    "'fov_y_deg': 40}, " beside "'objects': ["
#define LIGHT "'lights': [{'direction': [0.7, 1, -1.1], 'color': [2, 1.9, 1.8]}], "
#define CLOUDS(members, beside)                                                                    \
    "{'shell': {'mesh': {'shape': 'sphere', 'divisions': [24, 12]}, 'thickness': 0.4, 'tiles': "   \
    "[3, 2], 'material': {'builtin': 'clouds', 'size': [8, 8, 4]" members "}}" beside "}"

/* What glows adds a multiple of its colour's radiance to the picture, lit or not: the same steps,
 * so but for rounding. Alpha stays. */
static void test_glow(void **state) {
    (void)state;
    for (size_t q = 0; q < QUALITIES; q++) {
        static const char *const members[] = {", 'lit': false", "", ", 'glow': 2.5",
                                              ", 'lit': false, 'glow': 2.5"};
        struct render_result result[4];
        for (int i = 0; i < 4; i++)
            assert_int_equal(support_draw(renderer, &result[i],
                                          VIEW(LIGHT) CLOUDS("%s", ", 'quality': {%s}") "]}",
                                          members[i], qualities[q]),
                             STATUS_OK);
        double most = 0;
        for (int i = 0; i < 4 * 256; i++) {
            double unlit = (double)result[0].pixels[i], lit = (double)result[1].pixels[i];
            double more = i % 4 < 3 ? 2.5 * unlit : 0;
            assert_true(fabs((double)result[2].pixels[i] - lit - more) < 1e-5);
            assert_true(fabs((double)result[3].pixels[i] - unlit - more) < 1e-5);
            most = fmax(most, more);
        }
        assert_true(most > 0.5);
        for (int i = 0; i < 4; i++)
            render_result_finish(&result[i]);
    }
}

/* A plane under a slab that only absorbs: light comes through it aslant and goes through it again
 * to the eye, straight up. Homogeneous, and as empty voxels. */
static void test_shadow(void **state) {
    (void)state;
    static const char *const materials[] = {"'builtin': 'homogeneous', 'extinction': 0",
                                            "'builtin': 'fur', 'size': [4, 4, 2], 'growth': 0"};
    for (int m = 0; m < 2; m++) {
        char json[2048];
        snprintf(json, sizeof json,
                 "{'image': {'width': 4, 'height': 4, 'samples': 1}, 'camera': {'eye': [0, 0, 5], "
                 "'up': [0, 1, 0], 'ortho_height': 0.5}, 'ambient': [0, 0, 0], 'lights': "
                 "[{'direction': [3, 0, -4], 'color': [1, 1, 1], 'shadow': true}], 'objects': "
                 "[{'shell': {'mesh': {'shape': 'plane', 'size': [6, 6]}, 'thickness': 0.5, "
                 "'material': {%s, 'absorption': 1.2}}}, {'mesh': {'shape': 'plane', 'size': [6, "
                 "6]}, 'color': [1, 1, 1], 'transform': {'translate': [0, 0, -0.5]}}]}",
                 materials[m]);
        double expected = 0.8 * exp(-1.2 * 0.5 / 0.8) * exp(-1.2 * 0.5);
        struct truth_fixture truth;
        struct render_result result;
        assert_int_equal(support_draw(renderer, &result, "%s", json), STATUS_OK);
        assert_int_equal(truth_open(&truth, "%s", json), STATUS_OK);
        truth_draw(&truth, 1e-12, 1);
        for (int p = 0; p < 16; p++) {
            assert_float_equal(truth.result.pixels[p][0], expected, 1e-9);
            assert_float_equal((double)result.pixels[4 * p], expected, 1e-5);
        }
        truth_close(&truth);
        render_result_finish(&result);
    }
}

/* Clouds that absorb, emit and glow, lit and alone, and unlit where they overlap others (joint
 * walks take normals once a cell, which errs by more), against the reference: of second order in
 * the steps. Bounds: twice what was measured. */
static void test_against_the_reference(void **state) {
    (void)state;
#define FILL         ", 'absorption': 0.8, 'emission': [0.3, 0.1, 0], 'glow': 0.5"
#define ROW(quality) VIEW(LIGHT) CLOUDS(FILL, ", 'quality': {" quality "}") "]}"
#define PAIR(quality)                                                                              \
    VIEW(LIGHT)                                                                                    \
    CLOUDS(FILL ", 'lit': false", ", 'quality': {" quality "}")                                    \
    ", " CLOUDS(", 'seed': 3, 'lit': false",                                                       \
                ", 'transform': {'translate': [0.3, 0, 0.2]}, 'quality': {" quality "}") "]}"
    static const struct {
        const char *coarse, *fine; /* a quarter of its steps, and all */
        double most;               /* of the fine one */
    } rows[] = {
        {ROW("'samples': 32, 'order': 'walk'"), ROW("'samples': 128, 'order': 'walk'"), 4e-4},
        {ROW("'samples': 32, 'order': 'sorted'"), ROW("'samples': 128, 'order': 'sorted'"), 8e-4},
        {ROW("'slices': 100"), ROW("'slices': 400"), 2e-3},
        {PAIR("'samples': 32"), PAIR("'samples': 128"), 2e-3},
        {PAIR("'slices': 100"), PAIR("'slices': 400"), 4e-3},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        double rmse[2];
        for (int fine = 0; fine < 2; fine++) {
            struct truth_fixture truth;
            struct render_result result;
            const char *json = fine ? rows[r].fine : rows[r].coarse;
            assert_int_equal(support_draw(renderer, &result, "%s", json), STATUS_OK);
            assert_int_equal(truth_open(&truth, "%s", json), STATUS_OK);
            truth_draw(&truth, 1e-7, 2);
            double sum = 0;
            for (int i = 0; i < 4 * 256; i++)
                sum += pow((double)result.pixels[i] - truth.result.pixels[i / 4][i % 4], 2);
            rmse[fine] = sqrt(sum / 1024);
            truth_close(&truth);
            render_result_finish(&result);
        }
        print_message("scene %zu: RMSE %.2e, finely %.2e\n", r, rmse[0], rmse[1]);
        assert_true(rmse[1] < rows[r].most);
        assert_true(rmse[1] < 0.6 * rmse[0]);
    }
}

/* No member of a material without a medium. */
static void test_refusals(void **state) {
    (void)state;
    static const char *const members[] = {"absorption", "emission", "glow"};
    for (int i = 0; i < 3; i++) {
        char text[512];
        struct arena arena = {0};
        struct scene scene;
        struct error err = {0};
        snprintf(text, sizeof text,
                 "{'objects': [{'shell': {'mesh': {'shape': 'plane'}, 'material': {'builtin': "
                 "'chain', '%s': 1}}}]}",
                 members[i]);
        support_quote(text);
        assert_int_equal(scene_read(text, strlen(text), &arena, &scene, &err),
                         STATUS_INVALID_SCENE);
        snprintf(text, sizeof text, "/objects/0/shell/material/%s", members[i]);
        assert_string_equal(err.faults[0].pointer, text);
        error_clear(&err);
        arena_free(&arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_form), cmocka_unit_test(test_glow),
        cmocka_unit_test(test_shadow),      cmocka_unit_test(test_against_the_reference),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
