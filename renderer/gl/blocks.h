/* Drawing a few pixels of a picture instead of all: small square blocks of them, scattered over it.
 *
 * A full-screen pass is drawn as one point a block, as large as the block; every other pass under a
 * depth buffer that holds "nearest" outside the blocks, so that nothing there passes the depth test
 * and no fragment is shaded (llvmpipe and hardware test before they shade, unless a shader writes
 * depth or discards). What falls inside is drawn by the very programs and state of the whole
 * picture, so its pixels are the same to the bit.
 *
 * A context must be current in all of these. */
#ifndef PELT_RENDERER_GL_BLOCKS_H
#define PELT_RENDERER_GL_BLOCKS_H

#include <glad/gl.h>
#include <stdbool.h>
#include <stdint.h>

#include "renderer/gl/program.h"
#include "renderer/gl/target.h"

struct gl_blocks {
    int width, height; /* of the picture, pixels */
    int k;             /* samples along a pixel's side */
    int side;          /* of a block, pixels */
    uint32_t count;
    uint32_t (*corner)[2]; /* each block's lower left pixel, the bottom row being 0; owned */
    GLuint buffer, texture, array;
    struct gl_target gathered;
};

/* Zeroed is empty. Takes `corner` (malloc'ed) over, also on failure; every block lies within the
 * picture. STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status gl_blocks_set(struct gl_blocks *blocks, int width, int height, int k, int side,
                          uint32_t (*corner)[2], uint32_t count, struct error *err);
void gl_blocks_finish(struct gl_blocks *blocks);

/* Sets the depth of `target` (which has one) to far away within the blocks and to the nearest
 * outside. STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status gl_blocks_mask(const struct gl_blocks *blocks, const struct gl_target *target,
                           struct error *err);

/* Draws a full-screen pass (fullscreen.vert, whose uniforms are set but for its own) over the
 * blocks, or over everything where `blocks` is NULL. `array`: an empty vertex array. */
void gl_blocks_draw(const struct gl_blocks *blocks, GLuint program, GLuint array);

/* As gl_resolve(), for the blocks alone: fills pixels[side * side * count], block after block, each
 * from its lower left, row by row. */
enum status gl_blocks_gather(struct gl_blocks *blocks, struct gl_programs *programs,
                             const struct gl_target *samples, const double background[4],
                             float (*pixels)[4], bool *compiled, struct error *err);

#endif
