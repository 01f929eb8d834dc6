/* The facade of the reference: pixels asked for one by one are those of the whole picture, and what
 * fails leaves nothing behind. */
#include "renderer/truth.h"

#include "tests/support.h"

static const char scene_text[] =
    "{'image': {'width': 24, 'height': 18},"
    " 'objects': [{'shell': {'mesh': {'shape': 'sphere', 'divisions': [8, 6]},"
    " 'material': {'builtin': 'fur', 'size': [16, 16, 8]}}}]}";

struct fixture {
    struct arena arena;
    struct scene scene;
    struct asset_source assets;
};

static int open_scene(void **state) {
    static struct fixture fixture;
    struct error err = {0};
    char text[sizeof scene_text];
    memcpy(text, scene_text, sizeof text);
    support_quote(text);
    fixture = (struct fixture){.assets.open = support_no_asset};
    assert_int_equal(scene_read(text, strlen(text), &fixture.arena, &fixture.scene, &err),
                     STATUS_OK);
    *state = &fixture;
    return 0;
}

static int close_scene(void **state) {
    struct fixture *fixture = *state;
    arena_free(&fixture->arena);
    return 0;
}

static void pixels_are_those_of_the_whole(void **state) {
    const struct fixture *fixture = *state;
    struct error err = {0};
    struct truth whole, some;
    struct truth_source *source;
    const uint32_t pixels[] = {431, 0, 221, 204, 221};
    assert_int_equal(truth_render(&fixture->scene, &fixture->assets,
                                  &(struct reference_request){.threads = 2}, &whole, &err),
                     STATUS_OK);
    assert_int_equal(whole.count, 24 * 18);
    assert_int_equal(truth_create(&fixture->scene, &fixture->assets, &source, &err), STATUS_OK);
    assert_memory_equal(truth_camera(source)->eye, whole.camera.eye, sizeof whole.camera.eye);
    struct reference_request request = {.pixels = pixels, .pixel_count = 5, .threads = 1};
    size_t drawn_on = 0;
    for (int round = 0; round < 2; round++) {
        assert_int_equal(truth_draw_pixels(source, &request, &some, &err), STATUS_OK);
        assert_int_equal(some.count, 5);
        for (size_t n = 0; n < 5; n++) {
            assert_memory_equal(some.pixels + 4 * n, whole.pixels + 4 * pixels[n],
                                4 * sizeof *some.pixels);
            assert_int_equal(some.touched[n], whole.touched[pixels[n]]);
            drawn_on += some.pixels[4 * n + 3] > 0;
        }
        truth_finish(&some);
    }
    assert_true(drawn_on >= 4);
    truth_destroy(source);
    truth_finish(&whole);
}

static void cancelled_leaves_nothing(void **state) {
    const struct fixture *fixture = *state;
    struct error err = {0};
    struct truth truth;
    struct truth_source *source;
    atomic_bool cancel = true;
    assert_int_equal(truth_create(&fixture->scene, &fixture->assets, &source, &err), STATUS_OK);
    assert_int_equal(
        truth_draw_pixels(source, &(struct reference_request){.cancel = &cancel}, &truth, &err),
        STATUS_CANCELLED);
    assert_null(truth.pixels);
    assert_null(truth.touched);
    assert_int_equal(truth.count, 0);
    error_clear(&err);
    truth_destroy(source);
    truth_destroy(NULL);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pixels_are_those_of_the_whole),
        cmocka_unit_test(cancelled_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, open_scene, close_scene);
}
