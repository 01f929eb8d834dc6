/* How a segment is sampled: rays that leap over what is empty see what others see, and nearer to
 * the truth with every step on; from voxel to voxel they find surfaces that others step over; what
 * a scene that does not leap leaves out; where leaping stands back, and is told of. */
#include <math.h>
#include <stdlib.h>

#include "renderer/error/metrics.h"
#include "renderer/force.h"
#include "renderer/truth.h"
#include "tests/unit/renderer_fixture.h"

enum { WIDTH = 48, PIXELS = WIDTH * WIDTH };

/* A plane: there tetrahedra are no approximation, and what differs from the truth is the sampling.
 * `eye` is low, so that rays pass many voxels; the reference draws every pixel. */
#define PLANE                                                                                      \
    "{'image': {'width': 48, 'height': 48}, 'camera': {'eye': [%g, -1.9, %g], 'target': [0, 0, "   \
    "0.1], 'fov_y_deg': 40}, 'lights': [{'direction': [1, 1, -2]}], 'objects': [{'shell': "        \
    "{'mesh': {'shape': 'plane', 'size': [2, 2], 'divisions': [3, 3]}, 'thickness': 0.2, "         \
    "'tiles': [%d, %d], 'material': {'builtin': '%s', 'size': [%d, %d, %d]}}, 'path': 'tetra', "   \
    "'quality': {'samples': %d, 'order': '%s', 'traversal': '%s'%s}}], 'report': {'error': '%s'}}"

struct look {
    double x, z; /* of the eye */
    int tiles[2];
    const char *material;
    int size[3], samples;
    const char *order, *traversal, *more;
};

static void draw(const struct look *look, const char *error, struct render_result *result) {
    assert_int_equal(support_draw(renderer, result, PLANE, look->x, look->z, look->tiles[0],
                                  look->tiles[1], look->material, look->size[0], look->size[1],
                                  look->size[2], look->samples, look->order, look->traversal,
                                  look->more ? look->more : "", error),
                     STATUS_OK);
}

/* The picture that no quality changes: drawn once for each material, by one eye each. */
static struct truth_of {
    const char *material;
    struct truth truth;
} truths[4];

static const struct truth *truth_of(const struct look *look) {
    struct truth_of *known = truths;
    while (known->material && strcmp(known->material, look->material) != 0)
        known++;
    assert_true(known < truths + sizeof truths / sizeof *truths);
    if (known->material)
        return &known->truth;
    char json[1024];
    int length = snprintf(json, sizeof json, PLANE, look->x, look->z, look->tiles[0],
                          look->tiles[1], look->material, look->size[0], look->size[1],
                          look->size[2], 1, "walk", "auto", "", "none");
    assert_true(length > 0 && length < (int)sizeof json);
    support_quote(json);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source assets = {.open = support_no_asset};
    struct reference_request request = {.tolerance = 1e-5};
    assert_int_equal(scene_read(json, strlen(json), &arena, &scene, &err), STATUS_OK);
    assert_int_equal(truth_render(&scene, &assets, &request, &known->truth, &err), STATUS_OK);
    arena_free(&arena);
    known->material = look->material;
    return &known->truth;
}

static double error_of(struct look look, const char *traversal, int samples) {
    const struct truth *truth = truth_of(&look);
    look.traversal = traversal;
    look.samples = samples;
    struct render_result result;
    draw(&look, "none", &result);
    struct error_metrics metrics;
    struct error err = {0};
    const double clear[4] = {0, 0, 0, 0};
    assert_int_equal(error_compare_pixels(result.pixels, truth->pixels, PIXELS, truth->touched,
                                          clear, &metrics, &err),
                     STATUS_OK);
    render_result_finish(&result);
    assert_true(metrics.touched.pixels > PIXELS / 4 && isfinite(metrics.touched.rmse));
    return metrics.touched.rmse;
}

static bool told(const struct report_pass *parts, size_t count, const char *name) {
    for (size_t i = 0; i < count; i++)
        if (strcmp(parts[i].name, name) == 0)
            return true;
    return false;
}

static bool warned(const struct render_result *result, const char *code) {
    for (size_t i = 0; i < result->report.warning_count; i++)
        if (strcmp(result->report.warnings[i].code, code) == 0)
            return true;
    return false;
}

static const char *const orders[] = {"walk", "sorted"};

/* Measured, walk and sorted alike, at 16, 64 and 256 steps of 16 layers:
 * adaptive 2.7e-2, 1.7e-3, 9.4e-5, dda 2.2e-2, 1.7e-3, 1.0e-4. */
static void media_tend_to_the_truth(void **state) {
    (void)state;
    static const char *const ways[] = {"adaptive", "dda"};
    for (int i = 0; i < 2; i++) {
        struct look look = {0.3, 0.7, {2, 3}, "clouds", {16, 16, 16}, 0, orders[i], NULL, NULL};
        for (int k = 0; k < 2; k++) {
            double coarse = error_of(look, ways[k], 16), middle = error_of(look, ways[k], 64);
            double fine = error_of(look, ways[k], 256);
            if (!(coarse < 0.05 && middle < coarse / 8 && fine < middle / 8))
                fail_msg("%s %s: %g %g %g", orders[i], ways[k], coarse, middle, fine);
        }
    }
}

static uint64_t fetches_of(struct look look, const char *traversal) {
    look.traversal = traversal;
    struct render_result result;
    struct error err = {0};
    assert_int_equal(renderer_count_fetches(renderer, true, &err), STATUS_OK);
    draw(&look, "none", &result);
    bool leaps = strcmp(traversal, "fixed") != 0;
    assert_int_equal(told(result.report.passes, result.report.pass_count, "leap"), leaps);
    assert_int_equal(told(result.report.left_out, result.report.left_out_count, "leap"), !leaps);
    render_result_finish(&result);
    uint64_t fetches = renderer_fetches(renderer);
    assert_int_equal(renderer_count_fetches(renderer, false, &err), STATUS_OK);
    return fetches;
}

/* Trees stand in wide gaps. Measured: 86,000 fetches in equal steps, those for leaping included
 * 49,000. */
static void empty_space_is_not_fetched(void **state) {
    (void)state;
    struct look look = {0.3, 0.7, {1, 1}, "trees", {64, 64, 32}, 32, "walk", NULL, NULL};
    uint64_t fixed = fetches_of(look, "fixed"), adaptive = fetches_of(look, "adaptive");
    print_message("fixed %llu, adaptive %llu\n", (unsigned long long)fixed,
                  (unsigned long long)adaptive);
    assert_true(10 * adaptive < 7 * fixed);
}

/* Measured: fixed 4.1e-2 at 16 steps, 1.6e-5 at 4,096; dda 4.9e-3, which is one of 9,216 rays, and
 * at 4 times as many pixels a side nearer than 4,096 steps; adaptive 5.5e-3 at 1,024. */
static void surfaces_are_found(void **state) {
    (void)state;
    for (int i = 0; i < 2; i++) {
        struct look look = {0.3, 0.5, {2, 3}, "chain", {32, 32, 16}, 0, orders[i], NULL, NULL};
        double fixed = error_of(look, "fixed", 16), adaptive = error_of(look, "adaptive", 1024);
        double dda = error_of(look, "dda", 1);
        if (!(dda < fixed / 6 && adaptive < fixed / 6))
            fail_msg("%s: fixed %g; dda %g; adaptive %g", orders[i], fixed, dda, adaptive);
        /* It is the same at any quality that its layers do not ask for anyway. */
        if (dda != error_of(look, "dda", 16))
            fail_msg("%s: dda depends on samples", orders[i]);
    }
}

/* What nobody asks for is a medium in equal steps, a solid from voxel to voxel. */
static void the_default_depends_on_what_is_there(void **state) {
    (void)state;
    struct look look = {0.3, 0.7, {2, 3}, "clouds", {8, 8, 8}, 8, "walk", "auto", NULL};
    struct render_result result;
    draw(&look, "none", &result);
    assert_int_equal(result.report.resolved.objects[0].quality.traversal, SCENE_TRAVERSAL_FIXED);
    render_result_finish(&result);
    look.material = "chain";
    draw(&look, "none", &result);
    assert_int_equal(result.report.resolved.objects[0].quality.traversal, SCENE_TRAVERSAL_DDA);
    render_result_finish(&result);
}

/* Sizes of one voxel, rays along a face, tiles whose voxels no step could pass one by one. */
static void extremes_end(void **state) {
    (void)state;
    static const int sizes[][3] = {{1, 1, 1}, {64, 1, 1}, {1, 1, 64}, {64, 64, 8}};
    static const char *const materials[] = {"clouds", "chain"};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (int m = 0; m < 2; m++)
            for (int k = 0; k < 2; k++)
                for (int tiles = 1; tiles <= 10000; tiles *= 10000) {
                    struct look look = {0,
                                        0.2,
                                        {tiles, 1},
                                        materials[m],
                                        {sizes[i][0], sizes[i][1], sizes[i][2]},
                                        16,
                                        orders[k],
                                        "dda",
                                        NULL};
                    struct render_result result;
                    draw(&look, "none", &result);
                    for (size_t p = 0; p < 4 * PIXELS; p++)
                        assert_true(isfinite(result.pixels[p]));
                    if (tiles > 1 && sizes[i][0] > 1)
                        assert_true(warned(&result, "voxels-skipped"));
                    render_result_finish(&result);
                }
}

/* A filter reads beyond the voxels, a joint walk takes its own steps: both are told of. */
static void leaping_stands_back(void **state) {
    (void)state;
    struct look look = {0.3, 9,      {400, 400}, "clouds",           {32, 32, 8},
                        8,   "walk", "dda",      ", 'filter': 'mip'"};
    struct render_result result;
    draw(&look, "none", &result);
    assert_true(told(result.report.passes, result.report.pass_count, "filter"));
    assert_true(told(result.report.left_out, result.report.left_out_count, "leap"));
    assert_true(warned(&result, "traversal-fixed"));
    render_result_finish(&result);
    assert_int_equal(
        support_draw(renderer, &result,
                     "{'image': {'width': 16, 'height': 16}, 'objects': ["
                     "{'shell': {'mesh': {'shape': 'sphere'}, 'material': {'builtin': 'clouds', "
                     "'size': [8, 8, 8]}}, 'quality': {'traversal': 'adaptive'}}, "
                     "{'shell': {'mesh': {'shape': 'sphere'}, 'material': {'builtin': 'fog', "
                     "'size': [8, 8, 8]}}, 'path': 'tetra'}]}"),
        STATUS_OK);
    assert_true(told(result.report.passes, result.report.pass_count, "overlap"));
    assert_true(warned(&result, "traversal-fixed"));
    render_result_finish(&result);
}

static int close_all(void **state) {
    for (size_t i = 0; i < sizeof truths / sizeof *truths; i++)
        if (truths[i].material)
            truth_finish(&truths[i].truth);
    return close_renderer(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(media_tend_to_the_truth),
        cmocka_unit_test(empty_space_is_not_fetched),
        cmocka_unit_test(surfaces_are_found),
        cmocka_unit_test(the_default_depends_on_what_is_there),
        cmocka_unit_test(extremes_end),
        cmocka_unit_test(leaping_stands_back),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_all);
}
