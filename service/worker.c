/* A worker: one GL context in a process of its own, drawing what the front asks for.
 *
 * The process ties itself to its parent (a front that dies takes its workers along), caps its own
 * address space and cores, makes the renderer, warms it with a canary picture, says READY, and then
 * answers JOB after JOB until the front closes the socket. It trusts the front (same binary, same
 * machine), not the scene: that is read again here, from the same text that the front has
 * validated, because a struct full of pointers does not travel.
 *
 * Stages: `queue` is everything between the front's validation and this process' picking the job up
 * (waiting, the socket, an attempt that crashed); `total` runs on one clock from the last byte of
 * the request to the encoded picture. What happens after that, in the front, no reply could tell.
 *
 * Left out on purpose: PR_SET_MDWE (it makes llvmpipe segfault), retries, deadlines and cancelling:
 * the front ends a worker that is not wanted any more. */
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "api/scene.h"
#include "renderer/render.h"
#include "service/child.h"
#include "service/encode.h"
#include "service/ipc.h"
#include "service/memfd.h"
#include "service/monotonic.h"
#include "service/worker.h"
#include "service/worker_reply.h"

/* Small scenes, one for each kind of material, so that the shader variants that most scenes need
 * are compiled before the first client waits for them. The first one is the canary of /readyz. */
static const char *const canaries[] = {
    "{\"image\":{\"width\":32,\"height\":32,\"samples\":1},\"objects\":[{\"shell\":{"
    "\"mesh\":{\"shape\":\"sphere\",\"divisions\":[8,6]},\"base\":{\"color\":[0.5,0.5,0.5]},"
    "\"material\":{\"builtin\":\"fur\",\"size\":[16,16,8]}}}]}",
    "{\"image\":{\"width\":32,\"height\":32,\"samples\":1},\"objects\":[{\"shell\":{"
    "\"mesh\":{\"shape\":\"sphere\",\"divisions\":[8,6]},"
    "\"material\":{\"builtin\":\"chain\",\"size\":[16,16,8]}}}]}",
    "{\"image\":{\"width\":32,\"height\":32,\"samples\":1},\"objects\":[{\"shell\":{"
    "\"mesh\":{\"shape\":\"plane\",\"divisions\":[2,2]},"
    "\"material\":{\"builtin\":\"homogeneous\"}}}]}",
};

struct worker_process {
    int socket;
    struct renderer *renderer;
    bool leaving;               /* the front has closed the socket, or is gone */
    bool fault;                 /* a message that cannot be: leave with a fault */
    struct child_assets assets; /* of the next job */
};

/* ---- a job ---- */

/* Reads the scene, draws or plans it and makes the body of the reply. */
static enum status job_draw(struct worker_process *worker, const struct ipc_job *job,
                            const char *json, double taken_ms, struct ipc_done *done, int *body_fd,
                            struct error *err) {
    struct arena arena = {0};
    struct scene scene;
    enum status status = scene_read(json, job->scene_bytes, &arena, &scene, err);
    if (status == STATUS_OK)
        status = scene_check_implemented(&scene, err);
    double read_ms = monotonic_ms();
    struct asset_source source = child_assets_source(&worker->assets);
    struct render_result result = {0};
    bool plan = job->kind == JOB_PLAN;
    struct render_limits limits = {.began_ms = job->received_ms};
    if (status == STATUS_OK)
        limits.reserve_ms =
            encode_expected_ms(job->format == JOB_FORMAT_EXR ? ENCODE_EXR : ENCODE_PNG,
                               scene.image.width, scene.image.height);
    if (status == STATUS_OK)
        status =
            plan ? renderer_plan(worker->renderer, &scene, &source, &result, err)
                 : renderer_render_within(worker->renderer, &scene, &source, &limits, &result, err);
    if (status == STATUS_OK) {
        double *stage_ms = result.report.stage_ms;
        stage_ms[REPORT_STAGE_queue] +=
            taken_ms - job->received_ms - job->parse_ms - job->assets_ms;
        stage_ms[REPORT_STAGE_parse] += job->parse_ms + read_ms - taken_ms;
        stage_ms[REPORT_STAGE_assets] += job->assets_ms;
        size_t bytes = 0;
        status = worker_reply_make(plan ? WORKER_REPLY_PLAN : WORKER_REPLY_PICTURE,
                                   (enum job_format)job->format, job->received_ms, &result, body_fd,
                                   &bytes, err);
        done->body_bytes = bytes;
        memcpy(done->stage_ms, stage_ms, sizeof done->stage_ms);
        done->total_ms = result.report.total_ms;
        render_result_finish(&result);
    }
    arena_free(&arena);
    return status;
}

static enum status canary_draw(struct worker_process *worker, const char *json, struct error *err) {
    struct arena arena = {0};
    struct scene scene;
    struct asset_source source = child_assets_source(&worker->assets);
    struct render_result result;
    enum status status = scene_read(json, strlen(json), &arena, &scene, err);
    if (status == STATUS_OK)
        status = scene_check_implemented(&scene, err);
    if (status == STATUS_OK)
        status = renderer_render(worker->renderer, &scene, &source, &result, err);
    if (status == STATUS_OK)
        render_result_finish(&result);
    arena_free(&arena);
    return status;
}

static void job_answer(struct worker_process *worker, uint64_t id, enum status status,
                       struct ipc_done *done, int body_fd, struct error *err) {
    if (!child_answer(worker->socket, id, status, done, body_fd, err))
        worker->leaving = worker->fault = true; /* the front sees the end of this process */
}

/* ---- messages ---- */

typedef void handler(struct worker_process *worker, struct ipc_message *message);

static void handle_asset(struct worker_process *worker, struct ipc_message *message) {
    if (!child_assets_take(&worker->assets, message))
        worker->leaving = worker->fault = true;
}

static void handle_job(struct worker_process *worker, struct ipc_message *message) {
    double taken_ms = monotonic_ms();
    const struct ipc_job *job = &message->body.job;
    struct error err = {0};
    struct ipc_done done = {0};
    int body_fd = -1;
    enum status status = STATUS_OK;
    const void *json = NULL;
    if (job->asset_count != worker->assets.count || job->scene_bytes > SCENE_BYTES_MAX ||
        !memfd_is_sealed(message->fd, job->scene_bytes)) {
        worker->leaving = worker->fault = true;
    } else if (job->kind == JOB_CANARY) {
        status = canary_draw(worker, canaries[0], &err);
        size_t none = 0;
        if (status == STATUS_OK)
            status = ipc_faults_write(&err, &body_fd, &none); /* an empty body */
        done.total_ms = monotonic_ms() - job->received_ms;
        job_answer(worker, message->header.job, status, &done, body_fd, &err);
    } else {
        status = memfd_map(message->fd, job->scene_bytes, &json, &err);
        if (status == STATUS_OK)
            status = job_draw(worker, job, json ? json : "", taken_ms, &done, &body_fd, &err);
        memfd_unmap(json, job->scene_bytes);
        job_answer(worker, message->header.job, status, &done, body_fd, &err);
    }
    error_clear(&err);
    child_assets_drop(&worker->assets);
}

static handler *const handlers[IPC_TYPE_COUNT] = {
    [IPC_ASSET] = handle_asset,
    [IPC_JOB] = handle_job,
};

static int serve(struct worker_process *worker) {
    while (!worker->leaving) {
        struct ipc_message message;
        int got = ipc_receive(worker->socket, &message, 0);
        if (got == 0)
            break;
        handler *handle = got == 1 ? handlers[message.header.type] : NULL;
        if (handle)
            handle(worker, &message);
        else
            worker->leaving = worker->fault = true;
        if (message.fd >= 0)
            close(message.fd);
    }
    child_assets_drop(&worker->assets);
    return worker->fault ? status_exit_code(STATUS_INTERNAL) : 0;
}

/* ---- start ---- */

static void say_failed(int socket, enum status status, const struct error *err) {
    struct ipc_message message = {.header = {.type = IPC_FAILED}, .fd = -1};
    message.body.failed.status = (int32_t)status;
    size_t at = 0, room = sizeof message.body.failed.message;
    for (size_t i = 0; i < err->fault_count && at + 1 < room; i++) {
        int n = snprintf(message.body.failed.message + at, room - at, "%s%s", i ? "; " : "",
                         err->faults[i].message ? err->faults[i].message : "");
        at += n > 0 ? (size_t)n : 0;
    }
    if (ipc_send(socket, &message, 0) != 0)
        fprintf(stderr, "pelt worker: %s\n", message.body.failed.message);
}

/* What this process draws with, as the report of the first canary tells it. */
static enum status say_ready(struct worker_process *worker, struct error *err) {
    struct ipc_message message = {.header = {.type = IPC_READY}, .fd = -1};
    double start_ms = monotonic_ms();
    for (size_t i = 1; i < sizeof canaries / sizeof *canaries; i++) {
        enum status status = canary_draw(worker, canaries[i], err);
        if (status != STATUS_OK)
            return status;
    }
    struct arena arena = {0};
    struct scene scene;
    struct asset_source source = child_assets_source(&worker->assets);
    struct render_result result;
    enum status status = scene_read(canaries[0], strlen(canaries[0]), &arena, &scene, err);
    if (status == STATUS_OK)
        status = renderer_render(worker->renderer, &scene, &source, &result, err);
    if (status == STATUS_OK) {
        const struct report *report = &result.report;
        struct ipc_ready *ready = &message.body.ready;
        memcpy(ready->backend, report->backend, sizeof ready->backend);
        memcpy(ready->device, report->device, sizeof ready->device);
        memcpy(ready->gl_renderer, report->gl_renderer, sizeof ready->gl_renderer);
        memcpy(ready->gl_version, report->gl_version, sizeof ready->gl_version);
        memcpy(ready->cpu, report->cpu, sizeof ready->cpu);
        ready->threads = report->threads;
        ready->clock = (int32_t)report->clock;
        ready->canary_ms = monotonic_ms() - start_ms;
        render_result_finish(&result);
        if (ipc_send(worker->socket, &message, 0) != 0)
            status = error_fault(err, STATUS_IO_ERROR, NULL, "the front is gone");
    }
    arena_free(&arena);
    return status;
}

static int usage(void) {
    fputs("pelt worker: started by `pelt serve` only\n", stderr);
    return status_exit_code(STATUS_USAGE);
}

int worker_main(int argc, char **argv) {
    struct renderer_options options;
    long parent;
    if (!child_arguments(argc, argv, &parent, &options))
        return usage();
    if (child_settle(parent) != 0)
        return status_exit_code(STATUS_INTERNAL);

    struct worker_process *worker = calloc(1, sizeof *worker);
    struct error err = {0};
    if (!worker)
        return status_exit_code(STATUS_OUT_OF_MEMORY);
    worker->socket = IPC_WORKER_FD;
    int code;
    enum status status = renderer_create(&options, &worker->renderer, &err);
    if (status == STATUS_OK)
        status = say_ready(worker, &err);
    if (status == STATUS_OK) {
        code = serve(worker);
    } else {
        say_failed(worker->socket, status, &err);
        code = status_exit_code(status);
    }
    renderer_destroy(worker->renderer);
    error_clear(&err);
    free(worker);
    return code;
}
