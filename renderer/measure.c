/* See measure.h. */
#include "renderer/measure.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/error/metrics.h"
#include "renderer/error/squares.h"
#include "renderer/reference/reference.h"

enum { REFERENCE_PIXELS = 4096 }; /* at the picture's own samples */

/* How much finer than the picture what stands for the path's limit is. */
static const double LIMIT_FACTOR = 8;

/* ---- what is common ---- */

bool measure_finite(const float p[4]) {
    return isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]) && isfinite(p[3]);
}

struct report_error measure_unknown(void) {
    return (struct report_error){.rmse = NAN,
                                 .rmse_standard_error = NAN,
                                 .max_abs = NAN,
                                 .p99 = NAN,
                                 .whole_rmse = NAN,
                                 .psnr_db = NAN,
                                 .flip = NAN,
                                 .coverage = NAN,
                                 .model = NAN,
                                 .model_standard_error = NAN,
                                 .discretisation = NAN,
                                 .discretisation_standard_error = NAN};
}

bool measure_is_exact(const struct picture *picture) {
    for (size_t i = 0; i < picture->object_count; i++)
        if (picture->objects[i].shell && !picture->objects[i].any_quality)
            return false;
    return true;
}

uint8_t *measure_met_pixels(const uint8_t *met, int width, int height, int k) {
    size_t columns = (size_t)width, rows = (size_t)height, side = (size_t)k;
    uint8_t *pixels = calloc(columns * rows + 1, 1);
    if (!pixels)
        return NULL;
    for (size_t y = 0; met && y < rows * side; y++) {
        uint8_t *row = pixels + (rows - 1 - y / side) * columns;
        for (size_t x = 0; x < columns * side; x++)
            row[x / side] |= met[y * columns * side + x];
    }
    return pixels;
}

const struct scene *measure_truth(const struct scene *scene, const struct path_object *objects,
                                  size_t count, struct scene *filtered) {
    bool any = false;
    for (size_t i = 0; i < count; i++)
        any |= objects[i].shell && objects[i].filter != SCENE_FILTER_NONE;
    if (!any || scene->image.samples >= MEASURE_SAMPLES)
        return scene;
    *filtered = *scene;
    filtered->image.samples = MEASURE_SAMPLES;
    return filtered;
}

enum status measure_open_reference(const struct measure *measure, struct reference **reference,
                                   struct error *err) {
    struct reference_sources sources = {measure->caches->meshes, measure->caches->volumes,
                                        measure->assets};
    enum status status = reference_create(measure->truth, &sources, reference, err);
    if (status == STATUS_OK)
        reference_set_camera(*reference, measure->camera);
    return status;
}

enum status measure_draw_again(const struct measure *measure, double factor, struct error *err) {
    struct report *report = measure->drawing->picture->report;
    struct report_drawn drawn;
    report_keep_drawn(report, &drawn);
    double ms;
    enum status status = probe_draw(measure->probe, measure->drawing,
                                    measure->scene->image.background, factor, &ms, err);
    report_restore_drawn(report, &drawn);
    return status;
}

/* ---- against the reference ---- */

static enum status judge(const struct measure *measure, const struct reference_result *truth,
                         struct report_error *out, struct error *err) {
    const struct probe *probe = measure->probe;
    const double *background = measure->scene->image.background;
    size_t count = probe->count;
    bool exact = measure_is_exact(measure->drawing->picture);
    struct squares model = {0}, discretisation = {0}, total = {0};
    float(*test)[4] = malloc((count + 1) * sizeof *test);
    float(*true_)[4] = malloc((count + 1) * sizeof *true_);
    enum status status = STATUS_OK;
    if (!test || !true_) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to compare pixels");
        goto done;
    }
    /* In the order of the picture where all of it is there, which FLIP needs. */
    bool whole =
        count == (size_t)measure->scene->image.width * (size_t)measure->scene->image.height;
    for (size_t n = 0; n < count; n++) {
        size_t to = whole ? probe->index[n] : n;
        memcpy(test[to], measure->pixels + 4 * (size_t)probe->index[n], sizeof *test);
        for (int i = 0; i < 4; i++)
            true_[to][i] = (float)truth->pixels[n][i];
    }
    uint8_t *touched = malloc(count + 1);
    if (!touched) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory to compare pixels");
        goto done;
    }
    for (size_t n = 0; n < count; n++)
        touched[whole ? probe->index[n] : n] = truth->touched[n];
    struct error_metrics metrics;
    status = error_compare(test[0], true_[0], whole ? measure->scene->image.width : (int)count,
                           whole ? measure->scene->image.height : 1, touched, background, NULL,
                           &metrics, err);
    free(touched);
    if (status != STATUS_OK)
        goto done;
    for (size_t n = 0; n < count; n++) {
        const float *drawn = measure->pixels + 4 * (size_t)probe->index[n];
        const float *limit = exact ? drawn : probe->pixels[n];
        double of_model[4], of_steps[4], of_both[4];
        for (int i = 0; i < 4; i++) {
            of_model[i] = (double)limit[i] - truth->pixels[n][i];
            of_steps[i] = (double)drawn[i] - (double)limit[i];
            of_both[i] = (double)drawn[i] - truth->pixels[n][i];
        }
        if (!(truth->touched[n] || error_drawn_on(drawn, background)) || !measure_finite(limit) ||
            !measure_finite(drawn))
            continue;
        struct squares *sums[3] = {&model, &discretisation, &total};
        const double *differences[3] = {of_model, of_steps, of_both};
        for (int i = 0; i < 3; i++) {
            squares_add(sums[i], differences[i], 1);
            squares_end_block(sums[i]);
        }
    }
    out->pixels = count;
    out->touched = metrics.touched.pixels;
    out->rmse = metrics.touched.rmse;
    out->rmse_standard_error = whole ? 0 : squares_standard_error(&total);
    out->max_abs = metrics.touched.max_abs;
    out->p99 = metrics.touched.p99;
    out->whole_rmse = metrics.whole.rmse;
    out->psnr_db = metrics.psnr_db;
    out->coverage = (double)metrics.coverage / (double)count;
    if (whole)
        out->flip = metrics.flip;
    out->model = squares_rmse(&model);
    out->model_standard_error = whole ? 0 : squares_standard_error(&model);
    out->model_pixels = model.count;
    out->discretisation = squares_rmse(&discretisation);
    out->discretisation_standard_error = whole ? 0 : squares_standard_error(&discretisation);
done:
    free(test);
    free(true_);
    return status;
}

enum status measure_reference(const struct measure *measure, struct report *report,
                              struct error *err) {
    const struct scene_image *image = &measure->scene->image;
    struct probe *probe = measure->probe;
    double all = (double)image->width * image->height;
    struct reference *reference = NULL;
    struct reference_result truth = {0};
    int k = measure->drawing->plan->k;
    /* As many rays, whatever a pixel takes of them. */
    double rays = (double)measure->scene->image.samples / measure->truth->image.samples;
    enum status status = probe_choose(probe, image->width, image->height, k, 1, NULL, NULL,
                                      fmax(1, all / (REFERENCE_PIXELS * rays)), err);
    if (status == STATUS_OK && !measure_is_exact(measure->drawing->picture))
        status = measure_draw_again(measure, LIMIT_FACTOR, err);
    if (status == STATUS_OK)
        status = measure_open_reference(measure, &reference, err);
    struct reference_request request = {
        .pixels = probe->index, .pixel_count = probe->count, .threads = measure->threads};
    if (status == STATUS_OK)
        status = reference_render(reference, &request, &truth, err);
    report->error = measure_unknown();
    report->error.kind = REPORT_ERROR_REFERENCE;
    if (status == STATUS_OK)
        status = judge(measure, &truth, &report->error, err);
    if (status == STATUS_OK && truth.unresolved)
        report_warn(report, "reference-unresolved", "/report/error", truth.unresolved, 0,
                    "intervals of the reference missed its tolerance of 1e-8");
    if (status == STATUS_OK && reference_folded(reference))
        report_warn(report, "reference-folds", "/report/error", reference_folded(reference), 0,
                    "prisms fold over; the reference draws each of their sheets");
    reference_result_finish(&truth);
    reference_destroy(reference);
    return status;
}
