/* The variants that variant_cover.h takes for pairs of flags compile and link on the GL of this
 * machine. glslang, which tests/check/shaders.sh uses, accepts some of what drivers refuse, and the
 * other way round.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/gl/program.h"
#include "shaders/interface.h"
#include "tests/tools/variant_cover.h"
#include "tests/unit/gl_fixture.h"

/* Sanitizers look at this program, not at the compiler of the driver: one in eight will do. */
#if defined(__SANITIZE_ADDRESS__)
enum { EVERY = 8 };
#else
enum { EVERY = 1 };
#endif

static void test_variants_link(void **state) {
    (void)state;
    struct gl_programs *programs = gl_programs_create();
    struct error err = {0};
    int count = 0;
    assert_non_null(programs);
    for (int id = 0; id < GL_PROGRAM_COUNT; id++) {
        uint32_t known = gl_program_flags((enum gl_program_id)id), variant = 0;
        static struct variant_cover cover;
        int taken = 0;
        variant_cover_init(&cover, (enum gl_program_id)id, 2);
        do {
            GLuint program = 0;
            if (gl_program_makes_sense((enum gl_program_id)id, variant) &&
                variant_cover_takes(&cover, variant) && taken++ % EVERY == 0 &&
                gl_programs_get(programs, (enum gl_program_id)id, variant, &program, NULL, &err) !=
                    STATUS_OK)
                fail_msg("%s", err.faults[0].message);
            count += program != 0;
            variant = (variant - known) & known;
        } while (variant);
    }
    assert_true(count >= GL_PROGRAM_COUNT); /* each program has one variant at least */
    gl_programs_destroy(programs);
    assert_int_equal(gl_check("all variants", NULL), STATUS_OK);
}

static void test_what_makes_sense(void **state) {
    (void)state;
    assert_true(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_MEDIUM));
    assert_true(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_SOLID | FLAG_LIT | FLAG_SPECULAR));
    assert_true(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_HOMOGENEOUS | FLAG_OCCLUDED));
    assert_false(gl_program_makes_sense(GL_PROGRAM_TETRA, 0));
    assert_false(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_MEDIUM | FLAG_SOLID));
    assert_false(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_HOMOGENEOUS | FLAG_LIT));
    assert_false(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_MEDIUM | FLAG_SPECULAR));
    assert_false(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_MEDIUM | (FLAG_TEXTURED)));
    assert_true(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_MEDIUM | FLAG_AMBIENT));
    assert_false(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_MEDIUM | FLAG_AMBIENT | FLAG_LIT));
    assert_false(
        gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_SOLID | FLAG_AMBIENT | FLAG_SPECULAR));
    assert_false(gl_program_makes_sense(GL_PROGRAM_TETRA, FLAG_HOMOGENEOUS | FLAG_AMBIENT));
    assert_true(gl_program_makes_sense(GL_PROGRAM_SURFACE, FLAG_AMBIENT | FLAG_TEXTURED));
    assert_false(gl_program_makes_sense(GL_PROGRAM_SURFACE, FLAG_TEXTURED));
    assert_true(gl_program_makes_sense(GL_PROGRAM_CHECK, 0));
    assert_false(gl_program_makes_sense(GL_PROGRAM_CHECK, FLAG_LIT));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_variants_link),
        cmocka_unit_test(test_what_makes_sense),
    };
    return cmocka_run_group_tests(tests, gl_fixture_open, gl_fixture_close);
}
