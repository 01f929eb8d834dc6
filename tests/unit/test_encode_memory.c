/* Memory runs out at every place where it can while a picture is encoded or a file is read: the
 * answer is STATUS_OUT_OF_MEMORY, and nothing stays allocated. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "service/encode.h"
#include "service/files.h"
#include "tests/unit/failing_malloc.h"

enum { SIDE = 200 };

static enum status encode(const float *pixels) {
    unsigned char *data = NULL;
    size_t bytes = 0;
    enum status status = encode_png(pixels, SIDE, SIDE, &data, &bytes, NULL);
    if (status != STATUS_OK && (data || bytes))
        return STATUS_INTERNAL;
    free(data);
    return status;
}

static enum status base64(const float *pixels) {
    size_t length = 0, bytes = 0;
    char *text = encode_base64((const unsigned char *)pixels, 1000, &length);
    unsigned char *data = text ? decode_base64(text, length, &bytes) : NULL;
    enum status status = data ? STATUS_OK : STATUS_OUT_OF_MEMORY;
    free(data);
    free(text);
    return status;
}

static enum status read_file(const float *pixels) {
    (void)pixels;
    unsigned char *data = NULL;
    size_t bytes = 0;
    /* /proc has no sizes, so that the buffer must grow. */
    enum status status = files_read("/proc/self/maps", 1 << 24, &data, &bytes, NULL);
    if (status != STATUS_OK && (data || bytes))
        return STATUS_INTERNAL;
    free(data);
    return status;
}

static void fail_each(enum status (*run)(const float *), int at_least) {
    float *pixels = calloc(SIDE * SIDE * 4, sizeof *pixels);
    assert_non_null(pixels);
    for (int i = 0; i < SIDE * SIDE * 4; i++) /* noise, so that the output must grow */
        pixels[i] = (float)((unsigned)i * 2654435761u >> 8) / (float)(1 << 24);
    int n = 0;
    for (enum status status = STATUS_OUT_OF_MEMORY; status != STATUS_OK; n++) {
        long before = live;
        fail_at = n;
        status = run(pixels);
        fail_at = -1;
        long left = live - before;
        assert_int_equal(left, 0);
        if (status != STATUS_OK)
            assert_int_equal(status, STATUS_OUT_OF_MEMORY);
    }
    assert_true(n > at_least); /* the interposed allocator is in use */
    free(pixels);
}

static void test_png(void **state) {
    (void)state;
    fail_each(encode, 5);
}

static void test_base64(void **state) {
    (void)state;
    fail_each(base64, 2);
}

static void test_files(void **state) {
    (void)state;
    fail_each(read_file, 1);
}

int main(void) {
    if (!INTERPOSED) {
        puts("the sanitizer has an allocator of its own");
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_png),
        cmocka_unit_test(test_base64),
        cmocka_unit_test(test_files),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
