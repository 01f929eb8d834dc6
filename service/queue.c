/* The queue as a list under one lock; queue.h says who watches the clients that wait in it. */
#include "service/queue.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <string.h>
#include <sys/epoll.h>

#include "service/monotonic.h"

/* Until the first picture says what is usual on this machine. */
static const double service_guess_ms = 200;
enum { RETRY_AFTER_MAX_S = 600 };

int queue_init(struct queue *queue, int limit, double wait_ms, int workers, int epoll,
               uint64_t tag) {
    *queue = (struct queue){.limit = limit,
                            .epoll = epoll,
                            .tag = tag,
                            .wait_ms = wait_ms,
                            .workers = workers,
                            .service_ms = service_guess_ms};
    return pthread_mutex_init(&queue->lock, NULL);
}

void queue_finish(struct queue *queue) {
    pthread_mutex_destroy(&queue->lock);
}

/* Seconds until what waits and runs now has been worked off. With the lock held. */
static double retry_after_s(const struct queue *queue) {
    double jobs = queue->length + queue->busy + 1;
    double seconds = ceil(queue->service_ms * jobs / queue->workers * 1e-3);
    return fmin(fmax(seconds, 1), RETRY_AFTER_MAX_S);
}

static void push_front(struct queue *queue, struct job *job) {
    job->next = queue->first;
    queue->first = job;
    if (!queue->last)
        queue->last = job;
    queue->length++;
}

static void push_back(struct queue *queue, struct job *job) {
    job->next = NULL;
    if (queue->last)
        queue->last->next = job;
    else
        queue->first = job;
    queue->last = job;
    queue->length++;
}

/* Takes `*link` out, the pointer that leads to a job; `before` is the job that holds it, or NULL.
 */
static struct job *unlink_job(struct queue *queue, struct job **link, struct job *before) {
    struct job *job = *link;
    *link = job->next;
    if (queue->last == job)
        queue->last = before;
    job->next = NULL;
    queue->length--;
    return job;
}

enum status queue_submit(struct queue *queue, struct job *job, bool ahead) {
    enum status status = STATUS_OK;
    pthread_mutex_lock(&queue->lock);
    job->id = ++queue->last_id;
    job->queued_ms = monotonic_ms();
    /* Watched before it can be taken, so that whoever ends the job always finds the watch. */
    struct epoll_event watch = {.events = EPOLLRDHUP | EPOLLONESHOT,
                                .data.u64 = queue->tag | job->id};
    if (queue->closed) {
        job->retry_after_s = 1; /* another server, or this one's successor */
        status = error_fault(&job->error, STATUS_SHUTTING_DOWN, NULL, "the server was stopped");
    } else if (!ahead && queue->length >= queue->limit) {
        job->retry_after_s = retry_after_s(queue);
        status = error_fault(&job->error, STATUS_QUEUE_FULL, NULL, "%d requests are waiting",
                             queue->length);
    } else if (job->client_fd >= 0 &&
               epoll_ctl(queue->epoll, EPOLL_CTL_ADD, job->client_fd, &watch) != 0) {
        status = error_fault(&job->error, STATUS_IO_ERROR, NULL, "watching the client: %s",
                             strerror(errno));
    } else if (ahead) {
        push_front(queue, job);
    } else {
        push_back(queue, job);
    }
    pthread_mutex_unlock(&queue->lock);
    return status;
}

void queue_put_back(struct queue *queue, struct job *job) {
    pthread_mutex_lock(&queue->lock);
    push_front(queue, job);
    pthread_mutex_unlock(&queue->lock);
}

struct job *queue_take(struct queue *queue) {
    pthread_mutex_lock(&queue->lock);
    struct job *job = queue->first ? unlink_job(queue, &queue->first, NULL) : NULL;
    pthread_mutex_unlock(&queue->lock);
    return job;
}

struct job *queue_take_id(struct queue *queue, uint64_t id) {
    struct job *found = NULL, *before = NULL;
    pthread_mutex_lock(&queue->lock);
    for (struct job **link = &queue->first; *link && !found; link = &before->next) {
        if ((*link)->id == id) {
            found = unlink_job(queue, link, before);
            break;
        }
        before = *link;
    }
    pthread_mutex_unlock(&queue->lock);
    return found;
}

static double expires_ms(const struct queue *queue, const struct job *job) {
    return job->attempts > 0 ? job->run_deadline_ms : job->queued_ms + queue->wait_ms;
}

struct job *queue_take_expired(struct queue *queue, double now_ms) {
    struct job *found = NULL, *before = NULL;
    pthread_mutex_lock(&queue->lock);
    for (struct job **link = &queue->first; *link; link = &before->next) {
        if (expires_ms(queue, *link) <= now_ms) {
            found = unlink_job(queue, link, before);
            found->retry_after_s = retry_after_s(queue);
            break;
        }
        before = *link;
    }
    pthread_mutex_unlock(&queue->lock);
    return found;
}

double queue_due_ms(struct queue *queue) {
    double due = INFINITY;
    pthread_mutex_lock(&queue->lock);
    for (const struct job *job = queue->first; job; job = job->next)
        due = fmin(due, expires_ms(queue, job));
    pthread_mutex_unlock(&queue->lock);
    return due;
}

int queue_length(struct queue *queue) {
    pthread_mutex_lock(&queue->lock);
    int length = queue->length;
    pthread_mutex_unlock(&queue->lock);
    return length;
}

void queue_close(struct queue *queue) {
    pthread_mutex_lock(&queue->lock);
    queue->closed = true;
    pthread_mutex_unlock(&queue->lock);
}

void queue_set_busy(struct queue *queue, int busy) {
    pthread_mutex_lock(&queue->lock);
    queue->busy = busy;
    pthread_mutex_unlock(&queue->lock);
}

void queue_learn(struct queue *queue, double service_ms) {
    pthread_mutex_lock(&queue->lock);
    /* A fifth of the way: the mean of about the last ten. */
    queue->service_ms += (service_ms - queue->service_ms) * 0.2;
    pthread_mutex_unlock(&queue->lock);
}

void queue_end_job(struct queue *queue, struct job *job) {
    if (job->client_fd >= 0)
        epoll_ctl(queue->epoll, EPOLL_CTL_DEL, job->client_fd, NULL);
    job->finished(job);
}
