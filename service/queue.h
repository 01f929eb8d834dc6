/* The bounded queue of jobs that wait for a worker: first come, first served; a job that lost its
 * worker goes to the front again. While a job waits, its client is watched: one that leaves takes
 * its place with it.
 *
 * HTTP threads put jobs in, the main thread takes them out: every function may be called from any
 * thread, none blocks, and no lock is held while a job's `finished` runs. */
#ifndef PELT_SERVICE_QUEUE_H
#define PELT_SERVICE_QUEUE_H

#include <pthread.h>
#include <stdbool.h>

#include "service/job.h"

struct queue {
    int limit;
    int epoll;      /* where clients are watched; not owned */
    uint64_t tag;   /* goes into the upper bits of their events, the job's id below */
    double wait_ms; /* how long a job may wait for its first worker */

    /* Guards what follows; held for a walk along the list at most. */
    pthread_mutex_t lock;
    struct job *first, *last;
    int length;
    uint64_t last_id;
    bool closed;
    int workers, busy; /* as queue_set_pace() said */
    double service_ms; /* running mean of what a job takes in a worker */
};

/* 0, or an errno. */
int queue_init(struct queue *queue, int limit, double wait_ms, int workers, int epoll,
               uint64_t tag);
void queue_finish(struct queue *queue);

/* Puts a job in and watches its client; it is the queue's from then on. Otherwise it stays the
 * caller's, job->error tells why, and job->retry_after_s is set where a later attempt may succeed:
 * STATUS_QUEUE_FULL, STATUS_SHUTTING_DOWN, STATUS_IO_ERROR. `ahead`: to the front, and without
 * regard to the limit. */
enum status queue_submit(struct queue *queue, struct job *job, bool ahead);

void queue_put_back(struct queue *queue, struct job *job);   /* one that was taken, to the front */
struct job *queue_take(struct queue *queue);                 /* the first one; NULL: empty */
struct job *queue_take_id(struct queue *queue, uint64_t id); /* NULL: it does not wait */

/* A job that has waited too long by `now_ms`, with retry_after_s set; NULL: none. One that had a
 * worker may wait until its run deadline. */
struct job *queue_take_expired(struct queue *queue, double now_ms);
double queue_due_ms(struct queue *queue); /* when the next one expires; INFINITY: never */

int queue_length(struct queue *queue);
void queue_close(struct queue *queue); /* refuses every job from now on */

/* How many workers are at work, for Retry-After. */
void queue_set_busy(struct queue *queue, int busy);
/* A job took this long in a worker. */
void queue_learn(struct queue *queue, double service_ms);

/* Ends the watch over a job's client and calls its `finished`. Not for one that is in the queue. */
void queue_end_job(struct queue *queue, struct job *job);

#endif
