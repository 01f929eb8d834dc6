/* From the renderer's pixels to the bytes of a file: PNG, OpenEXR, base64.
 *
 * The input of both image writers is what renderer_render() gives: width * height * 4 floats, top
 * row first, premultiplied linear RGBA. The same pixels always give the same bytes. Thread: any;
 * nothing is shared between calls. */
#ifndef PELT_SERVICE_ENCODE_H
#define PELT_SERVICE_ENCODE_H

#include <stddef.h>

#include "api/status.h"

enum encode_format { ENCODE_PNG, ENCODE_EXR };

/* 8-bit PNG: straight alpha, sRGB-encoded from float, clamped to [0, 1], no tone map. NaN becomes
 * 0. The alpha channel is left out where every pixel is opaque. A pixel whose alpha rounds to 0 is
 * written as 0, 0, 0, 0. `*data` is malloc'ed (caller frees) and NULL on failure.
 * STATUS_OUT_OF_MEMORY, STATUS_INTERNAL. Precondition: 1 <= width, height <= SCENE_IMAGE_SIDE_MAX.
 */
enum status encode_png(const float *rgba, int width, int height, unsigned char **data,
                       size_t *bytes, struct error *err);

/* OpenEXR: premultiplied linear fp32, through the OpenImageIO module, which is loaded on first use.
 * As above; STATUS_IO_ERROR where the module is not installed. */
enum status encode_exr(const float *rgba, int width, int height, unsigned char **data,
                       size_t *bytes, struct error *err);

/* One of the two, by format. */
enum status encode_image(enum encode_format format, const float *rgba, int width, int height,
                         unsigned char **data, size_t *bytes, struct error *err);

/* A map of width * height values as a grey, opaque picture; as above. */
enum status encode_map(enum encode_format format, const float *map, int width, int height,
                       unsigned char **data, size_t *bytes, struct error *err);

/* About how long encode_image() takes, for those who have a deadline: from the slowest pictures
 * that were measured, noise in every pixel, on two slow cores; with what opening the EXR module
 * costs, where it is not open. */
double encode_expected_ms(enum encode_format format, int width, int height);

/* RFC 4648 base64 with padding and without line breaks; malloc'ed (caller frees), terminated.
 * `length` (may be NULL) receives its length. NULL where memory ran out. */
char *encode_base64(const unsigned char *data, size_t bytes, size_t *length);

/* The reverse, strict: `length` characters, nothing but digits and final padding. malloc'ed (caller
 * frees), NULL where memory ran out or the text is no base64. */
unsigned char *decode_base64(const char *text, size_t length, size_t *bytes);

/* 8-bit sRGB of linear values, exact: the nearest code (ties upwards) of IEC 61966-2-1's transfer
 * function, found by a table of the 255 thresholds between codes. */
struct srgb_table {
    float threshold[257];     /* [k]: the smallest float whose code is k; [256]: infinity */
    unsigned char base[1665]; /* the code at the lower end of each bucket of 2^-7 octave */
};
void srgb_table_init(struct srgb_table *table);
unsigned char srgb_encode(const struct srgb_table *table, float linear);

#endif
