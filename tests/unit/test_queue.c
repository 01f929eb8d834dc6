/* The queue of jobs, and the quarantine: order, limits, time. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

#include "service/quarantine.h"
#include "service/queue.h"

static void finished(struct job *job) {
    ++*(int *)job->owner;
}

static void test_order_and_limit(void **state) {
    struct queue queue;
    struct job jobs[5];
    (void)state;
    assert_int_equal(queue_init(&queue, 3, 1000, 2, -1, 0), 0);
    for (int i = 0; i < 5; i++)
        job_init(&jobs[i]);
    assert_null(queue_take(&queue));
    for (int i = 0; i < 3; i++)
        assert_int_equal(queue_submit(&queue, &jobs[i], false), STATUS_OK);
    assert_int_equal(queue_submit(&queue, &jobs[3], false), STATUS_QUEUE_FULL);
    assert_int_equal(jobs[3].error.status, STATUS_QUEUE_FULL);
    assert_true(jobs[3].retry_after_s >= 1);
    assert_int_equal(queue_submit(&queue, &jobs[4], true), STATUS_OK); /* ahead, past the limit */
    assert_int_equal(queue_length(&queue), 4);
    assert_ptr_equal(queue_take(&queue), &jobs[4]);
    assert_ptr_equal(queue_take_id(&queue, jobs[1].id), &jobs[1]); /* from the middle */
    assert_null(queue_take_id(&queue, jobs[1].id));
    assert_ptr_equal(queue_take(&queue), &jobs[0]);
    queue_put_back(&queue, &jobs[0]);
    assert_ptr_equal(queue_take(&queue), &jobs[0]);
    assert_ptr_equal(queue_take_id(&queue, jobs[2].id), &jobs[2]); /* the last one */
    assert_int_equal(queue_length(&queue), 0);
    assert_int_equal(queue_submit(&queue, &jobs[0], false), STATUS_OK);
    assert_int_equal(queue_submit(&queue, &jobs[1], false), STATUS_OK);
    assert_ptr_equal(queue_take(&queue), &jobs[0]);
    assert_ptr_equal(queue_take(&queue), &jobs[1]);
    queue_close(&queue);
    assert_int_equal(queue_submit(&queue, &jobs[2], false), STATUS_SHUTTING_DOWN);
    for (int i = 0; i < 5; i++)
        job_finish(&jobs[i]);
    queue_finish(&queue);
}

static void test_expiry(void **state) {
    struct queue queue;
    struct job fresh, retried;
    (void)state;
    job_init(&fresh);
    job_init(&retried);
    assert_int_equal(queue_init(&queue, 3, 1000, 1, -1, 0), 0);
    assert_true(isinf(queue_due_ms(&queue)));
    assert_int_equal(queue_submit(&queue, &fresh, false), STATUS_OK);
    double at = fresh.queued_ms + 1000;
    assert_true(queue_due_ms(&queue) == at);
    assert_null(queue_take_expired(&queue, at - 1));
    assert_ptr_equal(queue_take_expired(&queue, at), &fresh);
    assert_true(fresh.retry_after_s >= 1);
    retried.attempts = 1; /* had a worker: its run deadline counts */
    retried.run_deadline_ms = at + 5000;
    queue_put_back(&queue, &retried);
    assert_null(queue_take_expired(&queue, at + 4999));
    assert_ptr_equal(queue_take_expired(&queue, at + 5000), &retried);
    queue_finish(&queue);
}

static void test_retry_after(void **state) {
    struct queue queue;
    struct job first, second;
    (void)state;
    job_init(&first);
    assert_int_equal(queue_init(&queue, 1, 1000, 2, -1, 0), 0);
    for (int i = 0; i < 100; i++)
        queue_learn(&queue, 4000);
    queue_set_busy(&queue, 2);
    assert_int_equal(queue_submit(&queue, &first, false), STATUS_OK);
    job_init(&second);
    assert_int_equal(queue_submit(&queue, &second, false), STATUS_QUEUE_FULL);
    assert_true(second.retry_after_s == 8); /* (1 waiting + 2 running + 1) * 4 s / 2 workers */
    for (int i = 0; i < 100; i++)
        queue_learn(&queue, 1e9);
    job_finish(&second);
    assert_int_equal(queue_submit(&queue, &second, false), STATUS_QUEUE_FULL);
    assert_true(second.retry_after_s == 600);
    job_finish(&second);
    assert_ptr_equal(queue_take(&queue), &first);
    queue_finish(&queue);
}

static void test_clients_are_watched(void **state) {
    struct queue queue;
    struct job job;
    struct epoll_event event;
    int ends[2], count = 0;
    (void)state;
    int epoll = epoll_create1(EPOLL_CLOEXEC);
    assert_true(epoll >= 0);
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0);
    assert_int_equal(queue_init(&queue, 1, 1000, 1, epoll, UINT64_C(7) << 56), 0);
    job_init(&job);
    job.client_fd = ends[0];
    job.finished = finished;
    job.owner = &count;
    assert_int_equal(queue_submit(&queue, &job, false), STATUS_OK);
    assert_int_equal(write(ends[1], "x", 1), 1); /* more of a client is no leaving */
    assert_int_equal(epoll_wait(epoll, &event, 1, 0), 0);
    close(ends[1]);
    assert_int_equal(epoll_wait(epoll, &event, 1, 0), 1);
    assert_true(event.data.u64 == (UINT64_C(7) << 56 | job.id));
    assert_ptr_equal(queue_take(&queue), &job);
    queue_end_job(&queue, &job);
    assert_int_equal(count, 1);
    /* The watch is gone: the same descriptor may be watched for the next job. */
    assert_int_equal(queue_submit(&queue, &job, false), STATUS_OK);
    assert_ptr_equal(queue_take(&queue), &job);
    queue_end_job(&queue, &job);
    close(ends[0]);
    close(epoll);
    queue_finish(&queue);
}

static void test_quarantine(void **state) {
    struct quarantine *quarantine = malloc(sizeof *quarantine);
    unsigned char key[DIGEST_BYTES] = {0};
    (void)state;
    assert_non_null(quarantine);
    assert_int_equal(quarantine_init(quarantine), 0);
    assert_true(quarantine_left_ms(quarantine, key, 0) == 0);
    assert_false(quarantine_record(quarantine, key, 1000));
    assert_true(quarantine_left_ms(quarantine, key, 1000) == 0);
    assert_true(quarantine_record(quarantine, key, 2000));
    assert_true(quarantine_left_ms(quarantine, key, 2000) == QUARANTINE_MS);
    assert_int_equal(quarantine_count(quarantine, 2000), 1);
    assert_true(quarantine_left_ms(quarantine, key, 2000 + QUARANTINE_MS - 1) == 1);
    assert_true(quarantine_left_ms(quarantine, key, 2000 + QUARANTINE_MS) == 0);
    /* An hour after its last crash a scene begins anew. */
    assert_false(quarantine_record(quarantine, key, 2000 + QUARANTINE_MS));
    quarantine_finish(quarantine);
    free(quarantine);
}

static void test_quarantine_makes_room(void **state) {
    struct quarantine *quarantine = malloc(sizeof *quarantine);
    unsigned char key[DIGEST_BYTES] = {0};
    (void)state;
    assert_non_null(quarantine);
    assert_int_equal(quarantine_init(quarantine), 0);
    for (int i = 0; i <= QUARANTINE_ENTRIES; i++) {
        memcpy(key, &i, sizeof i);
        quarantine_record(quarantine, key, i + 1);
        quarantine_record(quarantine, key, i + 1);
    }
    double now = QUARANTINE_ENTRIES + 1;
    assert_int_equal(quarantine_count(quarantine, now), QUARANTINE_ENTRIES);
    for (int i = 0; i <= QUARANTINE_ENTRIES; i++) {
        memcpy(key, &i, sizeof i);
        assert_int_equal(quarantine_left_ms(quarantine, key, now) > 0, i > 0); /* the oldest went */
    }
    quarantine_finish(quarantine);
    free(quarantine);
}

static void test_signals_that_count(void **state) {
    (void)state;
    for (int signal = 0; signal < 65; signal++)
        assert_int_equal(quarantine_counts(signal),
                         signal == 4 || signal == 6 || signal == 7 || signal == 8 || signal == 11);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order_and_limit),    cmocka_unit_test(test_expiry),
        cmocka_unit_test(test_retry_after),        cmocka_unit_test(test_clients_are_watched),
        cmocka_unit_test(test_quarantine),         cmocka_unit_test(test_quarantine_makes_room),
        cmocka_unit_test(test_signals_that_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
