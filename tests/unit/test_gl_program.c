/* The cache of programs: compiled once for each variant, and reported once. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/gl/program.h"
#include "tests/unit/gl_fixture.h"

static void test_a_program_is_compiled_once(void **state) {
    (void)state;
    struct gl_programs *programs = gl_programs_create();
    assert_non_null(programs);
    GLuint first = 0, second = 0;
    bool compiled = false;
    assert_int_equal(gl_programs_get(programs, GL_PROGRAM_CHECK, 0, &first, &compiled, NULL),
                     STATUS_OK);
    assert_true(compiled);
    assert_true(glIsProgram(first));

    compiled = false;
    assert_int_equal(gl_programs_get(programs, GL_PROGRAM_CHECK, 0, &second, &compiled, NULL),
                     STATUS_OK);
    assert_false(compiled);
    assert_int_equal(first, second);

    /* A hit never takes back what an earlier miss has reported. */
    compiled = true;
    assert_int_equal(gl_programs_get(programs, GL_PROGRAM_CHECK, 0, &second, &compiled, NULL),
                     STATUS_OK);
    assert_true(compiled);
    assert_int_equal(gl_programs_get(programs, GL_PROGRAM_CHECK, 0, &second, NULL, NULL),
                     STATUS_OK);

    gl_programs_destroy(programs);
    assert_false(glIsProgram(first));
    gl_programs_destroy(NULL);
    assert_int_equal(gl_check("the cache", NULL), STATUS_OK);
}

static void test_names_and_flags(void **state) {
    (void)state;
    assert_string_equal(gl_program_name(GL_PROGRAM_CHECK), "CHECK");
    assert_int_equal(gl_program_flags(GL_PROGRAM_CHECK), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_program_is_compiled_once),
        cmocka_unit_test(test_names_and_flags),
    };
    return cmocka_run_group_tests(tests, gl_fixture_open, gl_fixture_close);
}
