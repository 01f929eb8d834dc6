/* The arithmetic of a sweep, on numbers whose answers are known. */
#include <math.h>
#include <stdlib.h>

#include "renderer/sweep_series.h"
#include "renderer/sweep_stats.h"
#include "tests/support.h"

static void spread_interpolates(void **state) {
    (void)state;
    double five[] = {50, 10, 40, 20, 30}, one[] = {7}, two[] = {3, 1};
    struct sweep_spread spread = sweep_spread(five, 5);
    assert_float_equal(spread.median, 30, 1e-12);
    assert_float_equal(spread.p10, 14, 1e-12); /* 0.4 of the way from 10 to 20 */
    assert_float_equal(spread.p90, 46, 1e-12);
    spread = sweep_spread(one, 1);
    assert_true(spread.median == 7 && spread.p10 == 7 && spread.p90 == 7);
    spread = sweep_spread(two, 2);
    assert_float_equal(spread.median, 2, 1e-12);
    assert_float_equal(spread.p10, 1.2, 1e-12);
}

enum { LADDER = 6 };
static const double ladder[LADDER] = {4, 8, 16, 32, 64, 128};

/* C q^-p, seen against its own picture at `limit`, comes back. */
static void fit_finds_the_power(void **state) {
    (void)state;
    for (double order = 0.5; order <= 4; order += 0.25) {
        double error[LADDER];
        struct sweep_fit fit;
        for (int i = 0; i < LADDER; i++)
            error[i] = 3 * (pow(ladder[i], -order) - pow(512, -order));
        sweep_fit(ladder, error, LADDER, 512, 0, &fit);
        assert_int_equal(fit.points, LADDER);
        /* The iteration ends at steps of 1e-6, and converges the slower the lower the order. */
        assert_float_equal(fit.order, order, 3e-5);
        assert_float_equal(fit.constant / 3, 1, 1e-4);
        assert_true(fit.standard_error < 1e-5);
        assert_float_equal(fit.finest_order, order, 1e-4);
    }
}

/* One point off by a factor in the middle of five moves the slope by what least squares say: none
 * at the middle, and the residual gives the standard error. */
static void fit_tells_its_uncertainty(void **state) {
    (void)state;
    const double quality[] = {1, 2, 4, 8, 16};
    double error[5];
    for (int i = 0; i < 5; i++)
        error[i] = pow(quality[i], -2) * (i == 2 ? 2 : 1);
    struct sweep_fit fit;
    sweep_fit(quality, error, 5, 1e9, 0, &fit);
    double unit = log(2);
    assert_float_equal(fit.order, 2, 1e-9);
    /* Residuals -1/5 (four times) and 4/5 of log 2; x in steps of log 2, whose squares sum to 10.
     */
    assert_float_equal(fit.standard_error, sqrt((4 * 0.04 + 0.64) / 3 / 10) * unit / unit, 1e-9);
}

static void fit_leaves_out(void **state) {
    (void)state;
    double error[LADDER];
    struct sweep_fit fit;
    for (int i = 0; i < LADDER; i++)
        error[i] = pow(ladder[i], -2);
    /* Below the floor: the plateau must not bend the line. */
    error[4] = error[5] = 1e-3;
    sweep_fit(ladder, error, LADDER, 1e9, 0.97e-3, &fit);
    assert_int_equal(fit.points, 6);
    assert_true(fit.order < 1.9);
    assert_float_equal(fit.finest_order, 0, 0); /* of the plateau */
    sweep_fit(ladder, error, LADDER, 1e9, 1e-3, &fit);
    assert_int_equal(fit.points, 3); /* 32^-2 is 0.98e-3 */
    assert_float_equal(fit.finest_order, 2, 1e-9);
    assert_float_equal(fit.order, 2, 1e-9);
    /* What is more than half the limit, no number, zero. */
    for (int i = 0; i < LADDER; i++)
        error[i] = pow(ladder[i], -2);
    error[0] = NAN;
    error[1] = 0;
    sweep_fit(ladder, error, LADDER, 100, 0, &fit);
    assert_int_equal(fit.points, 2); /* 16 and 32 */
    assert_true(isnan(fit.standard_error) && isfinite(fit.order));
    sweep_fit(ladder, error, 3, 100, 0, &fit);
    assert_int_equal(fit.points, 1);
    assert_true(isnan(fit.order));
    sweep_fit(ladder, error, 0, 100, 0, &fit);
    assert_true(fit.points == 0 && isnan(fit.order) && isnan(fit.finest_order) &&
                isnan(fit.constant));
}

/* An error that grows has an order below zero, and nothing runs away. */
static void fit_survives_what_does_not_fall(void **state) {
    (void)state;
    double error[LADDER], same[LADDER];
    struct sweep_fit fit;
    for (int i = 0; i < LADDER; i++) {
        error[i] = ladder[i];
        same[i] = 0.5;
    }
    sweep_fit(ladder, error, LADDER, 512, 0, &fit);
    assert_float_equal(fit.order, -1, 1e-9);
    sweep_fit(ladder, same, LADDER, 512, 0, &fit);
    assert_true(isfinite(fit.order) && fabs(fit.order) < 1);
}

static void front_of_points(void **state) {
    (void)state;
    /* Beaten by none: 0, 2, 3. 1 is slower and worse than 0; 4 is no better than 3 by more than the
     * tolerance; 5 is equal to 2; 6 and 7 are no numbers; 8 is as fast as 0 and worse. */
    const double time[] = {1, 2, 3, 4, 5, 3, NAN, 9, 1};
    const double error[] = {0.5, 0.6, 0.3, 0.1, 0.0999, 0.3, 0, INFINITY, 0.55};
    const bool expected[] = {true, false, true, true, false, false, false, false, false};
    bool front[9];
    sweep_pareto(time, error, 9, 1e-3, front);
    for (int i = 0; i < 9; i++)
        assert_int_equal(front[i], expected[i]);
    sweep_pareto(time, error, 9, 0, front);
    assert_true(front[4]);
    sweep_pareto(time, error, 0, 0, front);
}

static int compare_pixels(const void *a, const void *b) {
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* Whatever the sizes: as many as asked for, inside, no pixel twice, the same each time. */
static void strata_are_distinct(void **state) {
    (void)state;
    static const int sizes[][3] = {{1, 1, 1},     {7, 1, 3},       {1, 9, 9},        {64, 48, 1},
                                   {64, 48, 2},   {64, 48, 3071},  {64, 48, 3072},   {300, 3, 500},
                                   {3, 300, 500}, {8192, 2, 4096}, {512, 512, 4096}, {37, 53, 1000},
                                   {100, 10, 901}};
    for (size_t n = 0; n < sizeof sizes / sizeof *sizes; n++) {
        size_t count = (size_t)sizes[n][2];
        uint32_t *pixels = malloc(count * sizeof *pixels), *again = malloc(count * sizeof *again);
        assert_non_null(pixels);
        assert_non_null(again);
        sweep_stratify(sizes[n][0], sizes[n][1], count, pixels);
        sweep_stratify(sizes[n][0], sizes[n][1], count, again);
        assert_memory_equal(pixels, again, count * sizeof *pixels);
        qsort(pixels, count, sizeof *pixels, compare_pixels);
        assert_true(pixels[count - 1] < (uint32_t)sizes[n][0] * (uint32_t)sizes[n][1]);
        for (size_t i = 1; i < count; i++)
            assert_true(pixels[i - 1] < pixels[i]);
        free(pixels);
        free(again);
    }
}

/* 4,096 of 512 x 512: one in each of 64 x 64 cells of 8 x 8 pixels, and not always at one place. */
static void strata_cover_the_frame(void **state) {
    (void)state;
    static uint32_t pixels[4096];
    static bool seen[4096];
    size_t places[64] = {0};
    memset(seen, 0, sizeof seen);
    sweep_stratify(512, 512, 4096, pixels);
    for (size_t i = 0; i < 4096; i++) {
        uint32_t x = pixels[i] % 512, y = pixels[i] / 512;
        seen[y / 8 * 64 + x / 8] = true;
        places[y % 8 * 8 + x % 8]++;
    }
    for (size_t i = 0; i < 4096; i++)
        assert_true(seen[i]);
    /* 64 expected at each place, with a deviation of 8: five of them leave room for all 64. */
    for (size_t i = 0; i < 64; i++)
        assert_in_range(places[i], 24, 104);
}

/* Each row of the table names members that there are, and moves them. */
static void rows_apply(void **state) {
    (void)state;
    size_t rows = 0;
    for (const struct sweep_row *row = sweep_rows; row->name; row++, rows++) {
        assert_ptr_equal(sweep_row_find(row->name), row);
        assert_true(strlen(sweep_row_path_name(row)) > 0 && strlen(sweep_row_unit(row)) > 0);
        for (int i = 0; i < SWEEP_LADDER_DEFAULT; i++) {
            assert_in_range(row->ladder[i], sweep_row_min(row), sweep_row_max(row) / 4);
            assert_true(i == 0 || row->ladder[i] > row->ladder[i - 1]);
        }
    }
    assert_true(rows >= 2);
    assert_null(sweep_row_find("tetra"));
    struct scene_object objects[2] = {
        {.kind = SCENE_OBJECT_SHELL, .quality = {.slices = 9, .traversal = SCENE_TRAVERSAL_DDA}},
        {.kind = SCENE_OBJECT_MESH, .quality = {.slices = 9}}};
    sweep_row_apply(sweep_row_find("tetra-walk"), 24, objects, 2);
    assert_int_equal(objects[0].path, SCENE_PATH_TETRA);
    assert_int_equal(objects[0].quality.samples, 24);
    assert_int_equal(objects[0].quality.order, SCENE_ORDER_WALK);
    assert_int_equal(objects[0].quality.slices, 0);
    assert_int_equal(objects[0].quality.traversal, SCENE_TRAVERSAL_FIXED);
    assert_int_equal(objects[1].quality.slices, 9);
    sweep_row_apply(sweep_row_find("tetra-sorted"), 3, objects, 2);
    assert_int_equal(objects[0].quality.order, SCENE_ORDER_SORTED);
    const struct scene scene = {.object_count = 1, .objects = objects + 1};
    assert_false(sweep_row_concerns(sweep_row_find("tetra-walk"), &scene));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spread_interpolates),
        cmocka_unit_test(fit_finds_the_power),
        cmocka_unit_test(fit_tells_its_uncertainty),
        cmocka_unit_test(fit_leaves_out),
        cmocka_unit_test(fit_survives_what_does_not_fall),
        cmocka_unit_test(front_of_points),
        cmocka_unit_test(strata_are_distinct),
        cmocka_unit_test(strata_cover_the_frame),
        cmocka_unit_test(rows_apply),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
