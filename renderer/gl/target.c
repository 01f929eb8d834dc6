/* Render targets: what Pelt draws into, and how pixels come back. */
#include "renderer/gl/target.h"

#include <string.h>

#include "renderer/gl/context.h"

enum status gl_target_resize(struct gl_target *target, int width, int height, bool with_depth,
                             struct error *err) {
    if (target->framebuffer && target->width == width && target->height == height &&
        (target->depth != 0) == with_depth)
        return STATUS_OK;
    gl_target_finish(target);
    GLint side_max = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side_max);
    if (width < 1 || height < 1 || width > side_max || height > side_max)
        return error_fault(err, STATUS_TOO_COMPLEX, NULL,
                           "a render target of %d x %d: this GL draws at most %d x %d", width,
                           height, side_max, side_max);

    target->width = width;
    target->height = height;
    glCreateTextures(GL_TEXTURE_2D, 1, &target->color);
    glTextureStorage2D(target->color, 1, GL_RGBA32F, width, height);
    glTextureParameteri(target->color, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTextureParameteri(target->color, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glCreateFramebuffers(1, &target->framebuffer);
    glNamedFramebufferTexture(target->framebuffer, GL_COLOR_ATTACHMENT0, target->color, 0);
    if (with_depth) {
        glCreateTextures(GL_TEXTURE_2D, 1, &target->depth);
        glTextureStorage2D(target->depth, 1, GL_DEPTH_COMPONENT32F, width, height);
        glTextureParameteri(target->depth, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTextureParameteri(target->depth, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        glNamedFramebufferTexture(target->framebuffer, GL_DEPTH_ATTACHMENT, target->depth, 0);
    }
    enum status status = gl_check("a render target", err);
    if (status == STATUS_OK) {
        GLenum complete = glCheckNamedFramebufferStatus(target->framebuffer, GL_FRAMEBUFFER);
        if (complete != GL_FRAMEBUFFER_COMPLETE)
            status = error_fault(err, STATUS_GL_ERROR, NULL,
                                 "a render target of %d x %d is incomplete (0x%x)", width, height,
                                 complete);
    }
    if (status != STATUS_OK)
        gl_target_finish(target);
    return status;
}

void gl_target_finish(struct gl_target *target) {
    glDeleteFramebuffers(1, &target->framebuffer); /* names of 0 are ignored */
    glDeleteTextures(1, &target->color);
    glDeleteTextures(1, &target->depth);
    *target = (struct gl_target){0};
}

/* GL's first row is the bottom one. Rows are swapped in place, a piece at a time. */
static void flip_rows(float *rgba, size_t row_floats, int rows) {
    enum { PIECE = 1024 };
    float held[PIECE];
    for (int low = 0, high = rows - 1; low < high; low++, high--)
        for (size_t at = 0; at < row_floats; at += PIECE) {
            size_t bytes = (row_floats - at < PIECE ? row_floats - at : PIECE) * sizeof *rgba;
            float *a = rgba + (size_t)low * row_floats + at;
            float *b = rgba + (size_t)high * row_floats + at;
            memcpy(held, a, bytes);
            memcpy(a, b, bytes);
            memcpy(b, held, bytes);
        }
}

enum status gl_target_read(const struct gl_target *target, float *rgba, struct error *err) {
    /* Bands of BAND_BYTES are still in the cache when they are flipped: 1024 x 1024 takes 1.0 ms,
     * against 1.6 for one read and one flip, 1.3 through a pixel buffer, and 0.7 for the read
     * alone. On hardware each call is a round trip, so the bands are not rows. */
    enum { BAND_BYTES = 1024 * 1024 };
    size_t row_floats = (size_t)target->width * 4;
    int band = (int)(BAND_BYTES / (row_floats * sizeof *rgba));
    if (band < 1)
        band = 1;
    GLint bound = 0;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &bound);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, target->framebuffer);
    glPixelStorei(GL_PACK_ALIGNMENT, 4);
    for (int bottom = 0; bottom < target->height; bottom += band) {
        int rows = target->height - bottom < band ? target->height - bottom : band;
        float *to = rgba + (size_t)(target->height - bottom - rows) * row_floats;
        glReadPixels(0, bottom, target->width, rows, GL_RGBA, GL_FLOAT, to);
        flip_rows(to, row_floats, rows);
    }
    glBindFramebuffer(GL_READ_FRAMEBUFFER, (GLuint)bound);
    return gl_check("reading pixels back", err);
}
