/* The supervisor: workers as state machines, jobs handed to them.
 *
 * Each worker is in one state, and whatever happens to it is one event; table[state][event] below
 * is the whole behaviour. An action returns the next state. In short:
 *
 *   DOWN --timer--> STARTING --ready--> IDLE --assign--> BUSY --done--> IDLE
 *                                                        BUSY --client gone--> ABANDONED --done-->
 * IDLE and from each of them, past a limit or on nonsense: kill -> DYING --exit--> DOWN
 *
 * ABANDONED: the job is already off the worker's hands; the worker gets GRACE_MS to finish, about
 * what its replacement would cost (context and shaders), and is killed after that.
 *
 * A worker's process is over when waitpid() says so, never earlier, so a pid is never signalled
 * after it may belong to someone else. */
#include "service/supervisor.h"

#include <assert.h>
#include <errno.h>
#include <math.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "service/memfd.h"
#include "service/monotonic.h"
#include "service/queue.h"

enum {
    START_LIMIT_MS = 60000, /* context, shaders and canary without a shader cache */
    CANARY_LIMIT_MS = 5000, /* a canary takes 10 to 100 ms */
    GRACE_MS = 250,         /* see ABANDONED above */
    DELAY_FIRST_MS = 100,   /* before the second restart in a row; doubles */
    DELAY_MAX_MS = 10000,
    START_FAILURES_MAX = 5, /* workers lost in a row before the first one was ever ready */
    ATTEMPTS_MAX = 2,       /* a job is tried once more after a crash */
    RETRY_AFTER_MAX_S = 600,
    EVENTS_AT_ONCE = 32
};

enum worker_state {
    WORKER_DOWN,      /* no process; timer: when to start one */
    WORKER_STARTING,  /* timer: start limit */
    WORKER_IDLE,      /* no timer */
    WORKER_BUSY,      /* has a job; timer: its run deadline */
    WORKER_ABANDONED, /* works for nobody; timer: end of the grace */
    WORKER_DYING,     /* was sent SIGKILL; may still have a job, whose deadline is the timer */
    WORKER_STATES
};

enum worker_event {
    EVENT_TIMER,
    EVENT_READY,  /* message */
    EVENT_FAILED, /* message: the worker could not start, and is about to exit */
    EVENT_DONE,   /* message */
    EVENT_ASSIGN, /* job */
    EVENT_CANCEL, /* its job's client is gone */
    EVENT_BROKEN, /* socket closed, or a message that breaks the protocol */
    EVENT_EXIT,   /* wait_status */
    WORKER_EVENTS
};

struct occasion { /* what comes with an event */
    struct ipc_message *message;
    struct job *job;
    int wait_status;
};

struct worker {
    enum worker_state state;
    int index;
    pid_t pid;       /* 0: none */
    int socket;      /* -1: none */
    double timer_ms; /* monotonic; INFINITY: none */
    struct job *job;
    double assigned_ms;
    int failures;         /* ends in a row without a job done */
    enum metrics_end end; /* why it is dying, valid in WORKER_DYING */
};

struct supervisor {
    struct supervisor_options options;
    const struct log *log;
    struct metrics *metrics;
    struct quarantine *quarantine;
    int epoll, wake;
    int worker_count;
    struct worker *workers;
    double service_ms; /* running mean of what a job takes in a worker */
    struct error failure;

    /* Guards what follows: HTTP threads submit and look on. Never held while blocking or while
     * `finished` runs. */
    pthread_mutex_t lock;
    struct queue queue;
    uint64_t last_id;
    struct supervisor_view view;
    bool stopped;
};

typedef enum worker_state action(struct supervisor *supervisor, struct worker *worker,
                                 struct occasion *occasion);

static void worker_event(struct supervisor *supervisor, struct worker *worker,
                         enum worker_event event, struct occasion *occasion);

/* What an epoll event is about, in its upper bits; below it the worker's index or the job's id. */
enum { WATCH_WAKE = 0, WATCH_WORKER = 1, WATCH_CLIENT = 2, WATCH_SHIFT = 56 };

static uint64_t watch_tag(int what, uint64_t id) {
    return (uint64_t)what << WATCH_SHIFT | id;
}

/* ---- jobs ---- */

static void job_end(struct supervisor *supervisor, struct job *job) {
    if (job->client_fd >= 0)
        epoll_ctl(supervisor->epoll, EPOLL_CTL_DEL, job->client_fd, NULL);
    job->finished(job);
}

static void job_fail(struct supervisor *supervisor, struct job *job, enum status status,
                     const char *text) {
    error_fault(&job->error, status, NULL, "%s", text);
    job_end(supervisor, job);
}

/* Seconds until the queue, as long as it is now, has been worked off. Call with the lock held. */
static double retry_after_s(const struct supervisor *supervisor) {
    double jobs = supervisor->queue.length + supervisor->view.busy + 1;
    double seconds = ceil(supervisor->service_ms * jobs / supervisor->worker_count * 1e-3);
    return fmin(fmax(seconds, 1), RETRY_AFTER_MAX_S);
}

/* The worker that had this job died. `signal` 0: it left or was ended for breaking the protocol. */
static void job_crashed(struct supervisor *supervisor, struct job *job, int signal) {
    double now = monotonic_ms();
    bool refused = false;
    job->crashed = true;
    if (job->kind != JOB_CANARY && quarantine_counts(signal))
        refused = quarantine_record(supervisor->quarantine, job->key, now);
    if (refused)
        log_event(supervisor->log, LOG_WARNING, "scene quarantined",
                  LOG_TEXT("id", job->request_id), LOG_NUMBER("signal", signal));
    if (job->kind == JOB_CANARY || refused || job->attempts >= ATTEMPTS_MAX ||
        now >= job->run_deadline_ms) {
        error_fault(&job->error, STATUS_WORKER_CRASHED, NULL,
                    "the worker died of signal %d (%s) while drawing this, in %d of %d attempts",
                    signal, signal > 0 ? strsignal(signal) : "none", job->attempts, ATTEMPTS_MAX);
        job_end(supervisor, job);
        return;
    }
    metrics_add(supervisor->metrics, &supervisor->metrics->retries);
    pthread_mutex_lock(&supervisor->lock);
    queue_push_front(&supervisor->queue, job);
    pthread_mutex_unlock(&supervisor->lock);
}

/* When a waiting job has waited too long; a job that lost its worker has its run deadline. */
static double job_wait_limit_ms(const struct supervisor *supervisor, const struct job *job) {
    if (job->attempts > 0)
        return job->run_deadline_ms;
    return job->queued_ms +
           (job->kind == JOB_CANARY ? CANARY_LIMIT_MS : supervisor->options.timeout_ms);
}

/* ---- actions of the table ---- */

static void worker_kill(struct worker *worker, enum metrics_end end) {
    worker->end = end;
    kill(worker->pid, SIGKILL); /* not reaped yet: the pid is still this worker's */
}

static enum worker_state act_ignore(struct supervisor *supervisor, struct worker *worker,
                                    struct occasion *occasion) {
    (void)supervisor;
    (void)occasion;
    return worker->state;
}

static enum worker_state act_start(struct supervisor *supervisor, struct worker *worker,
                                   struct occasion *occasion) {
    (void)occasion;
    struct error err = {0};
    if (worker_process_spawn(&supervisor->options.command, &worker->pid, &worker->socket, &err) ==
        STATUS_OK) {
        struct epoll_event watch = {.events = EPOLLIN,
                                    .data.u64 = watch_tag(WATCH_WORKER, (uint64_t)worker->index)};
        worker->timer_ms = monotonic_ms() + START_LIMIT_MS;
        if (epoll_ctl(supervisor->epoll, EPOLL_CTL_ADD, worker->socket, &watch) == 0)
            return WORKER_STARTING;
        worker_kill(worker, METRICS_END_start);
        worker->timer_ms = INFINITY;
        return WORKER_DYING;
    }
    worker->pid = 0;
    worker->failures++;
    worker->timer_ms = monotonic_ms() + DELAY_MAX_MS;
    log_event(supervisor->log, LOG_ERROR, "worker not started",
              LOG_TEXT("why", err.fault_count ? err.faults[0].message : ""));
    error_clear(&err);
    return WORKER_DOWN;
}

static enum worker_state act_kill_starting(struct supervisor *supervisor, struct worker *worker,
                                           struct occasion *occasion) {
    (void)supervisor;
    (void)occasion;
    worker_kill(worker, METRICS_END_start);
    worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

static enum worker_state act_ready(struct supervisor *supervisor, struct worker *worker,
                                   struct occasion *occasion) {
    struct ipc_ready *ready = &occasion->message->body.ready;
    ready->backend[sizeof ready->backend - 1] = 0;
    ready->device[sizeof ready->device - 1] = 0;
    ready->gl_renderer[sizeof ready->gl_renderer - 1] = 0;
    ready->gl_version[sizeof ready->gl_version - 1] = 0;
    ready->cpu[sizeof ready->cpu - 1] = 0;
    pthread_mutex_lock(&supervisor->lock);
    supervisor->view.ready = *ready;
    supervisor->view.ever_ready = true;
    supervisor->view.last_success_ms = monotonic_ms();
    pthread_mutex_unlock(&supervisor->lock);
    log_event(supervisor->log, LOG_INFO, "worker ready", LOG_NUMBER("worker", worker->index),
              LOG_NUMBER("pid", worker->pid), LOG_TEXT("backend", ready->backend),
              LOG_TEXT("renderer", ready->gl_renderer), LOG_NUMBER("canary_ms", ready->canary_ms));
    worker->timer_ms = INFINITY;
    return WORKER_IDLE;
}

static enum worker_state act_failed(struct supervisor *supervisor, struct worker *worker,
                                    struct occasion *occasion) {
    struct ipc_failed *failed = &occasion->message->body.failed;
    failed->message[sizeof failed->message - 1] = 0;
    enum status status = failed->status > STATUS_OK && failed->status < STATUS_COUNT
                             ? (enum status)failed->status
                             : STATUS_INTERNAL;
    log_event(supervisor->log, LOG_ERROR, "worker cannot start",
              LOG_NUMBER("worker", worker->index), LOG_NUMBER("pid", worker->pid),
              LOG_TEXT("why", failed->message));
    if (!supervisor->view.ever_ready) /* only this thread writes it */
        error_fault(&supervisor->failure, status, NULL, "%s", failed->message);
    return worker->state; /* it exits by itself, or its start limit ends it */
}

static enum worker_state act_assign(struct supervisor *supervisor, struct worker *worker,
                                    struct occasion *occasion) {
    struct job *job = occasion->job;
    double now = monotonic_ms();
    if (job->attempts++ == 0)
        job->run_deadline_ms =
            now + (job->kind == JOB_CANARY ? CANARY_LIMIT_MS : supervisor->options.timeout_ms);
    worker->job = job;
    worker->assigned_ms = now;
    worker->timer_ms = job->run_deadline_ms;

    bool sent = true;
    for (size_t i = 0; i < job->asset_count && sent; i++) {
        const struct job_asset *asset = &job->assets[i];
        struct ipc_message message = {.header = {.type = IPC_ASSET, .job = job->id},
                                      .fd = asset->fd};
        memcpy(message.body.asset.name, asset->name, sizeof asset->name);
        memcpy(message.body.asset.sha256, asset->sha256, DIGEST_BYTES);
        message.body.asset.bytes = asset->bytes;
        sent = ipc_send(worker->socket, &message, MSG_DONTWAIT) == 0;
    }
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

static enum worker_state act_done(struct supervisor *supervisor, struct worker *worker,
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
            metrics_stages(supervisor->metrics, done->stage_ms);
    } else {
        ipc_faults_read(message->fd, done->body_bytes, (enum status)done->status, &job->error);
        job->error.faults_left_out += done->faults_left_out;
    }
    memcpy(job->stage_ms, done->stage_ms, sizeof job->stage_ms);
    job->total_ms = done->total_ms;

    double now = monotonic_ms();
    if (job->kind == JOB_RENDER && done->status == STATUS_OK) {
        double ms = now - worker->assigned_ms;
        /* A fifth of the way: the mean of about the last ten. */
        supervisor->service_ms += (ms - supervisor->service_ms) * 0.2;
    }
    pthread_mutex_lock(&supervisor->lock);
    if (done->status == STATUS_OK)
        supervisor->view.last_success_ms = now;
    pthread_mutex_unlock(&supervisor->lock);
    worker->failures = 0;
    worker->job = NULL;
    worker->timer_ms = INFINITY;
    job_end(supervisor, job);
    return WORKER_IDLE;
}

static enum worker_state act_done_for_nobody(struct supervisor *supervisor, struct worker *worker,
                                             struct occasion *occasion) {
    (void)supervisor;
    (void)occasion;
    worker->failures = 0;
    worker->timer_ms = INFINITY;
    return WORKER_IDLE;
}

static enum worker_state act_cancel(struct supervisor *supervisor, struct worker *worker,
                                    struct occasion *occasion) {
    (void)occasion;
    struct job *job = worker->job;
    worker->job = NULL;
    worker->timer_ms = monotonic_ms() + GRACE_MS;
    metrics_add(supervisor->metrics, &supervisor->metrics->cancelled);
    job_fail(supervisor, job, STATUS_CANCELLED, "the client went away");
    return WORKER_ABANDONED;
}

static enum worker_state act_cancel_dying(struct supervisor *supervisor, struct worker *worker,
                                          struct occasion *occasion) {
    act_cancel(supervisor, worker, occasion);
    worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

static enum worker_state act_deadline(struct supervisor *supervisor, struct worker *worker,
                                      struct occasion *occasion) {
    (void)occasion;
    struct job *job = worker->job;
    if (worker->state != WORKER_DYING)
        worker_kill(worker, METRICS_END_deadline);
    worker->job = NULL;
    worker->timer_ms = INFINITY;
    if (job) {
        error_fault(&job->error, STATUS_DEADLINE, NULL, "not drawn within %.0f ms",
                    job->kind == JOB_CANARY ? CANARY_LIMIT_MS : supervisor->options.timeout_ms);
        job_end(supervisor, job);
    }
    return WORKER_DYING;
}

static enum worker_state act_grace_over(struct supervisor *supervisor, struct worker *worker,
                                        struct occasion *occasion) {
    (void)supervisor;
    (void)occasion;
    worker_kill(worker, METRICS_END_cancelled);
    worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

static enum worker_state act_broken(struct supervisor *supervisor, struct worker *worker,
                                    struct occasion *occasion) {
    (void)supervisor;
    (void)occasion;
    /* If it is dying anyway (its socket closes before it can be reaped), then its own exit status
     * stands and this signal is lost. */
    worker_kill(worker, METRICS_END_protocol);
    if (worker->state != WORKER_BUSY)
        worker->timer_ms = INFINITY;
    return WORKER_DYING;
}

/* Why a process that was not ended by the supervisor (or was told to go as it closed its socket)
 * came to its end. */
static enum metrics_end end_of(const struct worker *worker, int wait_status) {
    bool by_us = worker->state == WORKER_DYING && worker->end != METRICS_END_protocol;
    if (by_us)
        return worker->end;
    if (worker->state == WORKER_STARTING)
        return METRICS_END_start;
    if (WIFSIGNALED(wait_status) && quarantine_counts(WTERMSIG(wait_status)))
        return METRICS_END_crash;
    if (worker->state == WORKER_DYING && WIFSIGNALED(wait_status) &&
        WTERMSIG(wait_status) == SIGKILL)
        return METRICS_END_protocol;
    return METRICS_END_killed;
}

static enum worker_state act_exit(struct supervisor *supervisor, struct worker *worker,
                                  struct occasion *occasion) {
    int status = occasion->wait_status;
    enum metrics_end end = end_of(worker, status);
    bool was_starting = worker->state == WORKER_STARTING;
    bool ours = end == METRICS_END_deadline || end == METRICS_END_cancelled;
    int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;

    metrics_worker_end(supervisor->metrics, end);
    if (worker->socket >= 0)
        close(worker->socket); /* which also takes it out of epoll */
    log_event(supervisor->log, ours ? LOG_INFO : LOG_WARNING, "worker ended",
              LOG_NUMBER("worker", worker->index), LOG_NUMBER("pid", worker->pid),
              LOG_NUMBER("signal", signal),
              LOG_NUMBER("exit", WIFEXITED(status) ? WEXITSTATUS(status) : 0));
    worker->socket = -1;
    worker->pid = 0;
    double delay_ms = 0;
    if (!ours && ++worker->failures > 1)
        delay_ms = fmin(DELAY_FIRST_MS * exp2(fmin(worker->failures - 2, 20)), DELAY_MAX_MS);
    worker->timer_ms = monotonic_ms() + delay_ms;
    if (was_starting && !supervisor->view.ever_ready && worker->failures >= START_FAILURES_MAX)
        error_fault(&supervisor->failure, STATUS_NO_GL, NULL,
                    "%d workers in a row ended while they were starting, the last of signal %d",
                    worker->failures, signal);
    struct job *job = worker->job;
    worker->job = NULL;
    if (job)
        job_crashed(supervisor, job, signal);
    return WORKER_DOWN;
}

/* The behaviour. Rows: states. Columns: timer, ready, failed, done, assign, cancel, broken, exit.
 * What may come late and means nothing any more is ignored; what cannot be is `broken`, except in
 * the states without a process or a job, where the caller's asserts hold. */
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

static void worker_event(struct supervisor *supervisor, struct worker *worker,
                         enum worker_event event, struct occasion *occasion) {
    struct occasion none = {0};
    worker->state = table[worker->state][event](supervisor, worker, occasion ? occasion : &none);
}

/* ---- what happens ---- */

/* Every message that waits on a worker's socket. */
static void read_messages(struct supervisor *supervisor, struct worker *worker) {
    static const enum worker_event events[IPC_TYPE_COUNT] = {
        [IPC_READY] = EVENT_READY,  [IPC_FAILED] = EVENT_FAILED, [IPC_DONE] = EVENT_DONE,
        [IPC_ASSET] = EVENT_BROKEN, [IPC_JOB] = EVENT_BROKEN,
    };
    while (worker->socket >= 0) {
        struct ipc_message message;
        int got = ipc_receive(worker->socket, &message, MSG_DONTWAIT);
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
            return;
        struct occasion occasion = {.message = &message};
        if (got == 1) {
            worker_event(supervisor, worker, events[message.header.type], &occasion);
            if (message.fd >= 0)
                close(message.fd);
            continue;
        }
        /* Closed or nonsense: nothing more is read; the descriptor stays until the process is
         * reaped, but epoll must not report it for ever. */
        epoll_ctl(supervisor->epoll, EPOLL_CTL_DEL, worker->socket, NULL);
        worker_event(supervisor, worker, EVENT_BROKEN, NULL);
        return;
    }
}

static void reap(struct supervisor *supervisor) {
    for (int i = 0; i < supervisor->worker_count; i++) {
        struct worker *worker = &supervisor->workers[i];
        struct occasion occasion = {0};
        if (worker->pid <= 0 || waitpid(worker->pid, &occasion.wait_status, WNOHANG) != worker->pid)
            continue;
        read_messages(supervisor, worker); /* what it said before it died still counts */
        worker_event(supervisor, worker, EVENT_EXIT, &occasion);
    }
}

static void client_gone(struct supervisor *supervisor, uint64_t id) {
    pthread_mutex_lock(&supervisor->lock);
    struct job *job = queue_find(&supervisor->queue, id);
    if (job)
        queue_remove(&supervisor->queue, job);
    pthread_mutex_unlock(&supervisor->lock);
    if (job) {
        metrics_add(supervisor->metrics, &supervisor->metrics->cancelled);
        job_fail(supervisor, job, STATUS_CANCELLED, "the client went away");
        return;
    }
    for (int i = 0; i < supervisor->worker_count; i++) {
        struct worker *worker = &supervisor->workers[i];
        if (worker->job && worker->job->id == id) {
            worker_event(supervisor, worker, EVENT_CANCEL, NULL);
            return;
        }
    }
}

static void expire_waiting(struct supervisor *supervisor, double now) {
    for (;;) {
        pthread_mutex_lock(&supervisor->lock);
        struct job *job = supervisor->queue.first;
        while (job && job_wait_limit_ms(supervisor, job) > now)
            job = job->next;
        if (job) {
            queue_remove(&supervisor->queue, job);
            job->retry_after_s = retry_after_s(supervisor);
        }
        pthread_mutex_unlock(&supervisor->lock);
        if (!job)
            return;
        if (job->crashed)
            job_fail(supervisor, job, STATUS_WORKER_CRASHED,
                     "the worker died while drawing this, and no time was left to try again");
        else
            job_fail(supervisor, job, STATUS_QUEUE_FULL,
                     "no worker got free before the server's time limit");
    }
}

static void run_timers(struct supervisor *supervisor, double now) {
    for (int i = 0; i < supervisor->worker_count; i++)
        if (supervisor->workers[i].timer_ms <= now)
            worker_event(supervisor, &supervisor->workers[i], EVENT_TIMER, NULL);
}

static void hand_out(struct supervisor *supervisor) {
    for (int i = 0; i < supervisor->worker_count; i++) {
        struct worker *worker = &supervisor->workers[i];
        if (worker->state != WORKER_IDLE)
            continue;
        pthread_mutex_lock(&supervisor->lock);
        struct occasion occasion = {.job = queue_pop(&supervisor->queue)};
        pthread_mutex_unlock(&supervisor->lock);
        if (!occasion.job)
            return;
        worker_event(supervisor, worker, EVENT_ASSIGN, &occasion);
    }
}

static void update_view(struct supervisor *supervisor) {
    int count[WORKER_STATES] = {0};
    for (int i = 0; i < supervisor->worker_count; i++)
        count[supervisor->workers[i].state]++;
    pthread_mutex_lock(&supervisor->lock);
    supervisor->view.starting = count[WORKER_STARTING];
    supervisor->view.idle = count[WORKER_IDLE];
    supervisor->view.busy = count[WORKER_BUSY] + count[WORKER_ABANDONED];
    supervisor->view.down = count[WORKER_DOWN] + count[WORKER_DYING];
    pthread_mutex_unlock(&supervisor->lock);
}

void supervisor_run(struct supervisor *supervisor) {
    struct epoll_event events[EVENTS_AT_ONCE];
    int count = epoll_wait(supervisor->epoll, events, EVENTS_AT_ONCE, 0);
    for (int i = 0; i < count; i++) {
        uint64_t id = events[i].data.u64 & ((UINT64_C(1) << WATCH_SHIFT) - 1);
        uint64_t drained;
        switch (events[i].data.u64 >> WATCH_SHIFT) {
        case WATCH_WAKE:
            if (read(supervisor->wake, &drained, sizeof drained) < 0)
                assert(errno == EAGAIN || errno == EINTR);
            break;
        case WATCH_WORKER:
            read_messages(supervisor, &supervisor->workers[id]);
            break;
        case WATCH_CLIENT:
            client_gone(supervisor, id);
            break;
        }
    }
    reap(supervisor);
    double now = monotonic_ms();
    expire_waiting(supervisor, now);
    run_timers(supervisor, now);
    hand_out(supervisor);
    update_view(supervisor);
}

double supervisor_due_ms(const struct supervisor *supervisor) {
    /* The queue may grow while this looks, but a new job wakes the main thread anyway. */
    pthread_mutex_t *lock = (pthread_mutex_t *)(uintptr_t)&supervisor->lock;
    double due = INFINITY;
    for (int i = 0; i < supervisor->worker_count; i++)
        due = fmin(due, supervisor->workers[i].timer_ms);
    pthread_mutex_lock(lock);
    for (struct job *job = supervisor->queue.first; job; job = job->next)
        due = fmin(due, job_wait_limit_ms(supervisor, job));
    pthread_mutex_unlock(lock);
    return due;
}

enum status supervisor_submit(struct supervisor *supervisor, struct job *job) {
    enum status status = STATUS_OK;
    pthread_mutex_lock(&supervisor->lock);
    job->id = ++supervisor->last_id;
    job->queued_ms = monotonic_ms();
    bool canary = job->kind == JOB_CANARY;
    bool room =
        canary ? supervisor->view.idle > 0 : supervisor->queue.length < supervisor->queue.limit;
    /* Watched before it can be handed out, so that the end of the job always finds the watch. */
    struct epoll_event watch = {.events = EPOLLRDHUP | EPOLLONESHOT,
                                .data.u64 = watch_tag(WATCH_CLIENT, job->id)};
    if (supervisor->stopped) {
        status = error_fault(&job->error, STATUS_SHUTTING_DOWN, NULL, "the server was stopped");
    } else if (!room) {
        job->retry_after_s = retry_after_s(supervisor);
        status = error_fault(&job->error, STATUS_QUEUE_FULL, NULL, "%d requests are waiting",
                             supervisor->queue.length);
    } else if (job->client_fd >= 0 &&
               epoll_ctl(supervisor->epoll, EPOLL_CTL_ADD, job->client_fd, &watch) != 0) {
        status = error_fault(&job->error, STATUS_IO_ERROR, NULL, "watching the client: %s",
                             strerror(errno));
    } else if (canary) {
        queue_push_front(&supervisor->queue, job);
    } else {
        queue_push(&supervisor->queue, job);
    }
    pthread_mutex_unlock(&supervisor->lock);
    if (status == STATUS_OK) {
        uint64_t one = 1;
        ssize_t written = write(supervisor->wake, &one, sizeof one);
        (void)written; /* fails only where the counter is full, and then it is readable anyway */
    }
    return status;
}

/* ---- life ---- */

enum status supervisor_create(const struct supervisor_options *options, const struct log *log,
                              struct metrics *metrics, struct quarantine *quarantine,
                              struct supervisor **out, struct error *err) {
    *out = NULL;
    int count = options->command.workers;
    struct supervisor *supervisor = calloc(1, sizeof *supervisor);
    struct worker *workers = calloc((size_t)count, sizeof *workers);
    if (!supervisor || !workers || pthread_mutex_init(&supervisor->lock, NULL) != 0) {
        free(supervisor);
        free(workers);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the supervisor");
    }
    supervisor->options = *options;
    supervisor->log = log;
    supervisor->metrics = metrics;
    supervisor->quarantine = quarantine;
    supervisor->worker_count = count;
    supervisor->workers = workers;
    supervisor->queue.limit = options->queue_limit;
    supervisor->view.workers = count;
    supervisor->view.queue_limit = options->queue_limit;
    supervisor->service_ms = 200; /* until the first picture says what is usual here */
    for (int i = 0; i < count; i++)
        workers[i] = (struct worker){.index = i, .socket = -1, .timer_ms = 0};
    supervisor->epoll = epoll_create1(EPOLL_CLOEXEC);
    supervisor->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    struct epoll_event watch = {.events = EPOLLIN, .data.u64 = watch_tag(WATCH_WAKE, 0)};
    if (supervisor->epoll < 0 || supervisor->wake < 0 ||
        epoll_ctl(supervisor->epoll, EPOLL_CTL_ADD, supervisor->wake, &watch) != 0) {
        error_fault(err, STATUS_IO_ERROR, NULL, "epoll: %s", strerror(errno));
        supervisor_destroy(supervisor);
        return STATUS_IO_ERROR;
    }
    supervisor_run(supervisor); /* every worker's timer is due: all start */
    *out = supervisor;
    return STATUS_OK;
}

void supervisor_stop(struct supervisor *supervisor, double grace_ms) {
    double deadline = monotonic_ms() + grace_ms;
    struct timespec pause = {0, 2000000};
    for (int i = 0; i < supervisor->worker_count; i++)
        if (supervisor->workers[i].socket >= 0)
            close(supervisor->workers[i].socket); /* an idle worker leaves when it sees this */
    for (int i = 0; i < supervisor->worker_count; i++) {
        struct worker *worker = &supervisor->workers[i];
        while (worker->pid > 0 && waitpid(worker->pid, NULL, WNOHANG) == 0) {
            if (monotonic_ms() >= deadline) {
                kill(worker->pid, SIGKILL);
                waitpid(worker->pid, NULL, 0);
                break;
            }
            nanosleep(&pause, NULL);
        }
        if (worker->job)
            job_fail(supervisor, worker->job, STATUS_SHUTTING_DOWN, "the server was stopped");
        *worker = (struct worker){.index = i, .socket = -1, .timer_ms = INFINITY};
    }
    for (;;) {
        pthread_mutex_lock(&supervisor->lock);
        supervisor->stopped = true;
        struct job *job = queue_pop(&supervisor->queue);
        pthread_mutex_unlock(&supervisor->lock);
        if (!job)
            return;
        job_fail(supervisor, job, STATUS_SHUTTING_DOWN, "the server was stopped");
    }
}

void supervisor_destroy(struct supervisor *supervisor) {
    if (!supervisor)
        return;
    if (supervisor->epoll >= 0)
        close(supervisor->epoll);
    if (supervisor->wake >= 0)
        close(supervisor->wake);
    error_clear(&supervisor->failure);
    pthread_mutex_destroy(&supervisor->lock);
    free(supervisor->workers);
    free(supervisor);
}

int supervisor_fd(const struct supervisor *supervisor) {
    return supervisor->epoll;
}

void supervisor_view(struct supervisor *supervisor, struct supervisor_view *view) {
    pthread_mutex_lock(&supervisor->lock);
    *view = supervisor->view;
    view->queue_length = supervisor->queue.length;
    pthread_mutex_unlock(&supervisor->lock);
}

bool supervisor_has_failed(struct supervisor *supervisor, struct error *err) {
    if (supervisor->failure.status == STATUS_OK)
        return false;
    error_move(err, &supervisor->failure);
    return true;
}

int supervisor_jobs(struct supervisor *supervisor) {
    pthread_mutex_lock(&supervisor->lock);
    int jobs = supervisor->queue.length;
    pthread_mutex_unlock(&supervisor->lock);
    for (int i = 0; i < supervisor->worker_count; i++)
        jobs += supervisor->workers[i].job != NULL;
    return jobs;
}
