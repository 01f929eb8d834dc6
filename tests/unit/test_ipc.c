/* The protocol between front and worker: what breaks its table never comes through. */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

#include "service/ipc.h"
#include "service/memfd.h"

struct pair {
    int ends[2];
};

static int setup(void **state) {
    struct pair *pair = malloc(sizeof *pair);
    *state = pair;
    return pair ? socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, pair->ends) : -1;
}

static int teardown(void **state) {
    struct pair *pair = *state;
    if (pair->ends[0] >= 0)
        close(pair->ends[0]);
    close(pair->ends[1]);
    free(pair);
    return 0;
}

/* Descriptors that this process has open. */
static int open_descriptors(void) {
    int count = 0;
    for (int fd = 0; fd < 1024; fd++)
        count += fcntl(fd, F_GETFD) >= 0;
    return count;
}

static void test_round_trip(void **state) {
    struct pair *pair = *state;
    struct ipc_message sent = {.header = {.type = IPC_ASSET, .job = 42}}, got;
    memset(&sent.body.asset, 7, sizeof sent.body.asset);
    sent.fd = memfd_open("test");
    assert_int_equal(memfd_write(sent.fd, "bytes", 5, NULL), STATUS_OK);
    assert_false(memfd_is_sealed(sent.fd, 5));
    assert_int_equal(memfd_seal(sent.fd, NULL), STATUS_OK);
    assert_int_equal(ipc_send(pair->ends[0], &sent, 0), 0);
    assert_int_equal(ipc_receive(pair->ends[1], &got, 0), 1);
    assert_int_equal(got.header.job, 42);
    assert_memory_equal(&got.body.asset, &sent.body.asset, sizeof got.body.asset);
    assert_true(memfd_is_sealed(got.fd, 5));
    assert_false(memfd_is_sealed(got.fd, 6));
    assert_int_equal(write(got.fd, "x", 1), -1); /* sealed for good */
    assert_int_equal(ftruncate(got.fd, 0), -1);
    close(got.fd);
    close(sent.fd);
    assert_int_equal(ipc_receive(pair->ends[1], &got, MSG_DONTWAIT), -1);
    assert_int_equal(errno, EAGAIN);
    close(pair->ends[0]);
    pair->ends[0] = -1;
    assert_int_equal(ipc_receive(pair->ends[1], &got, 0), 0);
}

/* Sends any bytes with `count` copies of a descriptor. */
static void send_raw(int socket, const void *data, size_t bytes, int fd, int count) {
    union {
        struct cmsghdr header;
        char bytes[CMSG_SPACE(4 * sizeof(int))];
    } control = {0};
    struct iovec part = {(void *)(uintptr_t)data, bytes};
    struct msghdr packet = {.msg_iov = &part, .msg_iovlen = 1};
    if (count > 0) {
        packet.msg_control = &control;
        packet.msg_controllen = CMSG_SPACE((size_t)count * sizeof(int));
        struct cmsghdr *header = CMSG_FIRSTHDR(&packet);
        header->cmsg_level = SOL_SOCKET;
        header->cmsg_type = SCM_RIGHTS;
        header->cmsg_len = CMSG_LEN((size_t)count * sizeof(int));
        for (int i = 0; i < count; i++)
            memcpy(CMSG_DATA(header) + (size_t)i * sizeof fd, &fd, sizeof fd);
    }
    assert_int_equal(sendmsg(socket, &packet, 0), (ssize_t)bytes);
}

static void test_broken_messages(void **state) {
    struct pair *pair = *state;
    int fd = memfd_open("test");
    struct {
        struct ipc_header header;
        char body[sizeof(struct ipc_message)];
    } raw = {.header = {.magic = IPC_MAGIC, .version = IPC_VERSION, .type = IPC_ASSET}};
    size_t right = sizeof(struct ipc_header) + sizeof(struct ipc_asset);
    const struct {
        const char *what;
        size_t bytes;
        int fds;
        uint32_t magic;
        uint16_t version, type;
    } rows[] = {
        {"right", right, 1, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"too short", right - 1, 1, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"too long", right + 1, 1, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"longer than any", sizeof raw, 1, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"half a header", 7, 1, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"no descriptor", right, 0, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"two descriptors", right, 2, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"four descriptors", right, 4, IPC_MAGIC, IPC_VERSION, IPC_ASSET},
        {"other magic", right, 1, IPC_MAGIC + 1, IPC_VERSION, IPC_ASSET},
        {"other version", right, 1, IPC_MAGIC, IPC_VERSION + 1, IPC_ASSET},
        {"other type", right, 1, IPC_MAGIC, IPC_VERSION, IPC_JOB},
        {"no such type", right, 1, IPC_MAGIC, IPC_VERSION, IPC_TYPE_COUNT},
        {"far from any type", right, 1, IPC_MAGIC, IPC_VERSION, UINT16_MAX},
    };
    int before = open_descriptors();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct ipc_message got;
        raw.header.magic = rows[i].magic;
        raw.header.version = rows[i].version;
        raw.header.type = rows[i].type;
        send_raw(pair->ends[0], &raw, rows[i].bytes, fd, rows[i].fds);
        int result = ipc_receive(pair->ends[1], &got, MSG_DONTWAIT);
        if (i == 0) {
            assert_int_equal(result, 1);
            close(got.fd);
        } else if (result != -1 || errno != EPROTO || got.fd != -1) {
            fail_msg("%s: %d", rows[i].what, result);
        }
        if (open_descriptors() != before)
            fail_msg("%s: a descriptor is left", rows[i].what);
    }
    close(fd);
}

/* Every type has its size and its number of descriptors, and nothing else comes through. */
static void test_table(void **state) {
    static const struct {
        size_t body_bytes;
        int fds;
    } rows[IPC_TYPE_COUNT] = {
        [IPC_READY] = {sizeof(struct ipc_ready), 0},
        [IPC_FAILED] = {sizeof(struct ipc_failed), 0},
        [IPC_ASSET] = {sizeof(struct ipc_asset), 1},
        [IPC_JOB] = {sizeof(struct ipc_job), 1},
        [IPC_DONE] = {sizeof(struct ipc_done), 1},
        [IPC_TASK] = {sizeof(struct ipc_task), 1},
        [IPC_PROGRESS] = {sizeof(struct ipc_progress), 0},
        [IPC_RESULT] = {sizeof(struct ipc_result), 1},
        [IPC_PART] = {sizeof(struct ipc_part), 0},
    };
    struct pair *pair = *state;
    struct ipc_message got;
    struct {
        struct ipc_header header;
        char body[sizeof(struct ipc_message)];
    } raw = {.header = {.magic = IPC_MAGIC, .version = IPC_VERSION, .job = 7}};
    int fd = memfd_open("test"), before = open_descriptors();
    for (int type = 0; type < IPC_TYPE_COUNT; type++) {
        raw.header.type = (uint16_t)type;
        size_t right = sizeof raw.header + rows[type].body_bytes;
        for (int fds = 0; fds <= 2; fds++) {
            for (size_t bytes = right - 1; bytes <= right + 1; bytes++) {
                bool sane = bytes == right && fds == rows[type].fds;
                send_raw(pair->ends[0], &raw, bytes, fd, fds);
                int result = ipc_receive(pair->ends[1], &got, MSG_DONTWAIT);
                if (result != (sane ? 1 : -1) || (got.fd >= 0) != (sane && fds == 1))
                    fail_msg("type %d, %zu bytes, %d descriptors: %d", type, bytes, fds, result);
                if (got.fd >= 0)
                    close(got.fd);
                assert_int_equal(open_descriptors(), before);
            }
        }
    }
    close(fd);
}

static void test_a_reader_that_does_not_read(void **state) {
    struct pair *pair = *state;
    struct ipc_message message = {.header = {.type = IPC_READY}, .fd = -1};
    int sent = 0;
    while (sent < 100000 && ipc_send(pair->ends[0], &message, MSG_DONTWAIT) == 0)
        sent++;
    assert_true(sent > 0 && sent < 100000);
    assert_int_equal(errno, EAGAIN);
}

static void test_faults(void **state) {
    struct error from = {0}, to = {0};
    int fd = -1;
    size_t bytes = 0;
    (void)state;
    error_fault(&from, STATUS_BAD_ASSET, "/objects/0", "first %d", 1);
    error_fault(&from, STATUS_BAD_ASSET, NULL, "no pointer");
    error_fault(&from, STATUS_BAD_ASSET, "", "%s", "");
    assert_int_equal(ipc_faults_write(&from, &fd, &bytes), STATUS_OK);
    assert_true(memfd_is_sealed(fd, bytes));
    ipc_faults_read(fd, bytes, STATUS_BAD_ASSET, &to);
    assert_int_equal(to.status, STATUS_BAD_ASSET);
    assert_int_equal(to.fault_count, 3);
    assert_string_equal(to.faults[0].pointer, "/objects/0");
    assert_string_equal(to.faults[0].message, "first 1");
    assert_null(to.faults[1].pointer);
    assert_string_equal(to.faults[2].pointer, "");
    assert_string_equal(to.faults[2].message, "");
    close(fd);
    error_clear(&from);
    error_clear(&to);
    assert_int_equal(ipc_faults_write(&from, &fd, &bytes), STATUS_OK); /* none at all */
    ipc_faults_read(fd, bytes, STATUS_INTERNAL, &to);
    assert_int_equal(to.status, STATUS_INTERNAL);
    assert_int_equal(to.fault_count, 0);
    close(fd);
    error_clear(&to);
}

static void test_faults_that_are_cut(void **state) {
    static const char text[] = "/a\0first\0/b\0second";
    (void)state;
    for (size_t bytes = 0; bytes <= sizeof text; bytes++) {
        struct error to = {0};
        int fd = memfd_open("test");
        assert_int_equal(memfd_write(fd, text, bytes, NULL), STATUS_OK);
        assert_int_equal(memfd_seal(fd, NULL), STATUS_OK);
        ipc_faults_read(fd, bytes, STATUS_BAD_ASSET, &to);
        assert_int_equal(to.fault_count, (bytes >= 9) + (bytes >= sizeof text));
        error_clear(&to);
        close(fd);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(test_round_trip, setup, teardown),
        cmocka_unit_test_setup_teardown(test_broken_messages, setup, teardown),
        cmocka_unit_test_setup_teardown(test_table, setup, teardown),
        cmocka_unit_test_setup_teardown(test_a_reader_that_does_not_read, setup, teardown),
        cmocka_unit_test(test_faults),
        cmocka_unit_test(test_faults_that_are_cut),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
