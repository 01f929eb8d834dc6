/* Runs the tasks of the store (jobs.h), one at a time, each in a process of its own that lives as
 * long as its task. Main thread, all of it: the process dies with the thread that spawned it. */
#ifndef PELT_SERVICE_JOB_RUNNER_H
#define PELT_SERVICE_JOB_RUNNER_H

#include <stdbool.h>

#include "api/status.h"
#include "service/jobs.h"
#include "service/log.h"
#include "service/metrics.h"
#include "service/quarantine.h"
#include "service/worker_process.h"

struct job_runner_options {
    struct worker_command command;
    double timeout_ms; /* how long a task may run */
};

struct job_runner;

/* All parts outlive the runner. STATUS_OUT_OF_MEMORY, STATUS_IO_ERROR. */
enum status job_runner_create(const struct job_runner_options *options, struct jobs *jobs,
                              const struct log *log, struct metrics *metrics,
                              struct quarantine *quarantine, struct job_runner **runner,
                              struct error *err);

/* Kills the process that runs and waits for its end. Takes NULL. */
void job_runner_destroy(struct job_runner *runner);

int job_runner_fd(const struct job_runner *runner); /* readable when job_runner_run() has to do */

/* Hears the process, ends it where it is past its limit or not wanted any more, reaps it, starts
 * the next, lets results expire; never blocks. */
void job_runner_run(struct job_runner *runner);
double job_runner_due_ms(struct job_runner *runner);      /* monotonic; INFINITY: never */
bool job_runner_is_idle(const struct job_runner *runner); /* there is no process */

#endif
