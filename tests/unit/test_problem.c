/* The error record and the problem document made of it. */
#include "tests/unit/scene_fixture.h"

#include "api/problem_write.h"

static void assert_written(const struct error *err, const char *id, const char *wanted) {
    char *text = problem_write(err, id);
    assert_string_equal(text, wanted);
    free(text);
}

static void documents(void **state) {
    (void)state;
    struct error err = {0};
    assert_written(&err, NULL,
                   "{\"type\":\"/problems/internal\",\"title\":\"a fault in Pelt\",\"status\":500,"
                   "\"retryable\":false,\"errors\":[]}");
    error_fault(&err, STATUS_QUEUE_FULL, NULL, "%d wait", 8);
    assert_written(&err, "abc",
                   "{\"type\":\"/problems/queue-full\",\"title\":\"the queue is full\",\"status\":"
                   "503,\"detail\":\"8 wait\",\"retryable\":true,\"request_id\":\"abc\",\"errors\":"
                   "[{\"detail\":\"8 wait\"}]}");
    error_clear(&err);
    error_fault(&err, STATUS_INVALID_SCENE, "/image/width", "first");
    error_fault(&err, STATUS_TOO_COMPLEX, "", "second \"quoted\"");
    assert_written(&err, NULL,
                   "{\"type\":\"/problems/invalid-scene\",\"title\":\"the scene breaks its "
                   "contract\",\"status\":422,\"detail\":\"/image/width: first (and 1 more)\","
                   "\"retryable\":false,\"errors\":[{\"pointer\":\"/image/width\",\"detail\":"
                   "\"first\"},{\"pointer\":\"\",\"detail\":\"second \\\"quoted\\\"\"}]}");
    error_clear(&err);
}

static void faults_past_the_limit_are_counted(void **state) {
    (void)state;
    struct error err = {0}, more = {0};
    for (int i = 0; i < ERROR_FAULTS_MAX - 1; i++)
        error_fault(&err, STATUS_BAD_ASSET, "/x", "fault %d", i);
    for (int i = 0; i < 5; i++)
        error_fault(&more, STATUS_INTERNAL, "/y", "other %d", i);
    error_move(&err, &more);
    assert_int_equal(more.fault_count, 0);
    assert_null(more.faults);
    assert_int_equal(err.status, STATUS_BAD_ASSET);
    assert_int_equal(err.fault_count, ERROR_FAULTS_MAX);
    assert_int_equal(err.faults_left_out, 4);
    assert_string_equal(err.faults[ERROR_FAULTS_MAX - 1].message, "other 0");
    char *text = problem_write(&err, NULL);
    assert_non_null(strstr(text, "\"errors_left_out\":4"));
    assert_non_null(strstr(text, "(and 259 more)"));
    free(text);
    error_clear(&err);
}

static void nobody_need_listen(void **state) {
    (void)state;
    struct error more = {0};
    assert_int_equal(error_fault(NULL, STATUS_NO_GL, "/x", "unheard"), STATUS_NO_GL);
    error_fault(&more, STATUS_INTERNAL, "", "moved nowhere");
    error_move(NULL, &more);
    assert_null(more.faults);
    error_clear(NULL);
}

static void slugs_lead_back(void **state) {
    (void)state;
    for (int i = 0; i < STATUS_COUNT; i++) {
        assert_int_equal(status_from_slug(status_slug((enum status)i)), i);
        assert_true(strlen(status_title((enum status)i)) > 0);
        assert_in_range(status_http((enum status)i), 200, 599);
        assert_in_range(status_exit_code((enum status)i), 0, 8);
    }
    assert_int_equal(status_from_slug("no such thing"), STATUS_INTERNAL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(documents),
        cmocka_unit_test(faults_past_the_limit_are_counted),
        cmocka_unit_test(nobody_need_listen),
        cmocka_unit_test(slugs_lead_back),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
