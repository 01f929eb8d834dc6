/* Gradients of volumes and the half floats they are stored in. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/volume_generators.h"
#include "renderer/bake/normals.h"

/* Value of half `h` by the definition of binary16. */
static double half_value(uint16_t h) {
    int exponent = h >> 10 & 31, mantissa = h & 1023;
    double v = exponent ? ldexp(1024 + mantissa, exponent - 25) : ldexp(mantissa, -24);
    return h & 0x8000 ? -v : v;
}

static void every_half_is_read_and_written_back(void **state) {
    (void)state;
    for (uint32_t h = 0; h < 65536; h++) {
        float f = bake_float_from_half((uint16_t)h);
        if ((h & 0x7c00) == 0x7c00) {
            assert_true((h & 1023) ? isnan(f) : isinf(f) && (signbit(f) != 0) == (h >> 15));
            continue;
        }
        assert_true((double)f == half_value((uint16_t)h));
        assert_int_equal(bake_half_from_float(f), h);
    }
}

/* Between every two neighbours: just below, at and just above the middle. Ties go to even. */
static void halves_round_to_nearest_even(void **state) {
    (void)state;
    for (uint32_t h = 0; h < 0x7bff; h++) {
        float middle = (float)((half_value((uint16_t)h) + half_value((uint16_t)(h + 1))) / 2);
        assert_int_equal(bake_half_from_float(nextafterf(middle, 0)), h);
        assert_int_equal(bake_half_from_float(nextafterf(middle, 1e9f)), h + 1);
        assert_int_equal(bake_half_from_float(middle), h & 1 ? h + 1 : h);
        assert_int_equal(bake_half_from_float(-middle), 0x8000 | (h & 1 ? h + 1 : h));
    }
    assert_int_equal(bake_half_from_float(65519.996f), 0x7bff);
    assert_int_equal(bake_half_from_float(65520.0f), 0x7c00);
    assert_int_equal(bake_half_from_float(-INFINITY), 0xfc00);
    assert_int_equal(bake_half_from_float(NAN) & 0x7c00, 0x7c00);
    assert_int_not_equal(bake_half_from_float(NAN) & 1023, 0);
}

static struct volume make(int nx, int ny, int nz, bool solid,
                          double (*value)(double, double, double)) {
    struct volume volume = {.size = {nx, ny, nz}};
    float *voxels = volume_alloc_voxels(volume.size), *v = voxels;
    assert_non_null(voxels);
    for (int z = 0; z < nz; z++)
        for (int y = 0; y < ny; y++)
            for (int x = 0; x < nx; x++, v += 4)
                v[3] = (float)value((x + 0.5) / nx, (y + 0.5) / ny, (z + 0.5) / nz);
    *(solid ? &volume.solid : &volume.medium) = voxels;
    return volume;
}

static uint16_t *gradients(const struct volume *volume) {
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    uint16_t *halves = malloc(count * 8);
    memset(halves, 0xff, count * 8); /* NaN: what is not written shows */
    enum bake_field field = volume->solid ? BAKE_FIELD_SOLID : BAKE_FIELD_MEDIUM;
    assert_int_equal(bake_gradients(volume, field, halves), STATUS_OK);
    return halves;
}

static double at(const struct volume *volume, const uint16_t *halves, int x, int y, int z, int c) {
    size_t i = ((size_t)z * (size_t)volume->size[1] + (size_t)y) * (size_t)volume->size[0];
    return half_value(halves[4 * (i + (size_t)x) + (size_t)c]);
}

static void drop(struct volume *volume, uint16_t *halves) {
    free(volume->medium);
    free(volume->solid);
    free(halves);
}

static double waves(double u, double v, double w) {
    return 0.5 + 0.2 * sin(2 * M_PI * u) + 0.1 * cos(4 * M_PI * v) + 0.3 * (w - 0.5);
}

/* Against the derivatives of the function itself, over one voxel, with the sign turned outward. At
 * 64 voxels the difference of a wave is (pi k / 64)^2 / 1.5 off, a half float 2^-11: together less
 * than 1 % of the largest slope, measured 0.67 %. */
static void differences_are_derivatives(void **state) {
    (void)state;
    struct volume volume = make(64, 64, 16, true, waves);
    uint16_t *halves = gradients(&volume);
    double worst = 0;
    for (int z = 1; z < 15; z++)
        for (int y = 0; y < 64; y++)
            for (int x = 0; x < 64; x++) {
                double u = (x + 0.5) / 64, v = (y + 0.5) / 64;
                double expected[3] = {-0.4 * M_PI * cos(2 * M_PI * u) / 64,
                                      0.4 * M_PI * sin(4 * M_PI * v) / 64, -0.3 / 16};
                for (int c = 0; c < 3; c++)
                    worst = fmax(worst, fabs(at(&volume, halves, x, y, z, c) - expected[c]));
                assert_true(at(&volume, halves, x, y, z, 3) == 0);
            }
    print_message("waves: off by %.2f %% of the largest slope\n", worst / (0.4 * M_PI / 64) * 100);
    assert_true(worst < 0.01 * 0.4 * M_PI / 64);
    /* The end layers see the field go on with their own value: half the slope. */
    assert_true(fabs(at(&volume, halves, 5, 5, 0, 2) + 0.15 / 16) < 1e-5);
    assert_true(fabs(at(&volume, halves, 5, 5, 15, 2) + 0.15 / 16) < 1e-5);
    drop(&volume, halves);
}

static double ball(double u, double v, double w) {
    double d = 0.3 - sqrt((u - 0.5) * (u - 0.5) + (v - 0.5) * (v - 0.5) + (w - 0.5) * (w - 0.5));
    return fmin(fmax(0.5 + 32 * d / 2, 0), 1);
}

/* On the surface of a ball of radius 9.6 voxels the vector points away from the centre; the clamped
 * ramp of two voxels bends it by at most 5 degrees, measured 3.9. */
static void gradients_point_outward(void **state) {
    (void)state;
    struct volume volume = make(32, 32, 32, true, ball);
    uint16_t *halves = gradients(&volume);
    int seen = 0;
    double worst = 0;
    for (int z = 0; z < 32; z++)
        for (int y = 0; y < 32; y++)
            for (int x = 0; x < 32; x++) {
                double p[3] = {x - 15.5, y - 15.5, z - 15.5};
                double radius = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
                if (fabs(radius - 9.6) > 0.5)
                    continue;
                double dot = 0, length = 0;
                for (int c = 0; c < 3; c++) {
                    double g = at(&volume, halves, x, y, z, c);
                    dot += g * p[c] / radius;
                    length += g * g;
                }
                worst = fmax(worst, acos(fmin(dot / sqrt(length), 1)) * 180 / M_PI);
                seen++;
            }
    print_message("ball: %d voxels, worst angle %.2f degrees\n", seen, worst);
    assert_true(seen > 500);
    assert_true(worst < 5);
    drop(&volume, halves);
}

static double steep(double u, double v, double w) {
    (void)v, (void)w;
    return u < 0.5 ? 0 : 1e6; /* optical depth: opaque */
}

/* A medium's gradient is that of a voxel's opacity, not of its extinction: bounded, however dense.
 */
static void opacity_is_what_counts(void **state) {
    (void)state;
    struct volume volume = make(8, 1, 4, false, steep);
    uint16_t *halves = gradients(&volume);
    const double expected[8] = {0.5, 0, 0, -0.5, -0.5, 0, 0, 0.5}; /* periodic: twice an edge */
    for (int x = 0; x < 8; x++)
        assert_true(at(&volume, halves, x, 0, 1, 0) == expected[x]);
    drop(&volume, halves);

    volume = make(8, 1, 4, false, waves);
    halves = gradients(&volume);
    for (int x = 0; x < 8; x++) {
        double left = (double)volume.medium[4 * (8 + (x + 7) % 8) + 3];
        double right = (double)volume.medium[4 * (8 + (x + 1) % 8) + 3];
        double expected_u = (exp(-right / 4) - exp(-left / 4)) / 2;
        assert_true(fabs(at(&volume, halves, x, 0, 1, 0) - expected_u) < fabs(expected_u) / 1000);
    }
    drop(&volume, halves);
}

static double rough(double u, double v, double w) {
    double x = sin(u * 1234.5 + v * 777.7 + w * 345.6) * 43758.5453;
    return x - floor(x);
}

/* Large enough for two threads: the same as differences taken one by one. */
static void threads_change_nothing(void **state) {
    (void)state;
    struct volume volume = make(160, 128, 64, true, rough);
    uint16_t *halves = gradients(&volume);
    const int n[3] = {160, 128, 64};
    for (size_t i = 0; i < 160 * 128 * 64; i++) {
        int p[3] = {(int)(i % 160), (int)(i / 160 % 128), (int)(i / (160 * 128))};
        for (int c = 0; c < 3; c++) {
            float f[2];
            for (int side = 0; side < 2; side++) {
                int q[3] = {p[0], p[1], p[2]};
                q[c] += side ? 1 : -1;
                if (c < 2)
                    q[c] = (q[c] + n[c]) % n[c];
                else
                    q[c] = q[c] < 0 ? 0 : q[c] >= n[c] ? n[c] - 1 : q[c];
                f[side] = volume.solid[4 * ((q[2] * n[1] + q[1]) * n[0] + q[0]) + 3];
            }
            assert_int_equal(halves[4 * i + (size_t)c], bake_half_from_float((f[0] - f[1]) / 2));
        }
    }
    drop(&volume, halves);
}

static void one_voxel_has_no_gradient(void **state) {
    (void)state;
    static const int sizes[][3] = {{1, 1, 1}, {1, 1, 64}, {512, 1, 1}, {1, 512, 1}, {2, 2, 1}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        struct volume volume = make(sizes[i][0], sizes[i][1], sizes[i][2], false, waves);
        uint16_t *halves = gradients(&volume);
        size_t count = (size_t)sizes[i][0] * (size_t)sizes[i][1] * (size_t)sizes[i][2];
        for (size_t k = 0; k < count; k++)
            for (size_t c = 0; c < 4; c++) {
                double g = half_value(halves[4 * k + c]);
                assert_true(isfinite(g) && fabs(g) <= 0.5);
                /* Along an axis of one or two voxels both neighbours are the same one. */
                if (c == 3 || (c < 2 && sizes[i][c] <= 2) || (c == 2 && sizes[i][2] == 1))
                    assert_true(g == 0);
            }
        drop(&volume, halves);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_half_is_read_and_written_back),
        cmocka_unit_test(halves_round_to_nearest_even),
        cmocka_unit_test(differences_are_derivatives),
        cmocka_unit_test(gradients_point_outward),
        cmocka_unit_test(opacity_is_what_counts),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(one_voxel_has_no_gradient),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
