/* The kind `sweep`: POST /v1/sweep, the sweep of service/sweep.c as a long job.
 *
 * Options are the query's: series, quality, repeats, pixels, as on the command line. Outputs:
 * sweep.json, sweep.csv, sweep.html (with all pictures within), and, where the reference drew every
 * pixel, reference.png and .exr. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/truth.h"
#include "service/encode.h"
#include "service/job_kinds.h"
#include "service/jobs.h"
#include "service/sweep_ask.h"
#include "service/sweep_picture.h"
#include "service/sweep_write.h"

/* Reads NAME=VALUE lines. Threads are the machine's business here, not the client's. */
static enum status read_options(const char *lines, struct sweep_ask *ask, struct error *err) {
    char *text = strdup(lines), *rest = text;
    if (!text)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the options");
    enum status status = STATUS_OK;
    for (char *line; status == STATUS_OK && (line = strsep(&rest, "\n"));) {
        char *value = strchr(line, '=');
        if (!*line)
            continue;
        if (value)
            *value++ = 0;
        if (!value || strcmp(line, "threads") == 0 || !sweep_ask_set(ask, line, value))
            status = error_fault(err, STATUS_BAD_REQUEST, NULL,
                                 "%.64s=%.64s: a sweep takes series=NAME,... quality=N,... "
                                 "repeats=N and pixels=all or N",
                                 line, value ? value : "");
    }
    free(text);
    return status == STATUS_OK ? sweep_check(&ask->options, err) : status;
}

enum status task_sweep_check(const struct scene *scene, const char *options, struct error *err) {
    struct sweep_ask ask = {0};
    enum status status = read_options(options, &ask, err);
    sweep_ask_finish(&ask);
    return status == STATUS_OK ? truth_check(scene, err) : status;
}

static void tell_progress(void *user, size_t done, size_t total, const char *what) {
    const struct task_run *run = user;
    char phase[TASK_NAME_MAX];
    snprintf(phase, sizeof phase, "%s", what);
    run->progress(run->user, phase, done, total);
}

/* Takes `text`, which may be NULL. */
static enum status add_text(const struct task_run *run, const char *name, const char *media_type,
                            char *text, struct error *err) {
    enum status status =
        text ? run->output(run->user, name, media_type, text, strlen(text), err)
             : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %s", name);
    free(text);
    return status;
}

static enum status add_reference(const struct task_run *run, const struct sweep *sweep,
                                 const char *name, const char *media_type,
                                 enum encode_format format, struct error *err) {
    int width, height;
    unsigned char *data = NULL;
    size_t bytes = 0;
    float *pixels = sweep_picture(sweep, NULL, SWEEP_VIEW_PICTURE, 0, &width, &height);
    if (!pixels)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %s", name);
    enum status status = encode_image(format, pixels, width, height, &data, &bytes, err);
    if (status == STATUS_OK)
        status = run->output(run->user, name, media_type, data, bytes, err);
    free(data);
    free(pixels);
    return status;
}

enum status task_sweep_run(const struct task_run *run, struct error *err) {
    struct sweep_ask ask = {0};
    struct sweep *sweep = NULL;
    enum status status = read_options(run->options, &ask, err);
    ask.options.progress = tell_progress;
    ask.options.user = (void *)(uintptr_t)run; /* the callback reads `run` alone */
    ask.options.cancel = run->cancelled;
    if (status == STATUS_OK)
        status = sweep_run(run->renderer, run->scene, run->assets, &ask.options, &sweep, err);
    if (status == STATUS_OK)
        status = add_text(run, "sweep.json", "application/json", sweep_json(sweep), err);
    if (status == STATUS_OK)
        status = add_text(run, "sweep.csv", "text/csv", sweep_csv(sweep), err);
    if (status == STATUS_OK)
        status = add_text(run, "sweep.html", "text/html", sweep_html(sweep, "a posted scene"), err);
    if (status == STATUS_OK && !sweep->pixels)
        status = add_reference(run, sweep, "reference.png", "image/png", ENCODE_PNG, err);
    if (status == STATUS_OK && !sweep->pixels)
        status = add_reference(run, sweep, "reference.exr", "image/x-exr", ENCODE_EXR, err);
    sweep_destroy(sweep);
    sweep_ask_finish(&ask);
    return status;
}
