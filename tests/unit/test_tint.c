/* Extinction with colours: slabs against the closed form, over opaque surfaces and backgrounds of
 * any alpha, in the reference to 1e-9 and by every way of drawing; three equal factors against one
 * extinction; lit clouds, folds and overlaps against the reference; coloured shadow in the
 * reference (test_shadow_color.c: by the paths); what is refused. */
#include <math.h>
#include <stdlib.h>

#include "tests/reference_fixture.h"
#include "tests/unit/renderer_fixture.h"

static const double color[3] = {0.25, 0.5, 1}, tint[3] = {1, 0.25, 0};
#define TINT "'extinction_color': [1, 0.25, 0]"

/* Largest difference of any pixel from `expected`, relative above 1. */
static double off_by(const double pixel[4], const double expected[4]) {
    double most = 0;
    for (int i = 0; i < 4; i++)
        most = fmax(most, fabs(pixel[i] - expected[i]) / fmax(1, fabs(expected[i])));
    return most;
}

/* A slab at 60 degrees, s = 1 along each ray: over nothing, over a background that is half
 * transparent, over an opaque one, and over a red surface. Homogeneous, and as empty voxels that
 * absorb and emit. */
static void test_closed_form(void **state) {
    (void)state;
    static const struct {
        double sigma, absorption, q[3];
    } rows[] = {
        {2, 0, {0, 0, 0}},       {2, 1, {0.5, 0.5, 0.5}}, {0, 0, {1, 0, 1}},
        {1e-6, 1e-6, {0, 0, 0}}, {40, 0, {0, 0, 0}},      {1e6, 1e6, {1e5, 1, 1}},
    };
    static const double backgrounds[][4] = {{0, 0, 0, 0}, {0.2, 0.6, 0.8, 0.5}, {0.2, 0.6, 0.8, 1}};
    /* All but the first are several draws for each sample. */
    static const char *const ways[] = {"'order': 'walk'", "'order': 'sorted'", "'slices': 37",
                                       "'slices': 500, 'method': 'hybrid'"};
    double worst = 0, worst_truth = 0;
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++)
        for (int variant = 0; variant < 12; variant++) {
            int voxels = variant % 2, surface = variant / 2 % 2, b = variant / 4;
            double sigma = voxels ? 0 : rows[r].sigma, expected[4], mean = 0;
            const double *q = rows[r].q, *back = backgrounds[b];
            for (int i = 0; i < 3; i++) {
                double tau = tint[i] * (sigma + rows[r].absorption);
                double way = tau > 0 ? -expm1(-tau) / tau : 1;
                double behind = surface ? (i == 0 ? 1 : 0) : back[i] * back[3];
                expected[i] = (tint[i] * sigma * color[i] + q[i]) * way + exp(-tau) * behind;
                mean += exp(-tau) / 3;
            }
            expected[3] = surface ? 1 : 1 - mean * (1 - back[3]);
            char material[512], json[4096];
            if (voxels)
                snprintf(material, sizeof material,
                         "'builtin': 'fur', 'size': [4, 4, 2], 'growth': 0");
            else
                snprintf(material, sizeof material,
                         "'builtin': 'homogeneous', 'extinction': %.17g, 'color': [0.25, 0.5, 1]",
                         sigma);
            for (size_t w = 0; w <= sizeof ways / sizeof *ways; w++) {
                bool reference = w == sizeof ways / sizeof *ways;
                snprintf(json, sizeof json,
                         "{'image': {'width': 4, 'height': 4, 'samples': 1, 'background': [%g, %g, "
                         "%g, %g]}, 'camera': {'eye': [%.17g, 0, 5], 'ortho_height': 0.5}, "
                         "'lights': [], 'ambient': [1, 1, 1], 'objects': [{'shell': {'mesh': "
                         "{'shape': 'plane', 'size': [3, 3]}, 'thickness': 0.5, 'material': {%s, "
                         "'absorption': %.17g, 'emission': [%g, %g, %g], " TINT "}}, 'quality': "
                         "{%s}}%s]}",
                         back[0], back[1], back[2], back[3], 5 * sqrt(3), material,
                         rows[r].absorption, q[0], q[1], q[2], reference ? "" : ways[w],
                         surface ? ", {'mesh': {'shape': 'plane', 'size': [9, 9]}, 'color': [1, 0, "
                                   "0], 'transform': {'translate': [0, 0, -0.5]}}"
                                 : "");
                struct truth_fixture truth;
                struct render_result result;
                if (reference) {
                    assert_int_equal(truth_open(&truth, "%s", json), STATUS_OK);
                    truth_draw(&truth, 1e-12, 1);
                } else {
                    assert_int_equal(support_draw(renderer, &result, "%s", json), STATUS_OK);
                }
                for (int p = 0; p < 16; p++) {
                    double pixel[4];
                    for (int i = 0; i < 4; i++)
                        pixel[i] = reference ? truth.result.pixels[p][i]
                                             : (double)result.pixels[4 * p + i];
                    double off = off_by(pixel, expected);
                    /* Stiff voxels: what the reference's panels err by (its README). */
                    double most = reference ? (voxels ? 3e-9 : 1e-9) : w == 3 ? 2e-2 : 1e-5;
                    if (reference)
                        worst_truth = fmax(worst_truth, off);
                    else if (w != 3)
                        worst = fmax(worst, off);
                    if (!(off < most))
                        fail_msg("row %zu, variant %d, %s: %.12g %.12g %.12g %.12g, not %.12g "
                                 "%.12g %.12g "
                                 "%.12g",
                                 r, variant, reference ? "reference" : ways[w], pixel[0], pixel[1],
                                 pixel[2], pixel[3], expected[0], expected[1], expected[2],
                                 expected[3]);
                }
                if (reference)
                    truth_close(&truth);
                else
                    render_result_finish(&result);
            }
        }
    print_message("off by %.1e, the reference by %.1e\n", worst, worst_truth);
}

#define VIEW(beside)                                                                               \
    "{'image': {'width': 16, 'height': 16, 'samples': 1, 'background': [0.3, 0.5, 0.9, %g]}, "     \
    "'camera': {'eye': [0, -4, 1.5], 'fov_y_deg': 40}, " beside "'objects': ["
#define LIGHT "'lights': [{'direction': [0.7, 1, -1.1], 'color': [2, 1.9, 1.8]}], "
#define SHELL(mesh, material, beside)                                                              \
    "{'shell': {'mesh': {'shape': " mesh "}, 'thickness': 0.4, 'tiles': [3, 2], 'material': "      \
    "{" material "}}" beside "}"
#define SPHERE "'sphere', 'divisions': [24, 12]"
#define CLOUDS "'builtin': 'clouds', 'size': [8, 8, 4], 'extinction_color': [0.1, 0.4, 1]"
#define UNLIT  CLOUDS ", 'lit': false"
#define ASIDE  "'transform': {'translate': [0.3, 0, 0.2]}"

/* RMSE against the reference: second order in the steps, by walks, cells and slabs over any
 * background, and joint walks. Bounds: twice what was measured. */
static void test_against_the_reference(void **state) {
    (void)state;
    static const struct {
        const char *format;
        int coarse, fine;
        double alpha, most;
    } rows[] = {
        {VIEW(LIGHT) SHELL(SPHERE, CLOUDS, ", 'quality': {'samples': %d, 'order': 'walk'}") "]}",
         32, 128, 0.5, 2e-4},
        {VIEW(LIGHT) SHELL(SPHERE, CLOUDS ", 'absorption': 1, 'glow': 0.3",
                           ", 'quality': {'samples': %d, 'order': 'sorted'}") "]}",
         32, 128, 1, 2e-4},
        {VIEW(LIGHT) SHELL(SPHERE, CLOUDS, ", 'quality': {'slices': %d}") "]}", 100, 400, 1, 2e-4},
        {VIEW(LIGHT) SHELL(SPHERE, CLOUDS ", 'emission': [0.1, 0, 0.3]",
                           ", 'quality': {'samples': %d, 'order': 'sorted'}") "]}",
         32, 128, 0.5, 2e-4},
        {VIEW(LIGHT) SHELL(SPHERE, CLOUDS, ", 'quality': {'slices': %d}") "]}", 100, 400, 0, 2e-4},
        {VIEW("") SHELL(SPHERE, UNLIT, ", 'quality': {'samples': %1$d}") ", " SHELL(
             SPHERE, "'builtin': 'homogeneous', 'extinction': 1, 'extinction_color': [1, 0.2, 0.1]",
             ", 'quality': {'samples': %1$d}, " ASIDE) "]}",
         6, 128, 0.5, 2e-4},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        double rmse[2];
        for (int fine = 0; fine < 2; fine++) {
            char json[4096], quality[16];
            struct truth_fixture truth;
            struct render_result result;
            snprintf(quality, sizeof quality, "%d", fine ? rows[r].fine : rows[r].coarse);
            /* %g once, then the quality wherever it stands. */
            size_t length = 0;
            for (const char *c = rows[r].format; *c; c++) {
                bool alpha = strncmp(c, "%g", 2) == 0, own = strncmp(c, "%d", 2) == 0;
                bool named = strncmp(c, "%1$d", 4) == 0;
                if (alpha)
                    length +=
                        (size_t)snprintf(json + length, sizeof json - length, "%g", rows[r].alpha);
                else if (own || named)
                    length += (size_t)snprintf(json + length, sizeof json - length, "%s", quality);
                else
                    json[length++] = *c;
                c += alpha || own ? 1 : named ? 3 : 0;
            }
            json[length] = 0;
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

/* Light through a tinted slab, straight down and back up, in the reference. */
static void test_shadow(void **state) {
    (void)state;
    struct truth_fixture truth;
    assert_int_equal(
        truth_open(&truth, "{'image': {'width': 2, 'height': 2, 'samples': 1}, 'camera': {'eye': "
                           "[0, 0, 5], 'up': [0, 1, 0], 'ortho_height': 0.5}, 'ambient': [0, 0, "
                           "0], 'lights': [{'direction': [3, 0, -4], 'color': [1, 1, 1], 'shadow': "
                           "true}], 'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [6, "
                           "6]}, 'thickness': 0.5, 'material': {'builtin': 'homogeneous', "
                           "'extinction': 0, 'absorption': 1.2, " TINT
                           "}}}, {'mesh': {'shape': 'plane', 'size': [6, 6]}, 'color': [1, 1, 1], "
                           "'transform': {'translate': [0, 0, -0.5]}}]}"),
        STATUS_OK);
    truth_draw(&truth, 1e-12, 1);
    for (int i = 0; i < 3; i++)
        assert_float_equal(truth.result.pixels[0][i],
                           0.8 * exp(-tint[i] * 1.2 * 0.5 * (1 + 1 / 0.8)), 1e-9);
    truth_close(&truth);
}

/* More shells than can be walked at once are drawn cell by cell: over nothing, where all have one
 * colour. Over a surface too, which no channel's share of a depth may let through. */
static void test_many_of_one_color(void **state) {
    (void)state;
    static const double k[3] = {0.5, 0.125, 0};
    for (int surface = 0; surface < 2; surface++) {
        char shells[4096] = "";
        for (int i = 0; i < 8; i++)
            snprintf(shells + strlen(shells), sizeof shells - strlen(shells),
                     "%s{'shell': {'mesh': {'shape': 'plane', 'size': [3, 3]}, 'thickness': 0.5, "
                     "'material': {'builtin': 'homogeneous', 'extinction': 0.5, 'color': [0.25, "
                     "0.5, 1], 'extinction_color': [0.5, 0.125, 0]}}, 'transform': {'translate': "
                     "[0, 0, %g]}}",
                     i ? ", " : "", 0.01 * i);
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 4, 'height': 4, 'samples': 1, 'background': [0.2, "
                         "0.6, 0.8, 0.5]}, 'camera': {'eye': [0, 0, 5], 'up': [0, 1, 0], "
                         "'ortho_height': 0.5}, 'lights': [], 'ambient': [1, 1, 1], 'objects': "
                         "[%s%s]}",
                         shells,
                         surface ? ", {'mesh': {'shape': 'plane', 'size': [9, 9]}, 'color': [1, 0, "
                                   "0], 'transform': {'translate': [0, 0, -0.5]}}"
                                 : ""),
            STATUS_OK);
        static const double back[3] = {0.1, 0.3, 0.4};
        double expected[4], mean = 0;
        for (int i = 0; i < 3; i++) {
            double through = exp(-k[i] * 0.5 * 0.5 * 8);
            expected[i] = color[i] * (1 - through);
            expected[i] += through * (surface ? (i == 0 ? 1 : 0) : back[i]);
            mean += through / 3;
        }
        expected[3] = surface ? 1 : 1 - mean * 0.5;
        for (int p = 0; p < 16; p++) {
            double pixel[4];
            for (int i = 0; i < 4; i++)
                pixel[i] = (double)result.pixels[4 * p + i];
            assert_true(off_by(pixel, expected) < 1e-5);
        }
        render_result_finish(&result);
    }
}

static void test_refusals(void **state) {
    (void)state;
    static const struct {
        const char *json, *pointer;
        enum status status;
    } rows[] = {
        {"{'objects': [" SHELL(SPHERE, "'builtin': 'fog'",
                               ", 'quality': {'order': 'sorted'}") ", " SHELL(SPHERE, CLOUDS,
                                                                              "") "]}",
         "/objects/1/shell/material/extinction_color", STATUS_NOT_IMPLEMENTED},
        {"{'objects': [" SHELL(SPHERE, CLOUDS, ", 'path': 'slicing'") ", " SHELL(
             SPHERE, "'builtin': 'fog', 'extinction_color': [0.1, 0.4, 0.9]", "") "]}",
         "/objects/0/shell/material/extinction_color", STATUS_NOT_IMPLEMENTED},
        {"{'image': {'background': [0, 0, 0, 1]}, 'objects': [" SHELL(
             SPHERE, CLOUDS, ", 'quality': {'slices': 4097}") "]}",
         "/objects/0/shell/material/extinction_color", STATUS_NOT_IMPLEMENTED},
        {"{'objects': [" SHELL(SPHERE, "'builtin': 'chain', 'extinction_color': [1, 1, 1]",
                               "") "]}",
         "/objects/0/shell/material/extinction_color", STATUS_INVALID_SCENE},
        {"{'objects': [" SHELL(SPHERE, "'builtin': 'fog', 'extinction_color': [1, 1, 2]", "") "]}",
         "/objects/0/shell/material/extinction_color/2", STATUS_INVALID_SCENE},
        {"{'objects': [" SHELL(SPHERE, CLOUDS, "") "]}", NULL, STATUS_OK},
        {"{'lights': [{'shadow': true}], 'objects': [" SHELL(SPHERE, CLOUDS, "") "]}", NULL,
         STATUS_OK},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        char text[2048];
        struct arena arena = {0};
        struct scene scene;
        struct error err = {0};
        struct render_result result;
        struct asset_source source = {.open = support_no_asset};
        snprintf(text, sizeof text, "%s", rows[r].json);
        support_quote(text);
        enum status status = scene_read(text, strlen(text), &arena, &scene, &err);
        if (status == STATUS_OK)
            status = renderer_plan(renderer, &scene, &source, &result, &err);
        assert_int_equal(status, rows[r].status);
        if (status == STATUS_OK) {
            /* Left open, the path that can draw it is taken. */
            assert_int_equal(result.report.resolved.objects[0].path, SCENE_PATH_TETRA);
            render_result_finish(&result);
        } else {
            assert_string_equal(err.faults[0].pointer, rows[r].pointer);
        }
        error_clear(&err);
        arena_free(&arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closed_form), cmocka_unit_test(test_against_the_reference),
        cmocka_unit_test(test_shadow),      cmocka_unit_test(test_many_of_one_color),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
