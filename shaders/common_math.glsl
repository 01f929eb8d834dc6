/* What GLSL lacks. 1 - exp(-x) in fp32 is 10 % wrong at x = 1e-6. */

/* 1 - exp(-x) for x >= 0, to 2e-7 relative: its series below 1/2 (the first term left out is
 * x^8 / 9! < 1.1e-8), the plain form above, where nothing cancels by more than a bit and a half.
 * Both sides are computed and one selected: a branch saves nothing under a mask. */
float one_minus_exp(float x) {
    float series =
        x *
        (1.0 -
         x * (1.0 / 2.0) *
             (1.0 -
              x * (1.0 / 3.0) *
                  (1.0 - x * (1.0 / 4.0) * (1.0 - x * (1.0 / 5.0) * (1.0 - x * (1.0 / 6.0) * (1.0 - x * (1.0 / 7.0) * (1.0 - x * (1.0 / 8.0))))))));
    return x < 0.5 ? series : 1.0 - exp(-x);
}

/* (1 - exp(-x)) / x for x >= 0, 1 at 0: the mean of exp(-s) over [0, x]. To 2e-7 relative, as above. */
float mean_exp(float x) {
    float series =
        1.0 -
        x * (1.0 / 2.0) *
            (1.0 -
             x * (1.0 / 3.0) *
                 (1.0 - x * (1.0 / 4.0) * (1.0 - x * (1.0 / 5.0) * (1.0 - x * (1.0 / 6.0) * (1.0 - x * (1.0 / 7.0) * (1.0 - x * (1.0 / 8.0)))))));
    return x < 0.5 ? series : (1.0 - exp(-x)) / x;
}

/* -log(1 - h): its series below 1/8 (the first term left out is h^7 / 8 < 1e-7 of the whole). */
float depth_of(float h) {
    float far = 1.0 / 4.0 + h * (1.0 / 5.0 + h * (1.0 / 6.0 + h / 7.0));
    float series = h * (1.0 + h * (1.0 / 2.0 + h * (1.0 / 3.0 + h * far)));
    return h < 0.125 ? series : -log(1.0 - h);
}

/* By channels. */
vec3 one_minus_exp(vec3 x) {
    return vec3(one_minus_exp(x.r), one_minus_exp(x.g), one_minus_exp(x.b));
}

vec3 mean_exp(vec3 x) {
    return vec3(mean_exp(x.r), mean_exp(x.g), mean_exp(x.b));
}

/* The one optical depth that lets through the mean of what three let through: least + -log(mean of
 * exp(-(tau - least))), so that depths of any size keep their digits, and equal ones are that. */
float depth_of_channels(vec3 tau) {
    float least = min(min(tau.r, tau.g), tau.b);
    vec3 lost = one_minus_exp(tau - least);
    return least + depth_of((lost.r + lost.g + lost.b) / 3.0);
}

float most_of(vec3 x) {
    return max(max(x.r, x.g), x.b);
}
