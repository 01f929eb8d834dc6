/* See squares.h. */
#include "renderer/error/squares.h"

#include <math.h>
#include <stdlib.h>

double squares_add(struct squares *squares, const double difference[4], double weight) {
    double mean = 0;
    for (int i = 0; i < 4; i++) {
        mean += difference[i] * difference[i] / 4;
        squares->largest = fmax(squares->largest, fabs(difference[i]));
    }
    squares->block_sum += weight * mean;
    squares->block_weights += weight;
    squares->count++;
    return mean;
}

void squares_end_block(struct squares *squares) {
    squares_end_drawn(squares, 0);
}

void squares_end_drawn(struct squares *squares, double chance) {
    double s = squares->block_sum, w = squares->block_weights, open = fmax(0, 1 - chance);
    squares->sum += s;
    squares->weights += w;
    squares->ss += open * s * s;
    squares->sw += open * s * w;
    squares->ww += open * w * w;
    squares->block_sum = squares->block_weights = 0;
}

double squares_rmse(const struct squares *squares) {
    return squares->weights > 0 ? sqrt(squares->sum / squares->weights) : 0;
}

double squares_standard_error(const struct squares *squares) {
    double rmse = squares_rmse(squares), mean = rmse * rmse;
    if (rmse == 0)
        return 0;
    double variance = squares->ss - 2 * mean * squares->sw + mean * mean * squares->ww;
    return sqrt(fmax(0, variance)) / squares->weights / (2 * rmse);
}

static int compare_weighted(const void *a, const void *b) {
    double x = ((const struct weighted *)a)->error, y = ((const struct weighted *)b)->error;
    return (x > y) - (x < y);
}

double weighted_p99(struct weighted *errors, size_t count) {
    double all = 0, sum = 0;
    qsort(errors, count, sizeof *errors, compare_weighted);
    for (size_t n = 0; n < count; n++)
        all += errors[n].weight;
    for (size_t n = 0; n < count; n++) {
        sum += errors[n].weight;
        if (sum >= 0.99 * all)
            return errors[n].error;
    }
    return 0;
}
