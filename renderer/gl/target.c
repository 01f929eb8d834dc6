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

/* GL's first row is the bottom one. */
static void flip_rows(float *rgba, int width, int height) {
    enum { PIECE = 1024 };
    float held[PIECE];
    size_t row = (size_t)width * 4;
    for (int low = 0, high = height - 1; low < high; low++, high--)
        for (size_t at = 0; at < row; at += PIECE) {
            size_t bytes = (row - at < PIECE ? row - at : PIECE) * sizeof *rgba;
            float *a = rgba + (size_t)low * row + at, *b = rgba + (size_t)high * row + at;
            memcpy(held, a, bytes);
            memcpy(a, b, bytes);
            memcpy(b, held, bytes);
        }
}

enum status gl_target_read(const struct gl_target *target, float *rgba, struct error *err) {
    size_t bytes = (size_t)target->width * (size_t)target->height * 4 * sizeof *rgba;
    /* The size that the call takes is an int; one row at a time is always below it. */
    if (bytes <= INT32_MAX) {
        glPixelStorei(GL_PACK_ALIGNMENT, 4);
        glGetTextureImage(target->color, 0, GL_RGBA, GL_FLOAT, (GLsizei)bytes, rgba);
        flip_rows(rgba, target->width, target->height);
    } else {
        size_t row = (size_t)target->width * 4;
        for (int y = 0; y < target->height; y++)
            glGetTextureSubImage(target->color, 0, 0, y, 0, target->width, 1, 1, GL_RGBA, GL_FLOAT,
                                 (GLsizei)(row * sizeof *rgba),
                                 rgba + (size_t)(target->height - 1 - y) * row);
    }
    return gl_check("reading pixels back", err);
}
