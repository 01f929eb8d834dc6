/* Coloured shadows: light through media whose extinction has colours (api/README.md, "Absorption,
 * emission, glow and coloured extinction"), where all of them have the same and where they do not:
 * against closed forms, against the reference, by every way of drawing. */
#include <math.h>
#include <stdlib.h>

#include "renderer/truth.h"
#include "tests/unit/renderer_fixture.h"

static const double tint[2][3] = {{1, 0.25, 0}, {0.1, 0.5, 1}};

/* One or two slabs over a plane that is seen from below them: exp(-sum k sigma d / cos). */
static void test_slabs(void **state) {
    (void)state;
    static const char *const second[] = {
        "", /* one colour: shares of one optical depth */
        ", {'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': 0.25, 'material': "
        "{'builtin': 'homogeneous', 'extinction': 0, 'absorption': 1.5, 'extinction_color': [0.1, "
        "0.5, 1]}}, 'transform': {'translate': [0, 0, 2]}}",
        ", {'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': 0.25, 'material': "
        "{'builtin': 'fur', 'size': [4, 4, 2], 'growth': 0, 'absorption': 1.5}}, 'transform': "
        "{'translate': [0, 0, 2]}}"};
    for (double sigma = 1e-4; sigma < 1e6; sigma *= 100)
        for (int s = 0; s < 3; s++) {
            struct render_result result;
            assert_int_equal(
                support_draw(renderer, &result,
                             "{'image': {'width': 8, 'height': 8, 'samples': 1, 'background': [0, "
                             "0, 0, 1]}, 'camera': {'eye': [0, 0, 0.5], 'target': [0, 0, 0], 'up': "
                             "[0, 1, 0], 'fov_y_deg': 60}, 'ambient': [0, 0, 0.5], 'lights': "
                             "[{'direction': [1, 0, -1], 'color': [1, 1, 1], 'shadow': true}, "
                             "{'direction': [0, 1, -1], 'color': [0, 0, 1]}], 'objects': [{'mesh': "
                             "{'shape': 'plane', 'size': [8, 8]}}, {'shell': {'mesh': {'shape': "
                             "'plane', 'size': [8, 8]}, 'thickness': 0.5, 'material': {'builtin': "
                             "'homogeneous', 'extinction': %.17g, 'extinction_color': [1, 0.25, "
                             "0]}}, 'transform': {'translate': [0, 0, 1]}}%s]}",
                             sigma, second[s]),
                STATUS_OK);
            for (int i = 0; i < 64; i++)
                for (int c = 0; c < 3; c++) {
                    double depth = tint[0][c] * sigma * 0.5;
                    depth += s == 0 ? 0 : 1.5 * 0.25 * (s == 1 ? tint[1][c] : 1);
                    double expected = sqrt(0.5) * exp(-depth * sqrt(2));
                    expected += c == 2 ? 0.5 + sqrt(0.5) : 0;
                    double found = (double)result.pixels[4 * i + c];
                    if (!(fabs(found - expected) < 2e-6))
                        fail_msg("sigma %g, second %d, channel %d: %.9g, expected %.9g", sigma, s,
                                 c, found, expected);
                }
            render_result_finish(&result);
        }
}

/* A lit medium that shades itself, by each channel as much as that loses. Beside it a shell of
 * another colour, or none. With few steps light is right for the first channel alone. */
static void test_own_shell(void **state) {
    (void)state;
    static const struct {
        const char *quality;
        double most[3];
    } rows[] = {{"'samples': 256", {1e-4, 1e-4, 1e-4}},
                {"'samples': 256, 'order': 'sorted'", {1e-4, 1e-4, 1e-4}},
                {"'slices': 1000", {1e-4, 1e-4, 1e-4}},
                {"'slices': 4000, 'method': 'hybrid'", {1e-2, 1e-2, 1e-2}},
                {"'samples': 4", {1e-4, 0.1, 0.1}}};
    for (size_t r = 0; r < 2 * sizeof rows / sizeof *rows; r++) {
        double pixel[2][4];
        for (int light = 0; light < 2; light++) {
            struct render_result result;
            assert_int_equal(
                support_draw(
                    renderer, &result,
                    "{'image': {'width': 4, 'height': 4, 'samples': 1, 'background': [0, 0, 0, "
                    "1]}, 'camera': {'eye': [0.1, 0.2, 9], 'target': [0.1, 0.2, 0], 'up': [0, 1, "
                    "0], 'ortho_height': 1}, 'ambient': [%d, %d, %d], 'lights': [{'direction': [0, "
                    "0, -1], 'color': [%d, %d, %d], 'shadow': true}], 'shadow': {'slices': 48}, "
                    "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, "
                    "'thickness': 0.5, 'material': {'builtin': 'fur', 'size': [1, 1, 1], "
                    "'extinction_color': [1, 0.25, 0.05]}}, 'quality': {%s}}%s]}",
                    !light, !light, !light, light, light, light, rows[r / 2].quality,
                    r % 2 ? ", {'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': "
                            "0.5, 'material': {'builtin': 'homogeneous', 'extinction': 1, 'color': "
                            "[0, 0, 0]}}, "
                            "'transform': {'translate': [0, 0, -1]}}"
                          : ""),
                STATUS_OK);
            for (int c = 0; c < 4; c++)
                pixel[light][c] = (double)result.pixels[c];
            render_result_finish(&result);
        }
        /* The material's own depth and colour, from channels that tell them: lit evenly, c gives
         * color (1 - exp(-k tau)). */
        static double tau, color[3];
        static const double k[3] = {1, 0.25, 0.05};
        if (r == 0) {
            struct render_result result;
            assert_int_equal(
                support_draw(renderer, &result,
                             "{'image': {'width': 4, 'height': 4, 'samples': 1}, 'camera': {'eye': "
                             "[0.1, 0.2, 9], 'target': [0.1, 0.2, 0], 'up': [0, 1, 0], "
                             "'ortho_height': 1}, 'ambient': [1, 1, 1], 'lights': [], 'objects': "
                             "[{'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': "
                             "0.5, 'material': {'builtin': 'fur', 'size': [1, 1, 1]}}}]}"),
                STATUS_OK);
            tau = -log1p(-(double)result.pixels[3]);
            for (int c = 0; c < 3; c++)
                color[c] = (double)result.pixels[c] / (double)result.pixels[3];
            render_result_finish(&result);
        }
        for (int c = 0; c < 3; c++) {
            double expected = color[c] * -expm1(-2 * k[c] * tau) / 8;
            double found = pixel[1][c];
            double most = rows[r / 2].most[c];
            if (!(fabs(found - expected) < most * expected + 2e-6))
                fail_msg("%s, other %zu, channel %d: %.7g, expected %.7g", rows[r / 2].quality,
                         r % 2, c, found, expected);
        }
    }
}

/* RMSE over all pixels of a scene against its truth, which is drawn once. */
struct compared {
    struct truth truth;
    const char *json;
};

static void write_scene(char *out, size_t size, const char *json, const char *beside) {
    const char *at = strstr(json, "%s");
    assert_non_null(at);
    int length = snprintf(out, size, "%.*s%s%s", (int)(at - json), json, beside, at + 2);
    assert_true(length > 0 && (size_t)length < size);
}

static void open_truth(struct compared *compared, const char *json) {
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source source = {.open = support_no_asset};
    struct reference_request request = {.tolerance = 1e-4};
    char text[4096];
    compared->json = json;
    write_scene(text, sizeof text, json, "");
    support_quote(text);
    assert_int_equal(scene_read(text, strlen(text), &arena, &scene, &err), STATUS_OK);
    assert_int_equal(truth_render(&scene, &source, &request, &compared->truth, &err), STATUS_OK);
    arena_free(&arena);
}

static double rmse(const struct compared *compared, const char *beside) {
    char text[4096];
    struct render_result result;
    struct asset_source source = {.open = support_no_asset};
    write_scene(text, sizeof text, compared->json, beside);
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

#define VIEW                                                                                       \
    "{'image': {'width': 12, 'height': 12, 'samples': 1, 'background': [0, 0, 0, 1]}, 'camera': "  \
    "{'eye': [0, -4, 3], 'fov_y_deg': 50}, "
#define SUN "'lights': [{'direction': [1, 0.5, -1.3], 'shadow': true}], "
#define CLOUDS(beside)                                                                             \
    "{'shell': {'mesh': {'shape': 'sphere', 'divisions': [16, 8]}, 'thickness': 0.4, 'tiles': "    \
    "[4, 2], 'material': "                                                                         \
    "{'builtin': 'clouds', 'size': [8, 8, 4], 'extinction_color': [0.1, 0.4, 1]}}, 'quality': "    \
    "{'samples': 64}}" beside ", {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'transform': "       \
    "{'translate': [0, 0, -1.5]}}"
#define GLASS                                                                                      \
    ", {'shell': {'mesh': {'shape': 'torus', 'divisions': [24, 12]}, 'thickness': 0.2, "           \
    "'material': {'builtin': 'homogeneous', 'extinction': 2, 'color': [0.1, 0.2, 0.3], "           \
    "'extinction_color': [1, 0.5, 0.2]}}, 'transform': {'translate': [0, 0, -0.9], 'scale': 1.2}}"

/* Twice the texels, and more slices: less of an error. Bounds: one and a half of what was measured.
 */
static void test_error_falls_with_the_maps(void **state) {
    (void)state;
    static const struct {
        const char *name, *json;
        double most; /* with 512 texels */
    } rows[] = {
        {"one colour", VIEW SUN "'objects': [" CLOUDS("") "]%s}", 0.007},
        {"two colours", VIEW SUN "'objects': [" CLOUDS(GLASS) "]%s}", 0.011},
        {"two colours, a lamp among them",
         VIEW "'lights': [{'position': [0.4, -0.3, 0.2], 'color': [4, 4, 4], 'shadow': true}], "
              "'objects': [" CLOUDS(GLASS) "]%s}",
         0.0036},
    };
    static const int sizes[2][2] = {{64, 512}, {24, 192}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct compared compared;
        open_truth(&compared, rows[r].json);
        double found[2];
        bool lamp = r == 2; /* whose maps are six */
        for (int m = 0; m < 2; m++) {
            char maps[64];
            snprintf(maps, sizeof maps, ", 'shadow': {'size': %d, 'slices': %d}", sizes[lamp][m],
                     48);
            found[m] = rmse(&compared, maps);
        }
        print_message("%s: RMSE %.4f, %.4f with maps of %d, %d\n", rows[r].name, found[0], found[1],
                      sizes[lamp][0], sizes[lamp][1]);
        assert_true(found[1] < 0.2 * found[0] && found[1] < rows[r].most);
        truth_finish(&compared.truth);
    }
}

/* Three equal factors are one extinction, whatever keeps it. */
static void test_equal_factors(void **state) {
    (void)state;
    static const char *const colors[] = {"1, 1, 1", "0.5, 0.5, 0.5", "0.5, 0.5, 0.5"};
    float first[4 * 144] = {0};
    for (int i = 0; i < 3; i++) {
        struct render_result result;
        /* The last: beside a medium of so little that it is nothing but another colour. */
        assert_int_equal(
            support_draw(renderer, &result,
                         VIEW SUN
                         "'objects': [{'shell': {'mesh': {'shape': 'sphere'}, 'thickness': 0.4, "
                         "'material': {'builtin': 'homogeneous', 'extinction': %g, "
                         "'extinction_color': [%s]}}, 'quality': {'samples': 32}}, {'mesh': "
                         "{'shape': 'plane', 'size': [8, 8]}, 'transform': {'translate': [0, 0, "
                         "-1.5]}}%s]}",
                         i == 0 ? 1.0 : 2.0, colors[i],
                         i < 2 ? ""
                               : ", {'shell': {'mesh': {'shape': 'plane', 'size': [0.1, 0.1]}, "
                                 "'material': {'builtin': 'homogeneous', 'extinction': 1e-9}}}"),
            STATUS_OK);
        for (int p = 0; p < 4 * 144; p++) {
            if (i == 0)
                first[p] = result.pixels[p];
            assert_float_equal(result.pixels[p], first[p], 1e-5);
        }
        render_result_finish(&result);
    }
}

/* Layers of a texture are counted before a GL is asked for more than it need have. */
static void test_too_many_slices(void **state) {
    (void)state;
    static const double place[8][3] = {{1, 1, 1},  {1, 1, -1},  {1, -1, 1},  {1, -1, -1},
                                       {-1, 1, 1}, {-1, 1, -1}, {-1, -1, 1}, {-1, -1, -1}};
    char lights[1024] = "";
    for (int k = 0; k < 8; k++)
        snprintf(lights + strlen(lights), sizeof lights - strlen(lights),
                 "%s{'position': [%g, %g, %g], 'shadow': true}", k ? ", " : "", 0.1 * place[k][0],
                 0.1 * place[k][1], 0.1 * place[k][2]);
    for (int slices = 36; slices <= 96; slices += 60) {
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         VIEW
                         "'lights': [%s], 'shadow': {'size': 8, 'slices': %d}, 'objects': [" CLOUDS(
                             GLASS) "]}",
                         lights, slices),
            slices == 36 ? STATUS_OK : STATUS_TOO_COMPLEX);
        if (slices == 36)
            render_result_finish(&result);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slabs),
        cmocka_unit_test(test_own_shell),
        cmocka_unit_test(test_error_falls_with_the_maps),
        cmocka_unit_test(test_equal_factors),
        cmocka_unit_test(test_too_many_slices),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
