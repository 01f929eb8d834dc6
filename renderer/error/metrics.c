/* The figures of DESIGN, 'Error'. */
#include "renderer/error/metrics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/error/flip.h"

static const double SILHOUETTE = 1.0 / 512;

static int compare_floats(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* What is added up over a set of pixels. */
struct tally {
    size_t pixels;
    double squares, largest;
    float *errors; /* of each pixel, for the percentile */
};

static void tally_pixel(struct tally *tally, double squares, double largest) {
    tally->errors[tally->pixels++] = (float)sqrt(squares / 4);
    tally->squares += squares;
    tally->largest = fmax(tally->largest, largest);
}

static void tally_finish(struct tally *tally, struct error_figures *figures) {
    *figures = (struct error_figures){.pixels = tally->pixels};
    if (tally->pixels == 0)
        return;
    qsort(tally->errors, tally->pixels, sizeof *tally->errors, compare_floats);
    /* The smallest rank that covers 99 %, in integers: 0.99 is no binary fraction. */
    size_t rank = (tally->pixels * 99 + 99) / 100;
    figures->rmse = sqrt(tally->squares / (4 * (double)tally->pixels));
    figures->max_abs = tally->largest;
    figures->p99 = (double)tally->errors[rank - 1];
}

bool error_drawn_on(const float pixel[4], const double background[4]) {
    for (int i = 0; i < 4; i++) {
        double behind = background[i] * (i < 3 ? background[3] : 1);
        if (!(fabs((double)pixel[i] - behind) <= SILHOUETTE))
            return true;
    }
    return false;
}

static int finite_pixel(const float *pixel) {
    return isfinite(pixel[0]) && isfinite(pixel[1]) && isfinite(pixel[2]) && isfinite(pixel[3]);
}

enum status error_compare(const float *test, const float *reference, int width, int height,
                          const uint8_t *touched, const double background[4], float *flip_map,
                          struct error_metrics *metrics, struct error *err) {
    memset(metrics, 0, sizeof *metrics);
    size_t count = (size_t)width * (size_t)height;
    float *errors = malloc((2 * count + 1) * sizeof *errors);
    float *map = flip_map ? flip_map : malloc((count + 1) * sizeof *map);
    if (!errors || !map) {
        free(errors);
        if (!flip_map)
            free(map);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to compare pictures");
    }
    struct tally inside = {.errors = errors}, whole = {.errors = errors + count};
    for (size_t p = 0; p < count; p++) {
        const float *a = test + 4 * p, *b = reference + 4 * p;
        double squares = 0, largest = 0;
        int finite = finite_pixel(a) && finite_pixel(b);
        metrics->not_finite += !finite;
        for (int i = 0; i < 4; i++) {
            double difference = finite ? fabs((double)a[i] - (double)b[i]) : 1;
            squares += difference * difference;
            largest = fmax(largest, difference);
        }
        bool drawn[2] = {error_drawn_on(a, background), error_drawn_on(b, background)};
        metrics->coverage += drawn[0] != drawn[1];
        tally_pixel(&whole, squares, largest);
        if ((touched && touched[p]) || drawn[0] || drawn[1])
            tally_pixel(&inside, squares, largest);
    }
    tally_finish(&inside, &metrics->touched);
    tally_finish(&whole, &metrics->whole);
    metrics->psnr_db = metrics->whole.rmse > 0 ? -20 * log10(metrics->whole.rmse) : INFINITY;
    enum status status = error_flip(test, reference, width, height, map, &metrics->flip, err);
    free(errors);
    if (!flip_map)
        free(map);
    return status;
}
