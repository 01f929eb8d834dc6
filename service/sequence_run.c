/* See sequence_run.h. Nothing is drawn twice and nothing is kept here but the assets: what stays
 * from frame to frame is the renderer's own, and its report tells what that was. */
#include "service/sequence_run.h"

#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "api/report_parts.h"
#include "renderer/gl/clock.h"
#include "service/encode_gif.h"

/* ---- assets, each opened once ---- */

struct kept_asset {
    struct kept_asset *next;
    char *name;
    struct asset_bytes bytes;
};

struct kept_assets {
    const struct asset_source *from;
    struct kept_asset *first;
};

static enum status open_kept(void *user, const char *name, const char *pointer,
                             struct asset_bytes *bytes, struct error *err) {
    struct kept_assets *kept = user;
    for (const struct kept_asset *at = kept->first; at; at = at->next)
        if (strcmp(at->name, name) == 0) {
            *bytes = at->bytes;
            return STATUS_OK;
        }
    struct kept_asset *fresh = calloc(1, sizeof *fresh);
    char *copy = strdup(name);
    if (!fresh || !copy) {
        free(fresh);
        free(copy);
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for an asset");
    }
    enum status status = kept->from->open(kept->from->user, name, pointer, &fresh->bytes, err);
    if (status != STATUS_OK) {
        free(fresh);
        free(copy);
        return status;
    }
    fresh->name = copy;
    fresh->next = kept->first;
    kept->first = fresh;
    *bytes = fresh->bytes;
    return STATUS_OK;
}

static void close_kept(void *user, struct asset_bytes *bytes) {
    (void)user; /* when the run ends */
    *bytes = (struct asset_bytes){0};
}

static void finish_kept(struct kept_assets *kept) {
    while (kept->first) {
        struct kept_asset *gone = kept->first;
        kept->first = gone->next;
        kept->from->close(kept->from->user, &gone->bytes);
        free(gone->name);
        free(gone);
    }
}

/* ---- frames ---- */

struct run {
    struct renderer *renderer;
    struct sequence *sequence;
    struct asset_source assets;
    const struct sequence_order *order;
    struct encode_gif *gif;
};

static enum status draw_frame(struct run *run, int frame, const struct scene *scene,
                              double began_ms, struct error *err) {
    const struct sequence_order *order = run->order;
    struct render_result result;
    struct error found = {0};
    double parsed_ms = clock_now_ms();
    struct render_limits limits = {
        began_ms, order->pictures
                      ? encode_expected_ms(order->format, scene->image.width, scene->image.height)
                      : 0};
    if (renderer_render_within(run->renderer, scene, &run->assets, &limits, &result, &found) !=
        STATUS_OK)
        return sequence_blame(run->sequence, frame, &found, err);
    double drawn_ms = clock_now_ms();
    unsigned char *data = NULL;
    size_t bytes = 0;
    enum status status = STATUS_OK;
    if (order->pictures)
        status = encode_image(order->format, result.pixels, result.width, result.height, &data,
                              &bytes, err);
    if (status == STATUS_OK && order->gif && !run->gif)
        status = encode_gif_begin(result.width, result.height, run->sequence->fps, &run->gif, err);
    if (status == STATUS_OK && order->gif)
        status = encode_gif_add(run->gif, result.pixels, scene->image.background, err);
    double done_ms = clock_now_ms();
    result.report.stage_ms[REPORT_STAGE_parse] = parsed_ms - began_ms;
    result.report.stage_ms[REPORT_STAGE_encode] = done_ms - drawn_ms;
    result.report.total_ms = done_ms - began_ms;
    report_settle(&result.report);
    if (status == STATUS_OK)
        status = order->frame(order->user, frame, data, bytes, &result.report, err);
    free(data);
    render_result_finish(&result);
    return status;
}

enum status sequence_run(struct renderer *renderer, struct sequence *sequence,
                         const struct asset_source *assets, const struct sequence_order *order,
                         unsigned char **gif, size_t *gif_bytes, struct error *err) {
    struct kept_assets kept = {.from = assets};
    struct run run = {.renderer = renderer,
                      .sequence = sequence,
                      .assets = {open_kept, close_kept, &kept},
                      .order = order};
    enum status status = STATUS_OK;
    *gif = NULL;
    *gif_bytes = 0;
    for (int frame = order->first; frame <= order->last && status == STATUS_OK; frame++) {
        struct arena arena = {0};
        struct scene scene;
        double began_ms = clock_now_ms();
        if (order->cancelled && atomic_load(order->cancelled)) {
            status = error_fault(err, STATUS_CANCELLED, NULL, "cancelled before frame %d", frame);
            break;
        }
        status = sequence_frame(sequence, frame, &arena, &scene, err);
        if (status == STATUS_OK)
            status = draw_frame(&run, frame, &scene, began_ms, err);
        arena_free(&arena);
    }
    if (status == STATUS_OK && run.gif)
        status = encode_gif_end(run.gif, gif, gif_bytes, err);
    else
        encode_gif_abandon(run.gif);
    finish_kept(&kept);
    return status;
}

bool sequence_range(const char *text, int frames, int *first, int *last) {
    *first = 0;
    *last = frames - 1;
    if (!text || !*text)
        return true;
    long bounds[2];
    char *end = (char *)(uintptr_t)text;
    for (int i = 0; i < 2; i++) {
        if (strspn(end, "0123456789") == 0)
            return false;
        bounds[i] = strtol(end, &end, 10);
        if (bounds[i] >= frames)
            return false;
        if (i == 0 && !*end) {
            bounds[1] = bounds[0];
            break;
        }
        if (i == 0 && *end++ != '-')
            return false;
        if (i == 0 && !*end) {
            bounds[1] = frames - 1;
            break;
        }
    }
    *first = (int)bounds[0];
    *last = (int)bounds[1];
    return !*end && bounds[0] <= bounds[1];
}

/* ---- the index ---- */

void sequence_index_begin(struct json_out *out, const struct sequence *sequence, int width,
                          int height) {
    json_out_open(out, '{');
    json_out_key(out, "fps");
    json_out_number(out, sequence->fps);
    json_out_key(out, "width");
    json_out_integer(out, width);
    json_out_key(out, "height");
    json_out_integer(out, height);
    json_out_key(out, "frames");
    json_out_open(out, '[');
}

void sequence_index_add(struct json_out *out, const struct sequence *sequence, int frame,
                        const char *name, size_t bytes, const struct report *report) {
    json_out_open(out, '{');
    json_out_key(out, "frame");
    json_out_integer(out, frame);
    json_out_key(out, "time_s");
    json_out_number(out, frame / sequence->fps);
    if (name) {
        json_out_key(out, "name");
        json_out_string(out, name);
        json_out_key(out, "bytes");
        json_out_unsigned(out, bytes);
    }
    report_write_timing(out, report);
    json_out_key(out, "cold");
    json_out_boolean(out, report->cold);
    report_write_reuse(out, report);
    report_write_work(out, &report->work);
    report_write_warnings(out, report);
    json_out_close(out, '}');
}

void sequence_index_end(struct json_out *out) {
    json_out_close(out, ']');
    json_out_close(out, '}');
}
