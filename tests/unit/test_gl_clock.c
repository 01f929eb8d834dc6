/* The clock check must tell a timer query that lies from one that does not, and the stages of a
 * request must leave no time out. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "renderer/gl/clock.h"
#include "tests/unit/gl_fixture.h"
#include <glad/gl.h>

/* Stamps of this file's making stand in for GL_TIMESTAMP, `scale` times the truth. */
enum { QUERIES = 4096 };
static double stamp_ms[QUERIES], scale;

static void GLAD_API_PTR stamp(GLuint query, GLenum target) {
    assert_int_equal(target, GL_TIMESTAMP);
    assert_true(query < QUERIES);
    glFinish();
    stamp_ms[query] = clock_now_ms();
}

static void GLAD_API_PTR read_stamp(GLuint query, GLenum what, GLuint64 *result) {
    assert_int_equal(what, GL_QUERY_RESULT);
    *result = (GLuint64)(stamp_ms[query] * 1e6 * scale);
}

static void test_the_query_is_taken_only_where_it_agrees(void **state) {
    (void)state;
    PFNGLQUERYCOUNTERPROC real_counter = glad_glQueryCounter;
    PFNGLGETQUERYOBJECTUI64VPROC real_result = glad_glGetQueryObjectui64v;
    glad_glQueryCounter = stamp;
    glad_glGetQueryObjectui64v = read_stamp;
    scale = 1;
    assert_int_equal(gl_clock_check(), REPORT_CLOCK_QUERY);
    scale = 0.5;
    assert_int_equal(gl_clock_check(), REPORT_CLOCK_FENCE);
    scale = 1.5;
    assert_int_equal(gl_clock_check(), REPORT_CLOCK_FENCE);
    scale = 0;
    assert_int_equal(gl_clock_check(), REPORT_CLOCK_FENCE);
    glad_glQueryCounter = real_counter;
    glad_glGetQueryObjectui64v = real_result;
}

static void test_llvmpipe_is_timed_by_fence(void **state) {
    const struct gl_info *info = gl_context_info(*state);
    if (!strstr(info->renderer, "llvmpipe"))
        skip();
    assert_int_equal(info->clock, REPORT_CLOCK_FENCE);
}

static void pause_ms(long ms) {
    struct timespec rest = {0, ms * 1000000};
    while (nanosleep(&rest, &rest) != 0)
        ;
}

static void test_stages_leave_no_time_out(void **state) {
    (void)state;
    double stage_ms[REPORT_STAGE_COUNT] = {0};
    stage_ms[REPORT_STAGE_draw] = 1000; /* times are added to what is there */
    struct stage_clock clock;
    stage_clock_start(&clock, stage_ms, REPORT_STAGE_assets);
    double start_ms = clock.since_ms;
    pause_ms(3);
    stage_clock_next(&clock, REPORT_STAGE_draw, false);
    pause_ms(5);
    stage_clock_next(&clock, REPORT_STAGE_readback, true);
    pause_ms(2);
    stage_clock_next(&clock, REPORT_STAGE_draw, false);
    pause_ms(4);
    stage_clock_stop(&clock, true);
    double sum = 0;
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        sum += stage_ms[i];
    assert_true(stage_ms[REPORT_STAGE_assets] >= 3);
    assert_true(stage_ms[REPORT_STAGE_draw] >= 1009);
    assert_true(stage_ms[REPORT_STAGE_readback] >= 2);
    assert_true(stage_ms[REPORT_STAGE_bake] == 0);
    assert_true(fabs(sum - 1000 - (clock.since_ms - start_ms)) < 1e-6);
    assert_int_equal(gl_check("stages", NULL), STATUS_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_query_is_taken_only_where_it_agrees),
        cmocka_unit_test(test_llvmpipe_is_timed_by_fence),
        cmocka_unit_test(test_stages_leave_no_time_out),
    };
    return cmocka_run_group_tests(tests, gl_fixture_open, gl_fixture_close);
}
