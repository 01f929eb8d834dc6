/* The workers' state machine.
 *
 * Each worker is in one state, and whatever happens to it is one event; table[state][event] below
 * is the whole behaviour. An action returns the next state. In short:
 *
 *   DOWN --timer--> STARTING --ready--> IDLE --assign--> BUSY --done--> IDLE
 *   BUSY --client gone--> ABANDONED --done--> IDLE
 *   any of these, past a limit or on nonsense --kill--> DYING --exit--> DOWN
 *
 * ABANDONED: the job is already off the worker's hands; the worker gets GRACE_MS to finish, about
 * what its replacement would cost (context and shaders), and is killed after that.
 *
 * A worker's process is over when it has been reaped, never earlier, so a pid is never signalled
 * after it may belong to someone else. */
#include "service/workers.h"

#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "service/memfd.h"
#include "service/monotonic.h"

enum {
    START_LIMIT_MS = 60000, /* context, shaders and canary without a shader cache */
    CANARY_LIMIT_MS = 5000, /* a canary takes 10 to 100 ms */
    GRACE_MS = 250,         /* see ABANDONED above */
    DELAY_FIRST_MS = 100,   /* before the second restart in a row; doubles */
    DELAY_MAX_MS = 10000,
    START_FAILURES_MAX = 5, /* workers lost in a row before the first one was ever ready */
    ATTEMPTS_MAX = 2        /* a job is tried once more after a crash */
};

typedef enum worker_state action(struct workers *workers, struct worker *worker,
                                 struct occasion *occasion);

/* ---- jobs ---- */

void workers_fail_job(struct workers *workers, struct job *job, enum status status,
                      const char *text) {
    if (status == STATUS_SHUTTING_DOWN)
        job->retry_after_s = 1;
    error_fault(&job->error, status, NULL, "%s", text);
    queue_end_job(workers->queue, job);
}

/* The worker that had this job died. `signal` 0: it left or was ended for breaking the protocol. */
static void job_crashed(struct workers *workers, struct job *job, int signal) {
    double now = monotonic_ms();
    bool refused = false;
    job->crashed = true;
    if (job->kind != JOB_CANARY && quarantine_counts(signal))
        refused = quarantine_record(workers->quarantine, job->key, now);
    if (refused)
        log_event(workers->log, LOG_WARNING, "scene quarantined", LOG_TEXT("id", job->request_id),
                  LOG_NUMBER("signal", signal));
    if (job->kind == JOB_CANARY || refused || job->attempts >= ATTEMPTS_MAX ||
        now >= job->run_deadline_ms) {
        error_fault(&job->error, STATUS_WORKER_CRASHED, NULL,
                    "the worker died of signal %d (%s) while drawing this, in %d of %d attempts",
                    signal, signal > 0 ? strsignal(signal) : "none", job->attempts, ATTEMPTS_MAX);
        queue_end_job(workers->queue, job);
        return;
    }
    metrics_add(workers->metrics, &workers->metrics->retries);
    queue_put_back(workers->queue, job);
}

/* ---- actions of the table ---- */

static void worker_kill(struct worker *worker, enum metrics_end end) {
    worker->end = end;
    kill(worker->pid, SIGKILL); /* not reaped yet: the pid is still this worker's */
}

static enum worker_state act_ignore(struct workers *workers, struct worker *worker,
                                    struct occasion *occasion) {
    (void)workers;
    (void)occasion;
    return worker->state;
}

static enum worker_state act_start(struct workers *workers, struct worker *worker,
                                   struct occasion *occasion) {
    (void)occasion;
    struct error err = {0};
    if (worker_process_spawn(&workers->command, PROCESS_WORKER, &worker->pid, &worker->socket,
                             &err) == STATUS_OK) {
        struct epoll_event watch = {.events = EPOLLIN,
                                    .data.u64 = workers->tag | (uint64_t)worker->index};
        worker->timer_ms = monotonic_ms() + START_LIMIT_MS;
        if (epoll_ctl(workers->epoll, EPOLL_CTL_ADD, worker->socket, &watch) == 0)
            return WORKER_STARTING;
        worker_kill(worker, METRICS_END_start);
        worker->timer_ms = INFINITY;
        return WORKER_DYING;
    }
    worker->pid = 0;
    worker->failures++;
    worker->timer_ms = monotonic_ms() + DELAY_MAX_MS;
    log_event(workers->log, LOG_ERROR, "worker not started",
              LOG_TEXT("why", err.fault_count ? err.faults[0].message : ""));
    if (!workers->ever_ready)
        error_move(&workers->failure, &err); /* the daemon says so and ends */
    error_clear(&err);
    return WORKER_DOWN;
}

static enum worker_state act_kill_starting(struct workers *workers, struct worker *worker,
                                           struct occasion *occasion) {
    (void)workers;
    (void)occasion;
    worker_kill(worker, METRICS_END_start);
    worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

static enum worker_state act_ready(struct workers *workers, struct worker *worker,
                                   struct occasion *occasion) {
    struct ipc_ready *ready = &occasion->message->body.ready;
    ready->backend[sizeof ready->backend - 1] = 0;
    ready->device[sizeof ready->device - 1] = 0;
    ready->gl_renderer[sizeof ready->gl_renderer - 1] = 0;
    ready->gl_version[sizeof ready->gl_version - 1] = 0;
    ready->cpu[sizeof ready->cpu - 1] = 0;
    workers->ready = *ready;
    workers->ever_ready = true;
    workers->last_success_ms = monotonic_ms();
    log_event(workers->log, LOG_INFO, "worker ready", LOG_NUMBER("worker", worker->index),
              LOG_NUMBER("pid", worker->pid), LOG_TEXT("backend", ready->backend),
              LOG_TEXT("renderer", ready->gl_renderer), LOG_NUMBER("canary_ms", ready->canary_ms));
    worker->timer_ms = INFINITY;
    return WORKER_IDLE;
}

static enum worker_state act_failed(struct workers *workers, struct worker *worker,
                                    struct occasion *occasion) {
    struct ipc_failed *failed = &occasion->message->body.failed;
    failed->message[sizeof failed->message - 1] = 0;
    enum status status = failed->status > STATUS_OK && failed->status < STATUS_COUNT
                             ? (enum status)failed->status
                             : STATUS_INTERNAL;
    log_event(workers->log, LOG_ERROR, "worker cannot start", LOG_NUMBER("worker", worker->index),
              LOG_NUMBER("pid", worker->pid), LOG_TEXT("why", failed->message));
    if (!workers->ever_ready)
        error_fault(&workers->failure, status, NULL, "%s", failed->message);
    return worker->state; /* it exits by itself, or its start limit ends it */
}

static enum worker_state act_assign(struct workers *workers, struct worker *worker,
                                    struct occasion *occasion) {
    struct job *job = occasion->job;
    double now = monotonic_ms();
    if (job->attempts++ == 0)
        job->run_deadline_ms =
            now + (job->kind == JOB_CANARY ? CANARY_LIMIT_MS : workers->timeout_ms);
    worker->job = job;
    worker->assigned_ms = now;
    worker->timer_ms = job->run_deadline_ms;

    bool sent = ipc_send_assets(worker->socket, job->id, job->assets, job->asset_count);
    struct ipc_message message = {
        .header = {.type = IPC_JOB, .job = job->id},
        .body.job = {.kind = (int32_t)job->kind,
                     .format = (int32_t)job->format,
                     .asset_count = (uint32_t)job->asset_count,
                     .scene_bytes = job->scene_bytes,
                     .received_ms = job->received_ms,
                     .parse_ms = job->parse_ms,
                     .assets_ms = job->assets_ms},
        .fd = job->scene_fd,
    };
    if (sent && ipc_send(worker->socket, &message, MSG_DONTWAIT) == 0)
        return WORKER_BUSY;
    worker_kill(worker, METRICS_END_protocol); /* the job is tried again once it is gone */
    return WORKER_DYING;
}

static enum worker_state act_done(struct workers *workers, struct worker *worker,
                                  struct occasion *occasion) {
    struct ipc_message *message = occasion->message;
    struct ipc_done *done = &message->body.done;
    struct job *job = worker->job;
    bool sane = message->header.job == job->id && done->status >= 0 &&
                done->status < STATUS_COUNT && memfd_is_sealed(message->fd, done->body_bytes) &&
                isfinite(done->total_ms);
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        sane = sane && isfinite(done->stage_ms[i]) && done->stage_ms[i] >= 0;
    if (!sane) {
        worker_kill(worker, METRICS_END_protocol);
        return WORKER_DYING;
    }
    if (done->status == STATUS_OK) {
        job->body_fd = message->fd;
        message->fd = -1;
        job->body_bytes = done->body_bytes;
        if (job->kind == JOB_RENDER)
            metrics_stages(workers->metrics, done->stage_ms);
    } else {
        ipc_faults_read(message->fd, done->body_bytes, (enum status)done->status, &job->error);
        job->error.faults_left_out += done->faults_left_out;
    }
    memcpy(job->stage_ms, done->stage_ms, sizeof job->stage_ms);
    job->total_ms = done->total_ms;

    double now = monotonic_ms();
    if (job->kind == JOB_RENDER && done->status == STATUS_OK)
        queue_learn(workers->queue, now - worker->assigned_ms);
    if (done->status == STATUS_OK)
        workers->last_success_ms = now;
    worker->failures = 0;
    worker->job = NULL;
    worker->timer_ms = INFINITY;
    queue_end_job(workers->queue, job);
    return WORKER_IDLE;
}

static enum worker_state act_done_for_nobody(struct workers *workers, struct worker *worker,
                                             struct occasion *occasion) {
    (void)workers;
    (void)occasion;
    worker->failures = 0;
    worker->timer_ms = INFINITY;
    return WORKER_IDLE;
}

static enum worker_state act_cancel(struct workers *workers, struct worker *worker,
                                    struct occasion *occasion) {
    (void)occasion;
    struct job *job = worker->job;
    worker->job = NULL;
    worker->timer_ms = monotonic_ms() + GRACE_MS;
    metrics_add(workers->metrics, &workers->metrics->cancelled);
    workers_fail_job(workers, job, STATUS_CANCELLED, "the client went away");
    return WORKER_ABANDONED;
}

static enum worker_state act_cancel_dying(struct workers *workers, struct worker *worker,
                                          struct occasion *occasion) {
    act_cancel(workers, worker, occasion);
    worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

static enum worker_state act_deadline(struct workers *workers, struct worker *worker,
                                      struct occasion *occasion) {
    (void)occasion;
    struct job *job = worker->job;
    if (worker->state != WORKER_DYING)
        worker_kill(worker, METRICS_END_deadline);
    worker->job = NULL;
    worker->timer_ms = INFINITY;
    if (job) {
        error_fault(&job->error, STATUS_DEADLINE, NULL, "not drawn within %.0f ms",
                    job->kind == JOB_CANARY ? CANARY_LIMIT_MS : workers->timeout_ms);
        queue_end_job(workers->queue, job);
    }
    return WORKER_DYING;
}

static enum worker_state act_grace_over(struct workers *workers, struct worker *worker,
                                        struct occasion *occasion) {
    (void)workers;
    (void)occasion;
    worker_kill(worker, METRICS_END_cancelled);
    worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

static enum worker_state act_broken(struct workers *workers, struct worker *worker,
                                    struct occasion *occasion) {
    (void)workers;
    /* Where the socket was closed it is mostly dying already; then its own exit status stands, and
     * this signal is lost. */
    worker_kill(worker, occasion->message ? METRICS_END_protocol : METRICS_END_killed);
    if (worker->state != WORKER_BUSY)
        worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

/* Why a process came to its end. */
static enum metrics_end end_of(const struct worker *worker, int wait_status) {
    bool by_us = worker->state == WORKER_DYING && worker->end != METRICS_END_killed;
    if (by_us && WIFSIGNALED(wait_status) && WTERMSIG(wait_status) == SIGKILL)
        return worker->end;
    if (worker->state == WORKER_STARTING)
        return METRICS_END_start;
    if (WIFSIGNALED(wait_status) && quarantine_counts(WTERMSIG(wait_status)))
        return METRICS_END_crash;
    return METRICS_END_killed;
}

static enum worker_state act_exit(struct workers *workers, struct worker *worker,
                                  struct occasion *occasion) {
    int status = occasion->wait_status;
    enum metrics_end end = end_of(worker, status);
    bool was_starting = worker->state == WORKER_STARTING;
    bool ours = end == METRICS_END_deadline || end == METRICS_END_cancelled;
    int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;

    metrics_worker_end(workers->metrics, end);
    if (worker->socket >= 0)
        close(worker->socket); /* which also takes it out of epoll */
    log_event(workers->log, ours ? LOG_INFO : LOG_WARNING, "worker ended",
              LOG_NUMBER("worker", worker->index), LOG_NUMBER("pid", worker->pid),
              LOG_NUMBER("signal", signal),
              LOG_NUMBER("exit", WIFEXITED(status) ? WEXITSTATUS(status) : 0));
    worker->socket = -1;
    worker->pid = 0;
    double delay_ms = 0;
    if (!ours && ++worker->failures > 1)
        delay_ms = fmin(DELAY_FIRST_MS * exp2(fmin(worker->failures - 2, 20)), DELAY_MAX_MS);
    worker->timer_ms = monotonic_ms() + delay_ms;
    if (was_starting && !workers->ever_ready && worker->failures >= START_FAILURES_MAX)
        error_fault(&workers->failure, STATUS_NO_GL, NULL,
                    "%d workers in a row ended while they were starting, the last of signal %d",
                    worker->failures, signal);
    struct job *job = worker->job;
    worker->job = NULL;
    if (job)
        job_crashed(workers, job, signal);
    return WORKER_DOWN;
}

/* The behaviour. Rows: states. Columns: timer, ready, failed, done, assign, cancel, broken, exit.
 * What may come late and means nothing any more is ignored, and so is what nobody can have sent;
 * what a sane worker would not send is `broken`. */
static action *const table[WORKER_STATES][WORKER_EVENTS] = {
    [WORKER_DOWN] = {act_start, act_ignore, act_ignore, act_ignore, act_ignore, act_ignore,
                     act_ignore, act_ignore},
    [WORKER_STARTING] = {act_kill_starting, act_ready, act_failed, act_broken, act_ignore,
                         act_ignore, act_ignore, act_exit},
    [WORKER_IDLE] = {act_ignore, act_broken, act_broken, act_broken, act_assign, act_ignore,
                     act_broken, act_exit},
    [WORKER_BUSY] = {act_deadline, act_broken, act_broken, act_done, act_ignore, act_cancel,
                     act_broken, act_exit},
    [WORKER_ABANDONED] = {act_grace_over, act_broken, act_broken, act_done_for_nobody, act_ignore,
                          act_ignore, act_broken, act_exit},
    [WORKER_DYING] = {act_deadline, act_ignore, act_ignore, act_ignore, act_ignore,
                      act_cancel_dying, act_ignore, act_exit},
};

void workers_event(struct workers *workers, struct worker *worker, enum worker_event event,
                   struct occasion *occasion) {
    struct occasion none = {0};
    worker->state = table[worker->state][event](workers, worker, occasion ? occasion : &none);
}

/* ---- life ---- */

int workers_init(struct workers *workers, int count) {
    workers->list = calloc((size_t)count, sizeof *workers->list);
    workers->count = workers->list ? count : 0;
    for (int i = 0; i < workers->count; i++)
        workers->list[i] = (struct worker){.index = i, .socket = -1};
    return workers->list ? 0 : -1;
}

void workers_finish(struct workers *workers) {
    error_clear(&workers->failure);
    free(workers->list);
}
