/* The kind `sequence`: POST /v1/sequences, the frames of a sequence as a long job.
 *
 * Options are the query's: frames=A-B as on the command line, output=png, gif, or png,gif. Outputs:
 * frames.multipart, which grows frame by frame (RFC 2046 multipart/mixed; each picture can be had
 * by its own name too, from the moment it is made), sequence.gif, frames.json: what each frame
 * took, and what was kept and renewed for it. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "service/job_kinds.h"
#include "service/jobs.h"
#include "service/sequence_run.h"

/* Not to be met in a PNG by accident: 96 bits of it were drawn by lot. */
#define BOUNDARY "pelt-9c41e07fb3d85a62c0e7714d"

_Static_assert((int)SEQUENCE_FRAMES_MAX <= (int)TASK_PARTS_MAX, "each frame is a part");

struct ask {
    char range[32];
    bool pictures, gif;
};

static bool read_outputs(const char *value, struct ask *ask) {
    ask->pictures = strcmp(value, "png") == 0 || strcmp(value, "png,gif") == 0;
    ask->gif = strcmp(value, "gif") == 0 || strcmp(value, "png,gif") == 0;
    return ask->pictures || ask->gif;
}

static enum status read_options(const char *lines, struct ask *ask, struct error *err) {
    *ask = (struct ask){.pictures = true};
    enum status status = STATUS_OK;
    while (*lines && status == STATUS_OK) {
        char line[128];
        size_t length = strcspn(lines, "\n");
        snprintf(line, sizeof line, "%.*s", length < sizeof line ? (int)length : 0, lines);
        lines += length + (lines[length] == '\n');
        char *value = strchr(line, '=');
        if (value)
            *value++ = 0;
        bool good = value && strcmp(line, "frames") == 0 && strlen(value) < sizeof ask->range;
        if (good)
            snprintf(ask->range, sizeof ask->range, "%s", value);
        else
            good = value && strcmp(line, "output") == 0 && read_outputs(value, ask);
        if (!good)
            status = error_fault(err, STATUS_BAD_REQUEST, NULL,
                                 "%.64s=%.64s: a sequence takes frames=A-B and output=png, gif or "
                                 "png,gif",
                                 line, value ? value : "");
    }
    return status;
}

static enum status read_range(const struct ask *ask, const struct sequence *sequence, int *first,
                              int *last, struct error *err) {
    if (sequence_range(ask->range, sequence->frames, first, last))
        return STATUS_OK;
    return error_fault(err, STATUS_BAD_REQUEST, NULL, "frames=%s: the sequence has frames 0 to %d",
                       ask->range, sequence->frames - 1);
}

enum status task_sequence_read(const char *text, size_t bytes, const char *options,
                               scene_asset_visit *visit, void *user, struct error *err) {
    struct ask ask;
    struct arena arena = {0};
    struct sequence sequence = {0};
    int first, last;
    enum status status = read_options(options, &ask, err);
    if (status == STATUS_OK)
        status = sequence_read(text, bytes, &arena, &sequence, err);
    if (status == STATUS_OK)
        status = read_range(&ask, &sequence, &first, &last, err);
    if (status == STATUS_OK)
        status = sequence_check(&sequence, first, last, visit, user, err);
    sequence_finish(&sequence);
    arena_free(&arena);
    return status;
}

/* ---- running ---- */

struct running {
    const struct task_run *run;
    const struct sequence *sequence;
    struct sequence_order order;
    struct json_out index;
    int count;
};

static enum status take_frame(void *user, int frame, const unsigned char *data, size_t bytes,
                              const struct report *report, struct error *err) {
    struct running *running = user;
    const struct task_run *run = running->run;
    char name[TASK_PART_NAME_MAX], head[256];
    snprintf(name, sizeof name, "frame-%04d.png", frame);
    enum status status = STATUS_OK;
    if (data) {
        snprintf(head, sizeof head,
                 "%s--" BOUNDARY "\r\nContent-Type: image/png\r\n"
                 "Content-Disposition: attachment; filename=\"%s\"\r\nContent-Length: %zu\r\n\r\n",
                 running->count ? "\r\n" : "", name, bytes);
        status = run->grow(run->user, name, head, data, bytes, err);
    }
    if (running->count == 0)
        sequence_index_begin(&running->index, running->sequence, report->resolved.image.width,
                             report->resolved.image.height);
    sequence_index_add(&running->index, running->sequence, frame, data ? name : NULL, bytes,
                       report);
    running->count++;
    int last = running->order.last, left = last - frame;
    snprintf(name, sizeof name, left ? "frame %d" : "finishing", frame + 1);
    run->progress(run->user, name, (uint64_t)running->count,
                  (uint64_t)last - (uint64_t)running->order.first + 1);
    return status;
}

static enum status add_index(struct running *running, struct error *err) {
    const struct task_run *run = running->run;
    sequence_index_end(&running->index);
    char *text = json_out_finish(&running->index);
    running->index = (struct json_out){0};
    enum status status =
        text ? run->output(run->user, "frames.json", "application/json", text, strlen(text), err)
             : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the index");
    free(text);
    return status;
}

enum status task_sequence_run(const struct task_run *run, struct error *err) {
    struct ask ask;
    struct arena arena = {0};
    struct sequence sequence = {0};
    struct running running = {.run = run, .sequence = &sequence};
    struct sequence_order *order = &running.order;
    unsigned char *gif = NULL;
    size_t gif_bytes = 0;
    enum status status = read_options(run->options, &ask, err);
    if (status == STATUS_OK)
        status = sequence_read(run->text, run->text_bytes, &arena, &sequence, err);
    if (status == STATUS_OK)
        status = read_range(&ask, &sequence, &order->first, &order->last, err);
    order->pictures = ask.pictures;
    order->gif = ask.gif;
    order->format = ENCODE_PNG;
    order->cancelled = run->cancelled;
    order->frame = take_frame;
    order->user = &running;
    if (status == STATUS_OK && ask.pictures)
        status =
            run->begin(run->user, "frames.multipart", "multipart/mixed; boundary=" BOUNDARY, err);
    if (status == STATUS_OK)
        status = sequence_run(run->renderer, &sequence, run->assets, order, &gif, &gif_bytes, err);
    if (status == STATUS_OK && ask.pictures)
        status = run->grow(run->user, NULL, "\r\n--" BOUNDARY "--\r\n", NULL, 0, err);
    if (status == STATUS_OK && gif)
        status = run->output(run->user, "sequence.gif", "image/gif", gif, gif_bytes, err);
    if (status == STATUS_OK)
        status = add_index(&running, err);
    free(running.index.text);
    free(gif);
    sequence_finish(&sequence);
    arena_free(&arena);
    return status;
}
