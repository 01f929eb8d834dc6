/* Messages between the front and its processes: see ipc.h. */
#include "service/ipc.h"

#include <errno.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include "service/memfd.h"

static const struct ipc_rule {
    size_t body_bytes;
    int fds; /* 0 or 1 */
} rules[IPC_TYPE_COUNT] = {
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

union control {
    struct cmsghdr header; /* for its alignment */
    char bytes[CMSG_SPACE(sizeof(int))];
};

int ipc_send(int socket, struct ipc_message *message, int flags) {
    const struct ipc_rule *rule = &rules[message->header.type];
    message->header.magic = IPC_MAGIC;
    message->header.version = IPC_VERSION;
    struct iovec parts[2] = {{&message->header, sizeof message->header},
                             {&message->body, rule->body_bytes}};
    union control control = {0};
    struct msghdr packet = {.msg_iov = parts, .msg_iovlen = 2};
    if (rule->fds) {
        packet.msg_control = &control;
        packet.msg_controllen = sizeof control;
        struct cmsghdr *part = CMSG_FIRSTHDR(&packet);
        part->cmsg_level = SOL_SOCKET;
        part->cmsg_type = SCM_RIGHTS;
        part->cmsg_len = CMSG_LEN(sizeof(int));
        memcpy(CMSG_DATA(part), &message->fd, sizeof(int));
    }
    ssize_t sent;
    do
        sent = sendmsg(socket, &packet, flags | MSG_NOSIGNAL);
    while (sent < 0 && errno == EINTR);
    return sent < 0 ? -1 : 0;
}

bool ipc_send_assets(int socket, uint64_t job, const struct job_asset *assets, size_t count) {
    bool sent = true;
    for (size_t i = 0; i < count && sent; i++) {
        struct ipc_message message = {.header = {.type = IPC_ASSET, .job = job},
                                      .fd = assets[i].fd};
        memcpy(message.body.asset.name, assets[i].name, sizeof assets[i].name);
        memcpy(message.body.asset.sha256, assets[i].sha256, DIGEST_BYTES);
        message.body.asset.bytes = assets[i].bytes;
        sent = ipc_send(socket, &message, MSG_DONTWAIT) == 0;
    }
    return sent;
}

/* Takes the first descriptor that came with a packet. The buffer has room for one: the kernel
 * closes what does not fit and says so with MSG_CTRUNC. */
static int take_fd(struct msghdr *packet) {
    for (struct cmsghdr *part = CMSG_FIRSTHDR(packet); part; part = CMSG_NXTHDR(packet, part)) {
        if (part->cmsg_level == SOL_SOCKET && part->cmsg_type == SCM_RIGHTS &&
            part->cmsg_len == CMSG_LEN(sizeof(int))) {
            int fd;
            memcpy(&fd, CMSG_DATA(part), sizeof fd);
            return fd;
        }
    }
    return -1;
}

int ipc_receive(int socket, struct ipc_message *message, int flags) {
    *message = (struct ipc_message){.fd = -1};
    struct iovec parts[2] = {{&message->header, sizeof message->header},
                             {&message->body, sizeof message->body}};
    union control control = {0};
    struct msghdr packet = {.msg_iov = parts,
                            .msg_iovlen = 2,
                            .msg_control = &control,
                            /* not CMSG_SPACE: its padding would have room for a second one */
                            .msg_controllen = CMSG_LEN(sizeof(int))};
    ssize_t got;
    do
        got = recvmsg(socket, &packet, flags | MSG_CMSG_CLOEXEC);
    while (got < 0 && errno == EINTR);
    if (got < 0)
        return errno == ECONNRESET ? 0 : -1;
    if (got == 0)
        return 0;
    message->fd = take_fd(&packet);
    const struct ipc_header *header = &message->header;
    if ((size_t)got < sizeof *header || header->magic != IPC_MAGIC ||
        header->version != IPC_VERSION || header->type >= IPC_TYPE_COUNT ||
        (size_t)got != sizeof *header + rules[header->type].body_bytes ||
        (packet.msg_flags & (MSG_TRUNC | MSG_CTRUNC)) != 0 ||
        (message->fd >= 0) != (rules[header->type].fds == 1)) {
        if (message->fd >= 0)
            close(message->fd);
        message->fd = -1;
        errno = EPROTO;
        return -1;
    }
    return 1;
}

static const char no_pointer[] = "\x01";

enum status ipc_faults_write(const struct error *from, int *fd, size_t *bytes) {
    *bytes = 0;
    *fd = memfd_open("pelt-faults");
    if (*fd < 0)
        return STATUS_OUT_OF_MEMORY;
    enum status status = STATUS_OK;
    for (size_t i = 0; i < from->fault_count && status == STATUS_OK; i++) {
        const char *pointer = from->faults[i].pointer ? from->faults[i].pointer : no_pointer;
        const char *text = from->faults[i].message ? from->faults[i].message : "";
        status = memfd_write(*fd, pointer, strlen(pointer) + 1, NULL);
        if (status == STATUS_OK)
            status = memfd_write(*fd, text, strlen(text) + 1, NULL);
        *bytes += strlen(pointer) + strlen(text) + 2;
    }
    if (status == STATUS_OK)
        status = memfd_seal(*fd, NULL);
    if (status != STATUS_OK) {
        close(*fd);
        *fd = -1;
    }
    return status;
}

void ipc_faults_read(int fd, size_t bytes, enum status status, struct error *to) {
    const void *map = NULL;
    to->status = status;
    if (memfd_map(fd, bytes, &map, NULL) != STATUS_OK)
        return;
    const char *at = map, *end = at + bytes;
    while (at < end) {
        const char *text = memchr(at, 0, (size_t)(end - at));
        if (!text || ++text == end)
            break;
        const char *next = memchr(text, 0, (size_t)(end - text));
        if (!next)
            break;
        error_fault(to, status, strcmp(at, no_pointer) == 0 ? NULL : at, "%s", text);
        at = next + 1;
    }
    memfd_unmap(map, bytes);
}
