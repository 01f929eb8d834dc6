/* From linear premultiplied floats to PNG, OpenEXR and base64.
 *
 * PNG is written here by libpng and not by OpenImageIO, because most pictures need nothing else of
 * that library (261 shared objects, 0.4 s to load), and because it divides by alpha after it has
 * rounded to 8 bits: 0.1 at alpha 0.2 comes back as 130 and not as 128. After the SUB filter, zlib
 * at level 1 that looks for runs alone is both the fastest and the smallest of its strategies:
 * smooth with noise, 1024 x 1024 RGBA, 20 ms and 1.1 MB, against 32-41 ms and 1.3 MB by default.
 *
 * sRGB: pow() for each channel would cost 60 ms for 1024 x 1024. Instead the 255 floats at which
 * the code changes are computed in double, and a table over the float's exponent and its seven
 * leading bits of mantissa says which of them is near. Two thresholds are never in one bucket: they
 * are closest, relative to their value, near 1, 255 * 1.055 / 2.4 = 112 to the unit, where a bucket
 * is 1/256 wide. So one comparison decides, and the result is exact.
 *
 * Left out: 16-bit PNG (EXR keeps floats), interlacing, colour management beyond the sRGB chunk. */
#include "service/encode.h"

#include <assert.h>
#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>

#include "api/scene.h"
#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"

/* ---- sRGB ---- */

enum { BUCKET_SHIFT = 23 - 7, LOWEST_EXPONENT = 127 - 13 };
static const uint32_t lowest_bits = (uint32_t)LOWEST_EXPONENT << 23; /* 2^-13, below code 1 */

static double linear_from_srgb(double s) {
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

void srgb_table_init(struct srgb_table *table) {
    table->threshold[0] = 0;
    for (int code = 1; code <= 255; code++) {
        double exact = linear_from_srgb((code - 0.5) / 255);
        float near = (float)exact;
        table->threshold[code] = near < exact ? nextafterf(near, 2) : near;
    }
    table->threshold[256] = INFINITY;
    int code = 0;
    for (uint32_t i = 0; i < sizeof table->base; i++) {
        uint32_t bits = lowest_bits + (i << BUCKET_SHIFT);
        float lower;
        memcpy(&lower, &bits, sizeof lower);
        while (table->threshold[code + 1] <= lower)
            code++;
        table->base[i] = (unsigned char)code;
    }
}

/* `x` in [2^-13, 1]. */
static unsigned char code_of(const struct srgb_table *table, float x) {
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    unsigned base = table->base[(bits - lowest_bits) >> BUCKET_SHIFT];
    return (unsigned char)(base + (x >= table->threshold[base + 1]));
}

unsigned char srgb_encode(const struct srgb_table *table, float linear) {
    const float low = 1.0f / 8192;
    float x = linear > low ? linear : low; /* NaN too */
    return code_of(table, x < 1 ? x : 1);
}

/* ---- pixels ---- */

static float clamp01(float x) {
    return x > 0 ? (x < 1 ? x : 1) : 0; /* NaN: 0 */
}

static unsigned char alpha_code(float alpha) {
    return (unsigned char)(clamp01(alpha) * 255 + 0.5f);
}

static bool is_opaque(const float *rgba, size_t pixels) {
    for (size_t i = 0; i < pixels; i++)
        if (alpha_code(rgba[4 * i + 3]) != 255)
            return false;
    return true;
}

static void quantise_row(const struct srgb_table *table, const float *rgba, int width, bool opaque,
                         unsigned char *out) {
    for (int x = 0; x < width; x++, rgba += 4) {
        unsigned char alpha = alpha_code(rgba[3]);
        if (alpha == 0) {
            memset(out, 0, 4);
        } else {
            float a = clamp01(rgba[3]);
            out[0] = srgb_encode(table, rgba[0] / a);
            out[1] = srgb_encode(table, rgba[1] / a);
            out[2] = srgb_encode(table, rgba[2] / a);
            if (!opaque)
                out[3] = alpha;
        }
        out += opaque ? 3 : 4;
    }
}

/* ---- PNG ---- */

struct png_output {
    unsigned char *data;
    size_t bytes, capacity;
    char message[128];
};

static void png_fail(png_structp png, png_const_charp message) {
    struct png_output *output = png_get_error_ptr(png);
    strncpy(output->message, message, sizeof output->message - 1);
    png_longjmp(png, 1);
}

static void png_ignore_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

static void png_append(png_structp png, png_bytep data, size_t bytes) {
    struct png_output *output = png_get_io_ptr(png);
    if (output->capacity - output->bytes < bytes) {
        size_t capacity = 2 * output->capacity + bytes + 4096;
        unsigned char *grown = realloc(output->data, capacity);
        if (!grown)
            png_error(png, "memory ran out");
        output->data = grown;
        output->capacity = capacity;
    }
    memcpy(output->data + output->bytes, data, bytes);
    output->bytes += bytes;
}

static void png_flush_nothing(png_structp png) {
    (void)png;
}

/* Everything that may fail in libpng, in a function of its own: nothing that it reads after a jump
 * has changed since setjmp(). `row` is scratch for one row. */
static bool png_write_all(png_structp png, png_infop info, struct png_output *output,
                          const float *rgba, int width, int height, bool opaque,
                          const struct srgb_table *table, unsigned char *row) {
    if (setjmp(png_jmpbuf(png)))
        return false;
    png_set_write_fn(png, output, png_append, png_flush_nothing);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8,
                 opaque ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_compression_level(png, 1);
    png_set_compression_strategy(png, Z_RLE);
    png_set_compression_buffer_size(png, 65536);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_write_info(png, info);
    for (int y = 0; y < height; y++) {
        quantise_row(table, rgba + (size_t)y * (size_t)width * 4, width, opaque, row);
        png_write_row(png, row);
    }
    png_write_end(png, info);
    return true;
}

enum status encode_png(const float *rgba, int width, int height, unsigned char **data,
                       size_t *bytes, struct error *err) {
    assert(width >= 1 && width <= SCENE_IMAGE_SIDE_MAX);
    assert(height >= 1 && height <= SCENE_IMAGE_SIDE_MAX);
    *data = NULL;
    *bytes = 0;
    bool opaque = is_opaque(rgba, (size_t)width * (size_t)height);
    enum status status = STATUS_OUT_OF_MEMORY;
    png_structp png = NULL;
    png_infop info = NULL;
    struct png_output *output = calloc(1, sizeof *output);
    struct srgb_table *table = malloc(sizeof *table);
    unsigned char *row = malloc((size_t)width * 4);
    if (!output || !table || !row)
        goto done;
    srgb_table_init(table);
    png = png_create_write_struct(PNG_LIBPNG_VER_STRING, output, png_fail, png_ignore_warning);
    info = png ? png_create_info_struct(png) : NULL;
    if (!info)
        goto done;
    if (png_write_all(png, info, output, rgba, width, height, opaque, table, row))
        status = STATUS_OK;
    else if (!strcasestr(output->message, "memory")) /* as libpng and zlib put it */
        status = STATUS_INTERNAL;
done:
    if (status == STATUS_OK) {
        *data = output->data;
        *bytes = output->bytes;
        output->data = NULL;
    } else {
        error_fault(err, status, NULL, "PNG of %d x %d: %s", width, height,
                    output && output->message[0] ? output->message : "memory ran out");
    }
    if (png)
        png_destroy_write_struct(&png, &info);
    if (output)
        free(output->data);
    free(output);
    free(table);
    free(row);
    return status;
}

/* ---- OpenEXR ---- */

enum status encode_exr(const float *rgba, int width, int height, unsigned char **data,
                       size_t *bytes, struct error *err) {
    assert(width >= 1 && width <= SCENE_IMAGE_SIDE_MAX);
    assert(height >= 1 && height <= SCENE_IMAGE_SIDE_MAX);
    *data = NULL;
    *bytes = 0;
    const struct image_module *images = module_open(MODULE_IMAGE_OIIO, err);
    if (!images)
        return STATUS_IO_ERROR;
    char message[256] = "";
    if (images->encode_exr(rgba, width, height, data, bytes, message, sizeof message)) {
        *data = NULL;
        return error_fault(err, STATUS_INTERNAL, NULL, "OpenEXR of %d x %d: %s", width, height,
                           message);
    }
    return STATUS_OK;
}

enum status encode_image(enum encode_format format, const float *rgba, int width, int height,
                         unsigned char **data, size_t *bytes, struct error *err) {
    return format == ENCODE_EXR ? encode_exr(rgba, width, height, data, bytes, err)
                                : encode_png(rgba, width, height, data, bytes, err);
}

enum status encode_map(enum encode_format format, const float *map, int width, int height,
                       unsigned char **data, size_t *bytes, struct error *err) {
    size_t count = (size_t)width * (size_t)height;
    float *pixels = calloc(count + 1, 4 * sizeof *pixels);
    *data = NULL;
    *bytes = 0;
    if (!pixels)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a map");
    for (size_t p = 0; p < count; p++) {
        pixels[4 * p] = pixels[4 * p + 1] = pixels[4 * p + 2] = map[p];
        pixels[4 * p + 3] = 1;
    }
    enum status status = encode_image(format, pixels, width, height, data, bytes, err);
    free(pixels);
    return status;
}

double encode_expected_ms(enum encode_format format, int width, int height) {
    double pixels = (double)width * height;
    if (format == ENCODE_PNG)
        return 4e-5 * pixels;
    const char *loaded[MODULE_COUNT];
    size_t count = module_loaded(loaded);
    bool open = false;
    for (size_t i = 0; i < count; i++)
        open |= strcmp(loaded[i], module_describe(MODULE_IMAGE_OIIO)->name) == 0;
    return 1e-4 * pixels + (open ? 0 : 400);
}

/* ---- base64 ---- */

char *encode_base64(const unsigned char *data, size_t bytes, size_t *length) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    if (bytes > SIZE_MAX / 2)
        return NULL;
    size_t groups = bytes / 3, rest = bytes % 3;
    char *text = malloc(4 * (groups + (rest > 0)) + 1);
    if (!text)
        return NULL;
    char *out = text;
    for (size_t i = 0; i < groups; i++, data += 3) {
        uint32_t word = (uint32_t)data[0] << 16 | (uint32_t)data[1] << 8 | data[2];
        *out++ = digits[word >> 18];
        *out++ = digits[word >> 12 & 63];
        *out++ = digits[word >> 6 & 63];
        *out++ = digits[word & 63];
    }
    if (rest) {
        uint32_t word = (uint32_t)data[0] << 16 | (rest == 2 ? (uint32_t)data[1] << 8 : 0);
        *out++ = digits[word >> 18];
        *out++ = digits[word >> 12 & 63];
        *out++ = rest == 2 ? digits[word >> 6 & 63] : '=';
        *out++ = '=';
    }
    *out = '\0';
    if (length)
        *length = (size_t)(out - text);
    return text;
}

static int digit_value(unsigned char c) {
    if (c >= 'A' && c <= 'Z')
        return c - 'A';
    if (c >= 'a' && c <= 'z')
        return c - 'a' + 26;
    if (c >= '0' && c <= '9')
        return c - '0' + 52;
    return c == '+' ? 62 : c == '/' ? 63 : -1;
}

unsigned char *decode_base64(const char *text, size_t length, size_t *bytes) {
    if (length % 4)
        return NULL;
    size_t padding = 0;
    while (padding < 2 && padding < length && text[length - 1 - padding] == '=')
        padding++;
    unsigned char *data = malloc(length / 4 * 3 + 1);
    if (!data)
        return NULL;
    size_t used = 0;
    for (size_t i = 0; i < length; i += 4) {
        uint32_t word = 0;
        for (size_t k = 0; k < 4; k++) {
            int value = i + k >= length - padding ? 0 : digit_value((unsigned char)text[i + k]);
            if (value < 0) {
                free(data);
                return NULL;
            }
            word = word << 6 | (uint32_t)value;
        }
        data[used++] = (unsigned char)(word >> 16);
        data[used++] = (unsigned char)(word >> 8);
        data[used++] = (unsigned char)word;
    }
    used -= padding;
    data[used] = 0;
    *bytes = used;
    return data;
}
