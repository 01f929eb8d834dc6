/* `pelt serve`: puts the parts of the daemon together and runs its main loop.
 *
 *   front (this process)                              workers
 *     main thread: signals, supervisor, deadlines       pelt worker: one GL context each,
 *     2 HTTP threads: bodies, validation, replies       single-threaded but for llvmpipe
 *                                                     at most one task
 *                                                       pelt job: ends with its task
 *
 * The front opens no GL and parses no asset. A request goes: HTTP thread reads and validates it and
 * submits a job, its connection is suspended; the main thread hands the job to a worker, and
 * resumes the connection when the worker has answered, died, or run out of time; an HTTP thread
 * replies.
 *
 * Long work (jobs.h) has neither a waiting connection nor a worker: job_runner.c gives it a process
 * of its own. A signal to stop cancels it.
 *
 * Signals are blocked in every thread and read from a descriptor, so no code runs in a handler. */
#include "service/serve.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "service/http.h"
#include "service/job_runner.h"
#include "service/monotonic.h"
#include "service/notify.h"
#include "service/serve_options.h"

enum { WORKER_GRACE_MS = 2000 };

struct server {
    struct serve_options options;
    struct log log;
    struct metrics metrics;
    struct quarantine quarantine;
    struct supervisor *supervisor;
    struct jobs jobs;
    struct job_runner *runner;
    struct store *store;
    struct http *http;
    int signals; /* signalfd */
    int stop_signals;
    bool announced, draining;
};

static int print_error(const struct error *err) {
    for (size_t i = 0; i < err->fault_count; i++)
        fprintf(stderr, "pelt serve: %s\n", err->faults[i].message ? err->faults[i].message : "");
    if (err->fault_count == 0)
        fprintf(stderr, "pelt serve: %s\n", status_title(err->status));
    return status_exit_code(err->status);
}

/* SIGCHLD wakes the loop for the supervisor; SIGPIPE would end the process when a client left. */
static int block_signals(void) {
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGCHLD);
    if (signal(SIGPIPE, SIG_IGN) == SIG_ERR || sigprocmask(SIG_BLOCK, &set, NULL) != 0)
        return -1;
    return signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
}

/* Each connection costs a descriptor, each waiting request one more for its scene and for each of
 * its assets; the usual soft limit of 1024 is too low, the hard one is not. */
static void raise_descriptor_limit(void) {
    struct rlimit limit;
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return;
    rlim_t wanted = 65536;
    if (limit.rlim_max != RLIM_INFINITY && wanted > limit.rlim_max)
        wanted = limit.rlim_max;
    if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur < wanted) {
        limit.rlim_cur = wanted;
        setrlimit(RLIMIT_NOFILE, &limit); /* where it fails the old one stands */
    }
}

static enum status server_start(struct server *server, struct error *err) {
    const struct serve_options *options = &server->options;
    struct supervisor_options supervision = {
        .command = {.renderer = options->renderer, .workers = options->workers},
        .queue_limit = options->queue,
        .timeout_ms = options->timeout_ms,
    };
    enum status status = store_create(options->assets, &server->store, err);
    if (status == STATUS_OK)
        status = supervisor_create(&supervision, &server->log, &server->metrics,
                                   &server->quarantine, &server->supervisor, err);
    struct job_runner_options running = {.command = supervision.command,
                                         .timeout_ms = options->job_timeout_s * 1e3};
    if (status == STATUS_OK)
        status = job_runner_create(&running, &server->jobs, &server->log, &server->metrics,
                                   &server->quarantine, &server->runner, err);
    if (status != STATUS_OK)
        return status;
    struct http_options http = {
        .listen = options->listen,
        .body_bytes_max = (size_t)options->body_mib << 20,
        .receive_ms = options->receive_timeout_ms,
        .timeout_ms = options->timeout_ms,
        .job_timeout_ms = running.timeout_ms,
        .connections = options->connections,
    };
    struct http_parts parts = {.supervisor = server->supervisor,
                               .store = server->store,
                               .jobs = &server->jobs,
                               .quarantine = &server->quarantine,
                               .metrics = &server->metrics,
                               .log = &server->log};
    return http_create(&http, &parts, &server->http, err);
}

static void read_signals(struct server *server) {
    struct signalfd_siginfo info;
    while (read(server->signals, &info, sizeof info) == (ssize_t)sizeof info)
        server->stop_signals += info.ssi_signo == SIGTERM || info.ssi_signo == SIGINT;
    if (server->stop_signals > 0 && !server->draining) {
        server->draining = true;
        int cancelled = jobs_close(&server->jobs, jobs_time_now());
        log_event(&server->log, LOG_INFO, "stopping",
                  LOG_NUMBER("in_flight", http_in_flight(server->http)),
                  LOG_NUMBER("jobs_cancelled", cancelled));
        if (notify_send("STOPPING=1") != 0)
            log_event(&server->log, LOG_WARNING, "notify", LOG_TEXT("why", strerror(errno)));
        http_drain(server->http);
    }
}

/* Once the first worker is ready: the one line on stdout, and systemd. */
static void announce(struct server *server) {
    struct supervisor_view view;
    supervisor_view(server->supervisor, &view);
    if (!view.ever_ready)
        return;
    server->announced = true;
    printf("pelt: listening on http://%s\n", http_address(server->http));
    fflush(stdout);
    log_event(&server->log, LOG_INFO, "ready", LOG_TEXT("address", http_address(server->http)),
              LOG_NUMBER("workers", view.workers), LOG_TEXT("renderer", view.ready.gl_renderer));
    if (notify_send("READY=1") != 0)
        log_event(&server->log, LOG_WARNING, "notify", LOG_TEXT("why", strerror(errno)));
}

static bool is_finished(struct server *server) {
    if (server->stop_signals > 1)
        return true;
    return server->draining && supervisor_jobs(server->supervisor) == 0 &&
           job_runner_is_idle(server->runner) && http_in_flight(server->http) == 0;
}

/* While draining, replies are sent by the HTTP threads, which do not wake this one: look this
 * often. */
enum { DRAIN_LOOK_MS = 20 };

static enum status server_run(struct server *server, struct error *err) {
    while (!is_finished(server)) {
        double now = monotonic_ms();
        double due = fmin(supervisor_due_ms(server->supervisor), http_due_ms(server->http, now));
        due = fmin(due, job_runner_due_ms(server->runner));
        double wait_ms = fmin(fmax(ceil(due - now), 0), 60000);
        if (server->draining)
            wait_ms = fmin(wait_ms, DRAIN_LOOK_MS);
        struct pollfd watched[] = {{server->signals, POLLIN, 0},
                                   {supervisor_fd(server->supervisor), POLLIN, 0},
                                   {job_runner_fd(server->runner), POLLIN, 0}};
        if (poll(watched, 3, (int)wait_ms) < 0 && errno != EINTR)
            return error_fault(err, STATUS_INTERNAL, NULL, "poll: %s", strerror(errno));
        read_signals(server);
        supervisor_run(server->supervisor);
        job_runner_run(server->runner);
        http_expire(server->http, monotonic_ms());
        if (!server->announced)
            announce(server);
        if (supervisor_has_failed(server->supervisor, err))
            return err->status;
    }
    return server->stop_signals > 1
               ? error_fault(err, STATUS_CANCELLED, NULL, "ended by a second signal")
               : STATUS_OK;
}

int serve_main(int argc, char **argv) {
    struct server server = {.signals = -1};
    struct error err = {0};
    int code;
    if (serve_options_read(argc, argv, &server.options, &err) != STATUS_OK) {
        code = print_error(&err);
        error_clear(&err);
        return code;
    }
    if (server.options.help) {
        serve_options_help();
        return 0;
    }
    server.log = (struct log){server.options.log, STDERR_FILENO};
    raise_descriptor_limit();
    server.signals = block_signals();
    if (server.signals < 0 || metrics_init(&server.metrics) != 0)
        return status_exit_code(STATUS_INTERNAL);
    if (quarantine_init(&server.quarantine) != 0) {
        metrics_finish(&server.metrics);
        return status_exit_code(STATUS_INTERNAL);
    }
    struct jobs_limits limits = {.queue = server.options.jobs_queue,
                                 .keep_bytes = (size_t)server.options.jobs_keep_mib << 20,
                                 .keep_ms = server.options.jobs_keep_s * 1e3};
    if (jobs_init(&server.jobs, &limits) != 0) {
        quarantine_finish(&server.quarantine);
        metrics_finish(&server.metrics);
        return status_exit_code(STATUS_INTERNAL);
    }
    enum status status = server_start(&server, &err);
    if (status == STATUS_OK)
        status = server_run(&server, &err);
    code = status == STATUS_OK ? 0 : print_error(&err);
    /* Workers first: that ends the jobs which are left (second signal) and so resumes their
     * connections; libmicrohttpd must not be stopped while any is suspended. */
    if (server.supervisor)
        supervisor_stop(server.supervisor, status == STATUS_OK ? WORKER_GRACE_MS : 0);
    job_runner_destroy(server.runner);
    http_destroy(server.http);
    supervisor_destroy(server.supervisor);
    store_destroy(server.store);
    jobs_finish(&server.jobs);
    quarantine_finish(&server.quarantine);
    metrics_finish(&server.metrics);
    close(server.signals);
    if (server.announced)
        log_event(&server.log, LOG_INFO, "stopped", LOG_NUMBER("exit", code));
    error_clear(&err);
    return code;
}
