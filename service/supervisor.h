/* Gives jobs to worker processes and stands up for them: starts and replaces workers, ends those
 * past their limit, retries after a crash, quarantines scenes that crash, cancels what nobody waits
 * for.
 *
 * supervisor_submit() and supervisor_view() may be called from any thread; everything else from the
 * main thread, which made it. */
#ifndef PELT_SERVICE_SUPERVISOR_H
#define PELT_SERVICE_SUPERVISOR_H

#include <stdbool.h>

#include "api/status.h"
#include "service/ipc.h"
#include "service/job.h"
#include "service/log.h"
#include "service/metrics.h"
#include "service/quarantine.h"
#include "service/worker_process.h"

struct supervisor_options {
    struct worker_command command;
    int queue_limit;
    double timeout_ms; /* how long a job may run (its retry included), and how long it may wait */
};

struct supervisor;

/* Starts the workers; does not wait for them. STATUS_OUT_OF_MEMORY, STATUS_IO_ERROR. The log, the
 * metrics and the quarantine stay the caller's and outlive the supervisor. */
enum status supervisor_create(const struct supervisor_options *options, const struct log *log,
                              struct metrics *metrics, struct quarantine *quarantine,
                              struct supervisor **supervisor, struct error *err);

/* Closes the workers' sockets, waits up to `grace_ms` for them to end, and kills the rest. Jobs
 * that are still there finish with STATUS_SHUTTING_DOWN, and so do those submitted from now on. */
void supervisor_stop(struct supervisor *supervisor, double grace_ms);

/* After supervisor_stop(), when no thread submits any more. Takes NULL. */
void supervisor_destroy(struct supervisor *supervisor);

/* Readable when supervisor_run() has something to do. */
int supervisor_fd(const struct supervisor *supervisor);

/* Handles what has happened, reaps children, starts what is due; never blocks. */
void supervisor_run(struct supervisor *supervisor);

/* Monotonic time at which supervisor_run() is due even if nothing happens; INFINITY: never. */
double supervisor_due_ms(struct supervisor *supervisor);

/* A job for a worker, any thread. STATUS_OK: the supervisor owns it until job->finished is called
 * (from the main thread, maybe before this returns). Otherwise it stays the caller's and job->error
 * tells why: STATUS_QUEUE_FULL (retry_after_s is set), STATUS_IO_ERROR. A canary is taken only
 * where a worker is idle. */
enum status supervisor_submit(struct supervisor *supervisor, struct job *job);

struct supervisor_view {
    int workers, starting, idle, busy, down;
    int queue_length, queue_limit;
    double last_success_ms; /* monotonic; 0: none yet */
    bool ever_ready;
    struct ipc_ready ready; /* what the worker that last became ready said, if ever_ready */
};
void supervisor_view(struct supervisor *supervisor, struct supervisor_view *view);

/* True once the workers cannot be started at all: `err` tells why. */
bool supervisor_has_failed(struct supervisor *supervisor, struct error *err);

/* Counts the readers that an orderly shutdown waits for: jobs queued or running. */
int supervisor_jobs(struct supervisor *supervisor);

#endif
