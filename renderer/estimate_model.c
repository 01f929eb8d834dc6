/* See estimate_model.h. */
#include "renderer/estimate_model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/error/squares.h"
#include "renderer/gl/clock.h"
#include "renderer/reference/reference.h"

enum {
    PIXELS_MIN = 8, /* fewer tell nothing of the others */
    PIXELS_MAX = 2048,
    PROMISE_PIXELS_MIN = 256, /* whatever they take */
    PROMISE_PER_BLOCK = 4
};

/* Of the reference: the error of pixels is about a tenth of it, of what is estimated here less than
 * a hundredth. */
static const double TOLERANCE = 1e-4;

/* A reference is made ready at some 1.3 to 2 us a prism (measured: 4,096 to 27,648 of them). */
static const double WORLD_MS_PER_PRISM = 2e-3;

/* A pixel of the probe, and with what chance it was to be looked at. */
struct pick {
    uint32_t n;
    double chance;
};

struct picks {
    struct pick *pick;
    size_t count;
};

static enum status no_memory(struct error *err) {
    return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for pixels");
}

/* An order in which every beginning is spread over the whole: the van der Corput sequence's. */
static enum status spread(struct picks *picks, struct error *err) {
    struct pick *ordered = malloc((picks->count + 1) * sizeof *ordered);
    if (!ordered)
        return no_memory(err);
    int bits = 0;
    while ((size_t)1 << bits < picks->count)
        bits++;
    size_t filled = 0;
    for (size_t n = 0; n < (size_t)1 << bits; n++) {
        size_t reversed = 0;
        for (int b = 0; b < bits; b++)
            reversed |= (n >> b & 1) << (bits - 1 - b);
        if (reversed < picks->count)
            ordered[filled++] = picks->pick[reversed];
    }
    free(picks->pick);
    picks->pick = ordered;
    return STATUS_OK;
}

/* One pixel a block, since its neighbours would tell much the same; a promise, which breaks by
 * single pixels, looks at some of those too. */
static void pick_of_blocks(const struct measure *measure, const uint8_t *met_pixels,
                           struct picks *picks) {
    const struct probe *probe = measure->probe;
    size_t area = (size_t)probe->blocks.side * (size_t)probe->blocks.side;
    size_t each = measure->promises && area >= PROMISE_PER_BLOCK ? PROMISE_PER_BLOCK : 1;
    for (size_t k = 0; k < each; k++)
        for (size_t block = 0; block < probe->count / area; block++) {
            uint32_t n = (uint32_t)(block * area + (block + k * area / each) % area);
            if (met_pixels[probe->index[n]])
                picks->pick[picks->count++] = (struct pick){n, probe->chance[block]};
        }
}

/* PIXELS_MAX of all, each with a chance in proportion to its interest: pixels follow one another on
 * a line, each as long as its chance, and those are taken in which a mark at a whole number lies.
 */
static void pick_by_interest(const struct measure *measure, const uint8_t *met_pixels,
                             const float *interest, struct picks *picks) {
    const struct probe *probe = measure->probe;
    size_t area = (size_t)probe->blocks.side * (size_t)probe->blocks.side;
    double all = 0, at = 0.5;
    for (size_t n = 0; n < probe->count; n++)
        all += met_pixels[probe->index[n]] ? (double)interest[probe->index[n]] : 0;
    for (size_t n = 0; n < probe->count && all > 0; n++) {
        if (!met_pixels[probe->index[n]])
            continue;
        double chance = fmin(1, PIXELS_MAX * (double)interest[probe->index[n]] / all);
        if (floor(at + chance) > floor(at))
            picks->pick[picks->count++] =
                (struct pick){(uint32_t)n, chance * probe->chance[n / area]};
        at += chance;
    }
}

/* Adds the errors of the picks `from` to `to` - 1. */
static enum status add_pixels(const struct measure *measure, const struct reference *reference,
                              float (*limit)[4], const struct picks *picks, size_t from, size_t to,
                              struct squares *squares, struct error *err) {
    uint32_t *pixels = malloc((to - from + 1) * sizeof *pixels);
    if (!pixels)
        return no_memory(err);
    for (size_t i = from; i < to; i++)
        pixels[i - from] = measure->probe->index[picks->pick[i].n];
    struct reference_request request = {.pixels = pixels,
                                        .pixel_count = to - from,
                                        .threads = measure->threads,
                                        .tolerance = TOLERANCE};
    struct reference_result truth;
    enum status status = reference_render(reference, &request, &truth, err);
    free(pixels);
    if (status != STATUS_OK)
        return status;
    for (size_t i = from; i < to; i++) {
        const float *at = limit[picks->pick[i].n];
        double difference[4];
        if (!measure_finite(at))
            continue;
        for (int c = 0; c < 4; c++)
            difference[c] = (double)at[c] - truth.pixels[i - from][c];
        squares_add(squares, difference, 1 / picks->pick[i].chance);
        squares_end_block(squares);
    }
    reference_result_finish(&truth);
    return STATUS_OK;
}

/* As many as fit, twice as many each time, since the first tell what the next will take. */
static enum status add_what_fits(const struct measure *measure, const struct reference *reference,
                                 float (*limit)[4], const struct picks *picks, double began,
                                 double budget_ms, struct squares *squares, struct error *err) {
    size_t least = measure->promises ? PROMISE_PIXELS_MIN : PIXELS_MIN;
    size_t count = picks->count < PIXELS_MAX ? picks->count : PIXELS_MAX;
    size_t done = 0, next = (size_t)measure->threads;
    double ready = clock_now_ms(), now = ready;
    enum status status = STATUS_OK;
    while (status == STATUS_OK && done < count) {
        double left_ms = fmax(0, budget_ms - (now - began)), each_ms = (now - ready) / (double)done;
        size_t fit = done ? (size_t)fmin(left_ms / each_ms, PIXELS_MAX) : next;
        if (done + fit < least && measure->promises)
            fit = least - done;
        if (fit == 0 || (done && done + fit < least))
            break;
        next = next < fit ? next : fit;
        size_t to = done + next < count ? done + next : count;
        status = add_pixels(measure, reference, limit, picks, done, to, squares, err);
        next *= 2;
        done = to;
        now = clock_now_ms();
    }
    if (done < count && done < least)
        *squares = (struct squares){0};
    return status;
}

enum status estimate_model(const struct measure *measure, float (*limit)[4],
                           const uint8_t *met_pixels, const float *interest, double budget_ms,
                           struct model_error *model, struct error *err) {
    const struct picture *picture = measure->drawing->picture;
    *model = (struct model_error){.rmse = NAN, .standard_error = NAN};
    double prisms = 0;
    for (size_t i = 0; i < picture->object_count; i++)
        prisms += picture->objects[i].mesh->triangle_count;
    double began = clock_now_ms();
    if (prisms * WORLD_MS_PER_PRISM >= budget_ms)
        return STATUS_OK;
    struct picks picks = {.pick = malloc((measure->probe->count + 1) * sizeof *picks.pick)};
    if (!picks.pick)
        return no_memory(err);
    if (interest)
        pick_by_interest(measure, met_pixels, interest, &picks);
    else
        pick_of_blocks(measure, met_pixels, &picks);
    struct reference *reference = NULL;
    struct squares squares = {0};
    enum status status = spread(&picks, err);
    if (status == STATUS_OK && picks.count)
        status = measure_open_reference(measure, &reference, err);
    if (status == STATUS_OK)
        status = add_what_fits(measure, reference, limit, &picks, began, budget_ms, &squares, err);
    model->pixels = squares.count;
    if (squares.count) {
        model->rmse = squares_rmse(&squares);
        model->standard_error = squares_standard_error(&squares);
    }
    reference_destroy(reference);
    free(picks.pick);
    return status;
}
