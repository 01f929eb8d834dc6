/* The store of long work: what /v1/jobs shows, and the states that it goes through.
 *
 * Two words that are never mixed: over HTTP, and in the names of these files, a *job* is long work
 * under /v1/jobs. In the code one of them is a `struct task`; `struct job` (job.h) is one picture
 * that a worker draws while its client waits.
 *
 * A task is QUEUED, then RUNNING (one at a time), then DONE, FAILED or CANCELLED; jobs.c has the
 * table. What it made is kept in sealed memory files until it is deleted, until `keep_ms` is over,
 * or until others need the room: those that finished first go first. The store knows no process:
 * job_runner.h runs what jobs_start() hands out.
 *
 * Every function may be called from any thread, and none blocks: the lock is held for a walk along
 * the list at most. Time is the caller's to tell, so that tests can make it up. */
#ifndef PELT_SERVICE_JOBS_H
#define PELT_SERVICE_JOBS_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/status.h"
#include "service/job.h"

enum task_state {
    TASK_QUEUED,
    TASK_RUNNING,
    TASK_DONE,
    TASK_FAILED,
    TASK_CANCELLED,
    TASK_STATES,
    TASK_GONE = TASK_STATES /* not a state: it leaves the store */
};
const char *task_state_name(enum task_state state); /* as GET /v1/jobs/ID tells it */

enum {
    JOBS_ID_BYTES = 33,      /* 128 random bits in hexadecimal, and the terminating 0 */
    JOBS_FINISHED_MAX = 256, /* kept at once, whatever they hold */
    JOBS_EXPIRED_MAX = 1024, /* ids of which it can be told that they were there */
    TASK_OUTPUTS_MAX = 16,
    TASK_PARTS_MAX = 4096,   /* of one output */
    TASK_PART_NAME_MAX = 32, /* with the terminating 0 */
    TASK_NAME_MAX = 64,      /* of an output, a media type, a phase; with the terminating 0 */
    TASK_OPTIONS_MAX = 1024
};

/* What a task works on. Owned by whoever holds it; task_input_finish() closes and frees. */
struct task_input {
    int kind;                       /* index among task_kinds */
    char options[TASK_OPTIONS_MAX]; /* NAME=VALUE lines, as the kind takes them */
    char request_id[JOB_REQUEST_ID_MAX];
    int scene_fd; /* sealed memory file; -1: none */
    size_t scene_bytes;
    size_t asset_count;
    struct job_asset *assets;
    unsigned char key[DIGEST_BYTES]; /* of scene and assets, for the quarantine */
    size_t held_bytes;               /* that this input costs the front */
};
void task_input_init(struct task_input *input);
void task_input_finish(struct task_input *input);

/* A piece of an output that has a name of its own: a frame of a sequence. */
struct task_part {
    char name[TASK_PART_NAME_MAX];
    size_t offset, bytes;
};

struct task_output {
    char name[TASK_NAME_MAX], media_type[TASK_NAME_MAX];
    int fd; /* sealed memory file */
    size_t bytes;
    bool grows; /* bytes and parts are added to it while the task runs: it can be read meanwhile */
    size_t part_count, part_room;
    struct task_part *parts; /* the store's */
};

/* Appends a part; false where memory ran out. */
bool task_output_add_part(struct task_output *output, const struct task_part *part);

struct jobs_time {
    double ms;     /* monotonic */
    double unix_s; /* of the calendar */
};
struct jobs_time jobs_time_now(void);

struct task {
    struct task *next; /* in the order of submission */
    uint64_t serial;   /* its name inside the daemon; ids go outside */
    char id[JOBS_ID_BYTES];
    int kind;
    char request_id[JOB_REQUEST_ID_MAX];
    enum task_state state;
    struct task_input input; /* only while it is queued */
    size_t held_bytes;       /* of its input, until it is finished */
    int attempts;            /* processes it was given to */
    uint64_t done, total;    /* progress; total 0: not known yet */
    char what[TASK_NAME_MAX];
    struct jobs_time created, started, finished; /* ms 0: not yet */
    struct error error;                          /* of one that failed */
    size_t output_count, output_bytes;
    struct task_output outputs[TASK_OUTPUTS_MAX];
};

struct jobs_limits {
    int queue;         /* tasks that may wait */
    size_t keep_bytes; /* of outputs; and, apart from those, of the inputs of what waits */
    double keep_ms;
};

struct jobs_view {
    int queued, running, finished;
    uint64_t done, failed, cancelled, expired, retried; /* so far */
    uint64_t ran;                                       /* tasks that ran and ended */
    double ran_s;                                       /* how long they ran, all together */
    size_t output_bytes;
};

struct jobs {
    struct jobs_limits limits;
    int wake; /* eventfd: something was submitted or deleted */

    /* Guards everything below. */
    pthread_mutex_t lock;
    struct task *first;
    struct jobs_follower *followers;
    uint64_t last_serial;
    size_t held_bytes; /* of all inputs */
    struct jobs_view view;
    bool closed;
    double service_ms; /* running mean of what a task takes */
    char expired[JOBS_EXPIRED_MAX][JOBS_ID_BYTES];
    size_t expired_next;
};

int jobs_init(struct jobs *jobs, const struct jobs_limits *limits); /* 0, or an errno */
void jobs_finish(struct jobs *jobs);

/* Puts a task at the end. STATUS_OK: `input` is moved, `id` is its name. Otherwise the input stays
 * the caller's, and *retry_after_s is set where a later attempt may succeed: STATUS_QUEUE_FULL,
 * STATUS_SHUTTING_DOWN, STATUS_SCENE_TOO_LARGE, STATUS_OUT_OF_MEMORY, STATUS_INTERNAL (no random
 * numbers). */
enum status jobs_submit(struct jobs *jobs, struct task_input *input, struct jobs_time now,
                        char id[JOBS_ID_BYTES], double *retry_after_s, struct error *err);

/* ---- for the one who runs them; each returns false where that task is not (or no more) running,
 * and does nothing then ---- */

/* Takes the first one that waits; its input becomes the caller's. False: none waits, or one runs.
 */
bool jobs_start(struct jobs *jobs, struct jobs_time now, uint64_t *serial, char id[JOBS_ID_BYTES],
                int *attempts, struct task_input *input);
bool jobs_is_running(struct jobs *jobs, uint64_t serial);
bool jobs_progress(struct jobs *jobs, uint64_t serial, const char *what, uint64_t done,
                   uint64_t total);

/* Adds a named output; `output->fd` is the store's after STATUS_OK. STATUS_TOO_COMPLEX where the
 * outputs of this one task are more than is kept of all; STATUS_INTERNAL for a name that is there
 * already, or one too many; STATUS_CANCELLED where it does not run. */
enum status jobs_output(struct jobs *jobs, uint64_t serial, const struct task_output *output,
                        struct jobs_time now, struct error *err);
/* The output that grows has `total` bytes now, and where `part` is not NULL a part more, which lies
 * within them. STATUS_TOO_COMPLEX and STATUS_CANCELLED as above; STATUS_INTERNAL where none grows,
 * it has become shorter, or has too many parts; STATUS_OUT_OF_MEMORY. */
enum status jobs_grow(struct jobs *jobs, uint64_t serial, const struct task_part *part,
                      size_t total, struct jobs_time now, struct error *err);
bool jobs_done(struct jobs *jobs, uint64_t serial, struct jobs_time now);
bool jobs_fail(struct jobs *jobs, uint64_t serial, struct error *why, struct jobs_time now);
/* Its process was lost: it waits again, before all others, without what it has made so far. Moves
 * the input back. */
bool jobs_put_back(struct jobs *jobs, uint64_t serial, struct task_input *input);

/* ---- for those who ask ---- */

/* STATUS_NOT_FOUND; STATUS_GONE for one that has expired. `look` is called with the lock held. */
enum status jobs_look(struct jobs *jobs, const char *id, struct jobs_time now,
                      void (*look)(void *user, const struct task *task), void *user,
                      struct error *err);
void jobs_look_at_all(struct jobs *jobs, struct jobs_time now,
                      void (*look)(void *user, const struct task *task), void *user);

/* Someone who reads an output while it grows. `wake` is called, with the lock held and once, when
 * the task has come further or has ended in any way. */
struct jobs_follower {
    struct jobs_follower *next;
    bool waits;
    void (*wake)(void *user);
    void *user;
};

/* jobs_look(), and where `look` returns true the follower waits. Whoever has waited calls
 * jobs_unfollow() before the follower goes, woken or not. */
enum status jobs_follow(struct jobs *jobs, const char *id, struct jobs_time now,
                        bool (*look)(void *user, const struct task *task), void *user,
                        struct jobs_follower *follower, struct error *err);
void jobs_unfollow(struct jobs *jobs, struct jobs_follower *follower);

/* Cancels one that waits or runs; drops a finished one. STATUS_NOT_FOUND (also for one that was
 * cancelled before), STATUS_GONE. `*was`: the state in which it was. */
enum status jobs_delete(struct jobs *jobs, const char *id, struct jobs_time now,
                        enum task_state *was, struct error *err);

void jobs_expire(struct jobs *jobs, struct jobs_time now);
double jobs_due_ms(struct jobs *jobs); /* monotonic: when the next one expires; INFINITY: never */

/* Cancels everything and refuses what comes from now on. Returns how many were cancelled. */
int jobs_close(struct jobs *jobs, struct jobs_time now);
struct jobs_view jobs_view(struct jobs *jobs);

#endif
