/* Sums over pixels that were drawn by lot: RMSE, its standard error, percentiles. On numbers alone.
 *
 * Pixels come in blocks; a block was chosen with some chance, and its pixels weigh the inverse
 * (Horvitz & Thompson 1952). Blocks are what was drawn by lot, so the standard error comes from
 * their sums: pixels of one are alike. */
#ifndef PELT_RENDERER_ERROR_SQUARES_H
#define PELT_RENDERER_ERROR_SQUARES_H

#include <stddef.h>

/* Squares of pixels' differences, each the mean over its channels. Zeroed is empty. */
struct squares {
    double sum, weights, largest; /* largest: of a channel */
    double block_sum, block_weights;
    double ss, sw, ww; /* of the blocks: products of their sums and weights */
    size_t count;
};

/* Adds a pixel to the current block; returns its mean square. */
double squares_add(struct squares *squares, const double difference[4], double weight);

/* Every block ends with this; so does a pixel that is a block of its own. */
void squares_end_block(struct squares *squares);

/* The same for a block that was chosen with this chance: what was sure to be chosen adds nothing to
 * the standard error. */
void squares_end_drawn(struct squares *squares, double chance);

double squares_rmse(const struct squares *squares); /* 0 where there are none */

/* Of the RMSE, to first order: that of the mean square, a ratio of two sums over blocks, over twice
 * the RMSE. */
double squares_standard_error(const struct squares *squares);

/* A pixel's error, and for how many it stands. */
struct weighted {
    double error, weight;
};

/* The smallest error that at least 99 % do not exceed; sorts them. 0 where there are none. */
double weighted_p99(struct weighted *errors, size_t count);

#endif
