/* Point lights: Lambert under one against the closed form, at any scale; media and solids against
 * the reference; inside a shell; shadows far away; and that what is not drawn is refused. */
#include <math.h>
#include <stdlib.h>

#include "renderer/truth.h"
#include "tests/unit/renderer_fixture.h"

/* A plane under a light at the height h over its middle: L h / d^3, and L h / (d r^2) within the
 * light's radius; under it nothing. */
static void test_plane(void **state) {
    (void)state;
    static const double scales[] = {1e-6, 1, 1e6};
    for (size_t n = 0; n < 3; n++)
        for (int near = 0; near < 3; near++) {
            double s = scales[n], h = (near == 2 ? -0.5 : 0.5) * s,
                   radius = near == 1 ? 2 * s : 0.01 * s;
            struct render_result result;
            assert_int_equal(
                support_draw(
                    renderer, &result,
                    "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': {'eye': "
                    "[0, 0, %.17g], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': "
                    "%.17g}, 'ambient': [0, 0, 0], 'lights': [{'position': [0, 0, %.17g], "
                    "'radius': %.17g, 'color': [%.17g, 0, 0]}], 'objects': [{'mesh': "
                    "{'shape': 'plane', 'size': [3, 3]}, 'color': [1, 1, 1], 'transform': "
                    "{'scale': %.17g}}]}",
                    9 * s, 2 * s, h, radius, fmin(1e6, s * s), s),
                STATUS_OK);
            double color = fmin(1e6, s * s);
            for (int y = 0; y < 16; y++)
                for (int x = 0; x < 16; x++) {
                    double px = ((x + 0.5) / 8 - 1) * s, py = (1 - (y + 0.5) / 8) * s;
                    double d = sqrt(px * px + py * py + h * h), least = fmax(d, radius);
                    double expected = fmax(0, color * h / d / least / least);
                    double found = (double)support_pixel(&result, x, y)[0];
                    assert_true(fabs(found - expected) <= 2e-6 * expected);
                }
            render_result_finish(&result);
        }
}

/* RMSE against the reference: lights beside and inside a shell, with a directional one that throws
 * shadows, and shells that are walked together. */
static void test_against_the_reference(void **state) {
    (void)state;
#define LIGHT "'lights': [{'position': [0.4, -1.1, 0.7], 'color': [0.6, 0.5, 0.4], 'radius': 0.1}"
#define FUR(quality)                                                                               \
    "{'shell': {'mesh': {'shape': 'sphere', 'divisions': [12, 6]}, 'thickness': 0.4, 'tiles': "    \
    "[3, "                                                                                         \
    "2], 'material': {'builtin': 'clouds', 'size': [8, 8, 4]}}, 'quality': {" quality "}}"
#define VIEW                                                                                       \
    "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': {'eye': [0, -4, 1], "          \
    "'fov_y_deg': 40}, "
    static const struct {
        const char *json;
        double most;
    } rows[] = {
        {VIEW LIGHT "], 'objects': [" FUR("'samples': 64, 'order': 'walk'") "]}", 2e-3},
        {VIEW LIGHT "], 'objects': [" FUR("'samples': 64, 'order': 'sorted'") "]}", 2e-3},
        {VIEW LIGHT "], 'objects': [" FUR("'slices': 400") "]}", 5e-3},
        {VIEW LIGHT
         ", {'direction': [1, 1, -1], 'shadow': true}], 'shadow': {'size': 512, 'slices': 48}, "
         "'objects': [" FUR(
             "'samples': 64") ", {'mesh': {'shape': 'plane', 'size': [5, 5]}, 'transform': "
                              "{'translate': [0, 0, -1.4]}}]}",
         2e-2},
        {VIEW LIGHT "], 'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [2, 2]}, "
                    "'thickness': 0.4, 'tiles': [1, 1], 'material': {'builtin': 'chain', 'size': "
                    "[24, 24, 8], 'specular': 0.5}}, 'quality': {'samples': 256}}]}",
         2e-2},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        char text[4096];
        struct arena arena = {0};
        struct scene scene;
        struct error err = {0};
        struct truth truth;
        struct render_result result;
        struct asset_source source = {.open = support_no_asset};
        struct reference_request request = {.tolerance = 1e-5};
        snprintf(text, sizeof text, "%s", rows[r].json);
        support_quote(text);
        assert_int_equal(scene_read(text, strlen(text), &arena, &scene, &err), STATUS_OK);
        assert_int_equal(truth_render(&scene, &source, &request, &truth, &err), STATUS_OK);
        assert_int_equal(renderer_render(renderer, &scene, &source, &result, &err), STATUS_OK);
        double sum = 0;
        for (int i = 0; i < 4 * 256; i++)
            sum += pow((double)result.pixels[i] - (double)truth.pixels[i], 2);
        double off = sqrt(sum / 1024);
        print_message("scene %zu: RMSE %.2e\n", r, off);
        assert_true(off < rows[r].most);
        render_result_finish(&result);
        truth_finish(&truth);
        arena_free(&arena);
    }
}

/* A light within a homogeneous slab [0, 1] at the height 0.4, over the ground at -1, of which a
 * square at -0.5 hides one half: L h / d^3 exp(-sigma 0.4 d / h). Only what lies below the light
 * dims it. */
static void test_shadow(void **state) {
    (void)state;
    static const char *const paths[] = {"tetra", "slicing"};
    for (int k = 0; k < 2; k++) {
        struct render_result result;
        assert_int_equal(
            support_draw(
                renderer, &result,
                "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'camera': {'eye': "
                "[0, 0, -0.6], 'target': [0, 0, -1], 'up': [0, 1, 0], 'fov_y_deg': 80}, "
                "'ambient': [0, 0, 0], 'lights': [{'position': [-0.13, 0.2, 0.4], 'color': [1, "
                "0, 0], 'shadow': true}], 'objects': [{'mesh': {'shape': 'plane', "
                "'size': [8, 8]}, 'color': [1, 1, 1], 'transform': {'translate': [0, 0, "
                "-1]}}, {'mesh': {'shape': 'plane', 'size': [2, 2]}, 'transform': "
                "{'translate': [1, 0, -0.5]}}, {'shell': {'mesh': {'shape': 'plane', "
                "'size': [8, 8]}, 'thickness': 1, 'material': {'builtin': "
                "'homogeneous', 'extinction': 3}}, 'path': '%s'}]}",
                paths[k]),
            STATUS_OK);
        for (int y = 0; y < 8; y++)
            for (int x = 0; x < 8; x++) {
                double reach = 0.4 * tan(40 * M_PI / 180), h = 1.4;
                double px = ((x + 0.5) / 4 - 1) * reach + 0.13,
                       py = (1 - (y + 0.5) / 4) * reach - 0.2;
                double d = sqrt(px * px + py * py + h * h);
                double expected = px > 0.13 * h / 0.9 ? 0 : h / (d * d * d) * exp(-3 * 0.4 * d / h);
                assert_float_equal(support_pixel(&result, x, y)[0], expected,
                                   1e-6 + 1e-3 * expected);
            }
        render_result_finish(&result);
    }
}

/* Lights at many places in one cell or another of a slab: what lies behind them, seen from what
 * they light, takes nothing. Media of a closed form and of voxels; what of the slab's own light is
 * seen is that of its constant voxels. */
static void test_within_its_caster(void **state) {
    (void)state;
    static const double places[][3] = {
        {1.3, -0.7, 0.5}, {-0.7, 1.3, 0.5}, {-2, 0.4, 0.2}, {0.4, -2, 0.8}, {0.3, 0.2, 0.5}};
    static const char *const materials[] = {
        "'builtin': 'homogeneous', 'extinction': 3",
        "'builtin': 'fur', 'size': [4, 4, 2], 'growth': 0, 'absorption': 3"};
    static const char *const paths[] = {"tetra", "slicing"};
    double worst = 0;
    for (size_t n = 0; n < 4 * sizeof places / sizeof *places; n++) {
        const double *at = places[n / 4];
        struct render_result result;
        assert_int_equal(
            support_draw(
                renderer, &result,
                "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'camera': {'eye': [%g, %g, "
                "-0.6], 'target': [%g, %g, -1], 'up': [0, 1, 0], 'fov_y_deg': 80}, 'ambient': [0, "
                "0, 0], 'lights': [{'position': [%g, %g, %g], 'color': [1, 0, 0], 'shadow': "
                "true}], 'objects': [{'mesh': {'shape': 'plane', 'size': [8, 8]}, 'color': [1, 1, "
                "1], 'transform': {'translate': [0, 0, -1]}}, {'shell': {'mesh': {'shape': "
                "'plane', 'size': [8, 8]}, 'thickness': 1, 'material': {%s}}, 'path': '%s'}]}",
                at[0], at[1], at[0], at[1], at[0], at[1], at[2], materials[n % 2],
                paths[n / 2 % 2]),
            STATUS_OK);
        for (int y = 0; y < 8; y++)
            for (int x = 0; x < 8; x++) {
                double reach = 0.4 * tan(40 * M_PI / 180), h = 1 + at[2];
                double px = ((x + 0.5) / 4 - 1) * reach, py = (1 - (y + 0.5) / 4) * reach;
                double d = sqrt(px * px + py * py + h * h);
                double expected = h / (d * d * d) * exp(-3 * at[2] * d / h);
                double off = fabs((double)support_pixel(&result, x, y)[0] / expected - 1);
                worst = fmax(worst, off);
                if (!(off < 1e-3))
                    fail_msg("light %zu, %s, %s: off by %.2e of it", n / 4, materials[n % 2],
                             paths[n / 2 % 2], off);
            }
        render_result_finish(&result);
    }
    print_message("off by %.1e at most\n", worst);
}

/* From further and further away the picture is that of a light with a direction. */
static void test_far_away(void **state) {
    (void)state;
    static const double toward[][3] = {{-1, -0.5, 1.3}, {-1, -1, 1}};
    for (size_t k = 0; k < 2; k++) {
        struct render_result results[4];
        double length = 0, off[4];
        for (int i = 0; i < 3; i++)
            length += toward[k][i] * toward[k][i];
        length = sqrt(length);
        for (int r = 0; r < 4; r++) {
            char light[256];
            double d = pow(1000, r); /* r = 0: with a direction */
            if (r == 0)
                snprintf(light, sizeof light, "'direction': [%.17g, %.17g, %.17g]", -toward[k][0],
                         -toward[k][1], -toward[k][2]);
            else /* a light of radius r gives what it gives there wherever it is nearer */
                snprintf(light, sizeof light, "'position': [%.17g, %.17g, %.17g]",
                         d * toward[k][0] / length, d * toward[k][1] / length,
                         d * toward[k][2] / length);
            double color = r == 0 ? 1 : fmin(1e6, d * d);
            assert_int_equal(
                support_draw(renderer, &results[r],
                             "{'image': {'width': 32, 'height': 32, 'samples': 1}, 'camera': "
                             "{'eye': [0.5, -4, 3], 'fov_y_deg': 50}, 'ambient': [0, 0, 0], "
                             "'lights': [{%s, 'color': [%.17g, 0, 0], 'shadow': true}], 'shadow': "
                             "{'size': 512, 'slices': 24}, 'objects': [{'shell': {'mesh': "
                             "{'shape': 'sphere', 'divisions': [12, 6]}, 'thickness': 0.4, "
                             "'tiles': [3, 2], 'base': {}, 'material': {'builtin': 'clouds', "
                             "'size': [8, 8, 4]}}, 'quality': {'samples': 32}}, {'mesh': "
                             "{'shape': 'plane', 'size': [6, 6]}, 'transform': {'translate': [0, "
                             "0, -1.5]}}]}",
                             light, color),
                STATUS_OK);
            double sum = 0, scale = r == 0 ? 1 : d * d / color;
            for (size_t i = 0; i < (size_t)32 * 32; i++)
                sum += pow(
                    (double)results[r].pixels[4 * i] * scale - (double)results[0].pixels[4 * i], 2);
            off[r] = sqrt(sum / 1024);
        }
        print_message("light %zu, at 1e3, 1e6, 1e9: %.1e, %.1e, %.1e from one with a direction\n",
                      k, off[1], off[2], off[3]);
        assert_true(off[1] < 1e-2 && off[2] < 1e-2 && off[3] < 1e-2);
        for (int r = 0; r < 4; r++)
            render_result_finish(&results[r]);
    }
}

static enum status status_of(const char *lights, const char *shadow, char pointer[64]) {
    char json[2048];
    snprintf(json, sizeof json,
             "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'lights': [%s], 'shadow': {%s}, "
             "'objects': [{'shell': {'mesh': {'shape': 'sphere'}, 'material': {'builtin': 'fur', "
             "'size': [4, 4, 4]}}}]}",
             lights, shadow);
    support_quote(json);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source source = {.open = support_no_asset};
    struct render_result result;
    assert_int_equal(scene_read(json, strlen(json), &arena, &scene, &err), STATUS_OK);
    enum status status = renderer_render(renderer, &scene, &source, &result, &err);
    snprintf(pointer, 64, "%s", err.fault_count ? err.faults[0].pointer : "");
    if (status == STATUS_OK)
        render_result_finish(&result);
    error_clear(&err);
    arena_free(&arena);
    return status;
}

/* Six views take six times the memory; and a light at a corner of cells is told of. */
static void test_refusal(void **state) {
    (void)state;
    char pointer[64];
    static const char inside[] = "{'position': [0.1, 0.2, 0.3], 'shadow': true}";
    static const char beside[] = "{'position': [0.1, 0.2, 9], 'shadow': true}";
    assert_int_equal(status_of(beside, "'size': 1024", pointer), STATUS_OK);
    assert_int_equal(status_of(inside, "'size': 1024", pointer), STATUS_TOO_COMPLEX);
    assert_string_equal(pointer, "/shadow/size");
    assert_int_equal(status_of(inside, "", pointer), STATUS_OK);
    assert_int_equal(status_of("{}, {'position': [0, 0, 1], 'shadow': true}", "", pointer),
                     STATUS_NOT_IMPLEMENTED);
    assert_string_equal(pointer, "/lights/1/position");
    assert_int_equal(status_of("{'position': [0, 0, 1.00001], 'shadow': true}", "", pointer),
                     STATUS_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plane),
        cmocka_unit_test(test_against_the_reference),
        cmocka_unit_test(test_shadow),
        cmocka_unit_test(test_far_away),
        cmocka_unit_test(test_within_its_caster),
        cmocka_unit_test(test_refusal),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
