/* Workers as state machines: what each event does to a worker in each state, and to the job it has.
 * workers.c holds the table. Main thread only, except where the queue and the log say otherwise. */
#ifndef PELT_SERVICE_WORKERS_H
#define PELT_SERVICE_WORKERS_H

#include <stdbool.h>
#include <sys/types.h>

#include "service/ipc.h"
#include "service/job.h"
#include "service/log.h"
#include "service/metrics.h"
#include "service/quarantine.h"
#include "service/queue.h"
#include "service/worker_process.h"

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
    EVENT_BROKEN, /* message: one that breaks the protocol; without: the socket was closed */
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

struct workers {
    struct worker_command command;
    double timeout_ms; /* how long a job may run, its retry included */
    const struct log *log;
    struct metrics *metrics;
    struct quarantine *quarantine;
    struct queue *queue; /* where jobs go back to, and are ended */
    int epoll;           /* where their sockets are watched */
    uint64_t tag;        /* in the upper bits of those events, the worker's index below */
    int count;
    struct worker *list;

    /* What became of them. */
    bool ever_ready;
    struct ipc_ready ready; /* what the worker that last became ready said */
    double last_success_ms; /* monotonic */
    struct error failure;   /* set where they cannot be started at all */
};

/* Every worker is WORKER_DOWN, with its timer due. 0; -1: no memory. The rest of `*workers` is the
 * caller's to fill in. */
int workers_init(struct workers *workers, int count);
void workers_finish(struct workers *workers); /* the processes must have been reaped */

/* Something happens to a worker. `occasion` may be NULL where nothing comes with it. */
void workers_event(struct workers *workers, struct worker *worker, enum worker_event event,
                   struct occasion *occasion);

/* Ends a job that no worker has with a failure. */
void workers_fail_job(struct workers *workers, struct job *job, enum status status,
                      const char *text);

#endif
