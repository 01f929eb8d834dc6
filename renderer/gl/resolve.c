/* The last pass of every picture. shaders/resolve.frag says what a sample holds. */
#include "renderer/gl/resolve.h"

#include "renderer/gl/context.h"
#include "shaders/interface.h"

void gl_target_begin(struct gl_target *target, const double background[4], const double shares[3]) {
    static const float far_away = 0;
    float color[4] = {0, 0, 0, 0}; /* an optical depth of 0, whatever the background's alpha */
    for (int i = 0; i < 3 && background; i++)
        color[i] = (float)(background[i] * background[3]);
    target->over_background = background != NULL;
    target->tinted = shares != NULL;
    for (int i = 0; i < 3; i++)
        target->shares[i] = shares ? (float)shares[i] : 1;
    /* Depths reach the buffer as the shaders give them, in [0, 1]. */
    glClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    glBindFramebuffer(GL_FRAMEBUFFER, target->framebuffer);
    glViewport(0, 0, target->width, target->height);
    glClearNamedFramebufferfv(target->framebuffer, GL_COLOR, 0, color);
    if (target->depth) {
        glDepthMask(GL_TRUE);
        glClearNamedFramebufferfv(target->framebuffer, GL_DEPTH, 0, &far_away);
    }
}

/* Both ways; `blocks` NULL: every pixel. */
static enum status resolve(struct gl_programs *programs, const struct gl_target *samples, int k,
                           const struct gl_blocks *blocks, const double background[4],
                           const struct gl_target *picture, bool *compiled, struct error *err) {
    GLuint program, array;
    uint32_t flags = (blocks ? FLAG_BLOCKS : 0u) | (samples->tinted ? FLAG_TINT : 0u);
    enum status status =
        gl_programs_get(programs, GL_PROGRAM_RESOLVE, flags, &program, compiled, err);
    if (status != STATUS_OK)
        return status;
    float premultiplied[4];
    for (int i = 0; i < 4; i++)
        premultiplied[i] = (float)(background[i] * (i < 3 ? background[3] : 1));
    for (int i = 0; i < 3 && samples->over_background; i++)
        premultiplied[i] = 0; /* its light is there */
    glBindFramebuffer(GL_FRAMEBUFFER, picture->framebuffer);
    glViewport(0, 0, picture->width, picture->height);
    glDisable(GL_DEPTH_TEST);
    glDisable(GL_BLEND);
    glUseProgram(program);
    glProgramUniform1i(program, 0, k);
    glProgramUniform4fv(program, 1, 1, premultiplied);
    if (samples->tinted)
        glProgramUniform3fv(program, 3, 1, samples->shares);
    glBindTextureUnit(BINDING_SAMPLES, samples->color);
    if (blocks) {
        glProgramUniform3i(program, 2, blocks->side, picture->width, (GLint)blocks->count);
        glBindTextureUnit(BINDING_BLOCKS, blocks->texture);
    }
    glCreateVertexArrays(1, &array); /* empty: the triangle comes from no buffer */
    gl_blocks_draw(NULL, program, array);
    glDeleteVertexArrays(1, &array);
    return gl_check("resolving the samples", err);
}

enum status gl_resolve(struct gl_programs *programs, const struct gl_target *samples, int k,
                       const double background[4], const struct gl_target *picture, bool *compiled,
                       struct error *err) {
    return resolve(programs, samples, k, NULL, background, picture, compiled, err);
}

enum status gl_resolve_blocks(struct gl_programs *programs, const struct gl_target *samples,
                              const struct gl_blocks *blocks, const double background[4],
                              bool *compiled, struct error *err) {
    return resolve(programs, samples, blocks->k, blocks, background, &blocks->gathered, compiled,
                   err);
}
