/* The bounded queue of jobs that wait for a worker: first come, first served; a job that lost its
 * worker goes to the front. Has no lock of its own: the supervisor's guards it. */
#ifndef PELT_SERVICE_QUEUE_H
#define PELT_SERVICE_QUEUE_H

#include <stdbool.h>

#include "service/job.h"

struct queue {
    struct job *first, *last;
    int length, limit;
};

bool queue_push(struct queue *queue, struct job *job);       /* false: full */
void queue_push_front(struct queue *queue, struct job *job); /* beyond the limit, if need be */
struct job *queue_pop(struct queue *queue);                  /* NULL: empty */
struct job *queue_find(const struct queue *queue, uint64_t id);
bool queue_remove(struct queue *queue, struct job *job); /* false: not there */

#endif
