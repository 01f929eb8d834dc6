/* scene_write(): what is written reads back equal, to the last bit; and the assets of a scene. */
#include "tests/unit/scene_fixture.h"

#include <float.h>

/* Reads, writes, reads the writing, and writes that again. */
static void assert_round_trip(const char *json) {
    struct read first, second;
    read_text(&first, json);
    assert_int_equal(first.status, STATUS_OK);
    char *once = scene_write(&first.scene);
    assert_non_null(once);
    read_text(&second, once);
    if (second.status != STATUS_OK)
        fail_msg("%s: %s\n%s", second.err.faults[0].pointer, second.err.faults[0].message, once);
    char *twice = scene_write(&second.scene);
    assert_string_equal(once, twice);
    free(once);
    free(twice);
    read_finish(&first);
    read_finish(&second);
}

static void every_kind_of_scene(void **state) {
    (void)state;
    assert_round_trip(LEAST(""));
    assert_round_trip(LEAST(", \"camera\": {\"eye\": [0, 1, 2], \"ortho_height\": 3}"));
    assert_round_trip(LEAST(", \"camera\": {\"eye\": [0, 1, 2]}, \"lights\": []"));
    assert_round_trip(LEAST(", \"target\": {\"deadline_ms\": 5}, \"report\": {\"error\": "
                            "\"reference\"}"));
    assert_round_trip("{\"objects\": [{\"mesh\": {\"shape\": \"terrain\", \"seed\": "
                      "4294967295}, \"color\": [1, 0, 0.3], \"path\": \"gdm\", \"quality\": "
                      "{\"rank\": 7}}, {\"skeleton\": {\"asset\": \"s\", \"relief\": "
                      "{\"geometry\": {\"shape\": \"torus\"}}}}]}");
    assert_round_trip("{\"objects\": [{\"skeleton\": {\"joints\": [{\"position\": [1, 2, 3], "
                      "\"radius\": 1}, {\"position\": [1, 2, 4], \"radius\": 0}], \"segments\": "
                      "[[1, 0]], \"tiles\": [2, 3]}}]}");
    assert_round_trip(SHELL_SCENE("{\"asset\": \"\\\"q\\u00e9\\u20ac.glb\"}",
                                  "{\"volume\": \"v.vdb\", \"size\": [4, 5, 6]}", ""));
}

/* Doubles with no short decimal form, and the smallest ones. */
static void numbers_to_the_last_bit(void **state) {
    (void)state;
    static const double numbers[] = {0.1,
                                     1.0 / 3,
                                     2.2250738585072011e-308,
                                     4.9e-324,
                                     1e12,
                                     -0.0,
                                     123456789.123456789,
                                     DBL_EPSILON,
                                     5e-324,
                                     0.30000000000000004,
                                     1 - DBL_EPSILON / 2};
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        struct read first, second;
        char text[512];
        snprintf(text, sizeof text, LEAST(", \"camera\": {\"eye\": [%.17g, 5, 6]}"), numbers[i]);
        read_text(&first, text);
        assert_int_equal(first.status, STATUS_OK);
        char *written = scene_write(&first.scene);
        assert_non_null(written);
        read_text(&second, written);
        assert_int_equal(second.status, STATUS_OK);
        assert_memory_equal(&second.scene.camera.eye[0], &numbers[i], sizeof(double));
        free(written);
        read_finish(&first);
        read_finish(&second);
    }
}

/* Composed matrices come back as they are, not composed again. */
static void transforms_to_the_last_bit(void **state) {
    (void)state;
    struct read first, second;
    read_text(&first,
              "{\"objects\": [{\"mesh\": {\"shape\": \"plane\"}, \"transform\": "
              "{\"translate\": [0.1, 0.2, 0.3], \"rotate_deg\": [11, 22.5, -33], \"scale\": "
              "[1e-6, 1e6, -3]}}]}");
    assert_int_equal(first.status, STATUS_OK);
    char *written = scene_write(&first.scene);
    read_text(&second, written);
    assert_int_equal(second.status, STATUS_OK);
    assert_memory_equal(first.scene.objects[0].transform, second.scene.objects[0].transform,
                        sizeof first.scene.objects[0].transform);
    free(written);
    read_finish(&first);
    read_finish(&second);
}

/* As the renderer leaves it in a report: the frame that it chose is written, and read as given. */
static void a_framed_camera_is_given(void **state) {
    (void)state;
    struct read first, second;
    read_text(&first, LEAST(""));
    first.scene.camera.given = true;
    first.scene.camera.eye[1] = -3;
    char *written = scene_write(&first.scene);
    read_text(&second, written);
    assert_int_equal(second.status, STATUS_OK);
    assert_true(second.scene.camera.given);
    assert_true(second.scene.camera.eye[1] == -3);
    assert_true(second.scene.camera.fov_y_deg == 40);
    free(written);
    read_finish(&first);
    read_finish(&second);
}

struct seen {
    size_t count;
    char text[8][128];
};

static void see(void *user, const char *name, const char *pointer) {
    struct seen *seen = user;
    assert_true(seen->count < 8);
    snprintf(seen->text[seen->count++], sizeof seen->text[0], "%s at %s", name, pointer);
}

static void assets_with_their_pointers(void **state) {
    (void)state;
    struct read read;
    read_text(
        &read,
        "{\"objects\": [{\"shell\": {\"mesh\": {\"asset\": \"a\"}, \"material\": {\"height\": "
        "\"h\", \"color\": \"a\"}}}, {\"mesh\": {\"shape\": \"plane\"}}, "
        "{\"shell\": {\"mesh\": {\"shape\": \"plane\"}, \"material\": {\"geometry\": "
        "{\"asset\": \"g\"}}}}, {\"skeleton\": {\"asset\": \"s\", \"relief\": {\"volume\": "
        "\"v\"}}}]}");
    assert_int_equal(read.status, STATUS_OK);
    struct seen seen = {0};
    scene_visit_assets(&read.scene, see, &seen);
    static const char *const wanted[] = {
        "a at /objects/0/shell/mesh/asset",     "h at /objects/0/shell/material/height",
        "a at /objects/0/shell/material/color", "g at /objects/2/shell/material/geometry/asset",
        "s at /objects/3/skeleton/asset",       "v at /objects/3/skeleton/relief/volume",
    };
    assert_int_equal(seen.count, sizeof wanted / sizeof *wanted);
    for (size_t i = 0; i < seen.count; i++)
        assert_string_equal(seen.text[i], wanted[i]);
    read_finish(&read);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_scene),        cmocka_unit_test(numbers_to_the_last_bit),
        cmocka_unit_test(transforms_to_the_last_bit), cmocka_unit_test(a_framed_camera_is_given),
        cmocka_unit_test(assets_with_their_pointers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
