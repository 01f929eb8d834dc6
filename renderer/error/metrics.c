/* The figures of DESIGN, 'Error'. */
#include "renderer/error/metrics.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/error/flip.h"
#include "renderer/error/squares.h"

static const double SILHOUETTE = 1.0 / 512;

static int compare_floats(const void *a, const void *b) {
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* What is added up over a set of pixels. */
struct tally {
    struct squares squares;
    float *errors; /* of each pixel, for the percentile */
};

static void tally_pixel(struct tally *tally, const double difference[4]) {
    size_t at = tally->squares.count;
    tally->errors[at] = (float)sqrt(squares_add(&tally->squares, difference, 1));
    squares_end_block(&tally->squares);
}

static void tally_finish(struct tally *tally, struct error_figures *figures) {
    size_t pixels = tally->squares.count;
    *figures = (struct error_figures){.pixels = pixels};
    if (pixels == 0)
        return;
    qsort(tally->errors, pixels, sizeof *tally->errors, compare_floats);
    /* The smallest rank that covers 99 %, in integers: 0.99 is no binary fraction. */
    size_t rank = (pixels * 99 + 99) / 100;
    figures->rmse = squares_rmse(&tally->squares);
    figures->rmse_standard_error = squares_standard_error(&tally->squares);
    figures->max_abs = tally->squares.largest;
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

static double channel_difference(float a, float b, int finite) {
    return finite ? (double)a - (double)b : 1;
}

void error_map(const float *test, const float *reference, int width, int height, float *map) {
    size_t count = (size_t)width * (size_t)height;
    for (size_t p = 0; p < count; p++) {
        const float *a = test + 4 * p, *b = reference + 4 * p;
        int finite = finite_pixel(a) && finite_pixel(b);
        for (int i = 0; i < 4; i++)
            map[4 * p + (size_t)i] = (float)fabs(channel_difference(a[i], b[i], finite));
    }
}

enum status error_compare_pixels(const float *test, const float *reference, size_t count,
                                 const uint8_t *touched, const double background[4],
                                 struct error_metrics *metrics, struct error *err) {
    *metrics = (struct error_metrics){.flip = NAN};
    float *errors = malloc((2 * count + 1) * sizeof *errors);
    if (!errors)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to compare pictures");
    struct tally inside = {.errors = errors}, whole = {.errors = errors + count};
    for (size_t p = 0; p < count; p++) {
        const float *a = test + 4 * p, *b = reference + 4 * p;
        double difference[4];
        int finite = finite_pixel(a) && finite_pixel(b);
        metrics->not_finite += !finite;
        for (int i = 0; i < 4; i++)
            difference[i] = channel_difference(a[i], b[i], finite);
        bool drawn[2] = {error_drawn_on(a, background), error_drawn_on(b, background)};
        metrics->coverage += drawn[0] != drawn[1];
        tally_pixel(&whole, difference);
        if ((touched && touched[p]) || drawn[0] || drawn[1])
            tally_pixel(&inside, difference);
    }
    tally_finish(&inside, &metrics->touched);
    tally_finish(&whole, &metrics->whole);
    metrics->psnr_db = metrics->whole.rmse > 0 ? -20 * log10(metrics->whole.rmse) : INFINITY;
    free(errors);
    return STATUS_OK;
}

enum status error_compare(const float *test, const float *reference, int width, int height,
                          const uint8_t *touched, const double background[4], float *flip_map,
                          struct error_metrics *metrics, struct error *err) {
    size_t count = (size_t)width * (size_t)height;
    enum status status =
        error_compare_pixels(test, reference, count, touched, background, metrics, err);
    if (status != STATUS_OK)
        return status;
    float *map = flip_map ? flip_map : malloc((count + 1) * sizeof *map);
    if (!map)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to compare pictures");
    status = error_flip(test, reference, width, height, map, &metrics->flip, err);
    if (!flip_map)
        free(map);
    return status;
}
