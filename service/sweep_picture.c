/* See sweep_picture.h. */
#include "service/sweep_picture.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Nine knots of magma's 256 colours, an eighth apart. */
static const unsigned char knots[9][3] = {{0, 0, 4},      {28, 16, 68},    {79, 18, 123},
                                          {129, 37, 129}, {181, 54, 122},  {229, 80, 100},
                                          {251, 135, 97}, {254, 194, 135}, {252, 253, 191}};

void sweep_colour(double share, double srgb[3]) {
    double at = share > 0 ? fmin(share, 1) * 8 : 0; /* what is no number is black */
    int knot = at < 7 ? (int)at : 7;
    for (int i = 0; i < 3; i++)
        srgb[i] = knots[knot][i] + (at - knot) * (knots[knot + 1][i] - knots[knot][i]);
}

/* IEC 61966-2-1, the way back. */
static double linear_from_srgb(double code) {
    double c = code / 255;
    return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4);
}

static void colour_pixel(double share, float *pixel) {
    double srgb[3];
    sweep_colour(share, srgb);
    for (int i = 0; i < 3; i++)
        pixel[i] = (float)linear_from_srgb(srgb[i]);
    pixel[3] = 1;
}

static double difference_at(const struct sweep *sweep, const struct sweep_point *point, size_t p) {
    double sum = 0;
    for (size_t i = 4 * p; i < 4 * p + 4; i++) {
        double difference = (double)point->pixels[i] - (double)sweep->reference[i];
        sum += difference * difference / 4;
    }
    return sqrt(sum);
}

/* What the view shows at a pixel: four channels, or one number in out[0]. */
static void value_at(const struct sweep *sweep, const struct sweep_point *point,
                     enum sweep_view view, size_t p, double out[4]) {
    const float *picture = point ? point->pixels : sweep->reference;
    if (view == SWEEP_VIEW_DIFFERENCE)
        out[0] = difference_at(sweep, point, p);
    else if (view == SWEEP_VIEW_FLIP)
        out[0] = (double)point->flip[p];
    else
        for (int i = 0; i < 4; i++)
            out[i] = (double)picture[4 * p + (size_t)i];
}

float *sweep_picture(const struct sweep *sweep, const struct sweep_point *point,
                     enum sweep_view view, int side_max, int *width, int *height) {
    assert(point || view == SWEEP_VIEW_PICTURE);
    assert(!sweep->pixels || (point && view == SWEEP_VIEW_PICTURE));
    int longest = sweep->width > sweep->height ? sweep->width : sweep->height;
    int factor = side_max > 0 ? (longest + side_max - 1) / side_max : 1;
    /* Blocks at the right and the lower edge may be smaller. */
    *width = (sweep->width + factor - 1) / factor;
    *height = (sweep->height + factor - 1) / factor;
    float *pixels = malloc((size_t)*width * (size_t)*height * 4 * sizeof *pixels);
    for (int y = 0; pixels && y < *height; y++)
        for (int x = 0; x < *width; x++) {
            double sum[4] = {0}, count = 0;
            for (int v = y * factor; v < (y + 1) * factor && v < sweep->height; v++)
                for (int u = x * factor; u < (x + 1) * factor && u < sweep->width; u++) {
                    double value[4] = {0};
                    value_at(sweep, point, view, (size_t)v * (size_t)sweep->width + (size_t)u,
                             value);
                    for (int i = 0; i < 4; i++)
                        sum[i] += value[i];
                    count++;
                }
            float *pixel = pixels + 4 * ((size_t)y * (size_t)*width + (size_t)x);
            if (view == SWEEP_VIEW_PICTURE)
                for (int i = 0; i < 4; i++)
                    pixel[i] = (float)(sum[i] / count);
            else
                colour_pixel(view == SWEEP_VIEW_FLIP ? sum[0] / count
                                                     : 1 + log10(sum[0] / count) / SWEEP_DECADES,
                             pixel);
        }
    return pixels;
}
