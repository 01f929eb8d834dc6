/* service/encode.c: sRGB against a double reference, PNG read back through libpng, base64. */

#include <math.h>
#include <png.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
/* cmocka wants the five headers above first. */
#include <cmocka.h>

#include "service/encode.h"

static double srgb_from_linear(double x) {
    return x <= 0.0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - 0.055;
}

/* The code by the definition, in double. The two branches of IEC 61966-2-1 meet at 10.31 / 255, far
 * from any tie. */
static int reference_code(float x) {
    double s = srgb_from_linear(x > 0 ? (x < 1 ? (double)x : 1.0) : 0.0);
    return (int)floor(255 * s + 0.5);
}

static float float_of(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static void test_srgb_is_exact_around_every_threshold(void **state) {
    (void)state;
    struct srgb_table table;
    srgb_table_init(&table);
    for (int code = 1; code <= 255; code++) {
        float x = table.threshold[code];
        for (int ulp = -3; ulp <= 3; ulp++) {
            uint32_t bits;
            memcpy(&bits, &x, sizeof bits);
            float near = float_of(bits + (uint32_t)ulp);
            assert_int_equal(srgb_encode(&table, near), reference_code(near));
        }
        assert_int_equal(srgb_encode(&table, x), code);
        assert_int_equal(srgb_encode(&table, nextafterf(x, 0)), code - 1);
    }
}

/* Between thresholds the code is constant; one float in 97 shows that the buckets agree. */
static void test_srgb_is_exact_everywhere(void **state) {
    (void)state;
    struct srgb_table table;
    srgb_table_init(&table);
    int last = 0;
    for (uint32_t bits = 0x38000000; bits <= 0x3f800000; bits += 97) {
        float x = float_of(bits);
        int code = srgb_encode(&table, x);
        assert_true(code == last || code == last + 1);
        last = code;
        if (bits % 64 == 0)
            assert_int_equal(code, reference_code(x));
    }
    assert_int_equal(last, 255);
}

static void test_srgb_of_the_extremes(void **state) {
    (void)state;
    struct srgb_table table;
    srgb_table_init(&table);
    assert_int_equal(srgb_encode(&table, 0), 0);
    assert_int_equal(srgb_encode(&table, -0.0f), 0);
    assert_int_equal(srgb_encode(&table, -1e30f), 0);
    assert_int_equal(srgb_encode(&table, 1e-40f), 0);
    assert_int_equal(srgb_encode(&table, NAN), 0);
    assert_int_equal(srgb_encode(&table, -INFINITY), 0);
    assert_int_equal(srgb_encode(&table, 1), 255);
    assert_int_equal(srgb_encode(&table, 1e30f), 255);
    assert_int_equal(srgb_encode(&table, INFINITY), 255);
}

struct decoded {
    unsigned char *pixels;
    int width, height, channels;
};

static struct decoded decode(const unsigned char *data, size_t bytes) {
    png_image image = {.version = PNG_IMAGE_VERSION};
    assert_true(png_image_begin_read_from_memory(&image, data, bytes));
    struct decoded result = {.width = (int)image.width,
                             .height = (int)image.height,
                             .channels = image.format & PNG_FORMAT_FLAG_ALPHA ? 4 : 3};
    image.format = result.channels == 4 ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
    result.pixels = malloc(PNG_IMAGE_SIZE(image));
    assert_non_null(result.pixels);
    assert_true(png_image_finish_read(&image, NULL, result.pixels, 0, NULL));
    return result;
}

static struct decoded round_trip(const float *rgba, int width, int height) {
    unsigned char *data;
    size_t bytes;
    assert_int_equal(encode_png(rgba, width, height, &data, &bytes, NULL), STATUS_OK);
    struct decoded result = decode(data, bytes);
    assert_int_equal(result.width, width);
    assert_int_equal(result.height, height);
    free(data);
    return result;
}

/* The example of NUMERICS.md: linear 0.1 at alpha 0.2 (premultiplied 0.02) is sRGB 89; an encoder
 * that divides after rounding is off by several codes. */
static void test_png_unpremultiplies_in_float(void **state) {
    (void)state;
    const float pixel[4] = {0.1f * 0.2f, 0.5f * 0.2f, 1.0f * 0.2f, 0.2f};
    struct decoded image = round_trip(pixel, 1, 1);
    assert_int_equal(image.channels, 4);
    assert_int_equal(image.pixels[0], reference_code(0.1f));
    assert_int_equal(image.pixels[1], reference_code(0.5f));
    assert_int_equal(image.pixels[2], 255);
    assert_int_equal(image.pixels[3], 51);
    free(image.pixels);
}

static void test_png_leaves_out_an_opaque_alpha(void **state) {
    (void)state;
    float pixels[2 * 4] = {1, 0.5f, 0, 1, 0, 0.25f, 1, 0.9999f};
    struct decoded image = round_trip(pixels, 2, 1);
    assert_int_equal(image.channels, 3);
    const unsigned char expected[6] = {255, 188, 0, 0, 137, 255};
    assert_memory_equal(image.pixels, expected, sizeof expected);
    free(image.pixels);
    pixels[3] = 0.5f;
    image = round_trip(pixels, 2, 1);
    assert_int_equal(image.channels, 4);
    free(image.pixels);
}

static void test_png_guards_against_what_is_no_number(void **state) {
    (void)state;
    const float pixels[6 * 4] = {NAN,      1,         1,    1, 1,        1,        1, NAN,
                                 INFINITY, -1,        1,    1, INFINITY, INFINITY, 1, 1,
                                 0.5f,     -INFINITY, 0.5f, 1, 1,        1,        1, 1e-30f};
    struct decoded image = round_trip(pixels, 6, 1);
    assert_int_equal(image.channels, 4);
    const unsigned char expected[6 * 4] = {0,   255, 255, 255, 0,   0, 0,   0,   255, 0, 255, 255,
                                           255, 255, 255, 255, 188, 0, 188, 255, 0,   0, 0,   0};
    assert_memory_equal(image.pixels, expected, sizeof expected);
    free(image.pixels);
}

static float noise(uint32_t *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (float)(*seed >> 8) / (float)(1 << 24);
}

static void test_png_keeps_rows_and_columns_and_is_deterministic(void **state) {
    (void)state;
    enum { W = 61, H = 37 };
    float *pixels = malloc(sizeof(float[W * H * 4]));
    assert_non_null(pixels);
    uint32_t seed = 1;
    for (int i = 0; i < W * H; i++) {
        float alpha = noise(&seed);
        for (int c = 0; c < 3; c++)
            pixels[4 * i + c] = noise(&seed) * alpha;
        pixels[4 * i + 3] = alpha;
    }
    unsigned char *first, *second;
    size_t first_bytes, second_bytes;
    assert_int_equal(encode_png(pixels, W, H, &first, &first_bytes, NULL), STATUS_OK);
    assert_int_equal(encode_png(pixels, W, H, &second, &second_bytes, NULL), STATUS_OK);
    assert_int_equal(first_bytes, second_bytes);
    assert_memory_equal(first, second, first_bytes);
    struct decoded image = decode(first, first_bytes);
    for (int i = 0; i < W * H; i++) {
        float alpha = pixels[4 * i + 3];
        int code = (int)floor((double)alpha * 255 + 0.5);
        assert_int_equal(image.pixels[4 * i + 3], code);
        for (int c = 0; c < 3; c++)
            assert_int_equal(image.pixels[4 * i + c],
                             code ? reference_code(pixels[4 * i + c] / alpha) : 0);
    }
    free(image.pixels);
    free(first);
    free(second);
    free(pixels);
}

static void test_base64(void **state) {
    (void)state;
    static const struct {
        const char *plain, *coded;
    } vectors[] = {{"", ""},
                   {"f", "Zg=="},
                   {"fo", "Zm8="},
                   {"foo", "Zm9v"},
                   {"foob", "Zm9vYg=="},
                   {"fooba", "Zm9vYmE="},
                   {"foobar", "Zm9vYmFy"},
                   {"\xff\xef\xbf", "/++/"}}; /* RFC 4648, section 10 */
    for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
        size_t length;
        char *text = encode_base64((const unsigned char *)vectors[i].plain,
                                   strlen(vectors[i].plain), &length);
        assert_non_null(text);
        assert_string_equal(text, vectors[i].coded);
        assert_int_equal(length, strlen(text));
        size_t bytes;
        unsigned char *back = decode_base64(text, length, &bytes);
        assert_non_null(back);
        assert_int_equal(bytes, strlen(vectors[i].plain));
        assert_memory_equal(back, vectors[i].plain, bytes);
        free(back);
        free(text);
    }
}

static void test_base64_refuses_what_is_none(void **state) {
    (void)state;
    static const char *const bad[] = {"A", "AAA", "A===", "====", "AA=A", "AA A", "AAA-", "AAAA\n"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        size_t bytes;
        assert_null(decode_base64(bad[i], strlen(bad[i]), &bytes));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_srgb_is_exact_around_every_threshold),
        cmocka_unit_test(test_srgb_is_exact_everywhere),
        cmocka_unit_test(test_srgb_of_the_extremes),
        cmocka_unit_test(test_png_unpremultiplies_in_float),
        cmocka_unit_test(test_png_leaves_out_an_opaque_alpha),
        cmocka_unit_test(test_png_guards_against_what_is_no_number),
        cmocka_unit_test(test_png_keeps_rows_and_columns_and_is_deterministic),
        cmocka_unit_test(test_base64),
        cmocka_unit_test(test_base64_refuses_what_is_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
