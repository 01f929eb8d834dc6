/* What the reference refuses is told from the scene alone, every pointer of it, and a reference of
 * such a scene is not made either. */
#include "tests/unit/scene_fixture.h"

#include "renderer/truth.h"

static enum status no_asset(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "there is no %s", name);
}

static void test_refusals(void **state) {
    (void)state;
    struct read read;
    struct error err = {0}, again = {0};
    struct truth truth;
    struct asset_source assets = {no_asset, NULL, NULL};
    struct reference_request request = {.threads = 1};
    read_text(&read,
              "{\"objects\": [{\"mesh\": {\"shape\": \"torus\"}}, {\"skeleton\": {\"builtin\": "
              "\"elm\"}}, {\"skeleton\": {\"builtin\": \"pine\"}}]}");
    assert_int_equal(read.status, STATUS_OK);
    assert_int_equal(truth_check(&read.scene, &err), STATUS_NOT_IMPLEMENTED);
    assert_int_equal(err.fault_count, 2);
    assert_fault(&err, "/objects/1/skeleton", "skeletons");
    assert_fault(&err, "/objects/2/skeleton", "skeletons");
    assert_int_equal(truth_render(&read.scene, &assets, &request, &truth, &again),
                     STATUS_NOT_IMPLEMENTED);
    assert_int_equal(again.fault_count, 2);
    error_clear(&err);
    error_clear(&again);
    read_finish(&read);
}

static void test_what_it_draws(void **state) {
    (void)state;
    struct read read;
    read_text(&read, LEAST(", \"lights\": [{\"shadow\": true}]"));
    assert_int_equal(read.status, STATUS_OK);
    assert_int_equal(truth_check(&read.scene, NULL), STATUS_OK);
    read_finish(&read);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_what_it_draws),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
