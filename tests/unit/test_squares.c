/* Sums over pixels that were drawn by lot, against what they must be. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "renderer/error/squares.h"

static void test_of_all(void **state) {
    (void)state;
    struct squares squares = {0};
    assert_true(squares_rmse(&squares) == 0 && squares_standard_error(&squares) == 0);
    static const double differences[3][4] = {{1, 0, 0, -1}, {0, 0, 0, 0}, {0, -2, 0, 0}};
    for (int n = 0; n < 3; n++) {
        squares_add(&squares, differences[n], 1);
        squares_end_block(&squares);
    }
    /* Mean squares 0.5, 0, 1; their mean 0.5, its variance (0 + 0.25 + 0.25) / 9. */
    assert_true(fabs(squares_rmse(&squares) - sqrt(0.5)) < 1e-15);
    assert_true(squares.largest == 2 && squares.count == 3);
    assert_true(fabs(squares_standard_error(&squares) - sqrt(0.5) / 3 / (2 * sqrt(0.5))) < 1e-15);
}

/* Pixels of one block are one draw: the error is that of blocks, not of pixels. */
static void test_blocks_are_drawn(void **state) {
    (void)state;
    struct squares alone = {0}, together = {0};
    for (int n = 0; n < 10; n++) {
        double difference[4] = {n % 3, 0, 0, 0};
        squares_add(&alone, difference, 2);
        squares_end_block(&alone);
        for (int copy = 0; copy < 4; copy++)
            squares_add(&together, difference, 2);
        squares_end_block(&together);
    }
    assert_true(fabs(squares_rmse(&alone) - squares_rmse(&together)) < 1e-15);
    assert_true(fabs(squares_standard_error(&alone) - squares_standard_error(&together)) < 1e-15);
}

static double uniform(uint32_t *state) {
    *state = *state * 1664525u + 1013904223u;
    return *state * 0x1p-32;
}

/* Weighed by the inverse of its chance, a sample that prefers large errors tells the mean square of
 * all: over 2,000 samples of a population the mean is right within its own error, and the standard
 * errors that are told are of the size of the scatter that is seen. */
static void test_weights_undo_preference(void **state) {
    (void)state;
    enum { POPULATION = 400, ROUNDS = 2000 };
    double errors[POPULATION], chance[POPULATION], true_ = 0;
    uint32_t lot = 1;
    for (int n = 0; n < POPULATION; n++) {
        errors[n] = n % 20 == 0 ? 1 + uniform(&lot) : 0.05 * uniform(&lot);
        chance[n] = fmin(1, 0.05 + 0.4 * errors[n]);
        true_ += errors[n] * errors[n] / 4 / POPULATION;
    }
    double mean = 0, scatter = 0, told = 0;
    for (int round = 0; round < ROUNDS; round++) {
        struct squares squares = {0};
        for (int n = 0; n < POPULATION; n++) {
            if (uniform(&lot) >= chance[n])
                continue;
            double difference[4] = {errors[n], 0, 0, 0};
            squares_add(&squares, difference, 1 / chance[n]);
            squares_end_block(&squares);
        }
        double rmse = squares_rmse(&squares);
        mean += rmse * rmse / ROUNDS;
        scatter += pow(rmse - sqrt(true_), 2) / ROUNDS;
        told += squares_standard_error(&squares) / ROUNDS;
    }
    print_message("mean square %.5f of %.5f, scatter %.5f, told %.5f\n", mean, true_, sqrt(scatter),
                  told);
    assert_true(fabs(mean / true_ - 1) < 0.05); /* a ratio of sums: biased by about 1 / samples */
    assert_true(told > 0.7 * sqrt(scatter) && told < 1.4 * sqrt(scatter));
}

/* What was sure to be looked at leaves nothing open. */
static void test_all_leaves_nothing_open(void **state) {
    (void)state;
    struct squares sure = {0}, half = {0}, none = {0};
    for (int n = 0; n < 10; n++) {
        double difference[4] = {n, 0, 0, 0};
        squares_add(&sure, difference, 1);
        squares_end_drawn(&sure, 1);
        squares_add(&half, difference, 1);
        squares_end_drawn(&half, 0.5);
        squares_add(&none, difference, 1);
        squares_end_block(&none);
    }
    assert_true(squares_standard_error(&sure) == 0 && squares_rmse(&sure) == squares_rmse(&none));
    assert_true(fabs(squares_standard_error(&half) / squares_standard_error(&none) - sqrt(0.5)) <
                1e-12);
}

static void test_percentile(void **state) {
    (void)state;
    struct weighted errors[200];
    assert_true(weighted_p99(errors, 0) == 0);
    for (int n = 0; n < 200; n++)
        errors[n] = (struct weighted){(n * 37) % 200, 1};
    assert_true(weighted_p99(errors, 200) == 197); /* 198 of 200 are at most this */
    /* One that stands for a hundred others. */
    for (int n = 0; n < 200; n++)
        errors[n] = (struct weighted){n, n == 199 ? 100 : 1};
    assert_true(weighted_p99(errors, 200) == 199);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_of_all),
        cmocka_unit_test(test_blocks_are_drawn),
        cmocka_unit_test(test_weights_undo_preference),
        cmocka_unit_test(test_all_leaves_nothing_open),
        cmocka_unit_test(test_percentile),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
