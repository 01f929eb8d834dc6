/* Slabs from the nearest on (renderer/path/onward.h), which end where nothing more can be seen,
 * against the same slabs from the farthest on: one picture, to rounding and to what is let through
 * no more. */
#include <math.h>

#include "renderer/force.h"
#include "tests/unit/renderer_fixture.h"

static void draw(struct render_result *result, uint32_t force, const char *scene) {
    renderer_force(renderer, force);
    assert_int_equal(support_draw(renderer, result, "%s", scene), STATUS_OK);
    renderer_force(renderer, 0);
}

/* Share of fragments that are drawn of those that all slabs have. What differs: sums of up to 512
 * terms in fp32, 3e-5 at the worst, measured 3e-6; and 1e-4 of what is behind an end, for few
 * slabs. */
static double compare(const char *what, const char *scene) {
    struct render_result onward, all;
    draw(&all, FORCE_FARTHEST_FIRST, scene);
    draw(&onward, FORCE_NEAREST_FIRST, scene);
    double most = 0, drawn = 0;
    for (int i = 0; i < 4 * all.width * all.height; i++) {
        double off = fabs((double)all.pixels[i] - (double)onward.pixels[i]);
        most = off <= most ? most : off; /* no number is more than any */
        drawn = fmax(drawn, fabs((double)all.pixels[i]));
    }
    double share =
        (double)onward.report.work.fragments / (double)fmax(1, (double)all.report.work.fragments);
    print_message("%s: off by %.1e at most, %.2f of the fragments\n", what, most, share);
    if (!(most < 3e-5 && drawn > 0.1 && share <= 1))
        fail_msg("%s: off by %.2e of %.2g, %.3f of the fragments", what, most, drawn, share);
    render_result_finish(&onward);
    render_result_finish(&all);
    return share;
}

#define SHELL(mesh, thickness, material, slices)                                                   \
    "{'shell': {'mesh': {" mesh "}, 'thickness': " thickness                                       \
    ", 'tiles': [12, 6], 'material': {" material "}}, 'quality': {'method': 'slabs', 'slices': "   \
    "" slices "}}"
#define SCENE(camera, objects)                                                                     \
    "{'image': {'width': 96, 'height': 96, 'samples': 1}, " camera "'objects': [" objects "]}"
#define TORUS "'shape': 'torus'"
#define ABOVE "'camera': {'eye': [0.2, -3, 2.2], 'target': [0, 0, 0]}, "
#define FUR   "'builtin': 'fur', 'size': [64, 64, 16]"
#define THIN  "'builtin': 'homogeneous', 'extinction': 1e-5, 'color': [1e5, 2e5, 3e5]"
#define THICK "'builtin': 'homogeneous', 'extinction': 1e4, 'color': [0.2, 0.4, 0.8]"

static void test_same_picture(void **state) {
    (void)state;
    assert_true(compare("fur", SCENE(ABOVE, SHELL(TORUS, "0.1", FUR, "400"))) < 0.8);
    assert_true(compare("in one wall", SCENE(ABOVE, SHELL(TORUS, "0.1", THICK, "400"))) < 0.8);
    compare("nothing to hide", SCENE(ABOVE, SHELL(TORUS, "0.1", THIN, "200")));
    compare("clouds", SCENE(ABOVE, SHELL(TORUS, "0.15", "'builtin': 'clouds'", "300")));
    compare("few slabs", SCENE(ABOVE, SHELL(TORUS, "0.1", FUR, "9")));
    compare("one", SCENE(ABOVE, SHELL(TORUS, "0.1", FUR, "1")));
    compare("folds", SCENE("", SHELL("'shape': 'teapot'", "0.1", FUR, "250")));
    compare("solid and medium", SCENE(ABOVE, SHELL(TORUS, "0.15", "'builtin': 'trees'", "200")));
    compare("from within", SCENE("'camera': {'eye': [1.42, 0, 0], 'target': [0, 0.4, 0]}, ",
                                 SHELL(TORUS, "0.15", FUR, "300")));
    compare("orthographic",
            SCENE("'camera': {'eye': [3, 1, 2], 'target': [0, 0, 0], 'ortho_height': 3}, ",
                  SHELL(TORUS, "0.1", FUR, "300")));
}

/* What lies within one another is mixed slab by slab, and the mirror of that mixes alike. */
static void test_several(void **state) {
    (void)state;
    compare("two shells in one place",
            SCENE(ABOVE, SHELL(TORUS, "0.2", FUR, "300") ", " SHELL(TORUS, "0.2",
                                                                    "'builtin': 'clouds'", "300")));
    compare("around and behind a mesh",
            SCENE(ABOVE, SHELL(TORUS, "0.2", FUR, "300") ", {'mesh': {'shape': 'sphere', "
                                                         "'radius': 0.8}}"));
}

/* Blocks of samples alone, as an error estimate draws them: its error must not change. */
static void test_blocks(void **state) {
    (void)state;
    struct render_result result;
    double rmse[2];
    for (int i = 0; i < 2; i++) {
        draw(&result, i ? FORCE_NEAREST_FIRST : FORCE_FARTHEST_FIRST,
             "{'image': {'width': 96, 'height': 96, 'samples': 1}, " ABOVE
             "'objects': [" SHELL(TORUS, "0.1", FUR, "300") "], 'report': {'error': 'estimate'}}");
        rmse[i] = result.report.error.discretisation;
        render_result_finish(&result);
    }
    print_message("estimates: %.6g, %.6g\n", rmse[0], rmse[1]);
    assert_true(rmse[0] > 0);
    if (!(fabs(rmse[1] / rmse[0] - 1) < 1e-3))
        fail_msg("estimates: %g and %g", rmse[0], rmse[1]);
}

/* It is done where it pays: fur hides what is behind it, clouds do not. More than a group's slabs
 * are summed up in groups, from the farthest on. */
static void test_where_it_pays(void **state) {
    (void)state;
    static const struct {
        const char *scene;
        bool less;
    } rows[] = {
        {SCENE(ABOVE, SHELL(TORUS, "0.1", FUR, "400")), true},
        {SCENE(ABOVE, SHELL(TORUS, "0.1", THICK, "400")), true},
        {SCENE(ABOVE, SHELL(TORUS, "0.15", "'builtin': 'clouds'", "400")), false},
        {SCENE(ABOVE, SHELL(TORUS, "0.1", FUR, "4000")), false},
        {SCENE(ABOVE, SHELL(TORUS, "0.1", FUR, "20")), false},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct render_result chosen, all;
        draw(&all, FORCE_FARTHEST_FIRST, rows[i].scene);
        draw(&chosen, 0, rows[i].scene);
        assert_int_equal(chosen.report.work.fragments < all.report.work.fragments, rows[i].less);
        render_result_finish(&chosen);
        render_result_finish(&all);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_picture),
        cmocka_unit_test(test_several),
        cmocka_unit_test(test_blocks),
        cmocka_unit_test(test_where_it_pays),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
