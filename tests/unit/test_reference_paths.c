/* The tetra path and the reference share no code, and meet: on a plane, where tetrahedra are no
 * approximation, with many samples; and elsewhere the more closely the finer the mesh. */
#include <math.h>

#include "renderer/error/metrics.h"
#include "tests/reference_fixture.h"
#include "tests/unit/asset_files.h"
#include "tests/unit/renderer_fixture.h"

#define SCENE                                                                                      \
    "{'image': {'width': 40, 'height': 40, 'samples': 1}, 'camera': {'eye': [0.7, -2.8, 2.1], "    \
    "'target': [0, 0, 0.1], 'fov_y_deg': %d}, 'lights': [{'direction': [-1, 1, -2], 'color': [3, " \
    "2, 1]}, {'direction': [1, 0.2, -0.3], 'color': [0.2, 0.5, 1]}], 'ambient': [0.1, 0.2, 0.1], " \
    "'objects': [{'shell': {'mesh': {%s}, 'thickness': 0.2, 'tiles': [3, 2], %s 'material': "      \
    "{%s}}, 'quality': {'samples': %d%s}%s}]}"

static double rmse_of(int fov_y_deg, const char *mesh, const char *base, const char *material,
                      int samples, const char *quality, const char *rest) {
    struct truth_fixture truth;
    struct render_result drawn;
    struct error_metrics metrics;
    struct error err = {0};
    char json[2048];
    int open = 0;
    int length =
        snprintf(json, sizeof json, SCENE, fov_y_deg, mesh, base, material, samples, quality, rest);
    assert_true(length > 0 && (size_t)length < sizeof json);
    struct asset_source files = {files_open, files_close, &open};
    assert_int_equal(truth_open_json(&truth, files, json), STATUS_OK);
    truth_draw(&truth, 0, 0);
    assert_int_equal(renderer_render(renderer, &truth.scene, &truth.assets, &drawn, &err),
                     STATUS_OK);
    float *pixels = malloc(truth.result.count * 4 * sizeof *pixels);
    assert_non_null(pixels);
    for (size_t p = 0; p < 4 * truth.result.count; p++)
        pixels[p] = (float)truth.result.pixels[p / 4][p % 4];
    assert_int_equal(error_compare(drawn.pixels, pixels, drawn.width, drawn.height,
                                   truth.result.touched, truth.scene.image.background, NULL,
                                   &metrics, &err),
                     STATUS_OK);
    assert_true(metrics.touched.pixels > 300);
    free(pixels);
    render_result_finish(&drawn);
    truth_close(&truth);
    return metrics.touched.rmse;
}

static void test_meets_on_a_plane(void **state) {
    (void)state;
    static const char mesh[] = "'shape': 'plane', 'divisions': [3, 3]";
    static const char base[] = "'base': {'color': [0.3, 0.2, 0.1]},";
    static const char turned[] =
        ", 'transform': {'scale': [-1, 0.7, 1.6], 'rotate_deg': [10, 20, 30]}";
    static const struct {
        const char *base, *material, *rest;
        double most; /* some three times what was measured */
    } cases[] = {
        {"", "'builtin': 'homogeneous', 'extinction': 3", "", 6e-7},
        {"", "'builtin': 'clouds', 'size': [32, 32, 16], 'lit': false", "", 3e-6},
        {base, "'builtin': 'clouds', 'size': [32, 32, 16], 'specular': 0.5", "", 1e-4},
        {base, "'builtin': 'clouds', 'size': [32, 32, 16], 'specular': 0.5", turned, 1e-4},
        {base, "'builtin': 'fur', 'size': [32, 32, 16]", "", 3e-5},
        {base, "'builtin': 'fog', 'size': [32, 32, 16]", "", 3e-5},
        {base, "'geometry': {'shape': 'torus', 'tube': 0.3}, 'size': [32, 32, 16]", "", 1e-4},
        {base, "'volume': 'api/examples/assets/smoke.vdb', 'size': [32, 32, 16]", "", 1e-4},
        {base, "'builtin': 'trees', 'size': [32, 32, 16]", "", 1e-4},
        {base, "'builtin': 'chain', 'size': [32, 32, 16]", "", 1e-4},
        {base, "'builtin': 'weave', 'size': [32, 32, 16]", "", 1e-4},
        {base, "'builtin': 'rocks', 'size': [32, 32, 16]", "", 1e-4},
        {base, "'builtin': 'grate', 'size': [32, 32, 16]", "", 1e-4},
        {base, "'builtin': 'scales', 'size': [32, 32, 16]", "", 1e-4},
        {base, "'builtin': 'bark', 'size': [32, 32, 16]", "", 1e-4},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        double rmse = rmse_of(35, mesh, cases[k].base, cases[k].material, 1024, "", cases[k].rest);
        print_message("%s%s: rmse %.1e\n", cases[k].material, cases[k].rest, rmse);
        if (!(rmse <= cases[k].most))
            fail_msg("%s: rmse %.2e", cases[k].material, rmse);
    }
}

/* P is bilinear in each side, its tetrahedra linear: they part by up to h |n_i - n_j| / 4, which
 * falls as the edge. By the affine map first order, then; measured 0.9 to 1.0. By the prisms' own,
 * to whose sides rays go, nothing is left but rounding: measured 2.7e-6 at the most. */
static void test_model_error_falls(void **state) {
    (void)state;
    static const char *const maps[] = {"affine", "exact"};
    for (int m = 0; m < 2; m++) {
        double before = 0;
        for (int n = 16; n <= 64; n *= 2) {
            char mesh[80], quality[64];
            snprintf(mesh, sizeof mesh, "'shape': 'torus', 'divisions': [%d, %d]", n, n / 2);
            snprintf(quality, sizeof quality, ", 'map': '%s'", maps[m]);
            double rmse =
                rmse_of(45, mesh, "", "'builtin': 'clouds', 'size': [16, 16, 8], 'lit': false", 256,
                        quality, "");
            double order = log2(before / rmse);
            print_message("%s, %d divisions: rmse %.2e\n", maps[m], n, rmse);
            bool fine = m == 1 ? rmse < 1e-5 : n == 16 || order > 0.6;
            if (!fine)
                fail_msg("%s, %d divisions: order %.2f, rmse %.2e after %.2e", maps[m], n, order,
                         rmse, before);
            before = rmse;
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_meets_on_a_plane),
        cmocka_unit_test(test_model_error_falls),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
