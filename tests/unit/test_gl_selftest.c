/* The self-test of a GL must see each ability that is missing. A GL that lacks one is made by
 * putting a function of this file in place of one of the loaded ones. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/selftest.h"
#include "tests/unit/gl_fixture.h"
#include <glad/gl.h>

static void expect_refused(const struct gl_info *info, const char *words) {
    struct error err = {0};
    assert_int_equal(gl_selftest(info, &err), STATUS_NO_GL);
    assert_int_equal(err.fault_count, 1);
    if (!strstr(err.faults[0].message, words))
        fail_msg("'%s' is not in: %s", words, err.faults[0].message);
    error_clear(&err);
}

static void test_a_sound_gl_passes_and_is_left_as_it_was(void **state) {
    struct error err = {0};
    assert_int_equal(gl_selftest(gl_context_info(*state), &err), STATUS_OK);
    assert_int_equal(err.fault_count, 0);
    GLint program = 1, framebuffer = 1, source = 0;
    glGetIntegerv(GL_CURRENT_PROGRAM, &program);
    glGetIntegerv(GL_FRAMEBUFFER_BINDING, &framebuffer);
    glGetIntegerv(GL_BLEND_SRC_RGB, &source);
    assert_int_equal(program, 0);
    assert_int_equal(framebuffer, 0);
    assert_int_equal(source, GL_ONE);
    assert_false(glIsEnabled(GL_BLEND) || glIsEnabled(GL_DEPTH_TEST));
}

static PFNGLTEXTURESTORAGE2DPROC real_storage;
static GLenum color_format, depth_format;

static void GLAD_API_PTR poorer_storage(GLuint texture, GLsizei levels, GLenum format,
                                        GLsizei width, GLsizei height) {
    if (format == GL_RGBA32F && color_format)
        format = color_format;
    if (format == GL_DEPTH_COMPONENT32F && depth_format)
        format = depth_format;
    real_storage(texture, levels, format, width, height);
}

static void test_poorer_formats_are_seen(void **state) {
    const struct gl_info *info = gl_context_info(*state);
    real_storage = glad_glTextureStorage2D;
    glad_glTextureStorage2D = poorer_storage;
    color_format = GL_RGBA16F;
    expect_refused(info, "does not blend 32-bit float colours");
    color_format = GL_RGBA8;
    expect_refused(info, "does not blend 32-bit float colours");
    color_format = 0;
    depth_format = GL_DEPTH_COMPONENT16;
    expect_refused(info, "does not keep depth");
    depth_format = GL_DEPTH_COMPONENT24;
    expect_refused(info, "does not keep depth");
    glad_glTextureStorage2D = real_storage;
}

static PFNGLBLENDFUNCPROC real_blend;

static void GLAD_API_PTR single_source(GLenum source, GLenum destination) {
    real_blend(source, destination == GL_SRC1_COLOR ? GL_SRC_COLOR : destination);
}

static void test_missing_dual_source_blending_is_seen(void **state) {
    real_blend = glad_glBlendFunc;
    glad_glBlendFunc = single_source;
    expect_refused(gl_context_info(*state), "does not blend 32-bit float colours");
    glad_glBlendFunc = real_blend;
}

static PFNGLENABLEPROC real_enable;
static GLenum not_enabled;

static void GLAD_API_PTR enable_others(GLenum what) {
    if (what != not_enabled)
        real_enable(what);
}

static void test_missing_blending_and_depth_tests_are_seen(void **state) {
    const struct gl_info *info = gl_context_info(*state);
    real_enable = glad_glEnable;
    glad_glEnable = enable_others;
    not_enabled = GL_BLEND;
    expect_refused(info, "does not blend 32-bit float colours");
    not_enabled = GL_DEPTH_TEST; /* then the second draw adds to the first */
    expect_refused(info, "does not blend 32-bit float colours");
    glad_glEnable = real_enable;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_sound_gl_passes_and_is_left_as_it_was),
        cmocka_unit_test(test_poorer_formats_are_seen),
        cmocka_unit_test(test_missing_dual_source_blending_is_seen),
        cmocka_unit_test(test_missing_blending_and_depth_tests_are_seen),
    };
    return cmocka_run_group_tests(tests, gl_fixture_open, gl_fixture_close);
}
