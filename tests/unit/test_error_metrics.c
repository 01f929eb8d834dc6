/* Image metrics on pictures whose errors are known by construction. */
#include <math.h>
#include <stdlib.h>

#include "renderer/error/flip.h"
#include "renderer/error/metrics.h"
#include "tests/support.h"

enum { W = 40, H = 30, N = W * H };

static void fill(float *pixels, float r, float g, float b, float a) {
    for (int p = 0; p < N; p++) {
        pixels[4 * p] = r;
        pixels[4 * p + 1] = g;
        pixels[4 * p + 2] = b;
        pixels[4 * p + 3] = a;
    }
}

static const double nothing[4] = {0, 0, 0, 0};

static void test_equal(void **state) {
    (void)state;
    float a[4 * N], map[N];
    struct error_metrics m;
    fill(a, 0.2f, 0.3f, 0.4f, 1);
    assert_int_equal(error_compare(a, a, W, H, NULL, nothing, map, &m, NULL), STATUS_OK);
    assert_true(m.whole.rmse == 0 && m.whole.max_abs == 0 && m.whole.p99 == 0);
    assert_true(m.touched.pixels == N && m.whole.pixels == N && m.coverage == 0);
    assert_true(isinf(m.psnr_db) && m.flip == 0 && m.not_finite == 0);
}

static void test_figures(void **state) {
    (void)state;
    float a[4 * N], b[4 * N];
    struct error_metrics m;
    fill(a, 0.5f, 0.5f, 0.5f, 1);
    fill(b, 0.5f, 0.5f, 0.5f, 1);
    /* Of 1200 pixels 12 are off by 0.25 in every channel, one of them by 0.5 in one: 99 % are
     * exact, so p99 is 0, and with one more it is not. */
    for (int p = 0; p < 12; p++)
        for (int i = 0; i < 4; i++)
            a[4 * p + i] += 0.25f;
    a[1] += 0.25f;
    assert_int_equal(error_compare(a, b, W, H, NULL, nothing, NULL, &m, NULL), STATUS_OK);
    double squares = 47 * 0.0625 + 0.25;
    assert_float_equal(m.whole.rmse, sqrt(squares / (4 * N)), 1e-9);
    assert_float_equal(m.whole.max_abs, 0.5, 0);
    assert_float_equal(m.whole.p99, 0, 0);
    assert_float_equal(m.psnr_db, 10 * log10(4 * N / squares), 1e-6);
    a[4 * 600 + 2] += 0.125f;
    assert_int_equal(error_compare(a, b, W, H, NULL, nothing, NULL, &m, NULL), STATUS_OK);
    assert_float_equal(m.whole.p99, 0.0625, 1e-7); /* one channel of four */
    /* Over the pixels that are touched alone: here all are drawn on but for the background. */
    const double grey[4] = {0.5, 0.5, 0.5, 1};
    uint8_t touched[N] = {0};
    touched[0] = touched[600] = touched[700] = 1;
    assert_int_equal(error_compare(a, b, W, H, touched, grey, NULL, &m, NULL), STATUS_OK);
    assert_int_equal(m.touched.pixels, 14); /* 12 and one drawn on, one touched and alike */
    assert_float_equal(m.touched.rmse, sqrt((squares + 0.015625) / (4 * 14)), 1e-9);
    assert_int_equal(m.whole.pixels, N);
}

static void test_coverage_and_numbers(void **state) {
    (void)state;
    float a[4 * N], b[4 * N];
    struct error_metrics m;
    const double background[4] = {1, 0.5, 0, 0.5}; /* premultiplied 0.5, 0.25, 0 */
    fill(a, 0.5f, 0.25f, 0, 0.5f);
    fill(b, 0.5f, 0.25f, 0, 0.5f);
    assert_int_equal(error_compare(a, b, W, H, NULL, background, NULL, &m, NULL), STATUS_OK);
    assert_int_equal(m.touched.pixels, 0);
    assert_true(m.touched.rmse == 0);
    a[4 * 7] = 0.6f;  /* drawn on in one */
    a[4 * 9 + 3] = 1; /* in both */
    b[4 * 9 + 1] = 0.9f;
    b[4 * 11 + 2] = 0.001f; /* less than half a code: in neither */
    a[4 * 13] = NAN;
    assert_int_equal(error_compare(a, b, W, H, NULL, background, NULL, &m, NULL), STATUS_OK);
    assert_int_equal(m.coverage, 2); /* and the one that is no number */
    assert_int_equal(m.touched.pixels, 3);
    assert_int_equal(m.not_finite, 1);
    assert_float_equal(m.whole.max_abs, 1, 0);
    assert_true(isfinite(m.whole.rmse) && isfinite(m.flip));
}

/* Constant pictures have no features and no filter changes them, so FLIP is 4.1.3's redistribution
 * of HyAB^0.7. Black and white: L* of 0 and 100, so 100^0.7 = 25.1188643; the largest is that of
 * green and blue, 41.2760984; 0.95 + (25.1188643 - 0.4 x 41.2760984) / (0.6 x 41.2760984) x 0.05 =
 * 0.9673798. Green and blue: 1. */
/* The map is the absolute difference, channel by channel; what is no number is 1 everywhere. */
static void test_map_of_differences(void **state) {
    (void)state;
    float a[4 * N], b[4 * N], map[4 * N];
    fill(a, 0.5f, 0.25f, 0, 1);
    fill(b, 0.25f, 0.5f, 0, 0.5f);
    b[4 * 7 + 2] = NAN;
    a[4 * 8] = INFINITY;
    error_map(a, b, W, H, map);
    for (int p = 0; p < N; p++) {
        const float expected[4] = {0.25f, 0.25f, 0, 0.5f};
        for (int i = 0; i < 4; i++)
            assert_true(map[4 * p + i] == (p == 7 || p == 8 ? 1 : expected[i]));
    }
}

static void test_flip_of_constants(void **state) {
    (void)state;
    float a[4 * N], b[4 * N], map[N];
    double mean;
    fill(a, 0, 0, 0, 1);
    fill(b, 1, 1, 1, 1);
    assert_int_equal(error_flip(a, b, W, H, map, &mean, NULL), STATUS_OK);
    for (int p = 0; p < N; p++)
        assert_float_equal(map[p], 0.9673798, 1e-6);
    assert_float_equal(mean, 0.9673798, 1e-6);
    fill(a, 0, 1, 0, 1);
    fill(b, 0, 0, 1, 1);
    assert_int_equal(error_flip(a, b, W, H, map, &mean, NULL), STATUS_OK);
    assert_float_equal(mean, 1, 1e-6);
    /* Greys Y = 0.18 and 0.2: L* 49.496 and 51.837, both over black and clamped. HyAB^0.7 of
     * 2.3412 is 1.81392, below 0.4 of the largest: 0.95 x 1.81392 / 16.51044 = 0.104372. */
    fill(a, 0.18f, 0.18f, 0.18f, 1);
    fill(b, 0.2f, 0.2f, 0.2f, 1);
    assert_int_equal(error_flip(a, b, W, H, map, &mean, NULL), STATUS_OK);
    double l1 = 116 * cbrt(0.18) - 16, l2 = 116 * cbrt(0.2) - 16;
    assert_float_equal(mean, 0.95 * pow(l2 - l1, 0.7) / (0.4 * 41.2760984), 1e-5);
}

/* Nothing at all is mid-grey, sRGB 0.5. */
static void test_flip_over_grey(void **state) {
    (void)state;
    float a[4 * N], b[4 * N], map[N];
    double mean;
    fill(a, 0, 0, 0, 0);
    fill(b, 0.21404114f, 0.21404114f, 0.21404114f, 1);
    assert_int_equal(error_flip(a, b, W, H, map, &mean, NULL), STATUS_OK);
    assert_true(mean < 1e-4); /* (1e-7)^0.7 of rounding is what is left of HyAB */
}

/* A single white pixel on black: symmetric, local, at most 1, largest at the pixel; and the same
 * wherever it lies, the far border left out. */
static void test_flip_of_a_point(void **state) {
    (void)state;
    float a[4 * N], b[4 * N], map[N], moved[N];
    double mean, mirrored;
    fill(a, 0, 0, 0, 1);
    fill(b, 0, 0, 0, 1);
    int at = 15 * W + 18;
    b[4 * at] = b[4 * at + 1] = b[4 * at + 2] = 1;
    assert_int_equal(error_flip(a, b, W, H, map, &mean, NULL), STATUS_OK);
    assert_int_equal(error_flip(b, a, W, H, moved, &mirrored, NULL), STATUS_OK);
    assert_float_equal(mean, mirrored, 1e-12);
    for (int p = 0; p < N; p++)
        assert_true(map[p] >= 0 && map[p] <= map[at] && map[p] <= 1);
    assert_true(map[at] > 0.5f);
    assert_true(map[0] == 0 && map[N - 1] == 0); /* both filters end before the corners */
    for (int k = 0; k < 9; k++) { /* the eye sees alike in all directions of the grid */
        assert_float_equal(map[at + k], map[at - k], 1e-6);
        assert_float_equal(map[at + k], map[at + k * W], 1e-6);
    }
}

/* A list of pixels: the same figures but for FLIP. Half of them off by d in every channel: the mean
 * square is d^2/2 with a variance of d^4/4 a pixel, so the RMSE's standard error is
 * d^2/2 / sqrt(n) / (2 d/sqrt(2)) = d / sqrt(8 n). */
static void test_some_pixels(void **state) {
    (void)state;
    float a[4 * N], b[4 * N];
    struct error_metrics all, some;
    fill(a, 0.5f, 0.5f, 0.5f, 0.5f);
    fill(b, 0.5f, 0.5f, 0.5f, 0.5f);
    for (int p = 0; p < N; p += 2)
        for (int i = 0; i < 4; i++)
            a[4 * p + i] += 0.25f;
    assert_int_equal(error_compare(a, b, W, H, NULL, nothing, NULL, &all, NULL), STATUS_OK);
    assert_int_equal(error_compare_pixels(a, b, N, NULL, nothing, &some, NULL), STATUS_OK);
    assert_true(isnan(some.flip) && all.flip > 0);
    some.flip = all.flip;
    assert_memory_equal(&some, &all, sizeof some);
    assert_float_equal(some.touched.rmse, 0.25 / sqrt(2), 1e-9);
    assert_float_equal(some.touched.rmse_standard_error, 0.25 / sqrt(8.0 * N), 1e-9);
    assert_int_equal(error_compare_pixels(a, b, 0, NULL, nothing, &some, NULL), STATUS_OK);
    assert_true(some.whole.pixels == 0 && some.whole.rmse == 0 && isinf(some.psnr_db));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_equal),
        cmocka_unit_test(test_figures),
        cmocka_unit_test(test_some_pixels),
        cmocka_unit_test(test_coverage_and_numbers),
        cmocka_unit_test(test_map_of_differences),
        cmocka_unit_test(test_flip_of_constants),
        cmocka_unit_test(test_flip_over_grey),
        cmocka_unit_test(test_flip_of_a_point),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
