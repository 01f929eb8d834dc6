/* Three draws on 4 x 4 pixels whose results are exact in fp32 and in nothing less.
 *
 * Over a clear of (1, 2, 3, 4) at depth 1:
 *   first, at depth 0.375:  colour = source + clear x factor, the two sources of dual-source
 * blending; second, at depth 0.5:   behind the first, so nothing may change; then the depth is read
 * back. source.w is 2^-20: the sum 2 + 2^-20 needs 21 bits of significand, which fp16 and 8 bit
 * lack; source.z is 100000, beyond fp16's largest. Every result is a sum of few bits, so that one
 * rounding order is as good as another and the comparison can be exact. */
#include "renderer/gl/selftest.h"

#include <glad/gl.h>
#include <string.h>

#include "renderer/gl/program.h"
#include "renderer/gl/target.h"

enum { SIDE = 4 };

static const float cleared[4] = {1, 2, 3, 4};
static const float source[4] = {0.5f, 0.25f, 100000, 0x1p-20f};
static const float factor[4] = {0, 0.25f, 0.5f, 0.5f};
static const float near_ndc = -0.25f, far_ndc = 0;

static void draw(GLuint program, struct gl_target *target) {
    GLuint array = 0;
    glCreateVertexArrays(1, &array);
    glBindVertexArray(array);
    glBindFramebuffer(GL_FRAMEBUFFER, target->framebuffer);
    glViewport(0, 0, SIDE, SIDE);
    glUseProgram(program);
    glUniform4fv(1, 1, source);
    glUniform4fv(2, 1, factor);
    glUniform1i(3, 0);
    const float depth = 1;
    glClearNamedFramebufferfv(target->framebuffer, GL_COLOR, 0, cleared);
    glClearNamedFramebufferfv(target->framebuffer, GL_DEPTH, 0, &depth);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_SRC1_COLOR);
    glUniform1f(0, near_ndc);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glUniform1f(0, far_ndc);
    glDrawArrays(GL_TRIANGLES, 0, 3);

    glDisable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ZERO);
    glDisable(GL_DEPTH_TEST);
    glUseProgram(0);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glBindVertexArray(0);
    glDeleteVertexArrays(1, &array);
}

static enum status compare(const struct gl_info *info, const struct gl_target *target,
                           struct error *err) {
    float got[SIDE * SIDE * 4], depth[SIDE * SIDE];
    enum status status = gl_target_read(target, got, err);
    if (status != STATUS_OK)
        return status;
    glGetTextureImage(target->depth, 0, GL_DEPTH_COMPONENT, GL_FLOAT, sizeof depth, depth);
    status = gl_check("reading depth back", err);
    if (status != STATUS_OK)
        return status;
    for (int i = 0; i < SIDE * SIDE; i++) {
        int x = i % SIDE, row = i / SIDE;
        const float pixel[4] = {(float)x, (float)(SIDE - 1 - row), 0, 0};
        for (int c = 0; c < 4; c++) {
            float wanted = source[c] + pixel[c] + cleared[c] * factor[c];
            if (got[i * 4 + c] != wanted)
                return error_fault(err, STATUS_NO_GL, NULL,
                                   "%s: %s does not blend 32-bit float colours from two sources: "
                                   "%.9g in place of %.9g",
                                   info->backend, info->renderer, (double)got[i * 4 + c],
                                   (double)wanted);
        }
        if (depth[i] != 0.5f + 0.5f * near_ndc)
            return error_fault(err, STATUS_NO_GL, NULL,
                               "%s: %s does not keep depth: %.9g in place of %.9g", info->backend,
                               info->renderer, (double)depth[i], (double)(0.5f + 0.5f * near_ndc));
    }
    return STATUS_OK;
}

enum status gl_selftest(const struct gl_info *info, struct error *err) {
    GLint dual_source = 0;
    glGetIntegerv(GL_MAX_DUAL_SOURCE_DRAW_BUFFERS, &dual_source);
    if (dual_source < 1)
        return error_fault(err, STATUS_NO_GL, NULL, "%s: %s cannot blend from two sources",
                           info->backend, info->renderer);
    struct gl_target target = {0};
    struct gl_programs *programs = gl_programs_create();
    GLuint program = 0;
    struct error why = {0};
    enum status status = programs
                             ? gl_programs_get(programs, GL_PROGRAM_CHECK, 0, &program, NULL, &why)
                             : error_fault(&why, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
    if (status == STATUS_OK)
        status = gl_target_resize(&target, SIDE, SIDE, true, &why);
    if (status == STATUS_OK) {
        draw(program, &target);
        status = gl_check("the self-test's draw", &why);
    }
    if (status == STATUS_OK)
        status = compare(info, &target, &why);
    gl_target_finish(&target);
    gl_programs_destroy(programs);

    /* Whatever went wrong, this GL is of no use; the reason stands in the text. */
    if (status != STATUS_OK && status != STATUS_NO_GL) {
        status = error_fault(err, STATUS_NO_GL, NULL, "%s: %s fails its self-test: %s",
                             info->backend, info->renderer,
                             why.fault_count && why.faults[0].message ? why.faults[0].message
                                                                      : status_title(status));
        error_clear(&why);
    } else {
        error_move(err, &why);
    }
    return status;
}
