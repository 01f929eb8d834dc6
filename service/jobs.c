/* The store as a list under one lock, and the table of what each event does to a task in each
 * state:
 *
 *   QUEUED --start--> RUNNING --done--> DONE
 *                             --fail--> FAILED
 *                             --lost--> QUEUED (the runner decides whether to try again)
 *   QUEUED, RUNNING --delete--> CANCELLED
 *   DONE, FAILED --delete--> gone;  DONE, FAILED, CANCELLED --expire--> gone
 *
 * A cancelled task stays to be looked at, so that whoever polls it learns what became of it; to
 * delete it again finds nothing to delete. The list is in the order of submission and short
 * (`--jobs-queue` and JOBS_FINISHED_MAX), so a walk finds everything. */
#include "service/jobs.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

#include "service/monotonic.h"

/* Until the first one says what is usual here. */
static const double service_guess_ms = 60000;
enum { RETRY_AFTER_MAX_S = 600 };

enum event {
    EVENT_START,
    EVENT_PROGRESS,
    EVENT_OUTPUT,
    EVENT_DONE,
    EVENT_FAIL,
    EVENT_LOST,
    EVENT_DELETE,
    EVENT_EXPIRE,
    EVENTS
};

struct occasion { /* what comes with an event */
    struct jobs_time now;
    struct task_input *input;
    const struct task_output *output;
    struct error *error;
    const char *what;
    uint64_t done, total;
    bool refused; /* set where the event means nothing in this state */
};

typedef enum task_state action(struct jobs *jobs, struct task *task, struct occasion *occasion);

static void input_move(struct task_input *to, struct task_input *from) {
    *to = *from;
    task_input_init(from);
}

static void drop_outputs(struct jobs *jobs, struct task *task) {
    for (size_t i = 0; i < task->output_count; i++) {
        close(task->outputs[i].fd);
        free(task->outputs[i].parts);
    }
    jobs->view.output_bytes -= task->output_bytes;
    task->output_count = task->output_bytes = 0;
}

static bool is_finished(const struct task *task) {
    return task->state == TASK_DONE || task->state == TASK_FAILED || task->state == TASK_CANCELLED;
}

/* ---- actions of the table; the lock is held ---- */

static enum task_state act_refuse(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    (void)jobs;
    occasion->refused = true;
    return task->state;
}

static enum task_state act_start(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    (void)jobs;
    input_move(occasion->input, &task->input);
    task->started = occasion->now;
    task->attempts++;
    return TASK_RUNNING;
}

static enum task_state act_progress(struct jobs *jobs, struct task *task,
                                    struct occasion *occasion) {
    (void)jobs;
    task->done = occasion->done;
    task->total = occasion->total;
    snprintf(task->what, sizeof task->what, "%s", occasion->what);
    return TASK_RUNNING;
}

static enum task_state act_output(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    task->outputs[task->output_count++] = *occasion->output;
    task->output_bytes += occasion->output->bytes;
    jobs->view.output_bytes += occasion->output->bytes;
    return TASK_RUNNING;
}

/* Whatever became of it, it is over. */
static void end(struct jobs *jobs, struct task *task, const struct occasion *occasion) {
    task->finished = occasion->now;
    jobs->held_bytes -= task->held_bytes;
    task->held_bytes = 0;
    if (task->state != TASK_RUNNING)
        return;
    double ms = task->finished.ms - task->started.ms;
    jobs->view.ran++;
    jobs->view.ran_s += ms * 1e-3;
    jobs->service_ms += (ms - jobs->service_ms) / 4;
}

static enum task_state act_done(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    end(jobs, task, occasion);
    jobs->view.done++;
    return TASK_DONE;
}

static enum task_state act_fail(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    end(jobs, task, occasion);
    drop_outputs(jobs, task);
    error_move(&task->error, occasion->error);
    jobs->view.failed++;
    return TASK_FAILED;
}

static enum task_state act_lost(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    drop_outputs(jobs, task);
    input_move(&task->input, occasion->input);
    task->done = task->total = 0;
    task->what[0] = 0;
    jobs->view.retried++;
    return TASK_QUEUED;
}

static enum task_state act_cancel(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    end(jobs, task, occasion);
    drop_outputs(jobs, task);
    task_input_finish(&task->input);
    jobs->view.cancelled++;
    return TASK_CANCELLED;
}

static enum task_state act_drop(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    (void)occasion;
    drop_outputs(jobs, task);
    return TASK_GONE;
}

static enum task_state act_expire(struct jobs *jobs, struct task *task, struct occasion *occasion) {
    memcpy(jobs->expired[jobs->expired_next], task->id, sizeof task->id);
    jobs->expired_next = (jobs->expired_next + 1) % JOBS_EXPIRED_MAX;
    jobs->view.expired++;
    return act_drop(jobs, task, occasion);
}

/* The behaviour. Rows: states. Columns: start, progress, output, done, fail, lost, delete, expire.
 */
static action *const table[TASK_STATES][EVENTS] = {
    [TASK_QUEUED] = {act_start, act_refuse, act_refuse, act_refuse, act_refuse, act_refuse,
                     act_cancel, act_refuse},
    [TASK_RUNNING] = {act_refuse, act_progress, act_output, act_done, act_fail, act_lost,
                      act_cancel, act_refuse},
    [TASK_DONE] = {act_refuse, act_refuse, act_refuse, act_refuse, act_refuse, act_refuse, act_drop,
                   act_expire},
    [TASK_FAILED] = {act_refuse, act_refuse, act_refuse, act_refuse, act_refuse, act_refuse,
                     act_drop, act_expire},
    [TASK_CANCELLED] = {act_refuse, act_refuse, act_refuse, act_refuse, act_refuse, act_refuse,
                        act_refuse, act_expire},
};

static void release(struct task *task) {
    task_input_finish(&task->input);
    error_clear(&task->error);
    free(task);
}

static void wake_followers(struct jobs *jobs) {
    for (struct jobs_follower *at = jobs->followers; at; at = at->next) {
        bool waits = at->waits;
        at->waits = false;
        if (waits)
            at->wake(at->user);
    }
}

/* Something happens to a task; false where it means nothing. The task is freed where it goes. */
static bool happen(struct jobs *jobs, struct task *task, enum event event,
                   struct occasion *occasion) {
    enum task_state before = task->state;
    enum task_state next = table[before][event](jobs, task, occasion);
    if (next != before)
        wake_followers(jobs);
    if (next != TASK_GONE) {
        task->state = next;
        return !occasion->refused;
    }
    struct task **link = &jobs->first;
    while (*link != task)
        link = &(*link)->next;
    *link = task->next;
    release(task);
    return true;
}

/* ---- finding, and making room; the lock is held ---- */

static struct task *find_serial(struct jobs *jobs, uint64_t serial) {
    struct task *task = jobs->first;
    while (task && task->serial != serial)
        task = task->next;
    return task;
}

static struct task *find_state(struct jobs *jobs, enum task_state state) {
    struct task *task = jobs->first;
    while (task && task->state != state)
        task = task->next;
    return task;
}

static int count_state(const struct jobs *jobs, enum task_state state) {
    int count = 0;
    for (const struct task *task = jobs->first; task; task = task->next)
        count += task->state == state;
    return count;
}

static int count_finished(const struct jobs *jobs) {
    return count_state(jobs, TASK_DONE) + count_state(jobs, TASK_FAILED) +
           count_state(jobs, TASK_CANCELLED);
}

static struct task *oldest_finished(struct jobs *jobs, bool with_outputs) {
    struct task *oldest = NULL;
    for (struct task *task = jobs->first; task; task = task->next)
        if (is_finished(task) && (task->output_count > 0 || !with_outputs) &&
            (!oldest || task->finished.ms < oldest->finished.ms))
            oldest = task;
    return oldest;
}

/* Lets go what is too old, what is too many, and what `needed` more bytes need. */
static void make_room(struct jobs *jobs, struct jobs_time now, size_t needed) {
    struct occasion occasion = {.now = now};
    struct task *oldest;
    while ((oldest = oldest_finished(jobs, false)) &&
           (now.ms - oldest->finished.ms >= jobs->limits.keep_ms ||
            count_finished(jobs) > JOBS_FINISHED_MAX))
        happen(jobs, oldest, EVENT_EXPIRE, &occasion);
    while (jobs->view.output_bytes + needed > jobs->limits.keep_bytes &&
           (oldest = oldest_finished(jobs, true)))
        happen(jobs, oldest, EVENT_EXPIRE, &occasion);
}

static struct task *find_id(struct jobs *jobs, const char *id, struct jobs_time now,
                            struct error *err) {
    make_room(jobs, now, 0);
    for (struct task *task = jobs->first; task; task = task->next)
        if (strcmp(task->id, id) == 0)
            return task;
    for (size_t i = 0; i < JOBS_EXPIRED_MAX; i++)
        if (*id && strcmp(jobs->expired[i], id) == 0) {
            error_fault(err, STATUS_GONE, NULL, "the job %s has expired", id);
            return NULL;
        }
    error_fault(err, STATUS_NOT_FOUND, NULL, "there is no job %s", id);
    return NULL;
}

static void wake(struct jobs *jobs) {
    uint64_t one = 1;
    ssize_t written = write(jobs->wake, &one, sizeof one);
    (void)written; /* fails only where the counter is full, and then it is readable anyway */
}

/* ---- submission ---- */

static int make_id(char id[JOBS_ID_BYTES]) {
    unsigned char bits[(JOBS_ID_BYTES - 1) / 2];
    if (gnutls_rnd(GNUTLS_RND_RANDOM, bits, sizeof bits) != 0)
        return -1;
    for (size_t i = 0; i < sizeof bits; i++)
        snprintf(id + 2 * i, 3, "%02x", bits[i]);
    return 0;
}

static enum status may_wait(struct jobs *jobs, const struct task_input *input,
                            double *retry_after_s, struct error *err) {
    int waiting = count_state(jobs, TASK_QUEUED);
    int working = waiting + count_state(jobs, TASK_RUNNING);
    double until_s = ceil(jobs->service_ms * fmax(working, 1) * 1e-3);
    *retry_after_s = fmin(fmax(until_s, 1), RETRY_AFTER_MAX_S);
    if (jobs->closed) {
        *retry_after_s = 1; /* another server, or this one's successor */
        return error_fault(err, STATUS_SHUTTING_DOWN, NULL, "the server was stopped");
    }
    if (waiting >= jobs->limits.queue)
        return error_fault(err, STATUS_QUEUE_FULL, NULL, "%d jobs are waiting", waiting);
    if (input->held_bytes > jobs->limits.keep_bytes) {
        *retry_after_s = 0;
        return error_fault(err, STATUS_SCENE_TOO_LARGE, NULL,
                           "a job's scene and assets have at most %zu bytes here",
                           jobs->limits.keep_bytes);
    }
    if (input->held_bytes > jobs->limits.keep_bytes - jobs->held_bytes)
        return error_fault(err, STATUS_QUEUE_FULL, NULL,
                           "the scenes and assets of the jobs that wait are too large together");
    return STATUS_OK;
}

enum status jobs_submit(struct jobs *jobs, struct task_input *input, struct jobs_time now,
                        char id[JOBS_ID_BYTES], double *retry_after_s, struct error *err) {
    *retry_after_s = 0;
    struct task *task = calloc(1, sizeof *task);
    if (!task)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a job");
    if (make_id(task->id) != 0) {
        free(task);
        return error_fault(err, STATUS_INTERNAL, NULL, "no random numbers for the job's id");
    }
    pthread_mutex_lock(&jobs->lock);
    make_room(jobs, now, 0);
    enum status status = may_wait(jobs, input, retry_after_s, err);
    if (status == STATUS_OK) {
        struct task **link = &jobs->first;
        while (*link)
            link = &(*link)->next;
        *link = task;
        task->serial = ++jobs->last_serial;
        task->kind = input->kind;
        task->created = now;
        task->held_bytes = input->held_bytes;
        jobs->held_bytes += input->held_bytes;
        memcpy(task->request_id, input->request_id, sizeof task->request_id);
        memcpy(id, task->id, JOBS_ID_BYTES);
        input_move(&task->input, input);
        *retry_after_s = 0;
    }
    pthread_mutex_unlock(&jobs->lock);
    if (status != STATUS_OK)
        free(task);
    else
        wake(jobs);
    return status;
}

/* ---- running ---- */

bool jobs_start(struct jobs *jobs, struct jobs_time now, uint64_t *serial, char id[JOBS_ID_BYTES],
                int *attempts, struct task_input *input) {
    struct occasion occasion = {.now = now, .input = input};
    pthread_mutex_lock(&jobs->lock);
    struct task *task = find_state(jobs, TASK_RUNNING) ? NULL : find_state(jobs, TASK_QUEUED);
    if (task) {
        happen(jobs, task, EVENT_START, &occasion);
        *serial = task->serial;
        *attempts = task->attempts;
        memcpy(id, task->id, JOBS_ID_BYTES);
    }
    pthread_mutex_unlock(&jobs->lock);
    return task != NULL;
}

static bool happen_to(struct jobs *jobs, uint64_t serial, enum event event,
                      struct occasion *occasion) {
    pthread_mutex_lock(&jobs->lock);
    struct task *task = find_serial(jobs, serial);
    bool meant = task && happen(jobs, task, event, occasion);
    pthread_mutex_unlock(&jobs->lock);
    return meant;
}

bool jobs_is_running(struct jobs *jobs, uint64_t serial) {
    pthread_mutex_lock(&jobs->lock);
    const struct task *task = find_serial(jobs, serial);
    bool running = task && task->state == TASK_RUNNING;
    pthread_mutex_unlock(&jobs->lock);
    return running;
}

bool jobs_progress(struct jobs *jobs, uint64_t serial, const char *what, uint64_t done,
                   uint64_t total) {
    struct occasion occasion = {.what = what, .done = done, .total = total};
    return happen_to(jobs, serial, EVENT_PROGRESS, &occasion);
}

enum status jobs_output(struct jobs *jobs, uint64_t serial, const struct task_output *output,
                        struct jobs_time now, struct error *err) {
    struct occasion occasion = {.now = now, .output = output};
    enum status status = STATUS_OK;
    pthread_mutex_lock(&jobs->lock);
    struct task *task = find_serial(jobs, serial);
    bool again = false;
    for (size_t i = 0; task && i < task->output_count; i++)
        again |= strcmp(task->outputs[i].name, output->name) == 0;
    if (!task || task->state != TASK_RUNNING) {
        status = error_fault(err, STATUS_CANCELLED, NULL, "the job does not run any more");
    } else if (again || task->output_count == TASK_OUTPUTS_MAX) {
        status = error_fault(err, STATUS_INTERNAL, NULL, "the job cannot have a result %s",
                             output->name);
    } else if (output->bytes > jobs->limits.keep_bytes - task->output_bytes) {
        status = error_fault(err, STATUS_TOO_COMPLEX, NULL,
                             "the results are larger than the %zu bytes that this server keeps",
                             jobs->limits.keep_bytes);
    } else {
        make_room(jobs, now, output->bytes);
        happen(jobs, task, EVENT_OUTPUT, &occasion);
    }
    pthread_mutex_unlock(&jobs->lock);
    return status;
}

enum status jobs_grow(struct jobs *jobs, uint64_t serial, const struct task_part *part,
                      size_t total, struct jobs_time now, struct error *err) {
    enum status status = STATUS_OK;
    pthread_mutex_lock(&jobs->lock);
    struct task *task = find_serial(jobs, serial);
    struct task_output *output = NULL;
    for (size_t i = 0; task && i < task->output_count; i++)
        if (task->outputs[i].grows)
            output = &task->outputs[i];
    size_t more = output && total > output->bytes ? total - output->bytes : 0;
    if (!task || task->state != TASK_RUNNING) {
        status = error_fault(err, STATUS_CANCELLED, NULL, "the job does not run any more");
    } else if (!output || total < output->bytes ||
               (part && (output->part_count == TASK_PARTS_MAX || part->offset < output->bytes ||
                         part->offset > total || part->bytes > total - part->offset))) {
        status = error_fault(err, STATUS_INTERNAL, NULL, "the job's result cannot grow so");
    } else if (more > jobs->limits.keep_bytes - task->output_bytes) {
        status = error_fault(err, STATUS_TOO_COMPLEX, NULL,
                             "the results are larger than the %zu bytes that this server keeps",
                             jobs->limits.keep_bytes);
    } else if (part && !task_output_add_part(output, part)) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a result");
    } else {
        make_room(jobs, now, more);
        output->bytes = total;
        task->output_bytes += more;
        jobs->view.output_bytes += more;
        wake_followers(jobs);
    }
    pthread_mutex_unlock(&jobs->lock);
    return status;
}

bool jobs_done(struct jobs *jobs, uint64_t serial, struct jobs_time now) {
    struct occasion occasion = {.now = now};
    return happen_to(jobs, serial, EVENT_DONE, &occasion);
}

bool jobs_fail(struct jobs *jobs, uint64_t serial, struct error *why, struct jobs_time now) {
    struct occasion occasion = {.now = now, .error = why};
    return happen_to(jobs, serial, EVENT_FAIL, &occasion);
}

bool jobs_put_back(struct jobs *jobs, uint64_t serial, struct task_input *input) {
    struct occasion occasion = {.input = input};
    return happen_to(jobs, serial, EVENT_LOST, &occasion);
}

/* ---- asking ---- */

enum status jobs_look(struct jobs *jobs, const char *id, struct jobs_time now,
                      void (*look)(void *user, const struct task *task), void *user,
                      struct error *err) {
    pthread_mutex_lock(&jobs->lock);
    const struct task *task = find_id(jobs, id, now, err);
    if (task)
        look(user, task);
    pthread_mutex_unlock(&jobs->lock);
    return task ? STATUS_OK : err->status;
}

enum status jobs_follow(struct jobs *jobs, const char *id, struct jobs_time now,
                        bool (*look)(void *user, const struct task *task), void *user,
                        struct jobs_follower *follower, struct error *err) {
    pthread_mutex_lock(&jobs->lock);
    const struct task *task = find_id(jobs, id, now, err);
    if (task && look(user, task)) {
        bool listed = false;
        for (const struct jobs_follower *at = jobs->followers; at; at = at->next)
            listed |= at == follower;
        if (!listed) {
            follower->next = jobs->followers;
            jobs->followers = follower;
        }
        follower->waits = true;
    }
    pthread_mutex_unlock(&jobs->lock);
    return task ? STATUS_OK : err->status;
}

void jobs_unfollow(struct jobs *jobs, struct jobs_follower *follower) {
    pthread_mutex_lock(&jobs->lock);
    for (struct jobs_follower **link = &jobs->followers; *link; link = &(*link)->next)
        if (*link == follower) {
            *link = follower->next;
            break;
        }
    pthread_mutex_unlock(&jobs->lock);
}

void jobs_look_at_all(struct jobs *jobs, struct jobs_time now,
                      void (*look)(void *user, const struct task *task), void *user) {
    pthread_mutex_lock(&jobs->lock);
    make_room(jobs, now, 0);
    for (const struct task *task = jobs->first; task; task = task->next)
        look(user, task);
    pthread_mutex_unlock(&jobs->lock);
}

enum status jobs_delete(struct jobs *jobs, const char *id, struct jobs_time now,
                        enum task_state *was, struct error *err) {
    struct occasion occasion = {.now = now};
    enum status status = STATUS_OK;
    pthread_mutex_lock(&jobs->lock);
    struct task *task = find_id(jobs, id, now, err);
    if (!task) {
        status = err->status;
    } else {
        *was = task->state;
        if (!happen(jobs, task, EVENT_DELETE, &occasion))
            status =
                error_fault(err, STATUS_NOT_FOUND, NULL, "the job %s was cancelled before", id);
    }
    pthread_mutex_unlock(&jobs->lock);
    if (status == STATUS_OK)
        wake(jobs);
    return status;
}

void jobs_expire(struct jobs *jobs, struct jobs_time now) {
    pthread_mutex_lock(&jobs->lock);
    make_room(jobs, now, 0);
    pthread_mutex_unlock(&jobs->lock);
}

double jobs_due_ms(struct jobs *jobs) {
    pthread_mutex_lock(&jobs->lock);
    const struct task *oldest = oldest_finished(jobs, false);
    double due = oldest ? oldest->finished.ms + jobs->limits.keep_ms : INFINITY;
    pthread_mutex_unlock(&jobs->lock);
    return due;
}

struct jobs_view jobs_view(struct jobs *jobs) {
    pthread_mutex_lock(&jobs->lock);
    struct jobs_view view = jobs->view;
    view.queued = count_state(jobs, TASK_QUEUED);
    view.running = count_state(jobs, TASK_RUNNING);
    view.finished = count_finished(jobs);
    pthread_mutex_unlock(&jobs->lock);
    return view;
}

/* ---- life ---- */

int jobs_init(struct jobs *jobs, const struct jobs_limits *limits) {
    *jobs = (struct jobs){.limits = *limits, .service_ms = service_guess_ms};
    jobs->wake = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (jobs->wake < 0)
        return errno;
    int failed = pthread_mutex_init(&jobs->lock, NULL);
    if (failed)
        close(jobs->wake);
    return failed;
}

int jobs_close(struct jobs *jobs, struct jobs_time now) {
    struct occasion occasion = {.now = now};
    int cancelled = 0;
    pthread_mutex_lock(&jobs->lock);
    jobs->closed = true;
    for (struct task *task = jobs->first, *next; task; task = next) {
        next = task->next;
        if (!is_finished(task) && happen(jobs, task, EVENT_DELETE, &occasion))
            cancelled++;
    }
    pthread_mutex_unlock(&jobs->lock);
    wake(jobs);
    return cancelled;
}

void jobs_finish(struct jobs *jobs) {
    while (jobs->first) {
        struct task *task = jobs->first;
        jobs->first = task->next;
        drop_outputs(jobs, task);
        release(task);
    }
    close(jobs->wake);
    pthread_mutex_destroy(&jobs->lock);
}
