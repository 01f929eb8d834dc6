/* Shaders of a test's own, from parts of Pelt's. With a context current. */
#ifndef PELT_TESTS_UNIT_SHADER_FIXTURE_H
#define PELT_TESTS_UNIT_SHADER_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <glad/gl.h>

static inline GLuint compile(GLenum stage, const char *const *parts, GLsizei count) {
    GLuint shader = glCreateShader(stage);
    glShaderSource(shader, count, parts, NULL);
    glCompileShader(shader);
    GLint good;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (!good) {
        char log[2048];
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        fail_msg("%s", log);
    }
    return shader;
}

#endif
