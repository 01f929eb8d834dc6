/* Shadows as the paths draw them: against closed forms, against the reference, which traces light's
 * rays; errors fall with the maps' size; nothing hides itself; no way of drawing differs. */
#include <math.h>
#include <stdlib.h>

#include "renderer/truth.h"
#include "tests/unit/renderer_fixture.h"

#define DOWN "'eye': [0, 0, 9], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 2"

/* A homogeneous slab over a plane, seen from between: exp(-sigma d / cos), by several lights. */
static void test_slab(void **state) {
    (void)state;
    for (double sigma = 1e-4; sigma < 1e6; sigma *= 100) {
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'camera': {'eye': [0, "
                         "0, 0.5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'fov_y_deg': 60}, "
                         "'ambient': [0, 0, 0.5], 'lights': [{'direction': [1, 0, -1], 'color': "
                         "[1, 0, 0], 'shadow': true}, {'direction': [0, 0, -3], 'color': [0, 1, "
                         "0], 'shadow': true}, {'direction': [0, 1, -1], 'color': [0, 0, 1]}], "
                         "'objects': [{'mesh': {'shape': 'plane', 'size': [8, 8]}}, {'shell': "
                         "{'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': 0.5, "
                         "'material': {'builtin': 'homogeneous', 'extinction': %.17g}}, "
                         "'transform': {'translate': [0, 0, 1]}}]}",
                         sigma),
            STATUS_OK);
        for (int i = 0; i < 64; i++) {
            const float *pixel = result.pixels + 4 * (size_t)i;
            assert_float_equal(pixel[0], sqrt(0.5) * exp(-sigma * 0.5 * sqrt(2)), 2e-6);
            assert_float_equal(pixel[1], exp(-sigma * 0.5), 2e-6);
            assert_float_equal(pixel[2], 0.5 + sqrt(0.5), 2e-6);
        }
        render_result_finish(&result);
    }
}

/* The square over a plane: what lies more than a texel and a half from its shadow's edge is dark or
 * lit to rounding, at any slant. */
static void test_opaque(void **state) {
    (void)state;
    for (double slant = 0; slant < 30; slant = slant * 3 + 0.37) {
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 64, 'height': 64, 'samples': 1}, 'camera': {" DOWN
                         "}, 'shadow': {'size': 500}, 'ambient': [0, 0, 0], 'lights': "
                         "[{'direction': [%.17g, 0.25, -1], 'color': [1, 1, 1], 'shadow': true}], "
                         "'objects': [{'mesh': {'shape': 'plane', 'size': [4, 4]}, 'color': [1, 1, "
                         "1]}, {'mesh': {'shape': 'plane', 'size': [1, 1]}, 'color': [0, 0, 0], "
                         "'transform': {'translate': [%.17g, 0, 0.1]}}]}",
                         slant, -slant * 0.1 - 20 * (slant < 0)),
            STATUS_OK);
        double cosine = 1 / sqrt(1 + slant * slant + 0.0625), texel = 4.3 * 1.5 / 490;
        int dark = 0, lit = 0;
        for (int y = 0; y < 64; y++)
            for (int x = 0; x < 64; x++) {
                double px = (x + 0.5) / 32 - 1, py = 1 - (y + 0.5) / 32;
                double reach = texel * sqrt(1 + slant * slant);
                double outside = fmax(fabs(px) - 0.5, fabs(py - 0.025) - 0.5);
                /* The square itself lies over some of it, and is black. */
                bool square = fabs(px + slant * 0.1) < 0.52 && fabs(py) < 0.52;
                if (square || fabs(outside) < 1.5 * reach)
                    continue;
                assert_float_equal(support_pixel(&result, x, y)[0], outside < 0 ? 0 : cosine, 2e-6);
                dark += outside < 0;
                lit += outside > 0;
            }
        print_message("slant %g: %d pixels in the shadow, %d beside it\n", slant, dark, lit);
        assert_true((lit > 100 || slant > 10) && (dark > 50 || slant < 1));
        render_result_finish(&result);
    }
}

/* A lit medium that shades itself. test_reference_shadow.c has the closed form. */
static void test_own_shell(void **state) {
    (void)state;
    static const char *const qualities[] = {"'samples': 512", "'samples': 512, 'order': 'sorted'",
                                            "'slices': 1000", "'slices': 4000, 'method': 'hybrid'",
                                            "'samples': 4"};
    for (size_t q = 0; q < sizeof qualities / sizeof *qualities; q++)
        /* Along the light any number of samples does (place_in_step). */
        for (int below = 0; below < (q == 4 ? 1 : 2); below++) {
            double pixel[2][4];
            for (int light = 0; light < 2; light++) {
                struct render_result result;
                assert_int_equal(
                    support_draw(renderer, &result,
                                 "{'image': {'width': 4, 'height': 4, 'samples': 1}, 'camera': "
                                 "{'eye': [0.1, 0.2, %d], 'target': [0.1, 0.2, 0], 'up': [0, 1, "
                                 "0], 'ortho_height': 1}, 'ambient': [%d, 0, 0], 'lights': "
                                 "[{'direction': [0, 0, -1], 'color': [%d, 0, 0], 'shadow': "
                                 "true}], 'shadow': {'slices': 48}, 'objects': [{'shell': {'mesh': "
                                 "{'shape': 'plane', 'size': [8, 8]}, 'thickness': 0.5, "
                                 "'material': {'builtin': 'fur', 'size': [1, 1, 1]}}, 'quality': "
                                 "{%s}}]}",
                                 below ? -9 : 9, !light, light, qualities[q]),
                    STATUS_OK);
                for (int c = 0; c < 4; c++)
                    pixel[light][c] = (double)result.pixels[c];
                render_result_finish(&result);
            }
            double alpha = pixel[0][3], tau = -log1p(-alpha), color = pixel[0][0] / alpha;
            double expected = color * (below ? tau * exp(-tau) / 4 : -expm1(-2 * tau) / 8);
            /* Planes as published are of first order. */
            double most = q == 3 ? 1e-2 : 1e-4;
            if (!(fabs(pixel[1][0] - expected) < most * expected + 1e-6))
                fail_msg("%s, below %d: %.7g, expected %.7g", qualities[q], below, pixel[1][0],
                         expected);
        }
}

/* RMSE over all pixels of a scene against its truth, which is drawn once. */
struct compared {
    struct truth truth;
    char json[4096];
};

/* A scene with something put in at its %s. */
static void write_scene(char *out, size_t size, const char *json, const char *beside) {
    const char *at = strstr(json, "%s");
    assert_non_null(at);
    int length = snprintf(out, size, "%.*s%s%s", (int)(at - json), json, beside, at + 2);
    assert_true(length > 0 && (size_t)length < size);
}

static void open_truth(struct compared *compared, const char *json, double tolerance) {
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source source = {.open = support_no_asset};
    struct reference_request request = {.tolerance = tolerance};
    write_scene(compared->json, sizeof compared->json, json, "");
    support_quote(compared->json);
    assert_int_equal(scene_read(compared->json, strlen(compared->json), &arena, &scene, &err),
                     STATUS_OK);
    assert_int_equal(truth_render(&scene, &source, &request, &compared->truth, &err), STATUS_OK);
    arena_free(&arena);
}

static double rmse(const struct compared *compared, const char *json, const char *beside) {
    char text[4096];
    struct render_result result;
    struct asset_source source = {.open = support_no_asset};
    write_scene(text, sizeof text, json, beside);
    assert_int_equal(support_draw_json(renderer, &source, text, &result), STATUS_OK);
    double sum = 0;
    size_t count = (size_t)result.width * (size_t)result.height;
    for (size_t i = 0; i < 4 * count; i++) {
        double off = (double)result.pixels[i] - (double)compared->truth.pixels[i];
        sum += off * off;
    }
    render_result_finish(&result);
    return sqrt(sum / (4.0 * (double)count));
}

#define VIEW(width) "{'image': {'width': " #width ", 'height': " #width ", 'samples': 1}, "

/* Lone convex meshes hide nothing but their far side; with concave ones, closed or not, what is
 * wrong is so within a texel of an edge. */
static void test_meshes_hide_themselves_rightly(void **state) {
    (void)state;
    static const struct {
        const char *json;
        double most;
    } rows[] = {
        {VIEW(48) "'lights': [{'direction': [1, 0.4, -0.3], 'shadow': true}], 'objects': [{'mesh': "
                  "{'shape': 'sphere'}}]%s}",
         1e-4},
        {VIEW(48) "'lights': [{'direction': [0.3, 1, -0.6], 'shadow': true}], 'objects': [{'mesh': "
                  "{'shape': 'plane'}, 'transform': {'rotate_deg': [30, 0, 20], 'scale': [1, 2, "
                  "3]}}]%s}",
         1e-6},
        {VIEW(48) "'lights': [{'direction': [1, 0.4, -0.5], 'shadow': true}], 'shadow': {'size': "
                  "1024}, 'objects': [{'mesh': {'shape': 'torus', 'divisions': [24, 12]}}]%s}",
         0.06},
        {VIEW(48) "'lights': [{'direction': [1, 0.4, -0.5], 'shadow': true}], 'shadow': {'size': "
                  "1024}, 'objects': [{'mesh': {'shape': 'terrain', 'divisions': [16, 16]}}]%s}",
         0.06},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct compared compared;
        open_truth(&compared, rows[r].json, 1e-6);
        double found = rmse(&compared, rows[r].json, "");
        print_message("mesh %zu: RMSE %.2e\n", r, found);
        assert_true(found < rows[r].most);
        truth_finish(&compared.truth);
    }
}

/* Past the limb of a base the ways of light through a medium are twice as long, and dark: none of
 * that lies on the base in front of it. Maps whose ranges were mixed there drew a comb of dark
 * stripes, RMSE 0.075; measured 0.016. */
static void test_limb(void **state) {
    (void)state;
    struct compared compared;
    static const char json[] =
        VIEW(24) "'camera': {'eye': [0.6, -3.2, 1.4], 'target': [0.7, -0.65, -0.2], 'fov_y_deg': "
                 "12}, 'ambient': [0, 0, 0], 'lights': [{'direction': [1, 0.6, -0.4], 'color': [9, "
                 "9, 9], 'shadow': true}], 'shadow': {'size': 256, 'slices': 48}, 'objects': "
                 "[{'shell': {'mesh': {'shape': 'sphere', 'divisions': [48, 24]}, 'thickness': "
                 "0.12, 'tiles': [4, 2], 'base': {}, 'material': {'builtin': 'clouds', 'size': "
                 "[16, 16, 4]}}, 'quality': {'samples': 64}}]%s}";
    open_truth(&compared, json, 1e-4);
    double found = rmse(&compared, json, "");
    print_message("clouds at the terminator: RMSE %.4f\n", found);
    assert_true(found < 0.03);
    truth_finish(&compared.truth);
}

/* Twice the texels, and more slices: less of an error, to be had in every way of drawing. */
static void test_error_falls_with_the_maps(void **state) {
    (void)state;
    static const struct {
        const char *name, *json;
        double most; /* with 512 texels */
    } rows[] = {
        {"mist around a sphere on a plane",
         VIEW(16) "'camera': {'eye': [0, -4, 3], 'fov_y_deg': 50}, 'lights': [{'direction': [1, "
                  "0.5, -1.3], 'shadow': true}], 'objects': [{'shell': {'mesh': {'shape': "
                  "'sphere'}, 'thickness': 0.4, 'tiles': [4, 2], 'material': {'builtin': 'clouds', "
                  "'size': [8, 8, 4]}}, 'quality': {'samples': 32}}, {'mesh': {'shape': 'plane', "
                  "'size': [8, 8]}, 'transform': {'translate': [0, 0, -1.5]}}]%s}",
         0.02},
        {"fur on a base",
         VIEW(16) "'camera': {'eye': [0, -3, 2], 'fov_y_deg': 40}, 'lights': [{'direction': [1, "
                  "0.5, -1.3], 'shadow': true}], 'objects': [{'shell': {'mesh': {'shape': "
                  "'sphere', 'divisions': [16, 8]}, 'thickness': 0.3, 'tiles': [3, 2], 'base': "
                  "{'color': [0.5, 0.4, 0.3]}, 'material': {'builtin': 'fur', 'size': [16, 16, "
                  "8]}}, 'quality': {'samples': 64}}]%s}",
         0.03},
        {"chain over a plane",
         VIEW(16) "'camera': {'eye': [0, -3, 2], 'fov_y_deg': 40}, 'lights': [{'direction': [1, "
                  "0.5, -1.3], 'shadow': true}], 'objects': [{'shell': {'mesh': {'shape': 'plane', "
                  "'size': [2, 2], 'divisions': [4, 4]}, 'thickness': 0.3, 'tiles': [2, 2], "
                  "'material': {'builtin': 'chain', 'size': [32, 32, 12]}}, 'quality': {'samples': "
                  "128}}, {'mesh': {'shape': "
                  "'plane', 'size': [4, 4]}, 'transform': {'translate': [0, 0, -0.3]}}]%s}",
         0.1},
    };
    static const char *const maps[] = {", 'shadow': {'size': 32, 'slices': 12}",
                                       ", 'shadow': {'size': 128, 'slices': 24}",
                                       ", 'shadow': {'size': 512, 'slices': 48}"};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct compared compared;
        open_truth(&compared, rows[r].json, 1e-4);
        double found[3];
        for (int m = 0; m < 3; m++)
            found[m] = rmse(&compared, rows[r].json, maps[m]);
        print_message("%s: RMSE %.4f, %.4f, %.4f with maps of 32, 128, 512\n", rows[r].name,
                      found[0], found[1], found[2]);
        assert_true(found[1] < 0.75 * found[0] && found[2] < found[1] && found[2] < rows[r].most);
        truth_finish(&compared.truth);
    }
}

/* The same picture, whatever draws it. */
static void test_every_way_alike(void **state) {
    (void)state;
    static const struct {
        const char *quality, *second;
        double most;
    } rows[] = {
        {"'samples': 64, 'order': 'walk'", "", 0},
        {"'samples': 64, 'order': 'sorted'", "", 2e-4},
        /* Measured 2e-4 and 7e-4; 6e-3 as long as light took fewer steps through what is sliced. */
        {"'slices': 400", "", 3e-3},
        {"'slices': 1000, 'method': 'software'", "", 3e-3},
        {"'slices': 1000, 'method': 'hybrid'", "", 3e-3},
        {"'slices': 1000, 'method': 'hardware'", "", 3e-3},
        /* A joint walk: there is next to nothing in the second shell, which lies within the first,
         * so that light's views are the same. */
        {"'samples': 64, 'order': 'walk'",
         ", {'shell': {'mesh': {'shape': 'plane', 'size': [2, 2]}, 'thickness': 0.1, 'material': "
         "{'builtin': 'homogeneous', 'extinction': 1e-7}}, 'transform': {'translate': [0, 0, "
         "0.1]}}",
         3e-3},
    };
    float *first = NULL;
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct render_result result;
        assert_int_equal(
            support_draw(
                renderer, &result,
                VIEW(48) "'camera': {'eye': [0, -3, 2], 'fov_y_deg': 40}, 'lights': "
                         "[{'direction': [1, 0.5, -1.3], 'shadow': true}], 'shadow': {'size': 128, "
                         "'slices': 96}, 'objects': [{'shell': "
                         "{'mesh': {'shape': 'plane', 'size': [2, 2], 'divisions': [4, 4]}, "
                         "'thickness': 0.3, 'tiles': [3, 2], 'base': {}, 'material': {'builtin': "
                         "'clouds', 'size': [16, 16, 8]}}, 'quality': {%s}}%s]}",
                rows[r].quality, rows[r].second),
            STATUS_OK);
        size_t count = 4 * (size_t)result.width * (size_t)result.height;
        double sum = 0;
        if (!first) {
            first = malloc(count * sizeof *first);
            assert_non_null(first);
            memcpy(first, result.pixels, count * sizeof *first);
        }
        for (size_t i = 0; i < count; i++)
            sum += ((double)first[i] - (double)result.pixels[i]) *
                   ((double)first[i] - (double)result.pixels[i]);
        double off = sqrt(sum / (double)count);
        print_message("%s: %.1e\n", rows[r].quality, off);
        assert_true(off <= rows[r].most);
        render_result_finish(&result);
    }
    free(first);
}

/* Light goes through solids from voxel to voxel as the eye does, so the picture is the same at any
 * number of steps; by equal ones they were 0.041 apart. */
static void test_solids_at_any_steps(void **state) {
    (void)state;
    static const int samples[] = {12, 1200};
    struct render_result results[2];
    for (int r = 0; r < 2; r++)
        assert_int_equal(
            support_draw(renderer, &results[r],
                         VIEW(48) "'camera': {'eye': [0, -3, 2], 'fov_y_deg': 40}, 'lights': "
                                  "[{'direction': [1, 0.5, -1.3], 'shadow': true}], 'shadow': "
                                  "{'size': 256}, 'objects': [{'shell': {'mesh': {'shape': "
                                  "'torus', 'divisions': [16, 8]}, 'thickness': 0.3, 'tiles': [6, "
                                  "3], 'material': {'builtin': 'chain', 'size': [32, 32, 12]}}, "
                                  "'quality': {'samples': %d}}, {'mesh': {'shape': 'plane', "
                                  "'size': [4, 4]}, 'transform': {'translate': [0, 0, -0.8]}}]}",
                         samples[r]),
            STATUS_OK);
    double sum = 0;
    for (int i = 0; i < 4 * 48 * 48; i++)
        sum += pow((double)results[0].pixels[i] - (double)results[1].pixels[i], 2);
    double off = sqrt(sum / (4 * 48 * 48));
    print_message("chain by %d steps and by %d: %.1e\n", samples[0], samples[1], off);
    assert_true(off < 1e-3);
    for (int r = 0; r < 2; r++)
        render_result_finish(&results[r]);
}

/* What is asked for is drawn or refused, and `resolved` gives the same picture. */
static void test_size(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(support_draw(renderer, &result,
                                  VIEW(8) "'lights': [{'shadow': true}, {'shadow': true}], "
                                          "'shadow': {'size': 4096}, 'objects': [{'mesh': "
                                          "{'shape': 'sphere'}}]}"),
                     STATUS_TOO_COMPLEX);
    assert_int_equal(support_draw(renderer, &result,
                                  VIEW(8) "'lights': [{'shadow': true}], 'shadow': {'slices': 13}, "
                                          "'objects': [{'shell': {'mesh': {'shape': 'sphere'}, "
                                          "'material': {'builtin': 'fur', 'size': [4, 4, 4]}}}]}"),
                     STATUS_OK);
    assert_int_equal(result.report.resolved.shadow.size, 256);
    assert_int_equal(result.report.resolved.shadow.slices, 24);
    assert_int_equal(result.report.warning_count, 0);
    render_result_finish(&result);
    /* Where fp32 cannot hold a shell's depth, that is told. */
    assert_int_equal(support_draw(renderer, &result,
                                  VIEW(8) "'lights': [{'shadow': true}], 'objects': [{'shell': "
                                          "{'mesh': {'shape': 'sphere'}, 'thickness': 1e-6, "
                                          "'material': {'builtin': 'fur', 'size': [4, 4, 4]}}}]}"),
                     STATUS_OK);
    bool told = false;
    for (size_t i = 0; i < result.report.warning_count; i++)
        told |= strcmp(result.report.warnings[i].code, "shadow-coarse") == 0;
    assert_true(told);
    render_result_finish(&result);
}

/* Where light goes on through a medium to another side of it, slices left out are four times as
 * many: by 12 clouds on a torus are off by 0.17. */
static void test_slices_left_out(void **state) {
    (void)state;
    static const struct {
        const char *mesh, *more;
        int slices;
    } cases[] = {{"torus", "", 48},
                 {"cylinder", "", 48},
                 {"torus", ", 'base': {'color': [1, 1, 1]}", 12},
                 {"plane", "", 12},
                 {"terrain", "", 12}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         VIEW(8) "'lights': [{'shadow': true}], 'objects': [{'shell': {'mesh': "
                                 "{'shape': '%s'}, 'material': {'builtin': 'clouds', 'size': [4, "
                                 "4, 4]}%s}}]}",
                         cases[i].mesh, cases[i].more),
            STATUS_OK);
        assert_int_equal(result.report.resolved.shadow.slices, cases[i].slices);
        render_result_finish(&result);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slices_left_out),
        cmocka_unit_test(test_slab),
        cmocka_unit_test(test_opaque),
        cmocka_unit_test(test_own_shell),
        cmocka_unit_test(test_meshes_hide_themselves_rightly),
        cmocka_unit_test(test_limb),
        cmocka_unit_test(test_error_falls_with_the_maps),
        cmocka_unit_test(test_every_way_alike),
        cmocka_unit_test(test_solids_at_any_steps),
        cmocka_unit_test(test_size),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
