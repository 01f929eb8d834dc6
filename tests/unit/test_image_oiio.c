/* The OpenImageIO module: every format that is read, what must be refused, and OpenEXR that is
 * written. The files are those of tests/data/image (tests/tools/make_images.py). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"

static const char folder[] = "tests/data/image";

struct file {
    unsigned char *data;
    size_t bytes;
};

/* malloc'ed to the byte, so that a read past the end shows under the sanitizer. */
static struct file load(const char *name) {
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *stream = fopen(path, "rb");
    assert_non_null(stream);
    struct file file = {malloc(1 << 20), 0};
    file.bytes = fread(file.data, 1, 1 << 20, stream);
    fclose(stream);
    unsigned char *fitted = realloc(file.data, file.bytes ? file.bytes : 1);
    assert_non_null(fitted);
    file.data = fitted;
    return file;
}

static const struct image_module *module(void **state) {
    return *state;
}

static int decode(const struct image_module *m, const char *name, struct image_pixels *image,
                  char message[512]) {
    struct file file = load(name);
    message[0] = 0;
    int result = m->decode(file.data, file.bytes, image, message, 512);
    free(file.data);
    return result;
}

static float sample(const struct image_pixels *image, int x, int y, int channel) {
    return image->data[(y * image->width + x) * image->channels + channel];
}

/* Red above, blue below, to within `tolerance` (JPEG: 2 steps of 8 bits, measured 1). */
static void check_halves(const struct image_module *m, const char *name, int bits, int is_float,
                         double tolerance) {
    struct image_pixels image;
    char message[512];
    if (decode(m, name, &image, message) != 0)
        fail_msg("%s: %s", name, message);
    assert_int_equal(image.bits, bits);
    assert_int_equal(image.is_float, is_float);
    assert_in_range(image.channels, 3, 4);
    for (int y = 0; y < image.height; y++)
        for (int x = 0; x < image.width; x++) {
            int upper = y < image.height / 2;
            assert_true(fabs((double)sample(&image, x, y, 0) - upper) <= tolerance);
            assert_true(fabs((double)sample(&image, x, y, 1)) <= tolerance);
            assert_true(fabs((double)sample(&image, x, y, 2) - !upper) <= tolerance);
        }
    free(image.data);
}

static void every_format_is_read(void **state) {
    check_halves(module(state), "good_8.png", 8, 0, 0);
    check_halves(module(state), "good.jpg", 8, 0, 2.0 / 255);
    check_halves(module(state), "good.tif", 8, 0, 0);
    check_halves(module(state), "good.gif", 8, 0, 0);
    check_halves(module(state), "good.webp", 8, 0, 0);
    check_halves(module(state), "good.hdr", 32, 1, 0);
    check_halves(module(state), "good.exr", 16, 1, 0);
    check_halves(module(state), "good_alpha.png", 8, 0, 0); /* not multiplied by its alpha of 0.2 */
}

static void depth_and_channels_are_kept(void **state) {
    struct image_pixels image;
    char message[512];
    assert_int_equal(decode(module(state), "grey_16.png", &image, message), 0);
    assert_int_equal(image.bits, 16);
    assert_int_equal(image.channels, 1);
    for (int i = 0; i < 64; i++) /* all 16 bits, without a colour transform */
        assert_true(fabs((double)image.data[i] - i * 1040 / 65535.0) < 1e-7);
    free(image.data);
    assert_int_equal(decode(module(state), "grey_1.png", &image, message), 0);
    assert_int_equal(image.width * image.height * image.channels, 16);
    assert_true(image.data[0] == 1.0f && image.data[8] == 0.0f);
    free(image.data);
    assert_int_equal(decode(module(state), "good_alpha.png", &image, message), 0);
    assert_int_equal(image.channels, 4);
    assert_true(fabs((double)sample(&image, 3, 3, 3) - 0.2) < 1e-6);
    free(image.data);
}

/* Each bad file ends in a message of one line, and none of them takes memory for what it claims
 * (the largest would be 40 GB): the peak grows by less than 64 MB. */
static void bad_files_are_refused(void **state) {
    struct rusage before, after;
    getrusage(RUSAGE_SELF, &before);
    DIR *dir = opendir(folder);
    assert_non_null(dir);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(dir));) {
        if (strncmp(entry->d_name, "bad_", 4) != 0)
            continue;
        struct image_pixels image;
        char message[512];
        int result = decode(module(state), entry->d_name, &image, message);
        print_message("%-26s %s\n", entry->d_name, message);
        if (result == 0)
            fail_msg("%s was read", entry->d_name);
        assert_null(image.data);
        assert_true(strlen(message) > 10);
        assert_null(strchr(message, '\n'));
        count++;
    }
    closedir(dir);
    assert_in_range(count, 24, 100);
    getrusage(RUSAGE_SELF, &after);
    assert_true(after.ru_maxrss - before.ru_maxrss < 64 * 1024);
}

static void messages_name_the_fault(void **state) {
    static const struct {
        const char *file, *text;
    } rows[] = {
        {"bad_100000_wide.png", "100000 x 100000"},
        {"bad_65535_wide.gif", "65535 x 65535"},
        {"bad_16384_wide.webp", "16384 x 16384"},
        {"bad_16384_lossless.webp", "16384 x 16384"},
        {"bad_no_width.png", "empty"},
        {"bad_lying.png", "lies"},
        {"bad_lying_a_little.png", "cut short"},
        {"bad_cut_short.jpg", "cut short"},
        {"bad_100000_wide.exr", "100000 x 100000"},
        {"bad_2_billion_high.exr", "1 x 2147483647"},
        {"bad_no_width.exr", "empty"},
        {"bad_tiles_of_one.exr", "tiles of 1 x 1"},
        {"bad_tiles_too_large.exr", "tiles of 1073741824"},
        {"bad_deep.exr", "one flat part"},
        {"bad_cut_in_header.exr", "header is cut short"},
        {"bad_text.png", "not an image"},
        {"bad_empty.png", "empty"},
        {"bad_targa.tga", "not an image"},
        {"bad_bitmap.bmp", "not an image"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct image_pixels image;
        char message[512];
        assert_int_not_equal(decode(module(state), rows[i].file, &image, message), 0);
        if (!strstr(message, rows[i].text))
            fail_msg("%s: \"%s\" does not say \"%s\"", rows[i].file, message, rows[i].text);
    }
}

/* Every good file with one byte changed, and cut at every length: read or refused, never a crash.
 * (The readers' own faults are contained by the worker; this guards the shim.) */
static void damaged_files_do_no_harm(void **state) {
    static const char *names[] = {"good_8.png", "good.tif", "good.gif", "good.webp",
                                  "good.hdr",   "good.jpg", "good.exr", "grey_16.png"};
    /* The sanitizer clears every byte that a lying header asks for. */
    size_t step = getenv("PELT_TEST_SHORT") ? 7 : 1;
    int refused = 0, tried = 0;
    for (size_t f = 0; f < sizeof names / sizeof *names; f++) {
        struct file file = load(names[f]);
        for (size_t i = 0; i < file.bytes; i += step) {
            for (int cut = 0; cut < 2; cut++) {
                size_t bytes = cut ? i : file.bytes;
                unsigned char *copy = malloc(bytes ? bytes : 1);
                memcpy(copy, file.data, bytes);
                if (!cut)
                    copy[i] ^= 0x55;
                struct image_pixels image;
                char message[64];
                int result = module(state)->decode(copy, bytes, &image, message, sizeof message);
                assert_true((result == 0) == (image.data != NULL));
                assert_true(result == 0 || memchr(message, 0, sizeof message));
                free(image.data);
                free(copy);
                refused += result != 0;
                tried++;
            }
        }
        free(file.data);
    }
    print_message("%d of %d refused\n", refused, tried);
    assert_true(refused > tried / 4);
}

static void make_pixels(float *rgba, int width, int height) {
    for (int i = 0; i < width * height * 4; i++)
        rgba[i] = (float)(i % 97) / 13.0f - 1.0f;
    rgba[0] = 1e30f;
    rgba[1] = 1e-30f;
}

static void exr_keeps_every_float(void **state) {
    enum { WIDTH = 61, HEIGHT = 37 };
    static float rgba[WIDTH * HEIGHT * 4];
    make_pixels(rgba, WIDTH, HEIGHT);
    unsigned char *data;
    size_t bytes;
    char message[512];
    assert_int_equal(
        module(state)->encode_exr(rgba, WIDTH, HEIGHT, &data, &bytes, message, sizeof message), 0);
    assert_true(bytes < sizeof rgba); /* ZIP */
    struct image_pixels image;
    assert_int_equal(module(state)->decode(data, bytes, &image, message, sizeof message), 0);
    assert_int_equal(image.width, WIDTH);
    assert_int_equal(image.height, HEIGHT);
    assert_int_equal(image.channels, 4);
    assert_int_equal(image.bits, 32);
    assert_true(image.is_float);
    assert_memory_equal(image.data, rgba, sizeof rgba);
    free(image.data);
    free(data);
}

/* The second one is written in another second of the clock: no time of day is in it. */
static void exr_bytes_depend_on_pixels_alone(void **state) {
    static float rgba[16 * 16 * 4];
    make_pixels(rgba, 16, 16);
    unsigned char *data[2];
    size_t bytes[2];
    for (int i = 0; i < 2; i++) {
        char message[512];
        assert_int_equal(
            module(state)->encode_exr(rgba, 16, 16, &data[i], &bytes[i], message, sizeof message),
            0);
        nanosleep(&(struct timespec){1 - i, 10000000}, NULL);
    }
    assert_int_equal(bytes[0], bytes[1]);
    assert_memory_equal(data[0], data[1], bytes[0]);
    free(data[0]);
    free(data[1]);
}

static void exr_cut_short_is_refused(void **state) {
    static float rgba[64 * 64 * 4];
    make_pixels(rgba, 64, 64);
    unsigned char *data;
    size_t bytes;
    char message[512];
    assert_int_equal(
        module(state)->encode_exr(rgba, 64, 64, &data, &bytes, message, sizeof message), 0);
    for (size_t cut = 4; cut < bytes; cut += bytes / 9) {
        struct image_pixels image;
        assert_int_not_equal(module(state)->decode(data, cut, &image, message, sizeof message), 0);
        assert_null(image.data);
    }
    free(data);
}

static void version_is_told(void **state) {
    int major = 0, minor = 0;
    assert_int_equal(sscanf(module(state)->version(), "%d.%d", &major, &minor), 2);
    assert_true(major >= 2);
}

static int open_module(void **state) {
    struct error err = {0};
    const void *table = module_open(MODULE_IMAGE_OIIO, &err);
    if (!table)
        print_error("%s\n", err.fault_count ? err.faults[0].message : "no message");
    error_clear(&err);
    memcpy(state, &table, sizeof table);
    return table ? 0 : -1;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_format_is_read),
        cmocka_unit_test(depth_and_channels_are_kept),
        cmocka_unit_test(bad_files_are_refused),
        cmocka_unit_test(messages_name_the_fault),
        cmocka_unit_test(damaged_files_do_no_harm),
        cmocka_unit_test(exr_keeps_every_float),
        cmocka_unit_test(exr_bytes_depend_on_pixels_alone),
        cmocka_unit_test(exr_cut_short_is_refused),
        cmocka_unit_test(version_is_told),
    };
    return cmocka_run_group_tests(tests, open_module, NULL);
}
