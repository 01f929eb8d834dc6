/* See estimate.h. */
#include "renderer/estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/error/metrics.h"
#include "renderer/error/squares.h"
#include "renderer/estimate_model.h"
#include "renderer/gl/clock.h"

enum {
    /* Of how many blocks one is drawn again, at four times the cost, or six: blocks of interest are
     * dear ones. An eighth of the picture's time. */
    ESTIMATE_EVERY = 48,
    FINE_PIXELS_MIN = 512, /* fewer are drawn three times as finely only, and twice as many: a sixth
                              of the time */
    PROMISE = 4            /* times as much of both where measure.promises */
};

/* How much finer the pair's other half is: of all pixels, of some, of few. (Twice is too near where
 * the steps are too long for an order to show: errors of both halves are then independent, and the
 * estimate half as much again as the truth.) */
static const double FACTOR_ALL = 2, FACTOR = 4, FACTOR_FEW = 3;

/* The order of convergence that is taken for granted: estimate.h. */
static const double ORDER = 1.7;

/* Of the picture's time an estimate may take this, the pair and the model's pixels together; clocks
 * and other work on the machine make it a third at times. */
static const double ESTIMATE_SHARE = 0.25;

/* For a promise the model error is looked at as long as the scene is not too large for that. */
static const double PROMISE_MODEL_MS_MIN = 24;

/* The pair: the error of the picture's steps in the probe's pixels, and their limit, which takes
 * the place of probe->pixels. Returns the 99th percentile; `errors` has room for all of them. */
static double embedded_pair(const struct measure *measure, const uint8_t *met_pixels, double factor,
                            struct squares *squares, struct weighted *errors) {
    struct probe *probe = measure->probe;
    size_t area = (size_t)probe->blocks.side * (size_t)probe->blocks.side;
    bool exact = measure_is_exact(measure->drawing->picture);
    double residue = pow(factor, -ORDER);
    for (size_t n = 0; n < probe->count; n++) {
        const float *drawn = measure->pixels + 4 * (size_t)probe->index[n];
        float *limit = probe->pixels[n];
        double difference[4], weight = 1 / probe->chance[n / area];
        for (int i = 0; i < 4; i++) {
            double fine = exact ? drawn[i] : limit[i];
            difference[i] = ((double)drawn[i] - fine) / (1 - residue);
            limit[i] = (float)(drawn[i] - difference[i]);
        }
        if (met_pixels[probe->index[n]] && measure_finite(limit)) {
            size_t at = squares->count;
            errors[at].error = sqrt(squares_add(squares, difference, weight));
            errors[at].weight = weight;
        }
        if (n % area == area - 1)
            squares_end_drawn(squares, probe->chance[n / area]);
    }
    return weighted_p99(errors, squares->count);
}

/* Where errors are likely: where the picture changes from pixel to pixel, at silhouettes and in
 * fine detail. A quarter of the mean everywhere, so that no place is without a chance. malloc'ed,
 * for each pixel; NULL where memory ran out. */
static float *find_interest(const struct measure *measure, const uint8_t *met_pixels) {
    size_t width = (size_t)measure->scene->image.width;
    size_t height = (size_t)measure->scene->image.height;
    float *interest = calloc(width * height + 1, sizeof *interest);
    double sum = 0, met = 0;
    if (!interest)
        return NULL;
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++) {
            const float *here = measure->pixels + 4 * (y * width + x);
            const float *left = x > 0 ? here - 4 : here, *right = x + 1 < width ? here + 4 : here;
            const float *above = y > 0 ? here - 4 * width : here;
            const float *below = y + 1 < height ? here + 4 * width : here;
            float most = 0;
            for (int i = 0; i < 4; i++) {
                most = fmaxf(most, fmaxf(fabsf(here[i] - left[i]), fabsf(here[i] - right[i])));
                most = fmaxf(most, fmaxf(fabsf(here[i] - above[i]), fabsf(here[i] - below[i])));
            }
            interest[y * width + x] = most < 1 ? most : 1;
            if (met_pixels[y * width + x]) {
                sum += (double)interest[y * width + x];
                met++;
            }
        }
    float floor = met > 0 && sum > 0 ? (float)(sum / met / 4) : 1;
    for (size_t p = 0; p < width * height; p++)
        interest[p] = met_pixels[p] ? interest[p] + floor : 0;
    return interest;
}

/* A solid's edge is in a pixel or it is not: a ray that grazes it between two steps makes an error
 * of a whole pixel in one of thousands, which no sample of them is likely to see. A promise
 * therefore looks at all of them. (How many are missed falls with the square root of the step only:
 * two pictures a factor of two apart differ in 0.29 of them, which the order taken for granted
 * makes 0.78 of the true error.) */
static bool any_solid(const struct picture *picture) {
    for (size_t i = 0; i < picture->object_count; i++)
        if (picture->objects[i].shell && volume_has_solid(picture->objects[i].volume))
            return true;
    return false;
}

/* What no sample of a picture tells of its hard edges: a sample that lies within what a raster or
 * fp32 leaves open of an edge falls on the one side here and on the other in truth. Of samples in
 * pictures of solids one in EDGES_EVERY does (measured: one in 5,000 to 9,000, forty scenes of
 * chain at 1 sample a pixel), and makes an error of what lies between neighbouring pixels, or a
 * pixel and the background, at the most. */
enum { EDGES_EVERY = 8192 };

static double edge_error(const struct measure *measure, const uint8_t *met_pixels) {
    size_t width = (size_t)measure->scene->image.width;
    size_t height = (size_t)measure->scene->image.height;
    double most = 0, samples = (double)measure->drawing->plan->k * measure->drawing->plan->k;
    const double *background = measure->scene->image.background;
    float behind[4];
    for (int i = 0; i < 4; i++) /* premultiplied */
        behind[i] = (float)(background[i] * (i < 3 ? background[3] : 1));
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++) {
            const float *here = measure->pixels + 4 * (y * width + x);
            const float *beside[3] = {x + 1 < width ? here + 4 : here,
                                      y + 1 < height ? here + 4 * width : here, behind};
            for (int k = 0; k < 3 && met_pixels[y * width + x]; k++) {
                double sum = 0;
                for (int i = 0; i < 4; i++) {
                    double d = (double)here[i] - (double)beside[k][i];
                    sum += d * d / 4;
                }
                most = fmax(most, sum); /* fmax() passes over what is no number */
            }
        }
    return sqrt(most / (EDGES_EVERY * samples));
}

/* Pixels that objects touch: those where a shell is met, and where the picture is drawn on. Where
 * there are no shells, the latter take the place of the former. */
static size_t count_touched(const struct measure *measure, uint8_t *met_pixels, size_t *met) {
    const double *background = measure->scene->image.background;
    size_t count = (size_t)measure->scene->image.width * (size_t)measure->scene->image.height;
    size_t touched = 0;
    *met = 0;
    for (size_t p = 0; p < count; p++) {
        bool drawn_on = error_drawn_on(measure->pixels + 4 * p, background);
        if (!measure->met)
            met_pixels[p] = drawn_on;
        *met += met_pixels[p];
        touched += met_pixels[p] || drawn_on;
    }
    return touched;
}

enum status estimate_error(const struct measure *measure, struct report *report,
                           struct error *err) {
    const struct scene_image *image = &measure->scene->image;
    struct probe *probe = measure->probe;
    int k = measure->drawing->plan->k, side = probe_block_side(image->width, image->height, k);
    double began = clock_now_ms();
    struct report_error *out = &report->error;
    *out = measure_unknown();
    out->kind = REPORT_ERROR_ESTIMATE;
    uint8_t *met_pixels = measure_met_pixels(measure->met, image->width, image->height, k);
    struct weighted *errors = NULL;
    float *interest = NULL;
    enum status status = STATUS_OK;
    if (!met_pixels) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to measure a picture");
        goto done;
    }
    size_t met, touched = count_touched(measure, met_pixels, &met);
    double eligible =
        (double)probe_eligible(image->width, image->height, k, side, measure->met) * side * side;
    bool all = measure->promises && any_solid(measure->drawing->picture);
    double factor = FACTOR, every = ESTIMATE_EVERY / (measure->promises ? PROMISE : 1);
    if (all) {
        factor = FACTOR_ALL;
        every = 1;
    } else if (eligible < every * FINE_PIXELS_MIN) {
        factor = FACTOR_FEW;
        every = fmax(1, every / 2);
    }
    interest = find_interest(measure, met_pixels);
    status = interest
                 ? probe_choose(probe, image->width, image->height, k, side, measure->met, interest,
                                every, err)
                 : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to measure a picture");
    if (status == STATUS_OK && !measure_is_exact(measure->drawing->picture))
        status = measure_draw_again(measure, factor, err);
    errors = status == STATUS_OK ? malloc((probe->count + 1) * sizeof *errors) : NULL;
    if (status == STATUS_OK && !errors)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to measure a picture");
    if (status != STATUS_OK)
        goto done;
    struct squares squares = {0};
    out->p99 = embedded_pair(measure, met_pixels, factor, &squares, errors);
    /* Over all touched pixels: where no shell is met there is no error. */
    double share = touched ? sqrt((double)met / (double)touched) : 0;
    out->pixels = probe->count;
    out->touched = squares.count;
    out->discretisation = squares_rmse(&squares) * share;
    out->discretisation_standard_error = squares_standard_error(&squares) * share;
    out->max_abs = squares.largest;
    struct model_error model;
    double share_ms = ESTIMATE_SHARE * measure->spent_ms;
    double budget_ms = measure->promises ? fmax(PROMISE_MODEL_MS_MIN, PROMISE * share_ms)
                                         : share_ms - (clock_now_ms() - began);
    /* Blocks that were not chosen by their interest leave that to the choice of their pixels. */
    status = estimate_model(measure, probe->pixels, met_pixels, all ? interest : NULL, budget_ms,
                            &model, err);
    if (status != STATUS_OK)
        goto done;
    /* Where the model error is unknown it stays so. */
    if (any_solid(measure->drawing->picture))
        model.rmse = hypot(model.rmse, edge_error(measure, met_pixels));
    out->model = model.rmse * share;
    out->model_standard_error = model.standard_error * share;
    out->model_pixels = model.pixels;
    out->rmse = hypot(out->discretisation, out->model);
    out->rmse_standard_error = hypot(out->discretisation * out->discretisation_standard_error,
                                     out->model * out->model_standard_error) /
                               fmax(out->rmse, 1e-300);
    if (model.pixels == 0 && squares.count)
        report_warn(report, "model-error-unknown", "/report/error", 1, 0,
                    "the model error is left out: the reference of a few pixels would take longer "
                    "than the share of the picture's time that an estimate may take");
    if (squares.count == 0)
        out->rmse = out->rmse_standard_error = out->model = out->model_standard_error = 0;
    out->whole_rmse = out->rmse * sqrt((double)touched / ((double)image->width * image->height));
    out->psnr_db = out->whole_rmse > 0 ? -20 * log10(out->whole_rmse) : INFINITY;
done:
    free(errors);
    free(interest);
    free(met_pixels);
    return status;
}
