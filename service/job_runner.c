/* The one process that runs tasks, from spawn to reaping.
 *
 * It is in one of four states: ABSENT; WORKING; LEAVING, when it has answered and is to end by
 * itself; DYING, when it was sent SIGKILL. The next task starts when it has been reaped, never
 * earlier, so there are never two, and a pid is never signalled after it may belong to someone
 * else.
 *
 * A process that dies of what a scene can cause (SEGV, BUS, ILL, FPE, ABRT) fails its task at once:
 * to run the same for another hour would crash again. One that was killed from outside is tried
 * once more. Both are told to the metrics, and the first kind to the quarantine, as with workers.
 */
#include "service/job_runner.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "service/ipc.h"
#include "service/memfd.h"
#include "service/monotonic.h"

enum {
    LEAVE_MS = 2000, /* from its answer to its end: it has only to give memory back */
    START_AGAIN_MS = 1000,
    ATTEMPTS_MAX = 2,
    EVENTS_AT_ONCE = 4
};

struct job_runner {
    struct job_runner_options options;
    struct jobs *jobs;
    const struct log *log;
    struct metrics *metrics;
    struct quarantine *quarantine;
    int epoll;

    enum { ABSENT, WORKING, LEAVING, DYING } state;
    pid_t pid;       /* 0 in ABSENT */
    int socket;      /* -1 in ABSENT */
    double timer_ms; /* monotonic: when it is killed; in ABSENT, when the next may start; INFINITY:
                        nothing is due */
    uint64_t task;   /* serial */
    char id[JOBS_ID_BYTES];
    int attempts;
    double started_ms;
    struct task_input input; /* of the task, for another attempt */
};

static void log_job(const struct job_runner *runner, enum log_level level, const char *event,
                    const char *why) {
    log_event(runner->log, level, event, LOG_TEXT("id", runner->input.request_id),
              LOG_TEXT("job", runner->id), LOG_NUMBER("pid", runner->pid),
              LOG_NUMBER("s", (monotonic_ms() - runner->started_ms) * 1e-3), LOG_TEXT("why", why));
}

static void kill_process(struct job_runner *runner) {
    kill(runner->pid, SIGKILL); /* not reaped yet: the pid is still its own */
    runner->state = DYING;
    runner->timer_ms = INFINITY;
}

/* Fails the task with what `err` says; where it was cancelled meanwhile that stands. */
static void fail(struct job_runner *runner, struct error *err) {
    char why[256] = "";
    if (err->fault_count && err->faults[0].message)
        snprintf(why, sizeof why, "%s", err->faults[0].message);
    if (jobs_fail(runner->jobs, runner->task, err, jobs_time_now()))
        log_job(runner, LOG_WARNING, "job failed", why);
    error_clear(err);
}

/* ---- messages ---- */

static bool is_word(const char *text, size_t room, const char *allowed) {
    const char *end = memchr(text, 0, room);
    return end && end > text && strspn(text, allowed) == (size_t)(end - text);
}

/* Each handler returns false for what a sane process would not send. */
typedef bool handler(struct job_runner *runner, struct ipc_message *message);

static bool handle_progress(struct job_runner *runner, struct ipc_message *message) {
    const struct ipc_progress *progress = &message->body.progress;
    if (!is_word(progress->what, sizeof progress->what,
                 "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789 ,.:;()+-") ||
        progress->done > progress->total)
        return false;
    jobs_progress(runner->jobs, runner->task, progress->what, progress->done, progress->total);
    return true;
}

static bool handle_result(struct job_runner *runner, struct ipc_message *message) {
    struct ipc_result *result = &message->body.result;
    if (!is_word(result->name, sizeof result->name, "abcdefghijklmnopqrstuvwxyz0123456789._-") ||
        !is_word(result->media_type, sizeof result->media_type,
                 "abcdefghijklmnopqrstuvwxyz0123456789._-+/;= ") ||
        !(result->growing ? result->bytes == 0 && memfd_holds(message->fd, 0)
                          : memfd_is_sealed(message->fd, result->bytes)))
        return false;
    struct task_output output = {
        .fd = message->fd, .bytes = result->bytes, .grows = result->growing};
    memcpy(output.name, result->name, sizeof output.name);
    memcpy(output.media_type, result->media_type, sizeof output.media_type);
    struct error err = {0};
    if (jobs_output(runner->jobs, runner->task, &output, jobs_time_now(), &err) == STATUS_OK) {
        message->fd = -1;
        return true;
    }
    fail(runner, &err);
    kill_process(runner);
    return true;
}

static bool handle_part(struct job_runner *runner, struct ipc_message *message) {
    const struct ipc_part *part = &message->body.part;
    struct task_part added = {.offset = part->offset, .bytes = part->bytes};
    bool named = part->name[0] != 0;
    if (named &&
        (!is_word(part->name, sizeof part->name, "abcdefghijklmnopqrstuvwxyz0123456789._-") ||
         strlen(part->name) >= sizeof added.name))
        return false;
    if (named)
        memcpy(added.name, part->name, sizeof added.name);
    struct error err = {0};
    if (jobs_grow(runner->jobs, runner->task, named ? &added : NULL, part->total, jobs_time_now(),
                  &err) == STATUS_OK)
        return true;
    fail(runner, &err);
    kill_process(runner);
    return true;
}

static bool handle_done(struct job_runner *runner, struct ipc_message *message) {
    struct ipc_done *done = &message->body.done;
    if (done->status < 0 || done->status >= STATUS_COUNT ||
        !memfd_is_sealed(message->fd, done->body_bytes))
        return false;
    if (done->status == STATUS_OK) {
        if (jobs_done(runner->jobs, runner->task, jobs_time_now()))
            log_job(runner, LOG_INFO, "job done", "");
    } else {
        struct error err = {0};
        ipc_faults_read(message->fd, done->body_bytes, (enum status)done->status, &err);
        err.faults_left_out += done->faults_left_out;
        fail(runner, &err);
    }
    runner->state = LEAVING;
    runner->timer_ms = monotonic_ms() + LEAVE_MS;
    return true;
}

static handler *const handlers[IPC_TYPE_COUNT] = {
    [IPC_PROGRESS] = handle_progress,
    [IPC_RESULT] = handle_result,
    [IPC_PART] = handle_part,
    [IPC_DONE] = handle_done,
};

static void read_messages(struct job_runner *runner) {
    while (runner->state == WORKING) {
        struct ipc_message message;
        int got = ipc_receive(runner->socket, &message, MSG_DONTWAIT);
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
            return;
        handler *handle = got == 1 ? handlers[message.header.type] : NULL;
        bool sane = handle && message.header.job == runner->task && handle(runner, &message);
        if (message.fd >= 0)
            close(message.fd);
        if (!sane && runner->state == WORKING)
            kill_process(runner); /* closed or nonsense; reaping tells which */
    }
}

/* ---- life of the process ---- */

static bool send_task(struct job_runner *runner) {
    const struct task_input *input = &runner->input;
    bool sent = ipc_send_assets(runner->socket, runner->task, input->assets, input->asset_count);
    struct ipc_message message = {.header = {.type = IPC_TASK, .job = runner->task},
                                  .body.task = {.kind = (int32_t)input->kind,
                                                .asset_count = (uint32_t)input->asset_count,
                                                .scene_bytes = input->scene_bytes},
                                  .fd = input->scene_fd};
    memcpy(message.body.task.options, input->options, sizeof input->options);
    return sent && ipc_send(runner->socket, &message, MSG_DONTWAIT) == 0;
}

static void start_next(struct job_runner *runner) {
    struct error err = {0};
    if (!jobs_start(runner->jobs, jobs_time_now(), &runner->task, runner->id, &runner->attempts,
                    &runner->input))
        return;
    runner->started_ms = monotonic_ms();
    if (worker_process_spawn(&runner->options.command, PROCESS_JOB, &runner->pid, &runner->socket,
                             &err) != STATUS_OK) {
        runner->pid = 0;
        fail(runner, &err);
        task_input_finish(&runner->input);
        runner->timer_ms = runner->started_ms + START_AGAIN_MS; /* processes are short now */
        return;
    }
    runner->state = WORKING;
    runner->timer_ms = runner->started_ms + runner->options.timeout_ms;
    log_job(runner, LOG_INFO, "job started", "");
    struct epoll_event watch = {.events = EPOLLIN};
    if (epoll_ctl(runner->epoll, EPOLL_CTL_ADD, runner->socket, &watch) != 0 || !send_task(runner))
        kill_process(runner); /* and tried again once it is gone */
}

/* The process ended before it had answered. */
static void lost(struct job_runner *runner, int wait_status) {
    int signal = WIFSIGNALED(wait_status) ? WTERMSIG(wait_status) : 0;
    struct error err = {0};
    if (!jobs_is_running(runner->jobs, runner->task))
        return; /* cancelled, or failed already: that is why it was killed */
    metrics_add(runner->metrics, &runner->metrics->job_crashes);
    bool own_doing = quarantine_counts(signal);
    if (own_doing && quarantine_record(runner->quarantine, runner->input.key, monotonic_ms()))
        log_event(runner->log, LOG_WARNING, "scene quarantined",
                  LOG_TEXT("id", runner->input.request_id), LOG_TEXT("job", runner->id),
                  LOG_NUMBER("signal", signal));
    if (!own_doing && runner->attempts < ATTEMPTS_MAX) {
        log_job(runner, LOG_WARNING, "job lost its process", "it is tried again");
        if (jobs_put_back(runner->jobs, runner->task, &runner->input))
            return;
    }
    error_fault(&err, STATUS_WORKER_CRASHED, NULL,
                "the job's process died of signal %d (%s), in %d of %d attempts", signal,
                signal > 0 ? strsignal(signal) : "none", runner->attempts, ATTEMPTS_MAX);
    fail(runner, &err);
}

static void reap(struct job_runner *runner) {
    siginfo_t ended = {0};
    int wait_status = 0;
    if (runner->pid <= 0 ||
        waitid(P_PID, (id_t)runner->pid, &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        ended.si_pid != runner->pid)
        return;
    read_messages(runner); /* what it said before it died still counts */
    if (waitpid(runner->pid, &wait_status, 0) != runner->pid)
        return;
    bool answered = runner->state == LEAVING;
    log_event(runner->log, LOG_INFO, "job process ended", LOG_TEXT("job", runner->id),
              LOG_NUMBER("pid", runner->pid),
              LOG_NUMBER("signal", WIFSIGNALED(wait_status) ? WTERMSIG(wait_status) : 0),
              LOG_NUMBER("exit", WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 0));
    if (!answered)
        lost(runner, wait_status);
    close(runner->socket); /* which also takes it out of epoll */
    task_input_finish(&runner->input);
    runner->state = ABSENT;
    runner->socket = -1;
    runner->pid = 0;
    runner->timer_ms = INFINITY;
}

static void run_timer(struct job_runner *runner) {
    struct error err = {0};
    if (monotonic_ms() < runner->timer_ms)
        return;
    runner->timer_ms = INFINITY;
    if (runner->state == ABSENT)
        return;
    if (runner->state == WORKING) {
        error_fault(&err, STATUS_DEADLINE, NULL, "not done within %.0f s",
                    runner->options.timeout_ms * 1e-3);
        fail(runner, &err);
    }
    kill_process(runner);
}

void job_runner_run(struct job_runner *runner) {
    struct epoll_event events[EVENTS_AT_ONCE];
    uint64_t drained;
    if (epoll_wait(runner->epoll, events, EVENTS_AT_ONCE, 0) > 0 &&
        read(runner->jobs->wake, &drained, sizeof drained) < 0 && errno != EAGAIN)
        log_event(runner->log, LOG_ERROR, "job runner", LOG_TEXT("why", strerror(errno)));
    read_messages(runner);
    if (runner->state == WORKING && !jobs_is_running(runner->jobs, runner->task)) {
        log_job(runner, LOG_INFO, "job cancelled", "");
        kill_process(runner);
    }
    /* Where it has answered or is dying nothing more is heard: its end comes with SIGCHLD. */
    if (runner->state == LEAVING || runner->state == DYING)
        epoll_ctl(runner->epoll, EPOLL_CTL_DEL, runner->socket, NULL);
    reap(runner);
    run_timer(runner);
    jobs_expire(runner->jobs, jobs_time_now());
    if (runner->state == ABSENT && isinf(runner->timer_ms))
        start_next(runner);
}

double job_runner_due_ms(struct job_runner *runner) {
    return fmin(runner->timer_ms, jobs_due_ms(runner->jobs));
}

int job_runner_fd(const struct job_runner *runner) {
    return runner->epoll;
}

bool job_runner_is_idle(const struct job_runner *runner) {
    return runner->state == ABSENT;
}

enum status job_runner_create(const struct job_runner_options *options, struct jobs *jobs,
                              const struct log *log, struct metrics *metrics,
                              struct quarantine *quarantine, struct job_runner **out,
                              struct error *err) {
    *out = NULL;
    struct job_runner *runner = calloc(1, sizeof *runner);
    if (!runner)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the job runner");
    *runner = (struct job_runner){.options = *options,
                                  .jobs = jobs,
                                  .log = log,
                                  .metrics = metrics,
                                  .quarantine = quarantine,
                                  .state = ABSENT,
                                  .socket = -1,
                                  .timer_ms = INFINITY};
    task_input_init(&runner->input);
    runner->epoll = epoll_create1(EPOLL_CLOEXEC);
    struct epoll_event watch = {.events = EPOLLIN};
    if (runner->epoll < 0 || epoll_ctl(runner->epoll, EPOLL_CTL_ADD, jobs->wake, &watch) != 0) {
        error_fault(err, STATUS_IO_ERROR, NULL, "the job runner does not start: %s",
                    strerror(errno));
        job_runner_destroy(runner);
        return STATUS_IO_ERROR;
    }
    *out = runner;
    return STATUS_OK;
}

void job_runner_destroy(struct job_runner *runner) {
    if (!runner)
        return;
    if (runner->pid > 0) {
        kill(runner->pid, SIGKILL);
        waitpid(runner->pid, NULL, 0);
    }
    if (runner->socket >= 0)
        close(runner->socket);
    if (runner->epoll >= 0)
        close(runner->epoll);
    task_input_finish(&runner->input);
    free(runner);
}
