/* EGL and OSMesa give the same picture to the last bit.
 *
 * One backend for each process, so this program runs itself once for each, as a child that writes
 * its pixels to a pipe. The picture leans on what could differ: perspective interpolation of many
 * small triangles, trilinear filtering, transcendental functions, dual-source blending in a fixed
 * order, a float depth buffer. On a machine where EGL draws on hardware the two are different
 * rasterisers, and the comparison is skipped. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "renderer/gl/context.h"
#include "renderer/gl/target.h"

enum { WIDTH = 301, HEIGHT = 203, TRIANGLES = 4000, PIXELS = WIDTH * HEIGHT, HARDWARE = 3 };

static const char vertex_text[] =
    "#version 450 core\n"
    "layout(location = 0) out vec3 where;\n"
    "uint mix_bits(uint x) {\n"
    "    x = (x ^ (x >> 16)) * 0x7feb352du;\n"
    "    x = (x ^ (x >> 15)) * 0x846ca68bu;\n"
    "    return x ^ (x >> 16);\n"
    "}\n"
    "float chance(uint x) { return float(mix_bits(x) >> 8) * 5.9604644775390625e-8; }\n";

static const char vertex_main[] =
    "void main() {\n"
    "    uint triangle = uint(gl_VertexID) / 3u, corner = uint(gl_VertexID);\n"
    "    vec3 middle = vec3(chance(triangle * 7u), chance(triangle * 7u + 1u), chance(triangle * "
    "7u + 2u));\n"
    "    vec3 offset = vec3(chance(corner * 11u), chance(corner * 11u + 1u), chance(corner * 11u + "
    "2u)) - 0.5;\n"
    "    where = middle + 0.2 * offset;\n"
    "    float w = 0.5 + where.z;\n"
    "    gl_Position = vec4((where.xy * 2.0 - 1.0) * 0.9, (where.z - 0.5) * 0.8, w);\n"
    "}\n";

static const char fragment_text[] =
    "#version 450 core\n"
    "layout(location = 0) in vec3 where;\n"
    "layout(binding = 0) uniform sampler3D volume;\n"
    "layout(location = 0, index = 0) out vec4 color;\n"
    "layout(location = 0, index = 1) out vec4 transmittance;\n"
    "void main() {\n"
    "    vec4 texel = texture(volume, where * 3.0);\n"
    "    float tau = 2.0 * texel.a * length(dFdx(where)) * 40.0;\n"
    "    for (int i = 0; i < 8; i++)\n"
    "        tau += 0.01 * exp(-where.z * float(i)) * pow(texel.r + 0.1, 1.7);\n"
    "    color = vec4(texel.rgb * (1.0 - exp(-tau)) + 0.1 * sin(where * 30.0), 1.0 - exp(-tau));\n"
    "    transmittance = vec4(exp(-tau));\n"
    "}\n";

static GLuint compile(GLenum type, int count, const char *const *text) {
    GLuint shader = glCreateShader(type);
    GLint compiled = 0;
    glShaderSource(shader, count, text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (!compiled) {
        char log[1000];
        glGetShaderInfoLog(shader, sizeof log, NULL, log);
        fprintf(stderr, "%s\n", log);
    }
    return shader;
}

static GLuint make_volume(void) {
    enum { SIDE = 16 };
    static unsigned char texels[SIDE * SIDE * SIDE][4];
    uint32_t seed = 1;
    for (size_t i = 0; i < sizeof texels; i++) {
        seed = seed * 1664525u + 1013904223u;
        (&texels[0][0])[i] = (unsigned char)(seed >> 24);
    }
    GLuint volume = 0;
    glCreateTextures(GL_TEXTURE_3D, 1, &volume);
    glTextureStorage3D(volume, 1, GL_RGBA8, SIDE, SIDE, SIDE);
    glTextureSubImage3D(volume, 0, 0, 0, 0, SIDE, SIDE, SIDE, GL_RGBA, GL_UNSIGNED_BYTE, texels);
    glTextureParameteri(volume, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    return volume;
}

/* The whole life of one context; the exit code of the child. */
static int draw_main(enum gl_backend backend, int out) {
    static const char *const vertex[] = {vertex_text, vertex_main};
    static const char *const fragment[] = {fragment_text};
    const struct gl_options options = {backend, -1, false};
    struct gl_context *context;
    struct error err = {0};
    struct gl_target target = {0};
    if (gl_context_create(&options, &context, &err) != STATUS_OK) {
        fprintf(stderr, "%s\n", err.fault_count ? err.faults[0].message : "no context");
        error_clear(&err);
        return 1;
    }
    if (!gl_context_info(context)->software) {
        gl_context_destroy(context);
        return HARDWARE;
    }
    if (gl_target_resize(&target, WIDTH, HEIGHT, true, &err) != STATUS_OK)
        return 1;
    GLuint program = glCreateProgram(), array = 0, volume = make_volume();
    glAttachShader(program, compile(GL_VERTEX_SHADER, 2, vertex));
    glAttachShader(program, compile(GL_FRAGMENT_SHADER, 1, fragment));
    glLinkProgram(program);
    glUseProgram(program);
    glCreateVertexArrays(1, &array);
    glBindVertexArray(array);
    glBindTextureUnit(0, volume);
    glBindFramebuffer(GL_FRAMEBUFFER, target.framebuffer);
    glViewport(0, 0, WIDTH, HEIGHT);
    glClearColor(0, 0, 0, 0);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glEnable(GL_DEPTH_TEST);
    glDrawArrays(GL_TRIANGLES, 0, 300); /* some write depth, the rest is blended over them */
    glDepthMask(GL_FALSE);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_SRC1_COLOR);
    glDrawArrays(GL_TRIANGLES, 300, TRIANGLES * 3 - 300);

    static float rgba[PIXELS * 4];
    if (gl_target_read(&target, rgba, &err) != STATUS_OK)
        return 1;
    gl_target_finish(&target);
    gl_context_destroy(context);
    for (size_t sent = 0; sent < sizeof rgba;) {
        ssize_t now = write(out, (const char *)rgba + sent, sizeof rgba - sent);
        if (now < 0)
            return 1;
        sent += (size_t)now;
    }
    return 0;
}

/* Runs this program as the child that draws with `backend`; its exit code. */
static int draw_in_child(const char *backend, float *rgba) {
    extern char **environ;
    int ends[2];
    assert_int_equal(pipe2(ends, O_CLOEXEC), 0);
    char program[] = "/proc/self/exe", name[16];
    snprintf(name, sizeof name, "%s", backend);
    char *const argv[] = {program, name, NULL};
    posix_spawn_file_actions_t actions;
    pid_t child = 0;
    assert_int_equal(posix_spawn_file_actions_init(&actions), 0);
    assert_int_equal(posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO), 0);
    assert_int_equal(posix_spawn(&child, program, &actions, NULL, argv, environ), 0);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    size_t got = 0, wanted = PIXELS * 4 * sizeof *rgba;
    for (ssize_t now = 1; got < wanted && now > 0; got += (size_t)now)
        now = read(ends[0], (char *)rgba + got, wanted - got);
    close(ends[0]);
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    assert_true(WIFEXITED(status));
    if (WEXITSTATUS(status) == 0)
        assert_int_equal(got, wanted);
    return WEXITSTATUS(status);
}

static void test_both_backends_draw_the_same(void **state) {
    (void)state;
    static float egl[PIXELS * 4], osmesa[PIXELS * 4];
    int code = draw_in_child("egl", egl);
    if (code == HARDWARE)
        skip();
    assert_int_equal(code, 0);
    assert_int_equal(draw_in_child("osmesa", osmesa), 0);
    size_t differ = 0, covered = 0;
    for (size_t i = 0; i < PIXELS * 4; i++) {
        differ += memcmp(&egl[i], &osmesa[i], sizeof *egl) != 0;
        covered += egl[i] != 0 && egl[i] - egl[i] == 0; /* finite */
    }
    assert_int_equal(differ, 0);
    assert_true(covered > PIXELS * 2); /* there is something to compare: half of all values */
}

int main(int argc, char **argv) {
    if (argc > 1)
        return draw_main(strcmp(argv[1], "egl") == 0 ? GL_BACKEND_EGL : GL_BACKEND_OSMESA,
                         STDOUT_FILENO);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_both_backends_draw_the_same)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
