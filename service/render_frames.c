/* See render_frames.h. All frames are read before the first is drawn, so a fault in the last one
 * costs no drawing; pictures appear one by one. */
#include "service/render_frames.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/clock.h"
#include "service/cli.h"
#include "service/files.h"
#include "service/sequence_run.h"

enum { PATH_BYTES = 4096, DIGITS_MAX = 9 };

/* Where the number of the frame goes in the name of a picture: the one %d or %0Nd in it. */
struct pattern {
    const char *text;
    int before; /* characters in front of it */
    int digits; /* at least this many */
    const char *behind;
};

static bool parse_pattern(const char *text, struct pattern *pattern) {
    const char *percent = strchr(text, '%');
    if (!percent || strchr(percent + 1, '%'))
        return false;
    const char *at = percent + 1;
    int digits = 0;
    for (; *at >= '0' && *at <= '9' && digits <= DIGITS_MAX; at++)
        digits = 10 * digits + (*at - '0');
    *pattern = (struct pattern){text, (int)(percent - text), digits, at + 1};
    return *at == 'd' && digits <= DIGITS_MAX;
}

struct frames {
    const struct render_frames *options;
    const struct sequence *sequence;
    struct sequence_order order;
    struct pattern pattern;
    struct json_out index;
    double *total_ms, *draw_ms; /* of each frame */
    struct report_reuse reuse[REPORT_PART_COUNT];
    int count;
};

static enum status take_frame(void *user, int frame, const unsigned char *data, size_t bytes,
                              const struct report *report, struct error *err) {
    struct frames *frames = user;
    const struct pattern *pattern = &frames->pattern;
    char path[PATH_BYTES] = "";
    enum status status = STATUS_OK;
    if (data) {
        int n = snprintf(path, sizeof path, "%.*s%0*d%s", pattern->before, pattern->text,
                         pattern->digits, frame, pattern->behind);
        if (n < 0 || (size_t)n >= sizeof path)
            return error_fault(err, STATUS_IO_ERROR, NULL, "the name of a picture is too long");
        status = files_write(path, data, bytes, err);
    }
    if (status != STATUS_OK)
        return status;
    if (frames->options->report) {
        if (frames->count == 0)
            sequence_index_begin(&frames->index, frames->sequence, report->resolved.image.width,
                                 report->resolved.image.height);
        sequence_index_add(&frames->index, frames->sequence, frame, data ? path : NULL, bytes,
                           report);
    }
    frames->total_ms[frames->count] = report->total_ms;
    frames->draw_ms[frames->count++] = report->stage_ms[REPORT_STAGE_draw];
    for (int i = 0; i < REPORT_PART_COUNT; i++) {
        frames->reuse[i].kept += report->reuse[i].kept;
        frames->reuse[i].renewed += report->reuse[i].renewed;
    }
    if (frames->options->progress)
        fprintf(stderr, "[%d/%d] %s%s%.0f ms, draw %.0f ms\n", frames->count,
                frames->order.last - frames->order.first + 1, path, *path ? "  " : "",
                report->total_ms, report->stage_ms[REPORT_STAGE_draw]);
    return STATUS_OK;
}

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static double median(double *values, int count) {
    qsort(values, (size_t)count, sizeof *values, compare);
    return count % 2 ? values[count / 2] : (values[count / 2 - 1] + values[count / 2]) / 2;
}

static void print_summary(struct frames *frames) {
    double all_ms = 0;
    for (int i = 0; i < frames->count; i++)
        all_ms += frames->total_ms[i];
    FILE *out = strcmp(frames->options->output, "-") == 0 ? stderr : stdout;
    fprintf(out, "%s: %d frames in %.2f s, %.1f ms each at the median, drawing %.1f ms\n",
            frames->options->output, frames->count, all_ms * 1e-3,
            median(frames->total_ms, frames->count), median(frames->draw_ms, frames->count));
    for (int i = 0; i < REPORT_PART_COUNT; i++)
        if (frames->reuse[i].kept + frames->reuse[i].renewed > 0)
            fprintf(out, "  %-10s renewed %u, kept %u times\n",
                    report_part_name((enum report_part)i), frames->reuse[i].renewed,
                    frames->reuse[i].kept);
}

/* What the output's name asks for; 0 or the exit code after a message. */
static int choose_output(const struct render_frames *options, struct frames *frames) {
    const char *dot = strrchr(options->output, '.');
    const char *format = options->format ? options->format : dot ? dot + 1 : "";
    frames->order.gif = strcasecmp(format, "gif") == 0;
    frames->order.pictures = !frames->order.gif;
    if (frames->order.gif)
        return 0;
    frames->order.format = strcasecmp(format, "exr") == 0 ? ENCODE_EXR : ENCODE_PNG;
    if (frames->order.format == ENCODE_PNG && strcasecmp(format, "png") != 0)
        return cli_usage("render", "%s ends in none of .png, .exr and .gif; give --format",
                         options->output);
    if (!parse_pattern(options->output, &frames->pattern))
        return cli_usage("render", "%s: the name of numbered pictures holds one %%d, or %%04d",
                         options->output);
    return 0;
}

/* With the sequence read and its frames checked. */
static enum status draw(struct frames *frames, struct sequence *sequence, struct error *err) {
    const struct render_frames *options = frames->options;
    struct file_assets files = {0};
    struct renderer *renderer = NULL;
    unsigned char *gif = NULL;
    size_t gif_bytes = 0;
    size_t count = (size_t)frames->order.last - (size_t)frames->order.first + 1;
    frames->total_ms = calloc(count, sizeof *frames->total_ms);
    frames->draw_ms = calloc(count, sizeof *frames->draw_ms);
    enum status status = STATUS_OK;
    if (!frames->total_ms || !frames->draw_ms)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
    if (status == STATUS_OK)
        status = file_assets_init(&files, options->assets, options->sequence, err);
    struct asset_source assets = file_assets_source(&files);
    if (status == STATUS_OK)
        status = renderer_create(&options->gl, &renderer, err);
    if (status == STATUS_OK)
        status = sequence_run(renderer, sequence, &assets, &frames->order, &gif, &gif_bytes, err);
    if (status == STATUS_OK && gif)
        status = files_write(options->output, gif, gif_bytes, err);
    if (status == STATUS_OK && options->report) {
        sequence_index_end(&frames->index);
        char *text = json_out_finish(&frames->index);
        status = text ? files_write(options->report, text, strlen(text), err)
                      : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
        free(text);
    } else {
        free(frames->index.text);
    }
    if (status == STATUS_OK && !options->quiet)
        print_summary(frames);
    free(gif);
    free(frames->total_ms);
    free(frames->draw_ms);
    renderer_destroy(renderer);
    file_assets_finish(&files);
    return status;
}

int render_frames(const struct render_frames *options) {
    struct frames frames = {.options = options, .order = {.frame = take_frame, .user = &frames}};
    struct arena arena = {0};
    struct sequence sequence = {0};
    struct error err = {0};
    unsigned char *text = NULL;
    size_t bytes = 0;
    int code = choose_output(options, &frames);
    if (code != 0)
        return code;
    enum status status = files_read(options->sequence, SCENE_BYTES_MAX, &text, &bytes, &err);
    if (status == STATUS_OK)
        status = sequence_read((const char *)text, bytes, &arena, &sequence, &err);
    free(text);
    frames.sequence = &sequence;
    if (status == STATUS_OK &&
        !sequence_range(options->range, sequence.frames, &frames.order.first, &frames.order.last))
        status =
            error_fault(&err, STATUS_USAGE, NULL, "--frames %s: the sequence has frames 0 to %d",
                        options->range, sequence.frames - 1);
    if (status == STATUS_OK)
        status = sequence_check(&sequence, frames.order.first, frames.order.last, NULL, NULL, &err);
    if (status == STATUS_OK)
        status = draw(&frames, &sequence, &err);
    if (status != STATUS_OK)
        cli_print_error(options->sequence, &err);
    code = status_exit_code(status);
    error_clear(&err);
    sequence_finish(&sequence);
    arena_free(&arena);
    return code;
}
