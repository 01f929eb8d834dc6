/* See blocks.h. */
#include "renderer/gl/blocks.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/gl/context.h"
#include "renderer/gl/resolve.h"
#include "shaders/interface.h"

enum { GATHERED_WIDTH = 512 };

enum status gl_blocks_set(struct gl_blocks *blocks, int width, int height, int k, int side,
                          uint32_t (*corner)[2], uint32_t count, struct error *err) {
    free(blocks->corner);
    blocks->width = width;
    blocks->height = height;
    blocks->k = k;
    blocks->side = side;
    blocks->count = count;
    blocks->corner = corner;
    float(*data)[2] = malloc((count + (size_t)1) * sizeof *data);
    if (!data)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %u blocks", count);
    for (uint32_t i = 0; i < count; i++)
        for (int c = 0; c < 2; c++)
            data[i][c] = (float)corner[i][c]; /* exact: below 2^24 */
    if (!blocks->buffer) {
        glCreateBuffers(1, &blocks->buffer);
        glCreateTextures(GL_TEXTURE_BUFFER, 1, &blocks->texture);
        glCreateVertexArrays(1, &blocks->array);
        glEnableVertexArrayAttrib(blocks->array, 0);
        glVertexArrayAttribFormat(blocks->array, 0, 2, GL_FLOAT, GL_FALSE, 0);
        glVertexArrayAttribBinding(blocks->array, 0, 0);
    }
    glNamedBufferData(blocks->buffer, (GLsizeiptr)((count + (size_t)1) * sizeof *data), data,
                      GL_STREAM_DRAW);
    glTextureBuffer(blocks->texture, GL_RG32F, blocks->buffer);
    glVertexArrayVertexBuffer(blocks->array, 0, blocks->buffer, 0, sizeof *data);
    free(data);
    return gl_check("uploading blocks of pixels", err);
}

void gl_blocks_finish(struct gl_blocks *blocks) {
    free(blocks->corner);
    glDeleteVertexArrays(1, &blocks->array);
    glDeleteTextures(1, &blocks->texture);
    glDeleteBuffers(1, &blocks->buffer);
    gl_target_finish(&blocks->gathered);
    *blocks = (struct gl_blocks){0};
}

enum status gl_blocks_mask(const struct gl_blocks *blocks, const struct gl_target *target,
                           struct error *err) {
    size_t width = (size_t)target->width, side = (size_t)blocks->side * (size_t)blocks->k;
    float *depth = malloc(width * (size_t)target->height * sizeof *depth);
    if (!depth)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a mask");
    for (size_t i = 0; i < width * (size_t)target->height; i++)
        depth[i] = 1; /* the nearest there is: interface.h, DEPTH_OF_T */
    for (uint32_t i = 0; i < blocks->count; i++) {
        size_t x = blocks->corner[i][0] * (size_t)blocks->k;
        size_t y = blocks->corner[i][1] * (size_t)blocks->k;
        for (size_t row = y; row < y + side; row++)
            memset(depth + row * width + x, 0, side * sizeof *depth);
    }
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTextureSubImage2D(target->depth, 0, 0, 0, target->width, target->height, GL_DEPTH_COMPONENT,
                        GL_FLOAT, depth);
    free(depth);
    return gl_check("masking pixels", err);
}

void gl_blocks_draw(const struct gl_blocks *blocks, GLuint program, GLuint array) {
    float side = blocks ? (float)(blocks->side * blocks->k) : 0;
    float width = blocks ? 2 / (float)blocks->width : 0;
    float height = blocks ? 2 / (float)blocks->height : 0;
    glProgramUniform4f(program, LOCATION_BLOCK, side, width, height,
                       blocks ? (float)blocks->side / 2 : 0);
    glBindVertexArray(blocks ? blocks->array : array);
    if (blocks) {
        glEnable(GL_PROGRAM_POINT_SIZE);
        glDrawArrays(GL_POINTS, 0, (GLsizei)blocks->count);
        glDisable(GL_PROGRAM_POINT_SIZE);
    } else {
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
}

enum status gl_blocks_gather(struct gl_blocks *blocks, struct gl_programs *programs,
                             const struct gl_target *samples, const double background[4],
                             float (*pixels)[4], bool *compiled, struct error *err) {
    uint64_t count = (uint64_t)blocks->count * (uint64_t)blocks->side * (uint64_t)blocks->side;
    if (count == 0)
        return STATUS_OK;
    int rows = (int)((count + GATHERED_WIDTH - 1) / GATHERED_WIDTH);
    float(*all)[4] = malloc((size_t)rows * GATHERED_WIDTH * sizeof *all);
    if (!all)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %llu pixels",
                           (unsigned long long)count);
    enum status status = gl_target_resize(&blocks->gathered, GATHERED_WIDTH, rows, false, err);
    if (status == STATUS_OK)
        status = gl_resolve_blocks(programs, samples, blocks, background, compiled, err);
    if (status == STATUS_OK)
        status = gl_target_read(&blocks->gathered, all[0], err);
    /* gl_target_read() gives the top row first. */
    for (uint64_t i = 0; i < count && status == STATUS_OK; i++) {
        size_t row = (size_t)rows - 1 - (size_t)(i / GATHERED_WIDTH);
        memcpy(pixels[i], all[row * GATHERED_WIDTH + i % GATHERED_WIDTH], sizeof *pixels);
    }
    free(all);
    return status;
}
