/* Render targets: kept while the size stays, refused where too large, read with the top row first.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/gl/target.h"
#include "tests/unit/gl_fixture.h"

/* Gives every pixel its own colour by clearing one row and one column at a time, and compares. */
static void expect_orientation(int width, int height) {
    struct gl_target target = {0};
    assert_int_equal(gl_target_resize(&target, width, height, false, NULL), STATUS_OK);
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    glEnable(GL_SCISSOR_TEST);
    for (int y = 0; y < height; y++) {
        glColorMask(GL_TRUE, GL_FALSE, GL_TRUE, GL_TRUE);
        glScissor(0, y, width, 1);
        glClearColor((float)y, 0, 0x1p-24f, -1e30f);
        glClear(GL_COLOR_BUFFER_BIT);
    }
    for (int x = 0; x < width; x++) {
        glColorMask(GL_FALSE, GL_TRUE, GL_FALSE, GL_FALSE);
        glScissor(x, 0, 1, height);
        glClearColor(0, (float)x, 0, 0);
        glClear(GL_COLOR_BUFFER_BIT);
    }
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    glDisable(GL_SCISSOR_TEST);

    float *rgba = malloc((size_t)width * (size_t)height * 4 * sizeof *rgba);
    assert_non_null(rgba);
    assert_int_equal(gl_target_read(&target, rgba, NULL), STATUS_OK);
    for (int row = 0; row < height; row++)
        for (int x = 0; x < width; x++) {
            const float *pixel = rgba + ((size_t)row * (size_t)width + (size_t)x) * 4;
            float y = (float)(height - 1 - row); /* GL counts rows from the bottom */
            if (pixel[0] != y || pixel[1] != (float)x || pixel[2] != 0x1p-24f || pixel[3] != -1e30f)
                fail_msg("%d x %d: row %d, column %d holds %g %g %g %g", width, height, row, x,
                         (double)pixel[0], (double)pixel[1], (double)pixel[2], (double)pixel[3]);
        }
    free(rgba);
    gl_target_finish(&target);
    assert_int_equal(target.framebuffer, 0);
    assert_int_equal(gl_check("orientation", NULL), STATUS_OK);
}

static void test_reading_puts_the_top_row_first(void **state) {
    (void)state;
    expect_orientation(1, 1);
    expect_orientation(3, 2);
    expect_orientation(64, 65);   /* one band */
    expect_orientation(129, 301); /* bands of 127 rows and a rest */
    expect_orientation(16384, 3); /* bands of a single row, rows longer than a piece of the flip */
    expect_orientation(3, 16384);
}

static void test_reading_leaves_the_bindings_alone(void **state) {
    (void)state;
    struct gl_target a = {0}, b = {0};
    float rgba[4 * 4];
    GLint bound = 0;
    assert_int_equal(gl_target_resize(&a, 2, 2, true, NULL), STATUS_OK);
    assert_int_equal(gl_target_resize(&b, 2, 2, false, NULL), STATUS_OK);
    glBindFramebuffer(GL_FRAMEBUFFER, a.framebuffer);
    assert_int_equal(gl_target_read(&b, rgba, NULL), STATUS_OK);
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &bound);
    assert_int_equal(bound, a.framebuffer);
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &bound);
    assert_int_equal(bound, a.framebuffer);
    gl_target_finish(&a);
    gl_target_finish(&b);
}

static void test_resize_allocates_only_for_a_new_size(void **state) {
    (void)state;
    struct gl_target target = {0};
    assert_int_equal(gl_target_resize(&target, 8, 4, true, NULL), STATUS_OK);
    assert_true(target.depth != 0);
    const float green[4] = {0, 1, 0, 1};
    glClearNamedFramebufferfv(target.framebuffer, GL_COLOR, 0, green);
    struct gl_target before = target;
    assert_int_equal(gl_target_resize(&target, 8, 4, true, NULL), STATUS_OK);
    assert_memory_equal(&before, &target, sizeof target);
    float rgba[8 * 4 * 4];
    assert_int_equal(gl_target_read(&target, rgba, NULL), STATUS_OK);
    assert_true(rgba[1] == 1); /* a new texture would have lost this */

    assert_int_equal(gl_target_resize(&target, 4, 8, true, NULL), STATUS_OK);
    GLint width = 0, format = 0;
    glGetTextureLevelParameteriv(target.color, 0, GL_TEXTURE_WIDTH, &width);
    glGetTextureLevelParameteriv(target.depth, 0, GL_TEXTURE_INTERNAL_FORMAT, &format);
    assert_int_equal(width, 4);
    assert_int_equal(format, GL_DEPTH_COMPONENT32F);
    assert_int_equal(gl_target_resize(&target, 4, 8, false, NULL), STATUS_OK);
    assert_int_equal(target.depth, 0);
    gl_target_finish(&target);
    gl_target_finish(&target);
}

static void expect_refused(int width, int height) {
    struct gl_target target = {0};
    struct error err = {0};
    assert_int_equal(gl_target_resize(&target, width, height, true, &err), STATUS_TOO_COMPLEX);
    assert_int_equal(err.fault_count, 1);
    assert_int_equal(target.framebuffer | target.color | target.depth, 0);
    error_clear(&err);
}

static void test_sizes_out_of_range_are_refused(void **state) {
    const struct gl_info *info = gl_context_info(*state);
    expect_refused(0, 1);
    expect_refused(1, 0);
    expect_refused(-1, 1);
    expect_refused(info->max_texture_size + 1, 1);
    expect_refused(1, INT32_MAX);
    assert_int_equal(gl_check("refusals", NULL), STATUS_OK);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reading_puts_the_top_row_first),
        cmocka_unit_test(test_reading_leaves_the_bindings_alone),
        cmocka_unit_test(test_resize_allocates_only_for_a_new_size),
        cmocka_unit_test(test_sizes_out_of_range_are_refused),
    };
    return cmocka_run_group_tests(tests, gl_fixture_open, gl_fixture_close);
}
