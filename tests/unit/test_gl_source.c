/* Shader text: includes, numbering, refusals, and a compiler's log that names the file at fault.
 *
 * This program brings its own set of embedded files (the linker takes it in place of the
 * archive's), so that broken shaders need not lie in shaders/. check.frag, which the self-test of
 * every context draws with, is one of the broken ones. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "api/embedded.h"
#include "renderer/gl/context.h"
#include "renderer/gl/program.h"
#include "renderer/gl/source.h"

#define TEXT(name, text)                                                                           \
    { "shaders/" name, text, text + sizeof text - 1 }

static const char interface_h[] = "#ifndef I\n#define I\n#define FLAG 1\n#endif\n";
static const char plain[] = "first\n  #  include \"common_a.glsl\"\nthird\n";
static const char common_a[] = "in a\n#include \"common_b.glsl\"\nback in a"; /* no last newline */
static const char common_b[] = "in b\n";
static const char twice[] = "#include \"common_b.glsl\"\n#include \"common_b.glsl\"\n";
static const char loop_a[] = "\n#include \"loop_b.glsl\"\n";
static const char loop_b[] = "#include \"loop_a.glsl\"\n";
static const char self_[] = "#include \"self.glsl\"\n";
static const char missing[] = "one\ntwo\n#include \"nowhere.glsl\"\n";
static const char outside[] = "#include \"../api/secret\"\n";
static const char empty[] = "";
static const char odd[] = "#included \"x\nint include; // \"y\"\n#include\n#\n";
static const char check_vert[] = "layout(location = 0) uniform float d;\n"
                                 "void main() { gl_Position = vec4(0, 0, d, 1); }\n";
static const char check_frag[] = "out vec4 color;\n#include \"broken.glsl\"\n"
                                 "void main() { color = vec4(broken()); }\n";
static const char broken[] =
    "float fine() { return 1.0; }\nfloat broken() {\n    return fine() + vec3(1.0);\n}\n";

const struct embedded embedded_files[] = {
    TEXT("interface.h", interface_h), TEXT("plain.frag", plain),
    TEXT("common_a.glsl", common_a),  TEXT("common_b.glsl", common_b),
    TEXT("twice.frag", twice),        TEXT("loop_a.glsl", loop_a),
    TEXT("loop_b.glsl", loop_b),      TEXT("self.glsl", self_),
    TEXT("missing.frag", missing),    TEXT("outside.frag", outside),
    TEXT("empty.frag", empty),        TEXT("odd.frag", odd),
    TEXT("check.vert", check_vert),   TEXT("check.frag", check_frag),
    TEXT("broken.glsl", broken),      {0, 0, 0}};

#define HEAD                                                                                       \
    "#version 450 core\n#define VARIANT 0x0005\n#line 10001 0\n#ifndef I\n#define I\n#define "     \
    "FLAG 1\n"                                                                                     \
    "#endif\n"

static void expect_text(const char *name, const char *wanted) {
    struct gl_source source;
    assert_int_equal(gl_source_assemble(&source, name, 5, NULL), STATUS_OK);
    assert_string_equal(source.text, wanted);
    assert_int_equal(source.length, strlen(wanted));
    gl_source_finish(&source);
}

static void test_includes_are_numbered(void **state) {
    (void)state;
    expect_text("plain.frag", HEAD
                "#line 20001 1\nfirst\n#line 30001 2\nin a\n#line 40001 3\nin b\n#line 30003 2\n"
                "back in a\n#line 20003 1\nthird\n");
    expect_text("twice.frag",
                HEAD "#line 20001 1\n#line 30001 2\nin b\n#line 20002 1\n#line 40001 3\nin b\n"
                     "#line 20003 1\n");
    expect_text("empty.frag", HEAD "#line 20001 1\n");
}

static void test_what_only_resembles_an_include_stays(void **state) {
    (void)state;
    expect_text("odd.frag",
                HEAD "#line 20001 1\n#included \"x\nint include; // \"y\"\n#include\n#\n");
}

static void expect_refusal(const char *name, const char *wanted) {
    struct gl_source source;
    struct error err = {0};
    assert_int_equal(gl_source_assemble(&source, name, 0, &err), STATUS_INTERNAL);
    assert_int_equal(err.fault_count, 1);
    assert_string_equal(err.faults[0].message, wanted);
    gl_source_finish(&source);
    error_clear(&err);
}

static void test_refusals_name_file_and_line(void **state) {
    (void)state;
    expect_refusal("missing.frag", "missing.frag:3: there is no shader file nowhere.glsl");
    expect_refusal("outside.frag", "outside.frag:1: there is no shader file ../api/secret");
    expect_refusal("absent.frag", "absent.frag:0: there is no shader file absent.frag");
    expect_refusal("loop_a.glsl", "loop_b.glsl:1: loop_a.glsl includes itself");
    expect_refusal("self.glsl", "self.glsl:1: self.glsl includes itself");
}

static void expect_log(const char *log, const char *wanted) {
    struct gl_source source = {.file_count = 2, .files = {"interface.h", "main.frag"}};
    char *got = gl_source_translate_log(&source, log);
    assert_non_null(got);
    assert_string_equal(got, wanted);
    free(got);
}

static void test_logs_name_files(void **state) {
    (void)state;
    expect_log("1:20017(5): error: x\n", "main.frag:17(5): error: x\n");
    expect_log("0:20017(5): error: x\n", "main.frag:17(5): error: x\n"); /* Mesa's lost source */
    expect_log("0(10003) : error C1: y\n1(20004) : z",
               "interface.h(3) : error C1: y\nmain.frag(4) : z");
    expect_log("ERROR: 1:20002: 'a' : b\n", "ERROR: main.frag:2: 'a' : b\n");
    expect_log("2:30017(5): no such file\n", "2:30017(5): no such file\n");
    expect_log("0:17(5): before any file\n", "0:17(5): before any file\n");
    expect_log("1: no line\n12 things\nat 1:20002\n", "1: no line\n12 things\nat 1:20002\n");
    expect_log("9:99999999999999999999:1", "9:99999999999999999999:1");
    expect_log("", "");
}

static void test_program_text_needs_no_gl(void **state) {
    (void)state;
    char *text = gl_program_source(GL_PROGRAM_CHECK, 0, "vert");
    assert_non_null(strstr(text, "gl_Position"));
    free(text);
    assert_null(gl_program_source(GL_PROGRAM_CHECK, 0, "comp"));
    assert_null(gl_program_source(GL_PROGRAM_CHECK, 0, "nonsense"));
}

static void test_a_compiler_error_names_the_included_file(void **state) {
    (void)state;
    const struct gl_options options = {GL_BACKEND_OSMESA, -1, false};
    struct gl_context *context;
    struct error err = {0};
    assert_int_equal(gl_context_create(&options, &context, &err), STATUS_NO_GL);
    assert_null(context);
    assert_int_equal(err.fault_count, 1);
    assert_non_null(strstr(err.faults[0].message, "shader check.frag, variant 0x0000"));
    assert_non_null(strstr(err.faults[0].message, "broken.glsl:3("));
    error_clear(&err);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_includes_are_numbered),
        cmocka_unit_test(test_what_only_resembles_an_include_stays),
        cmocka_unit_test(test_refusals_name_file_and_line),
        cmocka_unit_test(test_logs_name_files),
        cmocka_unit_test(test_program_text_needs_no_gl),
        cmocka_unit_test(test_a_compiler_error_names_the_included_file),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
