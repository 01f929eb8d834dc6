/* See estimate.h. */
#include "renderer/estimate.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/error/metrics.h"
#include "renderer/error/squares.h"
#include "renderer/gl/clock.h"
#include "renderer/reference/reference.h"

enum {
    ESTIMATE_EVERY = 48, /* of how many blocks one is drawn again, at four times the cost, or six:
                            blocks of interest are dear ones */
    ESTIMATE_PIXELS_MIN = 512, /* fewer say little about an error that lies in few places */
    MODEL_PIXELS_FIRST = 32,   /* drawn in any case, to learn what one costs */
    MODEL_PIXELS_MAX = 2048,
    PROMISE = 4 /* times as much of both where measure.promises */
};

/* How much finer the pair's other half is. */
static const double ESTIMATE_FACTOR = 4;

/* 4^-1.7: estimate.h. */
static const double RESIDUE = 0.0947;

/* Of the model's reference: the error of pixels is about a tenth of it, of what is estimated here
 * less than a hundredth. */
static const double MODEL_TOLERANCE = 1e-4;

/* A reference is made ready at some 1.3 to 2 us a prism (measured: 4,096 to 27,648 of them). */
static const double WORLD_MS_PER_PRISM = 2e-3;

/* A model error may cost a twentieth of what the picture took, or this, which makes some ten
 * pixels of most scenes. */
static const double MODEL_MS_MIN = 6;

/* Adds the errors of the probe's pixels pick[from] to pick[to - 1]. */
static enum status add_model(const struct measure *measure, const struct reference *reference,
                             float (*limit)[4], const uint32_t *pick, size_t from, size_t to,
                             struct squares *squares, struct error *err) {
    const struct probe *probe = measure->probe;
    uint32_t *pixels = malloc((to - from + 1) * sizeof *pixels);
    if (!pixels)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for pixels");
    for (size_t n = from; n < to; n++)
        pixels[n - from] = probe->index[pick[n]];
    struct reference_request request = {.pixels = pixels,
                                        .pixel_count = to - from,
                                        .threads = measure->threads,
                                        .tolerance = MODEL_TOLERANCE};
    struct reference_result truth;
    enum status status = reference_render(reference, &request, &truth, err);
    free(pixels);
    if (status != STATUS_OK)
        return status;
    for (size_t n = from; n < to; n++) {
        double difference[4];
        if (!measure_finite(limit[pick[n]]))
            continue;
        for (int i = 0; i < 4; i++)
            difference[i] = (double)limit[pick[n]][i] - truth.pixels[n - from][i];
        size_t area = (size_t)probe->blocks.side * (size_t)probe->blocks.side;
        squares_add(squares, difference, 1 / probe->chance[pick[n] / area]);
        squares_end_block(squares);
    }
    reference_result_finish(&truth);
    return STATUS_OK;
}

/* An order in which every beginning is spread over the whole: the van der Corput sequence's. */
static size_t spread(uint32_t *pick, size_t count) {
    uint32_t *ordered = malloc((count + 1) * sizeof *ordered);
    if (!ordered)
        return 0;
    int bits = 0;
    while ((size_t)1 << bits < count)
        bits++;
    size_t filled = 0;
    for (size_t n = 0; n < (size_t)1 << bits; n++) {
        size_t reversed = 0;
        for (int b = 0; b < bits; b++)
            reversed |= (n >> b & 1) << (bits - 1 - b);
        if (reversed < count)
            ordered[filled++] = pick[reversed];
    }
    memcpy(pick, ordered, count * sizeof *pick);
    free(ordered);
    return count;
}

enum status estimate_model(const struct measure *measure, float (*limit)[4],
                           const uint8_t *met_pixels, double budget_ms, struct model_error *model,
                           struct error *err) {
    const struct probe *probe = measure->probe;
    const struct picture *picture = measure->drawing->picture;
    *model = (struct model_error){.rmse = NAN, .standard_error = NAN};
    double prisms = 0;
    for (size_t i = 0; i < picture->object_count; i++)
        prisms += picture->objects[i].mesh->triangle_count;
    double began = clock_now_ms();
    if (prisms * WORLD_MS_PER_PRISM > budget_ms)
        return STATUS_OK;
    /* One pixel a block: its neighbours would tell the same. */
    size_t area = (size_t)probe->blocks.side * (size_t)probe->blocks.side, count = 0;
    uint32_t *pick = malloc((probe->count / area + 1) * sizeof *pick);
    if (!pick)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for pixels");
    for (size_t block = 0; block < probe->count / area; block++) {
        uint32_t n = (uint32_t)(block * area + block % area);
        if (met_pixels[probe->index[n]])
            pick[count++] = n;
    }
    struct reference *reference = NULL;
    struct squares squares = {0};
    enum status status = STATUS_OK;
    if (count && spread(pick, count) != count)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for pixels");
    if (status == STATUS_OK)
        status = measure_open_reference(measure, &reference, err);
    size_t first = count < MODEL_PIXELS_FIRST ? count : MODEL_PIXELS_FIRST;
    double ready = clock_now_ms();
    if (status == STATUS_OK)
        status = add_model(measure, reference, limit, pick, 0, first, &squares, err);
    double now = clock_now_ms();
    double each_ms = first ? (now - ready) / (double)first : 0;
    double left = each_ms > 0 ? (budget_ms - (now - began)) / each_ms : 0;
    size_t more = left < 1 ? first : first + (size_t)fmin(left, MODEL_PIXELS_MAX);
    if (status == STATUS_OK && more > first && count > first)
        status = add_model(measure, reference, limit, pick, first, more < count ? more : count,
                           &squares, err);
    model->pixels = squares.count;
    if (squares.count) {
        model->rmse = squares_rmse(&squares);
        model->standard_error = squares_standard_error(&squares);
    }
    reference_destroy(reference);
    free(pick);
    return status;
}

/* The pair: the error of the picture's steps in the probe's pixels, and their limit, which takes
 * the place of probe->pixels. Returns the 99th percentile; `errors` has room for all of them. */
static double embedded_pair(const struct measure *measure, const uint8_t *met_pixels,
                            struct squares *squares, struct weighted *errors) {
    struct probe *probe = measure->probe;
    size_t area = (size_t)probe->blocks.side * (size_t)probe->blocks.side;
    bool exact = measure_is_exact(measure->drawing->picture);
    for (size_t n = 0; n < probe->count; n++) {
        const float *drawn = measure->pixels + 4 * (size_t)probe->index[n];
        float *limit = probe->pixels[n];
        double difference[4], weight = 1 / probe->chance[n / area];
        for (int i = 0; i < 4; i++) {
            double fine = exact ? drawn[i] : limit[i];
            difference[i] = ((double)drawn[i] - fine) / (1 - RESIDUE);
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
    double times = measure->promises ? PROMISE : 1;
    double every = fmax(1, fmin(ESTIMATE_EVERY / times, eligible / (times * ESTIMATE_PIXELS_MIN)));
    interest = find_interest(measure, met_pixels);
    status = interest
                 ? probe_choose(probe, image->width, image->height, k, side, measure->met, interest,
                                every, err)
                 : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to measure a picture");
    if (status == STATUS_OK && !measure_is_exact(measure->drawing->picture))
        status = measure_draw_again(measure, ESTIMATE_FACTOR, err);
    errors = status == STATUS_OK ? malloc((probe->count + 1) * sizeof *errors) : NULL;
    if (status == STATUS_OK && !errors)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to measure a picture");
    if (status != STATUS_OK)
        goto done;
    struct squares squares = {0};
    out->p99 = embedded_pair(measure, met_pixels, &squares, errors);
    /* Over all touched pixels: where no shell is met there is no error. */
    double share = touched ? sqrt((double)met / (double)touched) : 0;
    out->pixels = probe->count;
    out->touched = squares.count;
    out->discretisation = squares_rmse(&squares) * share;
    out->discretisation_standard_error = squares_standard_error(&squares) * share;
    out->max_abs = squares.largest;
    struct model_error model;
    double spent = clock_now_ms() - began;
    status = estimate_model(measure, probe->pixels, met_pixels,
                            fmax(MODEL_MS_MIN, 0.05 * (measure->spent_ms + spent)) *
                                (measure->promises ? PROMISE : 1),
                            &model, err);
    if (status != STATUS_OK)
        goto done;
    out->model = model.rmse * share;
    out->model_standard_error = model.standard_error * share;
    out->model_pixels = model.pixels;
    out->rmse = hypot(out->discretisation, out->model);
    out->rmse_standard_error = hypot(out->discretisation * out->discretisation_standard_error,
                                     out->model * out->model_standard_error) /
                               fmax(out->rmse, 1e-300);
    if (model.pixels == 0 && squares.count)
        report_warn(report, "model-error-unknown", "/report/error", 1, 0,
                    "the model error is left out: making the reference ready for this many "
                    "triangles would take longer than a twentieth of the picture's time");
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
