/* The store of long work: states, limits, expiry with made-up time, and memory that runs out. */
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "service/jobs.h"
#include "service/memfd.h"
#include "tests/unit/failing_malloc.h"

enum { KEEP_BYTES = 1000, KEEP_MS = 5000, QUEUE = 3 };

static int setup(void **state) {
    struct jobs_limits limits = {.queue = QUEUE, .keep_bytes = KEEP_BYTES, .keep_ms = KEEP_MS};
    struct jobs *jobs = malloc(sizeof *jobs);
    *state = jobs;
    return jobs ? jobs_init(jobs, &limits) : -1;
}

static int teardown(void **state) {
    jobs_finish(*state);
    free(*state);
    return 0;
}

static struct jobs_time at(double ms) {
    return (struct jobs_time){ms, 1e9 + ms * 1e-3};
}

static int open_descriptors(void) {
    int count = 0;
    for (int fd = 0; fd < 1024; fd++)
        count += fcntl(fd, F_GETFD) >= 0;
    return count;
}

static void make_input(struct task_input *input, size_t held_bytes) {
    task_input_init(input);
    input->scene_fd = memfd_open("test");
    input->held_bytes = held_bytes;
    input->assets = calloc(1, sizeof *input->assets);
    if (!input->assets)
        return;
    input->asset_count = 1;
    input->assets[0].fd = memfd_open("test");
}

/* Submits one that must be taken. */
static void submit(struct jobs *jobs, double ms, char id[JOBS_ID_BYTES]) {
    struct task_input input;
    double retry_after_s = -1;
    make_input(&input, 10);
    assert_int_equal(jobs_submit(jobs, &input, at(ms), id, &retry_after_s, NULL), STATUS_OK);
    assert_int_equal(input.scene_fd, -1); /* moved */
    assert_true(retry_after_s == 0);
}

struct started {
    uint64_t serial;
    char id[JOBS_ID_BYTES];
    int attempts;
    struct task_input input;
};

static bool start(struct jobs *jobs, double ms, struct started *started) {
    return jobs_start(jobs, at(ms), &started->serial, started->id, &started->attempts,
                      &started->input);
}

static enum status add_output(struct jobs *jobs, uint64_t serial, const char *name, size_t bytes,
                              double ms) {
    struct task_output output = {.media_type = "image/png", .bytes = bytes};
    strncpy(output.name, name, sizeof output.name - 1);
    output.fd = memfd_open("test");
    enum status status = jobs_output(jobs, serial, &output, at(ms), NULL);
    if (status != STATUS_OK)
        close(output.fd);
    return status;
}

static void copy_task(void *user, const struct task *task) {
    *(struct task *)user = *task;
}

/* What a look at a task says: its state, or a status of 404 or 410 as a negative number. */
static int look(struct jobs *jobs, const char *id, double ms) {
    struct task task;
    struct error err = {0};
    enum status status = jobs_look(jobs, id, at(ms), copy_task, &task, &err);
    error_clear(&err);
    return status == STATUS_OK ? (int)task.state : -status_http(status);
}

static enum status delete (struct jobs *jobs, const char *id, double ms) {
    enum task_state was = TASK_STATES; struct error err = {0};
    enum status status = jobs_delete(jobs, id, at(ms), &was, &err);
    error_clear(&err);
    return status;
}

/* Runs the next one to its end, with one output. */
static void run(struct jobs *jobs, double from_ms, double to_ms, size_t bytes) {
    struct started started;
    assert_true(start(jobs, from_ms, &started));
    assert_int_equal(add_output(jobs, started.serial, "a", bytes, to_ms), STATUS_OK);
    assert_true(jobs_done(jobs, started.serial, at(to_ms)));
    task_input_finish(&started.input);
}

static void test_a_whole_life(void **state) {
    struct jobs *jobs = *state;
    int before = open_descriptors();
    char id[JOBS_ID_BYTES], other[JOBS_ID_BYTES];
    struct started started;
    struct task task;
    assert_false(start(jobs, 0, &started));
    submit(jobs, 1000, id);
    submit(jobs, 1001, other);
    assert_int_equal(strlen(id), 32);
    assert_int_equal(strspn(id, "0123456789abcdef"), 32);
    assert_string_not_equal(id, other);
    assert_int_equal(look(jobs, id, 1002), TASK_QUEUED);
    assert_true(start(jobs, 2000, &started));
    assert_string_equal(started.id, id);
    assert_int_equal(started.attempts, 1);
    assert_true(started.input.scene_fd >= 0);
    struct started second;
    assert_false(start(jobs, 2001, &second)); /* one at a time */
    assert_true(jobs_is_running(jobs, started.serial));
    assert_true(jobs_progress(jobs, started.serial, "reference", 3, 4));
    assert_int_equal(add_output(jobs, started.serial, "a.png", 100, 2500), STATUS_OK);
    assert_int_equal(add_output(jobs, started.serial, "a.png", 100, 2500), STATUS_INTERNAL);
    assert_int_equal(jobs_look(jobs, id, at(2600), copy_task, &task, NULL), STATUS_OK);
    assert_int_equal(task.done, 3);
    assert_string_equal(task.what, "reference");
    assert_true(jobs_done(jobs, started.serial, at(3000)));
    assert_int_equal(jobs_look(jobs, id, at(3001), copy_task, &task, NULL), STATUS_OK);
    assert_int_equal(task.state, TASK_DONE);
    assert_int_equal(task.output_count, 1);
    assert_true(task.created.ms == 1000 && task.started.ms == 2000 && task.finished.ms == 3000);
    /* Whatever comes late means nothing. */
    assert_false(jobs_progress(jobs, started.serial, "late", 4, 4));
    assert_false(jobs_done(jobs, started.serial, at(3002)));
    assert_false(jobs_put_back(jobs, started.serial, &started.input));
    assert_int_equal(add_output(jobs, started.serial, "b", 1, 3002), STATUS_CANCELLED);
    struct jobs_view view = jobs_view(jobs);
    assert_int_equal(view.done, 1);
    assert_int_equal(view.queued, 1);
    assert_int_equal(view.output_bytes, 100);
    assert_true(fabs(view.ran_s - 1) < 1e-9); /* exact but for the last bit of a double */
    task_input_finish(&started.input);
    assert_int_equal(delete (jobs, id, 3003), STATUS_OK);
    assert_int_equal(delete (jobs, id, 3004), STATUS_NOT_FOUND);
    assert_int_equal(look(jobs, id, 3005), -404);
    assert_int_equal(jobs_view(jobs).output_bytes, 0);
    assert_int_equal(delete (jobs, other, 3006), STATUS_OK);
    assert_int_equal(open_descriptors(), before);
}

static void test_cancelling(void **state) {
    struct jobs *jobs = *state;
    int before = open_descriptors();
    char waiting[JOBS_ID_BYTES], running[JOBS_ID_BYTES];
    struct started started;
    submit(jobs, 1000, running);
    submit(jobs, 1000, waiting);
    assert_true(start(jobs, 1001, &started));
    assert_int_equal(add_output(jobs, started.serial, "a", 100, 1001), STATUS_OK);
    assert_int_equal(delete (jobs, waiting, 1002), STATUS_OK);
    assert_int_equal(delete (jobs, running, 1003), STATUS_OK);
    assert_false(jobs_is_running(jobs, started.serial));
    assert_int_equal(look(jobs, running, 1004), TASK_CANCELLED);
    assert_int_equal(look(jobs, waiting, 1004), TASK_CANCELLED);
    assert_int_equal(delete (jobs, running, 1005), STATUS_NOT_FOUND);
    assert_false(jobs_put_back(jobs, started.serial, &started.input)); /* it stays cancelled */
    assert_false(start(jobs, 1006, &(struct started){0}));
    assert_int_equal(jobs_view(jobs).cancelled, 2);
    assert_int_equal(jobs_view(jobs).output_bytes, 0);
    task_input_finish(&started.input);
    assert_int_equal(open_descriptors(), before);
    assert_int_equal(look(jobs, running, 1003 + KEEP_MS), -410);
}

static void test_failing_and_trying_again(void **state) {
    struct jobs *jobs = *state;
    char first[JOBS_ID_BYTES], second[JOBS_ID_BYTES];
    struct started started;
    struct error why = {0};
    submit(jobs, 1000, first);
    submit(jobs, 1001, second);
    assert_true(start(jobs, 1002, &started));
    assert_int_equal(add_output(jobs, started.serial, "a", 100, 1002), STATUS_OK);
    assert_true(jobs_put_back(jobs, started.serial, &started.input));
    assert_int_equal(started.input.scene_fd, -1);
    assert_int_equal(jobs_view(jobs).output_bytes, 0); /* what it had made is gone */
    assert_int_equal(look(jobs, first, 1003), TASK_QUEUED);
    assert_true(start(jobs, 1004, &started));
    assert_string_equal(started.id, first); /* before the other */
    assert_int_equal(started.attempts, 2);
    error_fault(&why, STATUS_WORKER_CRASHED, NULL, "it died");
    assert_true(jobs_fail(jobs, started.serial, &why, at(1005)));
    assert_int_equal(why.fault_count, 0); /* moved */
    assert_int_equal(look(jobs, first, 1006), TASK_FAILED);
    assert_int_equal(jobs_view(jobs).failed, 1);
    assert_int_equal(jobs_view(jobs).retried, 1);
    task_input_finish(&started.input);
    assert_int_equal(delete (jobs, first, 1007), STATUS_OK);
}

static void test_limits_of_the_queue(void **state) {
    struct jobs *jobs = *state;
    char id[JOBS_ID_BYTES];
    struct task_input input;
    double retry_after_s = 0;
    struct error err = {0};
    for (int i = 0; i < QUEUE; i++)
        submit(jobs, 1000, id);
    make_input(&input, 10);
    assert_int_equal(jobs_submit(jobs, &input, at(1001), id, &retry_after_s, &err),
                     STATUS_QUEUE_FULL);
    assert_true(retry_after_s >= 1);
    assert_true(input.scene_fd >= 0); /* still ours */
    long before = live;
    assert_int_equal(jobs_submit(jobs, &input, at(1001), id, &retry_after_s, NULL),
                     STATUS_QUEUE_FULL);
    assert_int_equal(live, before); /* nothing is left of it; where `live` is counted */
    struct started started;
    assert_true(start(jobs, 1002, &started)); /* one place is free again */
    assert_int_equal(jobs_submit(jobs, &input, at(1003), id, &retry_after_s, NULL), STATUS_OK);
    task_input_finish(&started.input);
    assert_int_equal(jobs_close(jobs, at(1004)), 1 + QUEUE);
    make_input(&input, 10);
    assert_int_equal(jobs_submit(jobs, &input, at(1005), id, &retry_after_s, NULL),
                     STATUS_SHUTTING_DOWN);
    task_input_finish(&input);
    error_clear(&err);
}

static void test_bytes_that_wait(void **state) {
    struct jobs *jobs = *state;
    char id[JOBS_ID_BYTES];
    struct task_input input;
    double retry_after_s = 0;
    make_input(&input, KEEP_BYTES + 1);
    assert_int_equal(jobs_submit(jobs, &input, at(1000), id, &retry_after_s, NULL),
                     STATUS_SCENE_TOO_LARGE); /* never */
    assert_true(retry_after_s == 0);
    input.held_bytes = KEEP_BYTES;
    assert_int_equal(jobs_submit(jobs, &input, at(1000), id, &retry_after_s, NULL), STATUS_OK);
    struct started started;
    assert_true(start(jobs, 1001, &started));
    make_input(&input, 1);
    assert_int_equal(jobs_submit(jobs, &input, at(1002), id, &retry_after_s, NULL),
                     STATUS_QUEUE_FULL); /* not while that one runs */
    assert_true(retry_after_s >= 1);
    assert_true(jobs_done(jobs, started.serial, at(1003)));
    assert_int_equal(jobs_submit(jobs, &input, at(1004), id, &retry_after_s, NULL), STATUS_OK);
    task_input_finish(&started.input);
}

static void test_expiry(void **state) {
    struct jobs *jobs = *state;
    char ids[2][JOBS_ID_BYTES];
    assert_true(isinf(jobs_due_ms(jobs)));
    submit(jobs, 1000, ids[0]);
    submit(jobs, 1000, ids[1]);
    assert_true(isinf(jobs_due_ms(jobs))); /* what waits does not expire */
    run(jobs, 1000, 2000, 10);
    run(jobs, 2000, 3000, 10);
    assert_true(jobs_due_ms(jobs) == 2000 + KEEP_MS);
    jobs_expire(jobs, at(2000 + KEEP_MS - 1));
    assert_int_equal(look(jobs, ids[0], 2000 + KEEP_MS - 1), TASK_DONE);
    jobs_expire(jobs, at(2000 + KEEP_MS));
    assert_int_equal(jobs_view(jobs).expired, 1);
    assert_int_equal(look(jobs, ids[0], 2000 + KEEP_MS), -410);
    assert_int_equal(delete (jobs, ids[0], 2000 + KEEP_MS), STATUS_GONE);
    assert_int_equal(look(jobs, ids[1], 2000 + KEEP_MS), TASK_DONE);
    assert_int_equal(look(jobs, ids[1], 3000 + KEEP_MS), -410); /* a look is enough */
    assert_int_equal(look(jobs, "", 3000), -404);
    assert_int_equal(jobs_view(jobs).output_bytes, 0);
}

static void test_bytes_that_are_kept(void **state) {
    struct jobs *jobs = *state;
    int before = open_descriptors();
    char ids[3][JOBS_ID_BYTES];
    struct started started;
    for (int i = 0; i < 3; i++)
        submit(jobs, 1000, ids[i]);
    run(jobs, 1000, 1001, 400);
    run(jobs, 1002, 1003, 500);
    assert_true(start(jobs, 1004, &started));
    assert_int_equal(add_output(jobs, started.serial, "a", 100, 1005), STATUS_OK);
    assert_int_equal(look(jobs, ids[0], 1005), TASK_DONE); /* 1000 are within the limit */
    assert_int_equal(add_output(jobs, started.serial, "b", 1, 1006), STATUS_OK);
    assert_int_equal(jobs_view(jobs).output_bytes, 601); /* at once, not at the next look */
    assert_int_equal(look(jobs, ids[0], 1006), -410);    /* the oldest has made room */
    assert_int_equal(look(jobs, ids[1], 1006), TASK_DONE);
    assert_int_equal(add_output(jobs, started.serial, "c", KEEP_BYTES - 100, 1007),
                     STATUS_TOO_COMPLEX);                  /* more than all that may be kept */
    assert_int_equal(look(jobs, ids[1], 1007), TASK_DONE); /* and nobody pays for it */
    assert_int_equal(add_output(jobs, started.serial, "c", SIZE_MAX, 1007), STATUS_TOO_COMPLEX);
    assert_int_equal(add_output(jobs, started.serial, "c", KEEP_BYTES - 101, 1008), STATUS_OK);
    assert_int_equal(look(jobs, ids[1], 1008), -410);
    assert_int_equal(jobs_view(jobs).output_bytes, KEEP_BYTES);
    assert_true(jobs_done(jobs, started.serial, at(1009)));
    task_input_finish(&started.input);
    assert_int_equal(delete (jobs, ids[2], 1010), STATUS_OK);
    assert_int_equal(open_descriptors(), before);
}

static void test_outputs_are_counted(void **state) {
    struct jobs *jobs = *state;
    char id[JOBS_ID_BYTES], name[2] = "a";
    struct started started;
    submit(jobs, 1000, id);
    assert_true(start(jobs, 1000, &started));
    for (int i = 0; i < TASK_OUTPUTS_MAX; i++, name[0]++)
        assert_int_equal(add_output(jobs, started.serial, name, 1, 1000), STATUS_OK);
    assert_int_equal(add_output(jobs, started.serial, name, 1, 1000), STATUS_INTERNAL);
    task_input_finish(&started.input);
}

/* However many fail at once, only so many are kept. */
static void test_many_finished(void **state) {
    struct jobs *jobs = *state;
    char first[JOBS_ID_BYTES], id[JOBS_ID_BYTES];
    submit(jobs, 1000, first);
    run(jobs, 1000, 1000, 0);
    for (int i = 1; i <= JOBS_FINISHED_MAX + JOBS_EXPIRED_MAX; i++) {
        submit(jobs, 1000 + i, id);
        run(jobs, 1000 + i, 1000 + i, 0);
        if (i == JOBS_FINISHED_MAX)
            assert_int_equal(look(jobs, first, 1000 + i), -410);
    }
    assert_int_equal(look(jobs, id, 3000), TASK_DONE);
    assert_int_equal(jobs_view(jobs).finished, JOBS_FINISHED_MAX);
    assert_int_equal(jobs_view(jobs).expired, JOBS_EXPIRED_MAX + 1);
    assert_int_equal(look(jobs, first, 3000), -404); /* that it was there is forgotten, too */
}

static void count_task(void *user, const struct task *task) {
    (void)task;
    ++*(int *)user;
}

static void test_everything_is_listed(void **state) {
    struct jobs *jobs = *state;
    char id[JOBS_ID_BYTES];
    int count = 0;
    submit(jobs, 1000, id);
    submit(jobs, 1000, id);
    run(jobs, 1000, 1001, 0);
    jobs_look_at_all(jobs, at(1002), count_task, &count);
    assert_int_equal(count, 2);
    jobs_look_at_all(jobs, at(1001 + KEEP_MS), count_task, &count);
    assert_int_equal(count, 3); /* the finished one is gone */
}

/* Each allocation of a submission fails in turn: told, and the input is still the caller's. */
static void test_no_memory(void **state) {
    struct jobs *jobs = *state;
    char id[JOBS_ID_BYTES];
    double retry_after_s;
    if (!INTERPOSED)
        skip();
    submit(jobs, 1000, id); /* GnuTLS has made what it makes once */
    struct task_input input;
    make_input(&input, 10);
    enum status status = STATUS_OUT_OF_MEMORY;
    int failures = 0;
    for (; status != STATUS_OK; failures++) {
        struct error err = {0};
        long before = live;
        fail_at = failures;
        status = jobs_submit(jobs, &input, at(1000), id, &retry_after_s, &err);
        bool reached = fail_at < 0;
        fail_at = -1;
        if (!reached)
            break;
        assert_int_equal(status, STATUS_OUT_OF_MEMORY);
        assert_true(input.scene_fd >= 0);
        error_clear(&err);
        assert_int_equal(live, before);
    }
    assert_true(failures >= 1);
    assert_int_equal(status, STATUS_OK);
    assert_int_equal(jobs_view(jobs).queued, 2);
}

/* ---- an output that grows ---- */

static enum status grow(struct jobs *jobs, uint64_t serial, const char *name, size_t offset,
                        size_t bytes, size_t total) {
    struct task_part part = {.offset = offset, .bytes = bytes};
    if (name)
        strncpy(part.name, name, sizeof part.name - 1);
    return jobs_grow(jobs, serial, name ? &part : NULL, total, at(0), NULL);
}

struct following {
    struct jobs_follower follower;
    int woken;
    size_t bytes, parts;
    enum task_state state;
    bool wait;
};

static void count_wake(void *user) {
    ((struct following *)user)->woken++;
}

static bool look_on(void *user, const struct task *task) {
    struct following *following = user;
    following->state = task->state;
    following->bytes = task->output_count ? task->outputs[0].bytes : 0;
    following->parts = task->output_count ? task->outputs[0].part_count : 0;
    return following->wait;
}

static void an_output_grows(void **state) {
    struct jobs *jobs = *state;
    char id[JOBS_ID_BYTES];
    struct started started;
    struct following following = {.wait = true};
    following.follower = (struct jobs_follower){.wake = count_wake, .user = &following};
    submit(jobs, 0, id);
    assert_true(start(jobs, 0, &started));
    assert_int_equal(grow(jobs, started.serial, "a", 0, 1, 1), STATUS_INTERNAL); /* none grows */
    struct task_output output = {.name = "frames", .media_type = "multipart/mixed", .grows = true};
    output.fd = memfd_open("test");
    assert_int_equal(jobs_output(jobs, started.serial, &output, at(0), NULL), STATUS_OK);
    assert_int_equal(jobs_follow(jobs, id, at(0), look_on, &following, &following.follower, NULL),
                     STATUS_OK);
    assert_int_equal(following.bytes, 0);
    assert_int_equal(grow(jobs, started.serial, "a", 10, 90, 100), STATUS_OK);
    assert_int_equal(following.woken, 1);
    assert_int_equal(grow(jobs, started.serial, "b", 110, 90, 200), STATUS_OK);
    assert_int_equal(following.woken, 1); /* once for each time that it waits */
    jobs_follow(jobs, id, at(0), look_on, &following, &following.follower, NULL);
    assert_int_equal(following.bytes, 200);
    assert_int_equal(following.parts, 2);
    assert_int_equal(jobs_view(jobs).output_bytes, 200);
    /* Nonsense: shorter, a part that was there, one that reaches past the end. */
    assert_int_equal(grow(jobs, started.serial, NULL, 0, 0, 199), STATUS_INTERNAL);
    assert_int_equal(grow(jobs, started.serial, "c", 190, 10, 300), STATUS_INTERNAL);
    assert_int_equal(grow(jobs, started.serial, "c", 250, 51, 300), STATUS_INTERNAL);
    assert_int_equal(grow(jobs, started.serial, "c", 250, SIZE_MAX, 300), STATUS_INTERNAL);
    assert_int_equal(grow(jobs, started.serial, "c", 200, 10, KEEP_BYTES + 1), STATUS_TOO_COMPLEX);
    assert_int_equal(following.woken, 1);
    assert_int_equal(grow(jobs, started.serial, NULL, 0, 0, 205), STATUS_OK);
    assert_int_equal(following.woken, 2);
    jobs_follow(jobs, id, at(0), look_on, &following, &following.follower, NULL);
    assert_true(jobs_done(jobs, started.serial, at(1)));
    assert_int_equal(following.woken, 3);
    following.wait = false;
    jobs_follow(jobs, id, at(1), look_on, &following, &following.follower, NULL);
    assert_int_equal(following.state, TASK_DONE);
    assert_int_equal(following.bytes, 205);
    assert_int_equal(grow(jobs, started.serial, NULL, 0, 0, 206), STATUS_CANCELLED);
    jobs_unfollow(jobs, &following.follower);
    jobs_unfollow(jobs, &following.follower);
    task_input_finish(&started.input);
}

/* Deleted, failed or put back: whoever follows is told, and the bytes are given back. */
static void a_growing_output_goes_with_its_task(void **state) {
    struct jobs *jobs = *state;
    int before = open_descriptors();
    for (int how = 0; how < 3; how++) {
        char id[JOBS_ID_BYTES];
        struct started started;
        struct following following = {.wait = true};
        struct error why = {.status = STATUS_INTERNAL};
        enum task_state was;
        following.follower = (struct jobs_follower){.wake = count_wake, .user = &following};
        submit(jobs, 0, id);
        assert_true(start(jobs, 0, &started));
        struct task_output output = {.name = "frames", .media_type = "x/y", .grows = true};
        output.fd = memfd_open("test");
        assert_int_equal(jobs_output(jobs, started.serial, &output, at(0), NULL), STATUS_OK);
        assert_int_equal(grow(jobs, started.serial, "a", 0, 100, 100), STATUS_OK);
        jobs_follow(jobs, id, at(0), look_on, &following, &following.follower, NULL);
        if (how == 0)
            assert_int_equal(jobs_delete(jobs, id, at(0), &was, NULL), STATUS_OK);
        else if (how == 1)
            assert_true(jobs_fail(jobs, started.serial, &why, at(0)));
        else
            assert_true(jobs_put_back(jobs, started.serial, &started.input));
        assert_int_equal(following.woken, 1);
        assert_int_equal(jobs_view(jobs).output_bytes, 0);
        jobs_unfollow(jobs, &following.follower);
        if (how == 2)
            jobs_delete(jobs, id, at(0), &was, NULL);
        task_input_finish(&started.input);
        assert_int_equal(open_descriptors(), before);
    }
}

int main(void) {
#define STORE_TEST(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(an_output_grows, setup, teardown),
        cmocka_unit_test_setup_teardown(a_growing_output_goes_with_its_task, setup, teardown),
        STORE_TEST(test_a_whole_life),
        STORE_TEST(test_cancelling),
        STORE_TEST(test_failing_and_trying_again),
        STORE_TEST(test_limits_of_the_queue),
        STORE_TEST(test_bytes_that_wait),
        STORE_TEST(test_expiry),
        STORE_TEST(test_bytes_that_are_kept),
        STORE_TEST(test_outputs_are_counted),
        STORE_TEST(test_many_finished),
        STORE_TEST(test_everything_is_listed),
        STORE_TEST(test_no_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
