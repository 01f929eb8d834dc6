/* Render targets: fp32 colour, 32-bit float depth. */
#ifndef PELT_RENDERER_GL_TARGET_H
#define PELT_RENDERER_GL_TARGET_H

#include <glad/gl.h>
#include <stdbool.h>

#include "api/status.h"

/* An FBO with one RGBA32F colour texture and, if asked, a DEPTH_COMPONENT32F texture; both may be
 * sampled with texelFetch. Reused between pictures of one size. */
struct gl_target {
    int width, height;
    GLuint framebuffer, color, depth; /* depth 0: none */
    bool over_background;             /* drawn over it, not yet to be laid over it (resolve.h) */
    bool tinted;     /* channels lose shares of what a sample's optical depth says: */
    float shares[3]; /* the largest is 1 */
};

/* Makes the target this size, allocating only if it differs. STATUS_OUT_OF_MEMORY,
 * STATUS_GL_ERROR. */
enum status gl_target_resize(struct gl_target *target, int width, int height, bool with_depth,
                             struct error *err);
void gl_target_finish(struct gl_target *target);

/* Reads the colour texture, top row first, into rgba (width * height * 4 floats). Blocks. */
enum status gl_target_read(const struct gl_target *target, float *rgba, struct error *err);

#endif
