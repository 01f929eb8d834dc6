/* Three shells, each over the next one's end: no order of all cells is right. Sorted cells draw the
 * samples where it is not each in its own order (renderer/path/cycles.h), and so draw what the
 * joint walk draws: with nothing else there, before and behind something opaque, with colours of
 * extinction, and in blocks of samples, as an estimate draws them. */
#include <math.h>

#include "tests/unit/renderer_fixture.h"

#define SQUARE                                                                                     \
    ", {'mesh': {'shape': 'plane', 'size': [1.6, 1.6]}, 'color': [0.3, 0.6, 0.9], 'transform': "   \
    "{'rotate_deg': [25, 10, 0]}}"

#define MIST "'builtin': 'homogeneous', 'extinction': 12"

/* Three bars around a triangle. `image`: more of its members, and what follows it; `objects`: more
 * of them. */
static void draw(struct render_result *result, const char *order, const char *image,
                 const char *material, const char *objects) {
    char bars[3][512];
    static const char *const colors[3] = {"1, 0.1, 0.1", "0.1, 1, 0.1", "0.1, 0.1, 1"};
    for (int k = 0; k < 3; k++) {
        double angle = k * 2 * M_PI / 3;
        snprintf(bars[k], sizeof bars[k],
                 "{'shell': {'mesh': {'shape': 'plane', 'size': [2, 0.3], 'divisions': [1, 1]}, "
                 "'thickness': 0.1, 'material': {%s, "
                 "'color': [%s]}}, 'quality': {'order': '%s', 'samples': 64}, 'path': 'tetra', "
                 "'transform': "
                 "{'rotate_deg': [0, "
                 "%d, %d], 'translate': [%g, %g, 0]}}",
                 material, colors[k], order, -14, 120 * k, 0.4 * sin(angle), -0.4 * cos(angle));
    }
    assert_int_equal(
        support_draw(
            renderer, result,
            "{'image': {'width': 96, 'height': 96, 'samples': 4%s}, 'camera': {'eye': [0.2, "
            "0.1, 5], 'target': [0, 0, 0], 'up': [0, 1, 0]}, 'lights': [], 'objects': "
            "[%s, %s, %s%s]}",
            image, bars[0], bars[1], bars[2], objects),
        STATUS_OK);
}

static const struct report_pass *pass_of(const struct report *report, const char *name) {
    for (size_t i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].name, name) == 0)
            return &report->passes[i];
    return NULL;
}

static bool warned(const struct report *report, const char *code) {
    for (size_t i = 0; i < report->warning_count; i++)
        if (strcmp(report->warnings[i].code, code) == 0)
            return true;
    return false;
}

static void compare(const char *what, const char *image, const char *material,
                    const char *objects) {
    struct render_result sorted, walked;
    draw(&sorted, "sorted", image, material, objects);
    draw(&walked, "auto", image, material, objects);
    double most = 0;
    for (int i = 0; i < 4 * walked.width * walked.height; i++) {
        double off = fabs((double)sorted.pixels[i] - (double)walked.pixels[i]);
        most = off <= most ? most : off; /* no number is more than any */
    }
    print_message("%s: off by %.1e at most, %llu cycles\n", what, most,
                  (unsigned long long)sorted.report.work.cycles);
    assert_int_equal(sorted.report.work.cycles, 1);
    assert_non_null(pass_of(&sorted.report, "cycles"));
    assert_null(pass_of(&walked.report, "cycles"));
    assert_false(warned(&sorted.report, "cycles"));
    if (!(most < 1e-4)) /* by the order of centres 0.3 and more */
        fail_msg("%s: off by %.2e", what, most);
    render_result_finish(&sorted);
    render_result_finish(&walked);
}

static void test_as_walked(void **state) {
    (void)state;
    compare("alone", "", MIST, "");
    compare("a square through them", "", MIST, SQUARE);
    compare("coloured extinction", ", 'background': [0.2, 0.3, 0.4, 1]",
            MIST ", 'extinction_color': [1, 0.4, 0.2]", SQUARE);
}

/* The samples are drawn under whatever mask the picture has, and leave it as it was: an
 * estimate draws blocks of them once more. */
static void test_blocks(void **state) {
    (void)state;
    static const char *const objects[2] = {"", SQUARE};
    for (int i = 0; i < 2; i++) {
        struct render_result measured, walked;
        for (int way = 0; way < 2; way++)
            draw(way ? &walked : &measured, way ? "auto" : "sorted",
                 "}, 'report': {'error': 'estimate'", "'builtin': 'clouds', 'size': [8, 8, 4]",
                 objects[i]);
        const struct report_error *found = &measured.report.error, *other = &walked.report.error;
        assert_true(fabs(found->discretisation - other->discretisation) <
                    0.05 * other->discretisation);
        assert_int_equal(measured.report.work.cycles, 1);
        double most = 0;
        for (int k = 0; k < 4 * walked.width * walked.height; k++) {
            double off = fabs((double)measured.pixels[k] - (double)walked.pixels[k]);
            most = off <= most ? most : off;
        }
        if (!(most < 1e-4))
            fail_msg("off by %.2e", most);
        render_result_finish(&measured);
        render_result_finish(&walked);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_as_walked),
        cmocka_unit_test(test_blocks),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
