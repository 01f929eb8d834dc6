/* The kind `reference`: the true picture of a scene, the picture that the scene's path draws, and
 * how far they are apart.
 *
 * The path draws first: it takes a thousandth of the time, and whatever is wrong with an asset
 * shows before minutes are spent. Everything compared is what `pelt reference --compare` compares,
 * so the figures are the same.
 *
 * Outputs: reference.png .exr (the truth), picture.png .exr (the path's), error.exr (the absolute
 * difference of each channel, in linear premultiplied RGBA), error.png (the root of its mean square
 * over the channels, grey, as linear light: white is `maps.error_png_white` of the report, a power
 * of two), flip.png (FLIP from 0, black, to 1, white), report.json. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_out.h"
#include "renderer/truth.h"
#include "service/encode.h"
#include "service/job_kinds.h"
#include "service/monotonic.h"

static const char png[] = "image/png", exr[] = "image/x-exr", json[] = "application/json";

struct pictures {
    int width, height;
    struct render_result drawn;
    struct truth truth;
    double reference_s;
    float *map; /* four channels, then FLIP */
    struct error_metrics metrics;
    double white; /* of error.png */
};

enum status task_reference_check(const struct scene *scene, const char *options,
                                 struct error *err) {
    if (*options)
        return error_fault(err, STATUS_BAD_REQUEST, NULL, "a reference takes no option %.*s",
                           (int)strcspn(options, "="), options);
    return truth_check(scene, err);
}

/* ---- outputs ---- */

static enum status add(const struct task_run *run, const char *name, const char *media_type,
                       enum status encoded, unsigned char *data, size_t bytes, struct error *err) {
    enum status status = encoded;
    if (status == STATUS_OK)
        status = run->output(run->user, name, media_type, data, bytes, err);
    free(data);
    return status;
}

static enum status add_picture(const struct task_run *run, const char *name,
                               enum encode_format format, const float *pixels, int width,
                               int height, struct error *err) {
    unsigned char *data = NULL;
    size_t bytes = 0;
    enum status status = encode_image(format, pixels, width, height, &data, &bytes, err);
    return add(run, name, format == ENCODE_EXR ? exr : png, status, data, bytes, err);
}

static enum status add_map(const struct task_run *run, const char *name, const float *map,
                           const struct pictures *pictures, struct error *err) {
    unsigned char *data = NULL;
    size_t bytes = 0;
    enum status status =
        encode_map(ENCODE_PNG, map, pictures->width, pictures->height, &data, &bytes, err);
    return add(run, name, png, status, data, bytes, err);
}

static void write_figures(struct json_out *out, const char *name,
                          const struct error_figures *figures) {
    json_out_key(out, name);
    json_out_open(out, '{');
    json_out_key(out, "pixels");
    json_out_unsigned(out, figures->pixels);
    json_out_key(out, "rmse");
    json_out_number(out, figures->rmse);
    json_out_key(out, "max_abs");
    json_out_number(out, figures->max_abs);
    json_out_key(out, "p99");
    json_out_number(out, figures->p99);
    json_out_close(out, '}');
}

static void write_errors(struct json_out *out, const struct error_metrics *metrics) {
    json_out_key(out, "errors");
    json_out_open(out, '{');
    write_figures(out, "touched", &metrics->touched);
    write_figures(out, "whole", &metrics->whole);
    json_out_key(out, "coverage");
    json_out_unsigned(out, metrics->coverage);
    json_out_key(out, "psnr_db");
    json_out_number(out, metrics->psnr_db); /* null where nothing differs */
    json_out_key(out, "flip");
    json_out_number(out, metrics->flip);
    json_out_key(out, "not_finite");
    json_out_unsigned(out, metrics->not_finite);
    json_out_close(out, '}');
}

static enum status add_report(const struct task_run *run, const struct pictures *pictures,
                              struct error *err) {
    char *report = report_write(&pictures->drawn.report);
    struct json_out out = {0};
    json_out_open(&out, '{');
    json_out_key(&out, "report");
    json_out_raw(&out, report ? report : "null");
    write_errors(&out, &pictures->metrics);
    json_out_key(&out, "reference");
    json_out_open(&out, '{');
    json_out_key(&out, "time_s");
    json_out_number(&out, pictures->reference_s);
    json_out_key(&out, "folded_prisms");
    json_out_unsigned(&out, pictures->truth.folded);
    json_out_key(&out, "unresolved");
    json_out_unsigned(&out, pictures->truth.unresolved);
    json_out_close(&out, '}');
    json_out_key(&out, "maps");
    json_out_open(&out, '{');
    json_out_key(&out, "error_png_white");
    json_out_number(&out, pictures->white);
    json_out_key(&out, "flip_png_white");
    json_out_number(&out, 1);
    json_out_close(&out, '}');
    json_out_close(&out, '}');
    char *text = json_out_finish(&out);
    enum status status = STATUS_OK;
    if (!report || !text)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the report");
    else
        status = run->output(run->user, "report.json", json, text, strlen(text), err);
    free(report);
    free(text);
    return status;
}

/* ---- the work, in its order ---- */

static enum status draw(const struct task_run *run, struct pictures *pictures, struct error *err) {
    struct render_result *drawn = &pictures->drawn;
    run->progress(run->user, "picture", 0, 0);
    double begun_ms = monotonic_ms();
    enum status status = renderer_render(run->renderer, run->scene, run->assets, drawn, err);
    if (status != STATUS_OK)
        return status;
    pictures->width = drawn->width;
    pictures->height = drawn->height;
    double drawn_ms = monotonic_ms();
    status = add_picture(run, "picture.png", ENCODE_PNG, drawn->pixels, drawn->width, drawn->height,
                         err);
    drawn->report.stage_ms[REPORT_STAGE_encode] = monotonic_ms() - drawn_ms;
    drawn->report.total_ms = monotonic_ms() - begun_ms;
    report_settle(&drawn->report);
    if (status == STATUS_OK)
        status = add_picture(run, "picture.exr", ENCODE_EXR, drawn->pixels, drawn->width,
                             drawn->height, err);
    return status;
}

static void reference_progress(void *user, size_t done, size_t total) {
    const struct task_run *run = user;
    run->progress(run->user, "reference", done, total);
}

static enum status find_truth(const struct task_run *run, struct pictures *pictures,
                              struct error *err) {
    /* The callback reads `run` alone. */
    struct reference_request request = {
        .progress = reference_progress, .user = (void *)(uintptr_t)run, .cancel = run->cancelled};
    struct truth *truth = &pictures->truth;
    double begun_ms = monotonic_ms();
    enum status status = truth_render(run->scene, run->assets, &request, truth, err);
    pictures->reference_s = (monotonic_ms() - begun_ms) * 1e-3;
    if (status == STATUS_OK)
        status = add_picture(run, "reference.png", ENCODE_PNG, truth->pixels, truth->width,
                             truth->height, err);
    if (status == STATUS_OK)
        status = add_picture(run, "reference.exr", ENCODE_EXR, truth->pixels, truth->width,
                             truth->height, err);
    return status;
}

/* Each pixel's error as a share of `white`, the power of two that is not below the largest. */
static void grey_errors(struct pictures *pictures, size_t count) {
    float *map = pictures->map, *grey = map + 4 * count;
    double largest = 0;
    for (size_t p = 0; p < count; p++) {
        double squares = 0;
        for (int i = 0; i < 4; i++)
            squares += (double)map[4 * p + (size_t)i] * (double)map[4 * p + (size_t)i];
        grey[p] = (float)sqrt(squares / 4);
        largest = fmax(largest, (double)grey[p]);
    }
    int exponent = 0;
    double mantissa = frexp(largest, &exponent); /* largest = mantissa 2^exponent, in [1/2, 1) */
    pictures->white = largest > 0 ? ldexp(1, mantissa > 0.5 ? exponent : exponent - 1) : 1;
    for (size_t p = 0; p < count; p++)
        grey[p] = (float)((double)grey[p] / pictures->white);
}

static enum status compare(const struct task_run *run, struct pictures *pictures,
                           struct error *err) {
    int width = pictures->width, height = pictures->height;
    size_t count = (size_t)width * (size_t)height;
    run->progress(run->user, "errors", count, count);
    pictures->map = malloc((5 * count + 1) * sizeof *pictures->map);
    if (!pictures->map)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the maps");
    float *grey = pictures->map + 4 * count;
    const float *drawn = pictures->drawn.pixels, *truth = pictures->truth.pixels;
    error_map(drawn, truth, width, height, pictures->map);
    grey_errors(pictures, count);
    enum status status =
        add_picture(run, "error.exr", ENCODE_EXR, pictures->map, width, height, err);
    if (status == STATUS_OK)
        status = add_map(run, "error.png", grey, pictures, err);
    if (status == STATUS_OK)
        status = error_compare(drawn, truth, width, height, pictures->truth.touched,
                               run->scene->image.background, grey, &pictures->metrics, err);
    if (status == STATUS_OK)
        status = add_map(run, "flip.png", grey, pictures, err);
    return status;
}

enum status task_reference_run(const struct task_run *run, struct error *err) {
    struct pictures pictures = {0};
    enum status status = draw(run, &pictures, err);
    if (status == STATUS_OK)
        status = find_truth(run, &pictures, err);
    if (status == STATUS_OK)
        status = compare(run, &pictures, err);
    if (status == STATUS_OK)
        status = add_report(run, &pictures, err);
    free(pictures.map);
    truth_finish(&pictures.truth);
    render_result_finish(&pictures.drawn);
    return status;
}
