/* Lists of what planes cut: those that the device makes (renderer/path/lists.h) against those that
 * the processor makes (renderer/shell/slabs.h). The same cuts in the same order are the same
 * picture, to the bit; and where the processor counts what it cut, the device may have put aside as
 * many or more, since it keeps room for a second polygon. */
#include "renderer/force.h"
#include "tests/unit/renderer_fixture.h"

static void draw(struct render_result *result, uint32_t force, const char *scene) {
    renderer_force(renderer, force);
    assert_int_equal(support_draw(renderer, result, "%s", scene), STATUS_OK);
    renderer_force(renderer, 0);
}

/* Draws a scene both ways; `most`: fraction of fragments that must have been drawn, so that
 * pictures without anything in them are only compared where that is meant. */
static void compare_forced(const char *what, uint32_t force, const char *scene, bool empty) {
    struct render_result host, device;
    draw(&host, FORCE_HOST_LISTS | force, scene);
    draw(&device, FORCE_DEVICE_LISTS | force, scene);
    uint64_t off = 0;
    for (int i = 0; i < 4 * host.width * host.height; i++)
        off += memcmp(&host.pixels[i], &device.pixels[i], sizeof *host.pixels) != 0;
    print_message("%s: %d planes, %llu fragments, %llu polygons, of which the device lists %llu\n",
                  what, (int)host.report.work.slices,
                  (unsigned long long)host.report.work.fragments,
                  (unsigned long long)host.report.work.segments,
                  (unsigned long long)device.report.work.segments);
    if (off)
        fail_msg("%s: %llu of %d numbers differ", what, (unsigned long long)off,
                 4 * host.width * host.height);
    if (host.report.work.fragments != device.report.work.fragments)
        fail_msg("%s: %llu fragments, not %llu", what,
                 (unsigned long long)device.report.work.fragments,
                 (unsigned long long)host.report.work.fragments);
    assert_true(empty == (host.report.work.fragments == 0));
    assert_true(device.report.work.segments >= host.report.work.segments);
    render_result_finish(&host);
    render_result_finish(&device);
}

static void compare(const char *what, const char *scene) {
    compare_forced(what, 0, scene, false);
}

#define IMAGE(n) "'image': {'width': " #n ", 'height': " #n ", 'samples': 1}, "
#define SCENE(image, camera, mesh, material, slices, rest)                                         \
    "{" image camera "'objects': [{'shell': {'mesh': {" mesh "}, 'thickness': 0.15, 'tiles': [6, " \
    "3], 'material': {" material "}}, 'quality': {'method': 'hardware', 'slices': " slices         \
    "}}]" rest "}"
#define TORUS  "'shape': 'torus', 'divisions': [24, 12]"
#define CLOUDS "'builtin': 'clouds', 'size': [16, 16, 8]"
#define EVEN   "'builtin': 'homogeneous', 'extinction': 2"
#define ABOVE  "'camera': {'eye': [0.2, -3, 2.2], 'target': [0, 0, 0]}, "

/* Media and solids, unlit and lit, affine and exact; shapes whose normals part at silhouettes, so
 * that edges are named, and whose folds lie over one another, so that the order shows. */
static void test_same_picture(void **state) {
    (void)state;
    compare("torus", SCENE(IMAGE(96), ABOVE, TORUS, CLOUDS, "250", ""));
    compare("torus, exact", SCENE(IMAGE(64), ABOVE, TORUS, CLOUDS, "200, 'map': 'exact'", ""));
    compare("solid", SCENE(IMAGE(64), ABOVE, TORUS, "'builtin': 'chain'", "300", ""));
    compare("teapot",
            SCENE(IMAGE(64), "", "'shape': 'teapot', 'divisions': [4, 4]", CLOUDS, "100", ""));
    compare("terrain", SCENE(IMAGE(64), "", "'shape': 'terrain', 'divisions': [20, 20]",
                             "'builtin': 'fog'", "150", ""));
    compare("few prisms, thick", "{" IMAGE(64) ABOVE
            "'objects': [{'shell': {'mesh': {'shape': 'sphere', 'divisions': [5, 3]}, 'thickness': "
            "0.7, 'material': {" CLOUDS "}}, 'quality': {'method': 'hardware', 'slices': 90}}]}");
}

static void test_views(void **state) {
    (void)state;
    compare("the eye inside",
            SCENE(IMAGE(64), "'camera': {'eye': [1.45, 0, 0], 'target': [0, 0.2, 0]}, ", TORUS,
                  EVEN, "120", ""));
    compare("orthographic",
            SCENE(IMAGE(64),
                  "'camera': {'eye': [3, 1, 2], 'target': [0, 0, 0], 'ortho_height': 3}, ", TORUS,
                  CLOUDS, "120", ""));
    /* Planes lie in the shell's own faces. */
    compare("face on",
            SCENE(IMAGE(64), "'camera': {'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0]}, ",
                  "'shape': 'plane', 'divisions': [5, 5]", CLOUDS, "16", ""));
    compare_forced("behind the eye", 0,
                   SCENE(IMAGE(32), "'camera': {'eye': [0, -4, 0], 'target': [0, -9, 0]}, ", TORUS,
                         EVEN, "50", ""),
                   true);
    compare("far away",
            "{" IMAGE(64) "'camera': {'eye': [1e6, -4, 3], 'target': [1e6, 0, 0]}, 'objects': "
                          "[{'shell': {'mesh': {" TORUS "}, 'thickness': 0.15, 'material': {" CLOUDS
                          "}}, 'transform': {'translate': [1e6, 0, 0]}, 'quality': {'method': "
                          "'hardware', 'slices': 99}}]}");
    compare("behind a mesh", "{" IMAGE(64) ABOVE
            "'objects': [{'shell': {'mesh': {" TORUS
            "}, 'thickness': 0.15, 'base': {'color': [0.3, 0.2, 0.1]}, "
            "'material': {" CLOUDS "}}, 'quality': {'method': 'hardware', 'slices': 99}}, {'mesh': "
            "{'shape': 'sphere', 'radius': 0.7}}]}");
}

/* One plane; one more than a group; more than the tables of a batch hold (260,000 cuts); the most
 * there are, in 256 groups; every plane looking at every prism. */
static void test_many_and_few(void **state) {
    (void)state;
    compare("one plane", SCENE(IMAGE(32), ABOVE, TORUS, EVEN, "1", ""));
    compare("two", SCENE(IMAGE(32), ABOVE, TORUS, EVEN, "2", ""));
    compare("32", SCENE(IMAGE(32), ABOVE, TORUS, EVEN, "32", ""));
    compare("33", SCENE(IMAGE(32), ABOVE, TORUS, EVEN, "33", ""));
    compare("a group", SCENE(IMAGE(32), ABOVE, TORUS, EVEN, "512", ""));
    compare("and one more", SCENE(IMAGE(32), ABOVE, TORUS, EVEN, "513", ""));
    compare("of a solid", SCENE(IMAGE(32), ABOVE, TORUS, "'builtin': 'chain'", "1100", ""));
    compare("several batches",
            SCENE(IMAGE(16), ABOVE, "'shape': 'torus', 'divisions': [160, 80]", EVEN, "1000", ""));
    compare("the most planes",
            SCENE(IMAGE(8), ABOVE, "'shape': 'torus', 'divisions': [8, 4]", EVEN, "131072", ""));
    compare_forced("every plane", FORCE_EVERY_PLANE,
                   SCENE(IMAGE(32), ABOVE, TORUS, CLOUDS, "250", ""), false);
}

/* Many prisms are many in each plane: more than a batch is meant to hold, and it must. */
static void test_many_prisms(void **state) {
    (void)state;
    compare("1,002,528 prisms in one plane",
            SCENE(IMAGE(8), "'camera': {'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0]}, ",
                  "'shape': 'plane', 'divisions': [708, 708]", EVEN, "3", ""));
}

/* Several shells share the planes: there the processor's lists stay. */
static void test_several_shells(void **state) {
    (void)state;
    compare("two shells", "{" IMAGE(32) ABOVE
            "'objects': [{'shell': {'mesh': {" TORUS "}, 'thickness': 0.1, 'material': {" EVEN
            "}}, 'quality': {'method': 'hardware', 'slices': 40}}, {'shell': {'mesh': {'shape': "
            "'sphere'}, 'thickness': 0.1, 'material': {" EVEN
            "}}, 'quality': {'method': 'hardware', 'slices': 40}}]}");
}

/* Blocks of pixels alone, as an error estimate draws them. */
static void test_blocks(void **state) {
    (void)state;
    compare("blocks",
            SCENE(IMAGE(96), ABOVE, TORUS, CLOUDS, "100", ", 'report': {'error': 'estimate'}"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_same_picture),   cmocka_unit_test(test_views),
        cmocka_unit_test(test_many_and_few),   cmocka_unit_test(test_many_prisms),
        cmocka_unit_test(test_several_shells), cmocka_unit_test(test_blocks),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
