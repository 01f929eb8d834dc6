#include "service/queue.h"

#include <stddef.h>

bool queue_push(struct queue *queue, struct job *job) {
    if (queue->length >= queue->limit)
        return false;
    job->next = NULL;
    if (queue->last)
        queue->last->next = job;
    else
        queue->first = job;
    queue->last = job;
    queue->length++;
    return true;
}

void queue_push_front(struct queue *queue, struct job *job) {
    job->next = queue->first;
    queue->first = job;
    if (!queue->last)
        queue->last = job;
    queue->length++;
}

struct job *queue_pop(struct queue *queue) {
    struct job *job = queue->first;
    if (job)
        queue_remove(queue, job);
    return job;
}

struct job *queue_find(const struct queue *queue, uint64_t id) {
    for (struct job *job = queue->first; job; job = job->next)
        if (job->id == id)
            return job;
    return NULL;
}

bool queue_remove(struct queue *queue, struct job *job) {
    struct job *before = NULL;
    for (struct job *at = queue->first; at; before = at, at = at->next) {
        if (at != job)
            continue;
        if (before)
            before->next = job->next;
        else
            queue->first = job->next;
        if (queue->last == job)
            queue->last = before;
        job->next = NULL;
        queue->length--;
        return true;
    }
    return false;
}
