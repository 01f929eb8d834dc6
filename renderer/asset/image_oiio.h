/* The thin C face of OpenImageIO (image_oiio.cc, built as a module). Exceptions stop there.
 * Untrusted input: formats are admitted by magic bytes (PNG, JPEG, OpenEXR, TIFF, HDR, WebP, GIF,
 * TGA is not), dimensions are read and checked before a pixel is decoded. */
#ifndef PELT_RENDERER_ASSET_IMAGE_OIIO_H
#define PELT_RENDERER_ASSET_IMAGE_OIIO_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum { IMAGE_SIDE_MAX = 16384, IMAGE_PIXELS_MAX = 64 * 1024 * 1024 };

/* What the functions return besides 0. */
enum { IMAGE_REFUSED = -1, IMAGE_OUT_OF_MEMORY = -2 };

struct image_pixels {
    int width, height, channels; /* as decoded */
    float *data;                 /* width * height * channels, top row first; malloc'ed */
    int bits;                    /* of the file's samples: 8, 16, 32 */
    int is_float;
};

/* The largest volume: voxels in all, and along each side. */
enum { VOLUME_FILE_VOXELS_MAX = 32 * 1024 * 1024, VOLUME_FILE_SIDE_MAX = 4096 };

struct volume_pixels {
    int size[3];  /* x (u), y (v), z (w, from the base up) */
    int channels; /* 1: weight; 2: grey, weight; 4: colour, weight */
    float *data;  /* x fastest, then y, then z; malloc'ed */
    int bits;     /* of the file's samples: 8, 16, 32 */
    int is_float;
    int is_density;    /* the weight is a density (OpenVDB); else an alpha */
    int premultiplied; /* colours are already times alpha (OpenEXR) */
};
struct image_gif; /* an animated GIF that is being written */

/* A table, so that a module needs one symbol (`pelt_image_module`). Every function returns 0 on
 * success, else one of the above and writes a message of at most message_bytes. */
struct image_module {
    /* Decodes all channels to float: integers as value / maximum, without any colour transform. */
    int (*decode)(const unsigned char *data, size_t bytes, struct image_pixels *image,
                  char *message, size_t message_bytes);
    /* Reads an OpenVDB file (grid `density`, or the first with one channel; colours from `Cd` or
     * `color`, over the density's own box), the pages of a TIFF, GIF or WebP image as layers from
     * the base up, or a flat image that is a strip of square layers: from top to bottom, or from
     * left to right. Values are as in the file, whatever they are. */
    int (*decode_volume)(const unsigned char *data, size_t bytes, struct volume_pixels *volume,
                         char *message, size_t message_bytes);
    /* Writes premultiplied linear fp32 RGBA as a ZIP-compressed OpenEXR file into malloc'ed
     * memory. The same pixels give the same bytes. */
    int (*encode_exr)(const float *rgba, int width, int height, unsigned char **data, size_t *bytes,
                      char *message, size_t message_bytes);
    /* An animated GIF, frame by frame: 8-bit RGB, top row first, each shown for `centiseconds`,
     * again and again. Every frame has 256 colours of its own, dithered. gif_end() gives the
     * malloc'ed file and frees *gif, whatever it returns; data NULL: it is thrown away. The same
     * frames give the same bytes. */
    int (*gif_begin)(int width, int height, int centiseconds, struct image_gif **gif, char *message,
                     size_t message_bytes);
    int (*gif_add)(struct image_gif *gif, const unsigned char *rgb, char *message,
                   size_t message_bytes);
    int (*gif_end)(struct image_gif *gif, unsigned char **data, size_t *bytes, char *message,
                   size_t message_bytes);
    const char *(*version)(void);
};

#ifdef __cplusplus
}
#endif

#endif
