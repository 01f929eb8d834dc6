/* The supervisor: hears from workers, clients and timers, tells the workers' state machine
 * (workers.c) what has happened, and hands waiting jobs to idle workers. */
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

#include "service/monotonic.h"
#include "service/queue.h"
#include "service/workers.h"

enum { EVENTS_AT_ONCE = 32 };

struct supervisor {
    int epoll, wake;
    struct workers workers;
    struct queue queue;

    /* Guards the view, which HTTP threads copy. */
    pthread_mutex_t lock;
    struct supervisor_view view;
};

/* What an epoll event is about, in its upper bits; below it the worker's index or the job's id. */
enum { WATCH_WAKE = 0, WATCH_WORKER = 1, WATCH_CLIENT = 2, WATCH_SHIFT = 56 };

static uint64_t watch_tag(int what, uint64_t id) {
    return (uint64_t)what << WATCH_SHIFT | id;
}

/* ---- what happens ---- */

/* Every message that waits on a worker's socket. */
static void read_messages(struct supervisor *supervisor, struct worker *worker) {
    static const enum worker_event events[IPC_TYPE_COUNT] = {
        [IPC_READY] = EVENT_READY,     [IPC_FAILED] = EVENT_FAILED, [IPC_DONE] = EVENT_DONE,
        [IPC_ASSET] = EVENT_BROKEN,    [IPC_JOB] = EVENT_BROKEN,    [IPC_TASK] = EVENT_BROKEN,
        [IPC_PROGRESS] = EVENT_BROKEN, [IPC_RESULT] = EVENT_BROKEN,
    };
    while (worker->socket >= 0) {
        struct ipc_message message;
        int got = ipc_receive(worker->socket, &message, MSG_DONTWAIT);
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
            return;
        struct occasion occasion = {.message = &message};
        if (got == 1) {
            workers_event(&supervisor->workers, worker, events[message.header.type], &occasion);
            if (message.fd >= 0)
                close(message.fd);
            continue;
        }
        /* Closed or nonsense: nothing more is read; the descriptor stays until the process is
         * reaped, but epoll must not report it for ever. */
        epoll_ctl(supervisor->epoll, EPOLL_CTL_DEL, worker->socket, NULL);
        workers_event(&supervisor->workers, worker, EVENT_BROKEN, got < 0 ? &occasion : NULL);
        return;
    }
}

static void reap(struct supervisor *supervisor) {
    for (int i = 0; i < supervisor->workers.count; i++) {
        struct worker *worker = &supervisor->workers.list[i];
        struct occasion occasion = {0};
        siginfo_t ended = {0};
        if (worker->pid <= 0 ||
            waitid(P_PID, (id_t)worker->pid, &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
            ended.si_pid != worker->pid)
            continue;
        /* What it said before it died still counts, and is heard while the pid is still its own. */
        read_messages(supervisor, worker);
        if (waitpid(worker->pid, &occasion.wait_status, 0) == worker->pid)
            workers_event(&supervisor->workers, worker, EVENT_EXIT, &occasion);
    }
}

static void client_gone(struct supervisor *supervisor, uint64_t id) {
    struct job *job = queue_take_id(&supervisor->queue, id);
    if (job) {
        metrics_add(supervisor->workers.metrics, &supervisor->workers.metrics->cancelled);
        workers_fail_job(&supervisor->workers, job, STATUS_CANCELLED, "the client went away");
        return;
    }
    for (int i = 0; i < supervisor->workers.count; i++) {
        struct worker *worker = &supervisor->workers.list[i];
        if (worker->job && worker->job->id == id) {
            workers_event(&supervisor->workers, worker, EVENT_CANCEL, NULL);
            return;
        }
    }
}

static void expire_waiting(struct supervisor *supervisor, double now) {
    for (struct job *job; (job = queue_take_expired(&supervisor->queue, now)) != NULL;) {
        if (job->crashed)
            workers_fail_job(
                &supervisor->workers, job, STATUS_WORKER_CRASHED,
                "the worker died while drawing this, and no time was left to try again");
        else
            workers_fail_job(&supervisor->workers, job, STATUS_QUEUE_FULL,
                             "no worker got free before the server's time limit");
    }
}

static void run_timers(struct supervisor *supervisor, double now) {
    for (int i = 0; i < supervisor->workers.count; i++)
        if (supervisor->workers.list[i].timer_ms <= now)
            workers_event(&supervisor->workers, &supervisor->workers.list[i], EVENT_TIMER, NULL);
}

static void hand_out(struct supervisor *supervisor) {
    for (int i = 0; i < supervisor->workers.count; i++) {
        struct worker *worker = &supervisor->workers.list[i];
        if (worker->state != WORKER_IDLE)
            continue;
        struct occasion occasion = {.job = queue_take(&supervisor->queue)};
        if (!occasion.job)
            return;
        workers_event(&supervisor->workers, worker, EVENT_ASSIGN, &occasion);
    }
}

static void update_view(struct supervisor *supervisor) {
    int count[WORKER_STATES] = {0};
    for (int i = 0; i < supervisor->workers.count; i++)
        count[supervisor->workers.list[i].state]++;
    pthread_mutex_lock(&supervisor->lock);
    supervisor->view.ever_ready = supervisor->workers.ever_ready;
    supervisor->view.ready = supervisor->workers.ready;
    supervisor->view.last_success_ms = supervisor->workers.last_success_ms;
    supervisor->view.starting = count[WORKER_STARTING];
    supervisor->view.idle = count[WORKER_IDLE];
    supervisor->view.busy = count[WORKER_BUSY] + count[WORKER_ABANDONED];
    supervisor->view.down = count[WORKER_DOWN] + count[WORKER_DYING];
    pthread_mutex_unlock(&supervisor->lock);
    queue_set_busy(&supervisor->queue, count[WORKER_BUSY] + count[WORKER_ABANDONED]);
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
            read_messages(supervisor, &supervisor->workers.list[id]);
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

double supervisor_due_ms(struct supervisor *supervisor) {
    /* The queue may grow after this look, but a new job wakes the main thread anyway. */
    double due = queue_due_ms(&supervisor->queue);
    for (int i = 0; i < supervisor->workers.count; i++)
        due = fmin(due, supervisor->workers.list[i].timer_ms);
    return due;
}

enum status supervisor_submit(struct supervisor *supervisor, struct job *job) {
    bool canary = job->kind == JOB_CANARY;
    if (canary) {
        struct supervisor_view view;
        supervisor_view(supervisor, &view);
        job->retry_after_s = 1;
        if (view.idle == 0)
            return error_fault(&job->error, STATUS_QUEUE_FULL, NULL, "no worker is idle");
    }
    enum status status = queue_submit(&supervisor->queue, job, canary);
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
    if (!supervisor || pthread_mutex_init(&supervisor->lock, NULL) != 0) {
        free(supervisor);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the supervisor");
    }
    supervisor->view.workers = count;
    supervisor->view.queue_limit = options->queue_limit;
    supervisor->epoll = epoll_create1(EPOLL_CLOEXEC);
    supervisor->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    struct epoll_event watch = {.events = EPOLLIN, .data.u64 = watch_tag(WATCH_WAKE, 0)};
    if (supervisor->epoll < 0 || supervisor->wake < 0 ||
        queue_init(&supervisor->queue, options->queue_limit, options->timeout_ms, count,
                   supervisor->epoll, watch_tag(WATCH_CLIENT, 0)) != 0 ||
        epoll_ctl(supervisor->epoll, EPOLL_CTL_ADD, supervisor->wake, &watch) != 0 ||
        workers_init(&supervisor->workers, count) != 0) {
        error_fault(err, STATUS_IO_ERROR, NULL, "the supervisor does not start: %s",
                    strerror(errno));
        supervisor_destroy(supervisor);
        return STATUS_IO_ERROR;
    }
    struct workers *workers = &supervisor->workers;
    workers->command = options->command;
    workers->timeout_ms = options->timeout_ms;
    workers->log = log;
    workers->metrics = metrics;
    workers->quarantine = quarantine;
    workers->queue = &supervisor->queue;
    workers->epoll = supervisor->epoll;
    workers->tag = watch_tag(WATCH_WORKER, 0);
    supervisor_run(supervisor); /* every worker's timer is due: all start */
    *out = supervisor;
    return STATUS_OK;
}

void supervisor_stop(struct supervisor *supervisor, double grace_ms) {
    double deadline = monotonic_ms() + grace_ms;
    struct timespec pause = {0, 2000000};
    for (int i = 0; i < supervisor->workers.count; i++)
        if (supervisor->workers.list[i].socket >= 0)
            close(supervisor->workers.list[i].socket); /* an idle worker leaves when it sees this */
    for (int i = 0; i < supervisor->workers.count; i++) {
        struct worker *worker = &supervisor->workers.list[i];
        while (worker->pid > 0 && waitpid(worker->pid, NULL, WNOHANG) == 0) {
            if (monotonic_ms() >= deadline) {
                kill(worker->pid, SIGKILL);
                waitpid(worker->pid, NULL, 0);
                break;
            }
            nanosleep(&pause, NULL);
        }
        if (worker->job)
            workers_fail_job(&supervisor->workers, worker->job, STATUS_SHUTTING_DOWN,
                             "the server was stopped");
        *worker = (struct worker){.index = i, .socket = -1, .timer_ms = INFINITY};
    }
    queue_close(&supervisor->queue);
    for (struct job *job; (job = queue_take(&supervisor->queue)) != NULL;)
        workers_fail_job(&supervisor->workers, job, STATUS_SHUTTING_DOWN, "the server was stopped");
}

void supervisor_destroy(struct supervisor *supervisor) {
    if (!supervisor)
        return;
    if (supervisor->epoll >= 0)
        close(supervisor->epoll);
    if (supervisor->wake >= 0)
        close(supervisor->wake);
    workers_finish(&supervisor->workers);
    queue_finish(&supervisor->queue);
    pthread_mutex_destroy(&supervisor->lock);
    free(supervisor);
}

int supervisor_fd(const struct supervisor *supervisor) {
    return supervisor->epoll;
}

void supervisor_view(struct supervisor *supervisor, struct supervisor_view *view) {
    pthread_mutex_lock(&supervisor->lock);
    *view = supervisor->view;
    pthread_mutex_unlock(&supervisor->lock);
    view->queue_length = queue_length(&supervisor->queue);
}

bool supervisor_has_failed(struct supervisor *supervisor, struct error *err) {
    if (supervisor->workers.failure.status == STATUS_OK)
        return false;
    error_move(err, &supervisor->workers.failure);
    return true;
}

int supervisor_jobs(struct supervisor *supervisor) {
    int jobs = queue_length(&supervisor->queue);
    for (int i = 0; i < supervisor->workers.count; i++)
        jobs += supervisor->workers.list[i].job != NULL;
    return jobs;
}
