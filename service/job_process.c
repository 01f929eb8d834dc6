/* The process of one task: it takes the scene and its assets as a worker does, runs its kind's
 * function, sends what comes of it, and ends. An idle daemon holds nothing for tasks.
 *
 * It must never stand in the way of a picture that somebody waits for: nice 19, and SCHED_IDLE
 * where the system has it, so that a worker that wakes takes the processor at once. GL is opened
 * only for kinds that draw.
 *
 * Left out on purpose: deadlines, retries and cancelling. The front ends this process when it is
 * not wanted any more; `cancelled` is for a front that has gone meanwhile. */
#include "service/job_process.h"

#include <errno.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

#include "service/child.h"
#include "service/job_kinds.h"
#include "service/memfd.h"
#include "service/monotonic.h"

/* Often enough for whoever polls, and no load for the front. */
static const double progress_every_ms = 100;

struct job_process {
    int socket;
    uint64_t task;
    struct child_assets assets;
    struct renderer_options options;
    atomic_bool cancelled;
    int stream; /* of the output that grows; -1: none */
    size_t stream_bytes;
    double told_ms;
    char told_what[TASK_NAME_MAX];
};

static void take_low_priority(void) {
    struct sched_param none = {0};
    if (setpriority(PRIO_PROCESS, 0, 19) != 0)
        fprintf(stderr, "pelt job: setpriority: %s\n", strerror(errno));
    if (sched_setscheduler(0, SCHED_IDLE, &none) != 0)
        fprintf(stderr, "pelt job: sched_setscheduler: %s\n", strerror(errno));
}

/* ---- what the task says ---- */

static void tell_progress(void *user, const char *what, uint64_t done, uint64_t total) {
    struct job_process *process = user;
    double now = monotonic_ms();
    if (strcmp(what, process->told_what) == 0 && done < total &&
        now - process->told_ms < progress_every_ms)
        return;
    process->told_ms = now;
    struct ipc_message message = {.header = {.type = IPC_PROGRESS, .job = process->task}, .fd = -1};
    message.body.progress.done = done;
    message.body.progress.total = total;
    snprintf(message.body.progress.what, sizeof message.body.progress.what, "%s", what);
    snprintf(process->told_what, sizeof process->told_what, "%s", what);
    if (ipc_send(process->socket, &message, 0) != 0)
        atomic_store(&process->cancelled, true);
}

static enum status add_output(void *user, const char *name, const char *media_type,
                              const void *data, size_t bytes, struct error *err) {
    struct job_process *process = user;
    struct ipc_message message = {.header = {.type = IPC_RESULT, .job = process->task}};
    struct ipc_result *result = &message.body.result;
    message.fd = memfd_open("pelt-result");
    if (message.fd < 0)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory file: %s", strerror(errno));
    enum status status = memfd_write(message.fd, data, bytes, err);
    if (status == STATUS_OK)
        status = memfd_seal(message.fd, err);
    snprintf(result->name, sizeof result->name, "%s", name);
    snprintf(result->media_type, sizeof result->media_type, "%s", media_type);
    result->bytes = bytes;
    if (status == STATUS_OK && ipc_send(process->socket, &message, 0) != 0) {
        atomic_store(&process->cancelled, true);
        status = error_fault(err, STATUS_CANCELLED, NULL, "the front is gone");
    }
    close(message.fd);
    return status;
}

static enum status send(struct job_process *process, struct ipc_message *message,
                        struct error *err) {
    if (ipc_send(process->socket, message, 0) == 0)
        return STATUS_OK;
    atomic_store(&process->cancelled, true);
    return error_fault(err, STATUS_CANCELLED, NULL, "the front is gone");
}

static enum status begin_stream(void *user, const char *name, const char *media_type,
                                struct error *err) {
    struct job_process *process = user;
    struct ipc_message message = {.header = {.type = IPC_RESULT, .job = process->task}};
    struct ipc_result *result = &message.body.result;
    process->stream = memfd_open("pelt-result");
    if (process->stream < 0)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory file: %s", strerror(errno));
    enum status status = memfd_seal_growing(process->stream, err);
    snprintf(result->name, sizeof result->name, "%s", name);
    snprintf(result->media_type, sizeof result->media_type, "%s", media_type);
    result->growing = 1;
    message.fd = process->stream;
    return status == STATUS_OK ? send(process, &message, err) : status;
}

static enum status grow_stream(void *user, const char *part, const char *head, const void *data,
                               size_t bytes, struct error *err) {
    struct job_process *process = user;
    struct ipc_message message = {.header = {.type = IPC_PART, .job = process->task}, .fd = -1};
    size_t head_bytes = strlen(head);
    enum status status = memfd_write(process->stream, head, head_bytes, err);
    if (status == STATUS_OK)
        status = memfd_write(process->stream, data, bytes, err);
    if (status != STATUS_OK)
        return status;
    message.body.part.offset = process->stream_bytes + head_bytes;
    message.body.part.bytes = bytes;
    message.body.part.total = process->stream_bytes += head_bytes + bytes;
    snprintf(message.body.part.name, sizeof message.body.part.name, "%s", part ? part : "");
    return send(process, &message, err);
}

/* ---- the task ---- */

static enum status run_scene(struct job_process *process, const struct ipc_task *task,
                             const char *json, struct error *err) {
    const struct task_kind *kind = &task_kinds[task->kind];
    struct arena arena = {0};
    struct scene scene;
    struct asset_source assets = child_assets_source(&process->assets);
    struct task_run run = {.scene = kind->read ? NULL : &scene,
                           .text = json,
                           .text_bytes = task->scene_bytes,
                           .assets = &assets,
                           .options = task->options,
                           .cancelled = &process->cancelled,
                           .progress = tell_progress,
                           .output = add_output,
                           .begin = begin_stream,
                           .grow = grow_stream,
                           .user = process};
    enum status status = STATUS_OK;
    if (!kind->read) { /* else run() reads it */
        status = scene_read(json, task->scene_bytes, &arena, &scene, err);
        if (status == STATUS_OK)
            status = scene_check_implemented(&scene, err);
        if (status == STATUS_OK)
            status = kind->check(&scene, task->options, err);
    }
    if (status == STATUS_OK && kind->draws)
        status = renderer_create(&process->options, &run.renderer, err);
    if (status == STATUS_OK)
        status = kind->run(&run, err);
    renderer_destroy(run.renderer);
    arena_free(&arena);
    return status;
}

/* False where the message cannot be. */
static bool do_task(struct job_process *process, struct ipc_message *message) {
    struct ipc_task *task = &message->body.task;
    if (task->kind < 0 || task->kind >= task_kind_count ||
        task->asset_count != process->assets.count || task->scene_bytes > SCENE_BYTES_MAX ||
        !memchr(task->options, 0, sizeof task->options) ||
        !memfd_is_sealed(message->fd, task->scene_bytes))
        return false;
    process->task = message->header.job;
    struct error err = {0};
    struct ipc_done done = {0};
    const void *json = NULL;
    int body_fd = -1;
    size_t none = 0;
    enum status status = memfd_map(message->fd, task->scene_bytes, &json, &err);
    if (status == STATUS_OK)
        status = run_scene(process, task, json ? json : "", &err);
    if (status == STATUS_OK)
        status = ipc_faults_write(&err, &body_fd, &none); /* an empty body */
    memfd_unmap(json, task->scene_bytes);
    bool told = child_answer(process->socket, process->task, status, &done, body_fd, &err);
    error_clear(&err);
    return told;
}

/* ASSETs, then one TASK; anything else ends it. */
static bool serve(struct job_process *process) {
    bool sane = true, finished = false;
    while (sane && !finished) {
        struct ipc_message message;
        int got = ipc_receive(process->socket, &message, 0);
        if (got == 0)
            break;
        if (got == 1 && message.header.type == IPC_ASSET) {
            sane = child_assets_take(&process->assets, &message);
        } else {
            sane = got == 1 && message.header.type == IPC_TASK && do_task(process, &message);
            finished = true;
        }
        if (message.fd >= 0)
            close(message.fd);
    }
    child_assets_drop(&process->assets);
    return sane;
}

int job_process_main(int argc, char **argv) {
    struct renderer_options options;
    long parent;
    if (!child_arguments(argc, argv, &parent, &options)) {
        fputs("pelt job: started by `pelt serve` only\n", stderr);
        return status_exit_code(STATUS_USAGE);
    }
    if (child_settle(parent) != 0)
        return status_exit_code(STATUS_INTERNAL);
    take_low_priority();
    struct job_process *process = calloc(1, sizeof *process);
    if (!process)
        return status_exit_code(STATUS_OUT_OF_MEMORY);
    process->socket = IPC_WORKER_FD;
    process->options = options;
    process->stream = -1;
    bool sane = serve(process);
    if (process->stream >= 0)
        close(process->stream);
    free(process);
    return sane ? 0 : status_exit_code(STATUS_INTERNAL);
}
