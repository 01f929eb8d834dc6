/* Deadlines of client connections, with the time made up: what is cut, and what it is told. */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>
/* cmocka wants the headers above first. */
#include <cmocka.h>

#include "service/connections.h"
#include "service/monotonic.h"

enum { RECEIVE_MS = 1000 };

struct bench {
    struct log log;
    struct metrics metrics;
    struct connections connections;
    struct connection *connection;
    int ends[2]; /* ours, the client's */
    char told[4096];
};

static int setup(void **state) {
    struct bench *bench = calloc(1, sizeof *bench);
    *state = bench;
    if (!bench || metrics_init(&bench->metrics) != 0 ||
        socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, bench->ends) != 0 ||
        fcntl(bench->ends[1], F_SETFL, O_NONBLOCK) != 0)
        return -1;
    bench->log.fd = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (connections_init(&bench->connections, RECEIVE_MS, 8, &bench->log, &bench->metrics) != 0)
        return -1;
    bench->connection = connections_open(&bench->connections, bench->ends[0]);
    return bench->connection ? 0 : -1;
}

static int teardown(void **state) {
    struct bench *bench = *state;
    connections_close(&bench->connections, bench->connection);
    connections_finish(&bench->connections);
    metrics_finish(&bench->metrics);
    close(bench->ends[0]);
    close(bench->ends[1]);
    close(bench->log.fd);
    free(bench);
    return 0;
}

/* What the client has been sent; NULL while the connection is open and silent. */
static const char *hear(struct bench *bench) {
    ssize_t got = recv(bench->ends[1], bench->told, sizeof bench->told - 1, 0);
    if (got < 0) {
        assert_int_equal(errno, EAGAIN);
        return NULL;
    }
    bench->told[got] = 0;
    return bench->told;
}

static void test_silence_is_told(void **state) {
    struct bench *bench = *state;
    double deadline = bench->connection->deadline_ms;
    connections_expire(&bench->connections, deadline - 1);
    assert_null(hear(bench));
    connections_expire(&bench->connections, deadline);
    const char *told = hear(bench);
    assert_non_null(told);
    assert_memory_equal(told, "HTTP/1.1 408 ", 13);
    assert_non_null(strstr(told, "\r\nConnection: close\r\n"));
    assert_non_null(strstr(told, "\r\nX-Request-Id: "));
    assert_non_null(strstr(told, "\r\nServer-Timing: total;dur="));
    assert_non_null(strstr(told, "/problems/request-timeout"));
    const char *body = strstr(told, "\r\n\r\n");
    const char *length = strstr(told, "Content-Length: ");
    assert_non_null(body);
    assert_non_null(length);
    assert_int_equal(strtoul(length + 16, NULL, 10), strlen(body + 4));
    assert_string_equal(hear(bench), ""); /* and it is closed */
    assert_int_equal(connections_cut_status(&bench->connections, bench->connection), 408);
    assert_int_equal(bench->metrics.client_timeouts, 1);
    assert_false(connections_enter(&bench->connections, bench->connection, CONNECTION_WORKING, 0));
    connections_expire(&bench->connections, deadline + 1e9);
    assert_int_equal(bench->metrics.client_timeouts, 1); /* once */
}

static void test_a_slow_request_keeps_its_name(void **state) {
    struct bench *bench = *state;
    char id[REQUEST_ID_BYTES] = "mine";
    assert_true(connections_enter(&bench->connections, bench->connection, CONNECTION_RECEIVING, 0));
    connections_name(&bench->connections, bench->connection, id);
    connections_expire(&bench->connections, bench->connection->deadline_ms);
    const char *told = hear(bench);
    assert_non_null(told);
    assert_non_null(strstr(told, "\r\nX-Request-Id: mine\r\n"));
    assert_non_null(strstr(told, "\"request_id\":\"mine\""));
}

static void test_work_has_no_deadline_here(void **state) {
    struct bench *bench = *state;
    assert_true(connections_enter(&bench->connections, bench->connection, CONNECTION_WORKING, 0));
    connections_expire(&bench->connections, monotonic_ms() + 1e9);
    assert_null(hear(bench));
    assert_true(isinf(bench->connection->deadline_ms));
}

static void test_a_slow_reader_is_closed(void **state) {
    struct bench *bench = *state;
    double before = monotonic_ms();
    assert_true(
        connections_enter(&bench->connections, bench->connection, CONNECTION_SENDING, 64e6));
    double allowed = bench->connection->deadline_ms - before;
    assert_true(allowed >= 1030e3 && allowed < 1040e3); /* 30 s, and 1 s for each 64 KB */
    connections_expire(&bench->connections, bench->connection->deadline_ms);
    assert_string_equal(hear(bench), ""); /* without a word: it is in the middle of a reply */
}

static void test_an_idle_connection_is_closed(void **state) {
    struct bench *bench = *state;
    connections_enter(&bench->connections, bench->connection, CONNECTION_SENDING, 1);
    connections_enter(&bench->connections, bench->connection, CONNECTION_IDLE, 0);
    connections_expire(&bench->connections, bench->connection->deadline_ms);
    assert_string_equal(hear(bench), ""); /* after a request: without a word */
}

static void test_a_new_request_has_its_own_time(void **state) {
    struct bench *bench = *state;
    bench->connection->deadline_ms = 1; /* long ago, but nobody has looked yet */
    connections_enter(&bench->connections, bench->connection, CONNECTION_RECEIVING, 0);
    assert_true(bench->connection->deadline_ms > monotonic_ms());
}

static void test_draining(void **state) {
    struct bench *bench = *state;
    connections_enter(&bench->connections, bench->connection, CONNECTION_WORKING, 0);
    assert_int_equal(connections_in_flight(&bench->connections), 1);
    connections_drain(&bench->connections);
    assert_true(connections_draining(&bench->connections));
    assert_null(hear(bench)); /* what is in flight goes on */
    connections_enter(&bench->connections, bench->connection, CONNECTION_SENDING, 1);
    assert_null(hear(bench));
    connections_enter(&bench->connections, bench->connection, CONNECTION_IDLE, 0);
    assert_string_equal(hear(bench), "");
    assert_int_equal(connections_in_flight(&bench->connections), 0);
    assert_int_equal(connections_count(&bench->connections), 1);
}

static void test_when_to_look_again(void **state) {
    struct bench *bench = *state;
    double deadline = bench->connection->deadline_ms;
    assert_true(connections_due_ms(&bench->connections, deadline - 10) == deadline);
    connections_enter(&bench->connections, bench->connection, CONNECTION_WORKING, 0);
    /* A connection that opens now would be due then. */
    assert_true(connections_due_ms(&bench->connections, 5000) == 5000 + RECEIVE_MS);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_silence_is_told, setup, teardown),
        cmocka_unit_test_setup_teardown(test_a_slow_request_keeps_its_name, setup, teardown),
        cmocka_unit_test_setup_teardown(test_work_has_no_deadline_here, setup, teardown),
        cmocka_unit_test_setup_teardown(test_a_slow_reader_is_closed, setup, teardown),
        cmocka_unit_test_setup_teardown(test_an_idle_connection_is_closed, setup, teardown),
        cmocka_unit_test_setup_teardown(test_a_new_request_has_its_own_time, setup, teardown),
        cmocka_unit_test_setup_teardown(test_draining, setup, teardown),
        cmocka_unit_test_setup_teardown(test_when_to_look_again, setup, teardown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
