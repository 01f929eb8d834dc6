/* Solids on the tetra path: a height field of one height is a plane, whose place, normal and colour
 * are known. */
#include "tests/support.h"

#include <math.h>
#include <stdlib.h>

#include "service/encode.h"

static struct renderer *renderer;

/* The group runs once walking from cell to cell and once drawing the cells. */
static const char *order = "walk";

/* Every asset is an 8 x 8 picture of the grey whose 8-bit value is `level`. */
static enum status open_grey(void *user, const char *name, const char *pointer,
                             struct asset_bytes *bytes, struct error *err) {
    (void)name;
    (void)pointer;
    int level = *(const int *)user;
    double s = level / 255.0, linear = s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
    float rgba[64 * 4];
    for (int i = 0; i < 64 * 4; i++)
        rgba[i] = i % 4 == 3 ? 1 : (float)linear;
    unsigned char *data;
    size_t size;
    enum status status = encode_png(rgba, 8, 8, &data, &size, err);
    if (status == STATUS_OK)
        *bytes = (struct asset_bytes){
            .data = data, .size = size, .handle = data, .sha256 = {(unsigned char)level, 1}};
    return status;
}

static void close_grey(void *user, struct asset_bytes *bytes) {
    (void)user;
    free(bytes->handle);
}

static int open_renderer(void **state) {
    (void)state;
    renderer = support_renderer();
    return 0;
}

static int close_renderer(void **state) {
    (void)state;
    renderer_destroy(renderer);
    return 0;
}

/* A plane of solid at level / 255 of a thickness of 0.5, seen at `angle` from the normal, with a
 * red unlit-looking plane (ambient only) at `mesh_z`. */
static void draw(struct render_result *result, int level, double angle, double mesh_z) {
    char json[2048];
    int length = snprintf(
        json, sizeof json,
        "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'ambient': [0.1, 0.1, 0.1], "
        "'lights': "
        "[{'direction': [0, 1, -1], 'color': [2, 2, 2]}], 'camera': {'eye': [%.17g, 0, %.17g], "
        "'target': [0, 0, 0.25], 'up': [0, 1, 0], 'ortho_height': 0.5}, 'objects': [{'shell': "
        "{'mesh': {'shape': 'plane', 'size': [8, 8], 'divisions': [7, 5]}, 'thickness': 0.5, "
        "'tiles': [3, 3], 'material': {'height': 'grey', 'size': [16, 16, 32]}}, 'quality': "
        "{'order': '%s'}}, {'mesh': "
        "{'shape': "
        "'plane', 'size': [8, 8]}, 'color': [1, 0, 0], 'transform': {'translate': [0, 0, "
        "%.17g]}}]}",
        10 * sin(angle), 10 * cos(angle), order, mesh_z);
    support_quote(json);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source source = {open_grey, close_grey, &level};
    enum status status = scene_read(json, (size_t)length, &arena, &scene, &err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, &scene, &source, result, &err);
    for (size_t i = 0; i < err.fault_count; i++)
        print_message("%s: %s\n", err.faults[i].pointer, err.faults[i].message);
    assert_int_equal(status, STATUS_OK);
    arena_free(&arena);
}

/* The red plane a five-hundredth of the thickness below the surface is hidden, above it is seen. */
static void test_place(void **state) {
    (void)state;
    for (int level = 51; level <= 204; level += 51)
        for (int angle = 0; angle <= 60; angle += 30) {
            double z = 0.5 * level / 255;
            struct render_result result;
            draw(&result, level, angle * M_PI / 180, z - 0.001);
            for (int p = 0; p < 256; p++)
                if (!(result.pixels[4 * p + 1] > 0.1)) /* grey */
                    fail_msg("level %d, %d degrees, sample %d: %g %g", level, angle, p,
                             (double)result.pixels[4 * p], (double)result.pixels[4 * p + 1]);
            render_result_finish(&result);
            draw(&result, level, angle * M_PI / 180, z + 0.001);
            for (int p = 0; p < 256; p++)
                assert_true(result.pixels[4 * p + 1] == 0); /* red */
            render_result_finish(&result);
        }
}

/* Grey 1/2 without a colour image; the light falls at 45 degrees: 0.1 + 2 cos 45. Opaque. */
static void test_light(void **state) {
    (void)state;
    struct render_result result;
    draw(&result, 102, 0.5, -1);
    for (int p = 0; p < 256; p++) {
        const float *pixel = result.pixels + 4 * p;
        assert_true(pixel[3] == 1);
        for (int c = 1; c < 3; c++)
            assert_float_equal(pixel[c], pixel[0], 1e-6);
        assert_float_equal(pixel[0], result.pixels[0], 1e-4);
    }
    assert_float_equal(result.pixels[0], 0.5 * (0.1 + 2 * sqrt(0.5)), 1e-4);
    render_result_finish(&result);
}

/* Heights 0 and 1: nothing, and the shell's own top. */
static void test_ends(void **state) {
    (void)state;
    struct render_result result;
    draw(&result, 255, 0.7, 0.499);
    for (int p = 0; p < 256; p++)
        assert_true(result.pixels[4 * p + 1] > 0.1);
    render_result_finish(&result);
    draw(&result, 255, 0.7, 0.501);
    for (int p = 0; p < 256; p++)
        assert_true(result.pixels[4 * p + 1] == 0);
    render_result_finish(&result);
    draw(&result, 0, 0.7, 0.017);
    for (int p = 0; p < 256; p++)
        assert_true(result.pixels[4 * p + 1] == 0);
    render_result_finish(&result);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_place),
        cmocka_unit_test(test_light),
        cmocka_unit_test(test_ends),
    };
    int failed = cmocka_run_group_tests_name("walking", tests, open_renderer, close_renderer);
    order = "sorted";
    return failed + cmocka_run_group_tests_name("cells", tests, open_renderer, close_renderer);
}
