/* The functions that GLSL lacks (shaders/common_math.glsl) against C's, in the shader itself. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>
#include <glad/gl.h>

#include "api/embedded.h"
#include "renderer/gl/context.h"
#include "renderer/gl/target.h"
#include "tests/unit/shader_fixture.h"

enum { SIDE = 128, COUNT = SIDE * SIDE };

static void test_one_minus_exp(void **state) {
    (void)state;
    struct gl_context *context;
    struct error err = {0};
    struct gl_options options = {.device = -1};
    assert_int_equal(gl_context_create(&options, &context, &err), STATUS_OK);
    struct gl_target target = {0};
    assert_int_equal(gl_target_resize(&target, SIDE, SIDE, false, &err), STATUS_OK);

    /* From 1e-12 to 1e3, and both sides of where the series ends. */
    static float x[COUNT], rgba[COUNT * 4];
    for (int i = 0; i < COUNT; i++)
        x[i] = (float)pow(10, -12 + 15.0 * i / COUNT);
    x[0] = 0;
    x[COUNT - 3] = nextafterf(0.5f, 0);
    x[COUNT - 2] = 0.5f;
    x[COUNT - 1] = 1e30f;
    GLuint buffer, texture, array;
    glCreateBuffers(1, &buffer);
    glNamedBufferStorage(buffer, sizeof x, x, 0);
    glCreateTextures(GL_TEXTURE_BUFFER, 1, &texture);
    glTextureBuffer(texture, GL_R32F, buffer);
    glCreateVertexArrays(1, &array);

    const char *vert[] = {"#version 450 core\n", embedded_find("shaders/interface.h")->begin,
                          embedded_find("shaders/fullscreen.vert")->begin};
    const char *frag[] = {
        "#version 450 core\n", embedded_find("shaders/common_math.glsl")->begin,
        "layout(binding = 0) uniform samplerBuffer xs; layout(location = 0) out vec4 result;\n"
        "void main() { int i = int(gl_FragCoord.y) * 128 + int(gl_FragCoord.x);\n"
        "result = vec4(one_minus_exp(texelFetch(xs, i).r)); }\n"};
    GLuint program = glCreateProgram();
    glAttachShader(program, compile(GL_VERTEX_SHADER, vert, 3));
    glAttachShader(program, compile(GL_FRAGMENT_SHADER, frag, 3));
    glLinkProgram(program);
    glUseProgram(program);
    glBindTextureUnit(0, texture);
    glBindVertexArray(array);
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    glViewport(0, 0, SIDE, SIDE);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    assert_int_equal(gl_target_read(&target, rgba, &err), STATUS_OK);

    double worst = 0;
    for (int i = 0; i < COUNT; i++) {
        int row = SIDE - 1 - i / SIDE; /* read top row first */
        double found = rgba[4 * (row * SIDE + i % SIDE)];
        double exact = -expm1(-(double)x[i]);
        if (exact == 0)
            assert_true(found == 0);
        else
            worst = fmax(worst, fabs(found / exact - 1));
    }
    print_message("1 - exp(-x): largest relative error %.2e\n", worst);
    /* Measured 2.9e-7 on llvmpipe. */
    assert_true(worst < 6e-7);
    gl_target_finish(&target);
    gl_context_destroy(context);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_one_minus_exp)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
