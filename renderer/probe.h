/* A few pixels of a prepared picture, drawn again at another quality: what error estimates and
 * targets are made of. The pixels are the picture's own, with all their samples; they are drawn by
 * the same passes over the same buffers, so the fixed costs (meshes, order, uploads) are not paid
 * again. Uses the picture's sample target: what that holds is lost. */
#ifndef PELT_RENDERER_PROBE_H
#define PELT_RENDERER_PROBE_H

#include "renderer/drawing.h"

struct probe {
    struct gl_blocks blocks;
    double *chance;     /* of each block: the probability with which it was chosen */
    float (*pixels)[4]; /* of the last probe_draw(), in the order of `index`; block after block */
    uint32_t *index;    /* each pixel as y * width + x, the top row first */
    size_t count;
};

/* Zeroed is empty. Takes what its drawing needs with it: a context must be current. */
void probe_finish(struct probe *probe);

/* Chooses blocks of pixels of a picture of width x height with k x k samples a pixel, among those
 * that have a sample in `met` (as in struct picture; NULL: all are eligible), one of every `every`
 * by lot, spread evenly over the rows; the same call chooses the same. `interest`: NULL, or a
 * figure > 0 for each pixel, the top row first: a block's chance is as the sum of its pixels', so
 * that what is rare and matters is not missed; means over the blocks then weigh each by 1 / chance
 * (Horvitz & Thompson 1952). `side`: of a block, in pixels; 0: as suits the rasteriser.
 * STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status probe_choose(struct probe *probe, int width, int height, int k, int side,
                         const uint8_t *met, const float *interest, double every,
                         struct error *err);

/* Blocks that probe_choose() would choose from: for choosing `every`. */
size_t probe_eligible(int width, int height, int k, int side, const uint8_t *met);

/* The block's side that suits the rasteriser: whole 4 x 4 quads of samples where pixels allow it.
 */
int probe_block_side(int width, int height, int k);

/* Draws the chosen pixels with every object's quality multiplied by `factor`, over `background`
 * (straight linear RGBA). *ms: until the GL had finished drawing them, without reading them back.
 */
enum status probe_draw(struct probe *probe, const struct drawing *drawing,
                       const double background[4], double factor, double *ms, struct error *err);

#endif
