/* Filling a report: limits hold, texts are cut, stages are named. What is written is held to its
 * schema by tests/property/test_documents.py. */
#include "tests/unit/scene_fixture.h"

#include <jansson.h>

#include "api/report.h"

static void warnings_are_bounded(void **state) {
    (void)state;
    static struct report report;
    for (int i = 0; i < REPORT_WARNINGS_MAX + 7; i++)
        report_warn(&report, "code", "/objects/0", 3, 1, "number %d", i);
    assert_int_equal(report.warning_count, REPORT_WARNINGS_MAX);
    assert_int_equal(report.warnings_left_out, 7);
    assert_string_equal(report.warnings[2].message, "number 2");
    assert_int_equal(report.warnings[2].count, 3);
    assert_int_equal(report.warnings[2].first, 1);
}

static void long_texts_are_cut(void **state) {
    (void)state;
    static struct report report;
    char text[2000];
    memset(text, 'y', sizeof text - 1);
    text[sizeof text - 1] = 0;
    report_warn(&report, text, text, 1, 0, "%s", text);
    assert_int_equal(strlen(report.warnings[0].code), sizeof report.warnings[0].code - 1);
    assert_int_equal(strlen(report.warnings[0].pointer), sizeof report.warnings[0].pointer - 1);
    assert_int_equal(strlen(report.warnings[0].message), sizeof report.warnings[0].message - 1);
    report_pass(&report, text, text);
    report_left_out(&report, "shadow", NULL);
    assert_int_equal(strlen(report.passes[0].why), sizeof report.passes[0].why - 1);
    assert_string_equal(report.left_out[0].name, "shadow");
    assert_string_equal(report.left_out[0].why, "");
}

static void stages_have_their_names(void **state) {
    (void)state;
    assert_string_equal(report_stage_name(REPORT_STAGE_queue), "queue");
    assert_string_equal(report_stage_name(REPORT_STAGE_encode), "encode");
}

static void what_was_filled_in_is_written(void **state) {
    (void)state;
    static struct report report;
    struct read read;
    read_text(&read, LEAST(", \"ambient\": [0.1, 0.25, 0.7]"));
    report.resolved = read.scene;
    report.stage_ms[REPORT_STAGE_draw] = 12.5;
    report.total_ms = 20.25;
    report.cold = true;
    report.loaded_count = 1;
    snprintf(report.loaded[0], sizeof report.loaded[0], "OpenImageIO");
    report.work.tetrahedra = 6912;
    report_left_out(&report, "shadow", "no light casts a shadow");
    char *text = report_write(&report);
    assert_non_null(text);
    json_t *json = json_loads(text, 0, NULL);
    assert_non_null(json);
    double draw, total, ambient;
    const char *loaded, *pass, *clock, *version;
    int cold;
    json_int_t tetrahedra;
    assert_int_equal(
        json_unpack(json, "{s:{s:F, s:F}, s:b, s:s, s:{s:[s]}, s:{s:[{s:s}]}, s:{s:I}, s:{s:s}}",
                    "timing_ms", "draw", &draw, "total", &total, "cold", &cold, "clock", &clock,
                    "renderer", "loaded", &loaded, "plan", "left_out", "pass", &pass, "work",
                    "tetrahedra", &tetrahedra, "build", "version", &version),
        0);
    assert_true(draw == 12.5 && total == 20.25 && cold == 1 && tetrahedra == 6912);
    assert_string_equal(loaded, "OpenImageIO");
    assert_string_equal(pass, "shadow");
    assert_string_equal(clock, "fence");
    assert_string_equal(version, PELT_VERSION);
    assert_int_equal(json_unpack(json, "{s:{s:[F]}}", "resolved", "ambient", &ambient), 0);
    assert_true(ambient == 0.1);
    json_decref(json);
    free(text);
    read_finish(&read);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(warnings_are_bounded),
        cmocka_unit_test(long_texts_are_cut),
        cmocka_unit_test(stages_have_their_names),
        cmocka_unit_test(what_was_filled_in_is_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
