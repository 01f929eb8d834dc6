/* Opening a GL: what is refused, and in which words; errors are drained and named. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/gl/context.h"
#include <glad/gl.h>

static void expect_no_gl(struct gl_options options, size_t faults, const char *const *words) {
    struct gl_context *context;
    struct error err = {0};
    assert_int_equal(gl_context_create(&options, &context, &err), STATUS_NO_GL);
    assert_null(context);
    assert_int_equal(err.status, STATUS_NO_GL);
    assert_int_equal(err.fault_count, faults);
    for (; *words; words++) {
        bool found = false;
        for (size_t i = 0; i < err.fault_count; i++)
            found = found || strstr(err.faults[i].message, *words);
        if (!found)
            fail_msg("'%s' is in no message, of which the first is: %s", *words,
                     err.faults[0].message);
    }
    error_clear(&err);
}

static void test_a_missing_library_is_named_with_its_package(void **state) {
    (void)state;
    setenv("PELT_EGL_LIBRARY", "libEGL-absent.so.1", 1);
    setenv("PELT_OSMESA_LIBRARY", "libOSMesa-absent.so.8", 1);
    const char *egl[] = {"libEGL-absent.so.1", "libegl1", "libgl1-mesa-dri", NULL};
    const char *osmesa[] = {"libOSMesa-absent.so.8", "libosmesa6", NULL};
    const char *both[] = {"libEGL-absent.so.1", "libegl1", "libOSMesa-absent.so.8", "libosmesa6",
                          NULL};
    expect_no_gl((struct gl_options){GL_BACKEND_EGL, -1, false}, 1, egl);
    expect_no_gl((struct gl_options){GL_BACKEND_OSMESA, -1, false}, 1, osmesa);
    expect_no_gl((struct gl_options){GL_BACKEND_AUTO, -1, false}, 2, both);
    unsetenv("PELT_EGL_LIBRARY");
    unsetenv("PELT_OSMESA_LIBRARY");
}

static void test_a_library_that_is_no_gl_is_refused(void **state) {
    (void)state;
    setenv("PELT_EGL_LIBRARY", "libm.so.6", 1);
    setenv("PELT_OSMESA_LIBRARY", "libm.so.6", 1);
    const char *words[] = {"libm.so.6 is no EGL library", "libm.so.6 lacks OSMesaCreateContext",
                           NULL};
    expect_no_gl((struct gl_options){GL_BACKEND_AUTO, -1, false}, 2, words);
    unsetenv("PELT_EGL_LIBRARY");
    unsetenv("PELT_OSMESA_LIBRARY");
}

static void test_auto_takes_osmesa_where_egl_is_missing(void **state) {
    (void)state;
    setenv("PELT_EGL_LIBRARY", "libEGL-absent.so.1", 1);
    const struct gl_options options = {GL_BACKEND_AUTO, -1, false};
    struct gl_context *context;
    struct error err = {0};
    assert_int_equal(gl_context_create(&options, &context, &err), STATUS_OK);
    assert_int_equal(err.fault_count, 0);
    assert_string_equal(gl_context_info(context)->backend, "osmesa");
    gl_context_destroy(context);
    unsetenv("PELT_EGL_LIBRARY");
}

static void test_a_device_that_is_not_there(void **state) {
    (void)state;
    const char *egl[] = {"no device 63", NULL};
    const char *osmesa[] = {"OSMesa has no devices", NULL};
    expect_no_gl((struct gl_options){GL_BACKEND_EGL, 63, false}, 1, egl);
    expect_no_gl((struct gl_options){GL_BACKEND_AUTO, 63, false}, 1, egl);
    expect_no_gl((struct gl_options){GL_BACKEND_OSMESA, 0, false}, 1, osmesa);
}

static void test_info_and_hardware(void **state) {
    (void)state;
    struct gl_options options = {GL_BACKEND_AUTO, -1, false};
    struct gl_context *context;
    assert_int_equal(gl_context_create(&options, &context, NULL), STATUS_OK);
    const struct gl_info *info = gl_context_info(context);
    assert_non_null(strstr(info->version, "4."));
    assert_true(info->renderer[0] && info->vendor[0] && info->device[0]);
    assert_true(info->max_texture_size >= 16384);
    assert_true(info->max_3d_texture_size >= 2048);
    assert_true(info->max_texture_buffer_texels >= 65536);
    bool software = info->software;
    assert_int_equal(software, strstr(info->renderer, "llvmpipe") != NULL);
    gl_context_destroy(context);

    const char *words[] = {"hardware is required", NULL};
    options.require_hardware = true;
    if (software) {
        expect_no_gl(options, 1, words);
    } else {
        assert_int_equal(gl_context_create(&options, &context, NULL), STATUS_OK);
        gl_context_destroy(context);
    }
    options.backend = GL_BACKEND_OSMESA;
    const char *osmesa[] = {"in software only", NULL};
    expect_no_gl(options, 1, osmesa);
}

static void test_errors_are_drained_and_named(void **state) {
    (void)state;
    const struct gl_options options = {GL_BACKEND_AUTO, -1, false};
    struct gl_context *context;
    struct error err = {0};
    assert_int_equal(gl_context_create(&options, &context, NULL), STATUS_OK);
    assert_int_equal(gl_check("nothing", &err), STATUS_OK);
    glEnable(0xdead);
    glViewport(0, 0, -1, -1);
    assert_int_equal(gl_check("two mistakes", &err), STATUS_GL_ERROR);
    assert_int_equal(err.fault_count, 1);
    assert_string_equal(err.faults[0].message, "two mistakes: GL_INVALID_ENUM");
    assert_int_equal(gl_check("after", &err), STATUS_OK);
    error_clear(&err);
    gl_context_destroy(context);
    gl_context_destroy(NULL);
}

int main(void) {
    unsetenv("PELT_EGL_LIBRARY");
    unsetenv("PELT_OSMESA_LIBRARY");
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_missing_library_is_named_with_its_package),
        cmocka_unit_test(test_a_library_that_is_no_gl_is_refused),
        cmocka_unit_test(test_auto_takes_osmesa_where_egl_is_missing),
        cmocka_unit_test(test_a_device_that_is_not_there),
        cmocka_unit_test(test_info_and_hardware),
        cmocka_unit_test(test_errors_are_drained_and_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
