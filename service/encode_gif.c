/* Animated GIF through the OpenImageIO module: floats over the background to 8-bit sRGB here, the
 * palette and the file there. */
#include "service/encode_gif.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"
#include "service/encode.h"

struct encode_gif {
    const struct image_module *images;
    struct image_gif *gif;
    size_t pixels;
    unsigned char *rgb;
    struct srgb_table table;
};

static enum status failed(int outcome, const char *message, struct error *err) {
    return error_fault(err, outcome == IMAGE_OUT_OF_MEMORY ? STATUS_OUT_OF_MEMORY : STATUS_INTERNAL,
                       NULL, "%s", message);
}

enum status encode_gif_begin(int width, int height, double fps, struct encode_gif **out,
                             struct error *err) {
    *out = NULL;
    const struct image_module *images = module_open(MODULE_IMAGE_OIIO, err);
    if (!images)
        return STATUS_IO_ERROR;
    struct encode_gif *gif = calloc(1, sizeof *gif);
    size_t pixels = (size_t)width * (size_t)height;
    unsigned char *rgb = malloc(3 * pixels);
    if (!gif || !rgb) {
        free(gif);
        free(rgb);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a GIF");
    }
    *gif = (struct encode_gif){.images = images, .pixels = pixels, .rgb = rgb};
    srgb_table_init(&gif->table);
    char message[256] = "";
    int centiseconds = (int)fmin(fmax(floor(100 / fps + 0.5), 2), 65535);
    int outcome =
        images->gif_begin(width, height, centiseconds, &gif->gif, message, sizeof message);
    if (outcome) {
        encode_gif_abandon(gif);
        return failed(outcome, message, err);
    }
    *out = gif;
    return STATUS_OK;
}

enum status encode_gif_add(struct encode_gif *gif, const float *rgba, const double background[4],
                           struct error *err) {
    for (size_t i = 0; i < gif->pixels; i++) {
        float through = 1 - rgba[4 * i + 3];
        for (int c = 0; c < 3; c++)
            gif->rgb[3 * i + (size_t)c] =
                srgb_encode(&gif->table, rgba[4 * i + (size_t)c] + through * (float)background[c]);
    }
    char message[256] = "";
    int outcome = gif->images->gif_add(gif->gif, gif->rgb, message, sizeof message);
    return outcome ? failed(outcome, message, err) : STATUS_OK;
}

static void finish(struct encode_gif *gif) {
    free(gif->rgb);
    free(gif);
}

enum status encode_gif_end(struct encode_gif *gif, unsigned char **data, size_t *bytes,
                           struct error *err) {
    char message[256] = "";
    int outcome = gif->images->gif_end(gif->gif, data, bytes, message, sizeof message);
    finish(gif);
    return outcome ? failed(outcome, message, err) : STATUS_OK;
}

void encode_gif_abandon(struct encode_gif *gif) {
    if (!gif)
        return;
    if (gif->gif)
        gif->images->gif_end(gif->gif, NULL, NULL, NULL, 0);
    finish(gif);
}
