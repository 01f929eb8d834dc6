/* Coarser voxels: closed forms, what columns let through to rounding, sizes of all kinds, stiff
 * media. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/bake/normals.h"
#include "renderer/bake/pyramid.h"
#include "renderer/bake/view_pyramid.h"

static struct volume make(int nx, int ny, int nz) {
    struct volume volume = {.size = {nx, ny, nz}};
    volume.medium = calloc((size_t)nx * (size_t)ny * (size_t)nz, 4 * sizeof *volume.medium);
    assert_non_null(volume.medium);
    return volume;
}

static void set(struct volume *volume, int x, int y, int z, float sigma, float red) {
    size_t i =
        ((size_t)z * (size_t)volume->size[1] + (size_t)y) * (size_t)volume->size[0] + (size_t)x;
    volume->medium[4 * i] = sigma * red;
    volume->medium[4 * i + 3] = sigma;
}

static struct volume make_even(int nx, int ny, int nz, float sigma) {
    struct volume volume = make(nx, ny, nz);
    for (int z = 0; z < nz; z++)
        for (int y = 0; y < ny; y++)
            for (int x = 0; x < nx; x++)
                set(&volume, x, y, z, sigma, 0.5f);
    return volume;
}

/* A third of the voxels, of extinctions from 0.1 to 200. */
static struct volume make_random(int nx, int ny, int nz) {
    struct volume volume = make(nx, ny, nz);
    uint32_t seed = 1;
    for (int z = 0; z < nz; z++)
        for (int y = 0; y < ny; y++)
            for (int x = 0; x < nx; x++) {
                seed = seed * 1664525u + 1013904223u;
                float a = (float)(seed >> 8) / 16777216.0f, b = (float)(seed & 0xff) / 255;
                if (a < 1.0f / 3)
                    set(&volume, x, y, z, 0.1f * powf(2000, 3 * a), b);
            }
    return volume;
}

static const int sizes[][3] = {{1, 1, 1},  {2, 2, 2},  {5, 3, 2},   {512, 1, 1}, {1, 1, 64},
                               {7, 13, 3}, {8, 8, 64}, {16, 31, 5}, {3, 1, 7}};
enum { SIZES = sizeof sizes / sizeof *sizes };

/* The opacity equation in height, opacities across. */
static void the_papers_equations(void **state) {
    (void)state;
    struct volume volume = make(2, 1, 2);
    set(&volume, 0, 0, 0, 2, 0.25f);
    set(&volume, 0, 0, 1, 6, 0.75f);
    set(&volume, 1, 0, 0, 1, 1);
    struct pyramid pyramid;
    assert_int_equal(pyramid_make(&volume, PYRAMID_UNLIT, &pyramid), STATUS_OK);
    assert_int_equal(pyramid.count, 2);
    /* Alphas: 1 - e^-3 over 1 - e^-1; 1 - e^-0.5 alone. */
    double top = -expm1(-3), low = -expm1(-1), other = -expm1(-0.5);
    double alpha = (top + (1 - top) * low + other) / 2;
    double red = (top * 0.75 + (1 - top) * low * 0.25 + other * 1) / 2 / alpha;
    const float *cell = pyramid.level[1].medium;
    assert_float_equal((double)cell[3], -log1p(-alpha), 1e-6);
    assert_float_equal((double)(cell[0] / cell[3]), red, 1e-6);
    pyramid_finish(&pyramid);
    free(volume.medium);
}

static void what_is_even_stays(void **state) {
    (void)state;
    const float sigmas[] = {1e-7f, 3, 1e6f};
    for (size_t i = 0; i < (size_t)3 * SIZES; i++) {
        const int *n = sizes[i / 3];
        double sigma = (double)sigmas[i % 3];
        struct volume volume = make_even(n[0], n[1], n[2], (float)sigma);
        struct pyramid pyramid;
        assert_int_equal(pyramid_make(&volume, PYRAMID_UNLIT, &pyramid), STATUS_OK);
        const struct pyramid_level *last = &pyramid.level[pyramid.count - 1];
        assert_int_equal(last->size[0] * last->size[1] * last->size[2], 1);
        for (int l = 0; l < pyramid.count; l++) {
            assert_float_equal((double)pyramid.level[l].medium[3] / sigma, 1, 1e-5);
            assert_float_equal((double)(pyramid.level[l].medium[0] / pyramid.level[l].medium[3]),
                               0.5, 1e-5);
        }
        pyramid_finish(&pyramid);
        free(volume.medium);
    }
}

/* Half of the columns are clear: half of the light comes through, however dense the others are. */
static void stiff_columns_beside_clear_ones(void **state) {
    (void)state;
    struct volume volume = make(2, 1, 1);
    set(&volume, 0, 0, 0, 1e6f, 1);
    struct pyramid pyramid;
    assert_int_equal(pyramid_make(&volume, PYRAMID_UNLIT, &pyramid), STATUS_OK);
    assert_float_equal((double)pyramid.level[1].medium[3], log(2), 1e-6);
    assert_float_equal((double)pyramid.level[1].medium[0], log(2), 1e-6);
    pyramid_finish(&pyramid);
    free(volume.medium);
}

/* What one column lets through and gathers from an end. */
static void look(const struct volume *volume, int x, int y, bool above, double *left, double *red) {
    const int *n = volume->size;
    *left = 1;
    *red = 0;
    for (int i = 0; i < n[2]; i++) {
        int z = above ? n[2] - 1 - i : i;
        const float *v = volume->medium +
                         4 * (((size_t)z * (size_t)n[1] + (size_t)y) * (size_t)n[0] + (size_t)x);
        if (!(v[3] > 0))
            continue;
        double lost = -expm1(-(double)v[3] / n[2]);
        *red += *left * lost * (double)(v[0] / v[3]);
        *left *= 1 - lost;
    }
}

/* Of every cell of every level: a ray along w gathers what its columns' own rays gather. */
static void along_w_it_is_exact(void **state) {
    (void)state;
    const double aspect[2] = {1, 1.5};
    for (int s = 0; s < SIZES; s++) {
        struct volume volume = make_random(sizes[s][0], sizes[s][1], sizes[s][2]);
        const int *n = volume.size;
        struct view_pyramid pyramid;
        assert_int_equal(view_pyramid_make(&volume, aspect, false, &pyramid), STATUS_OK);
        assert_int_equal(pyramid.count == 0, n[0] == 1 && n[1] == 1);
        if (pyramid.count == 0) {
            free(volume.medium);
            view_pyramid_finish(&pyramid);
            continue;
        }
        const struct view_level *top = &pyramid.level[pyramid.count - 1];
        assert_int_equal(top->size[0] * top->size[1], 1);
        for (int above = 0; above < 2; above++) {
            double left = 0, red = 0;
            for (int i = 0; i < n[0] * n[1]; i++) {
                double one_left, one_red;
                look(&volume, i % n[0], i / n[0], above, &one_left, &one_red);
                left += one_left / (n[0] * n[1]);
                red += one_red / (n[0] * n[1]);
            }
            double through = 1, gathered = 0;
            for (int i = 0; i < n[2]; i++) {
                int z = above ? n[2] - 1 - i : i;
                int at = (above ? VIEW_ABOVE : VIEW_BELOW) * n[2] + z;
                double lost = (double)(top->medium[4 * at + 3] / top->left[at]);
                if (top->medium[4 * at + 3] > 0)
                    gathered +=
                        through * lost * (double)(top->medium[4 * at] / top->medium[4 * at + 3]);
                through *= 1 - lost;
            }
            assert_float_equal(through, left, 2e-6);
            assert_float_equal(gathered, red, 2e-6);
        }
        view_pyramid_finish(&pyramid);
        free(volume.medium);
    }
}

/* An even medium is the same from every side: what is lost in a layer is its extinction's share at
 * that slant, whatever the aspect. */
static void an_even_medium_from_each_side(void **state) {
    (void)state;
    static const double cosine[VIEW_SLANTS] = {1, 0.70710678118, 0.35355339059};
    const double aspects[][2] = {{1, 1}, {0.01, 100}, {1e-9, 1e9}};
    for (size_t a = 0; a < 3; a++) {
        struct volume volume = make_even(6, 5, 4, 2);
        struct view_pyramid pyramid;
        assert_int_equal(view_pyramid_make(&volume, aspects[a], false, &pyramid), STATUS_OK);
        for (int l = 0; l < pyramid.count; l++) {
            const struct view_level *level = &pyramid.level[l];
            int cells = level->size[0] * level->size[1];
            for (int side = 0; side < VIEW_SIDE; side++)
                for (int i = 0; i < 4 * cells; i++) {
                    int at = side * 4 * cells + i;
                    double depth = -log1p(-(double)(level->medium[4 * at + 3] / level->left[at]));
                    assert_float_equal(depth * cosine[side % VIEW_SLANTS] * 4, 2, 2e-4);
                }
            /* Beside its top there is nothing, so the lowest layer is looked at, where that is not
             * seen: cells less high than the thickness. */
            int at = VIEW_SIDE * 4 * cells;
            double depth = -log1p(-(double)(level->medium[4 * at + 3] / level->left[at]));
            if (a == 0 && l == 0)
                assert_float_equal(depth * 4, 2, 2e-4);
            assert_true(depth > 0 && depth * 4 < 2 + 2e-4);
        }
        view_pyramid_finish(&pyramid);
        free(volume.medium);
    }
}

/* A wall across u: its faces point along u, and face whoever looks. */
static void normals_are_those_that_are_seen(void **state) {
    (void)state;
    struct volume volume = make_even(8, 8, 4, 0);
    for (int z = 0; z < 4; z++)
        for (int y = 0; y < 8; y++)
            for (int x = 2; x < 6; x++)
                set(&volume, x, y, z, 400, 1);
    const double aspect[2] = {1, 1};
    struct view_pyramid pyramid;
    assert_int_equal(view_pyramid_make(&volume, aspect, true, &pyramid), STATUS_OK);
    const struct view_level *top = &pyramid.level[pyramid.count - 1];
    int at = VIEW_SIDE * 4;
    float lost = top->medium[4 * at + 3];
    /* Along u it faces the viewer; along v nothing does: half of the mean over both. */
    assert_true(top->moments[0][4 * at + 3] / lost > 0.4f);
    assert_true(fabsf(top->moments[0][4 * at] / lost) < 1e-3f);
    assert_true(fabsf(top->moments[0][4 * at + 2] / lost) < 1e-3f);
    view_pyramid_finish(&pyramid);

    struct pyramid mips;
    assert_int_equal(pyramid_make(&volume, PYRAMID_NORMALS, &mips), STATUS_OK);
    for (int i = 0; i < 3; i++)
        assert_true(fabsf(bake_float_from_half(mips.level[mips.count - 1].gradient[i])) < 1e-3f);
    pyramid_finish(&mips);
    free(volume.medium);
}

/* Strands of two directions side by side: T is their mean, and shorter; along w alone `mip` mixes,
 * where it is the upper one that is seen. */
static void strands_are_means_of_tangents(void **state) {
    (void)state;
    struct volume volume = make_even(4, 4, 2, 0);
    float strands[4 * 4 * 4 * 2] = {0};
    volume.strands = strands;
    for (int z = 0; z < 2; z++)
        for (int y = 0; y < 4; y++)
            for (int x = 0; x < 4; x++) {
                set(&volume, x, y, z, 100, 1);
                float *s = strands + 4 * ((z * 4 + y) * 4 + x);
                s[z == 0 ? 2 : x % 2] = 100;
                s[3] = 100;
            }
    struct pyramid mips, layers;
    assert_int_equal(pyramid_make(&volume, PYRAMID_STRANDS, &mips), STATUS_OK);
    assert_int_equal(pyramid_strand_layers(&volume, &layers), STATUS_OK);
    assert_null(mips.level[0].gradient);
    for (int l = 1; l < mips.count; l++) {
        const float *s = mips.level[l].strands;
        for (int i = 0; i < 3; i++) /* 1 of 22,000 parts of light reaches the lower layer */
            assert_float_equal(s[i] / s[3], i < 2 ? 0.5 : 0, 1e-3);
    }
    assert_int_equal(layers.count, 3);
    for (int l = 1; l < layers.count; l++) {
        const struct pyramid_level *level = &layers.level[l];
        size_t cells = (size_t)level->size[0] * (size_t)level->size[1];
        assert_int_equal(level->size[2], 2);
        for (size_t i = 0; i < 2 * cells; i++) {
            const float *s = level->strands + 4 * i;
            assert_float_equal(s[0], i < cells ? 0 : 50, 1e-4);
            assert_float_equal(s[1], i < cells ? 0 : 50, 1e-4);
            assert_float_equal(s[2], i < cells ? 100 : 0, 1e-4);
            assert_float_equal(s[3], 100, 1e-4);
        }
    }
    pyramid_finish(&mips);
    pyramid_finish(&layers);
    free(volume.medium);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_papers_equations),
        cmocka_unit_test(strands_are_means_of_tangents),
        cmocka_unit_test(what_is_even_stays),
        cmocka_unit_test(stiff_columns_beside_clear_ones),
        cmocka_unit_test(along_w_it_is_exact),
        cmocka_unit_test(an_even_medium_from_each_side),
        cmocka_unit_test(normals_are_those_that_are_seen),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
