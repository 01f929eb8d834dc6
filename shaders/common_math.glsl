/* What GLSL lacks. 1 - exp(-x) in fp32 is 10 % wrong at x = 1e-6. */

/* 1 - exp(-x) for x >= 0, to 2e-7 relative: its series below 1/2 (the first term left out is
 * x^8 / 9! < 1.1e-8), the plain form above, where nothing cancels by more than a bit and a half.
 * Both sides are computed and one selected: a branch saves nothing under a mask. */
float one_minus_exp(float x) {
    float series =
        x *
        (1.0 -
         x / 2.0 *
             (1.0 -
              x / 3.0 *
                  (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0)))))));
    return x < 0.5 ? series : 1.0 - exp(-x);
}

/* (1 - exp(-x)) / x for x >= 0, 1 at 0: the mean of exp(-s) over [0, x]. To 2e-7 relative, as above. */
float mean_exp(float x) {
    float series =
        1.0 -
        x / 2.0 *
            (1.0 -
             x / 3.0 *
                 (1.0 - x / 4.0 * (1.0 - x / 5.0 * (1.0 - x / 6.0 * (1.0 - x / 7.0 * (1.0 - x / 8.0))))));
    return x < 0.5 ? series : (1.0 - exp(-x)) / x;
}
