/* The protocol between the front and its processes (workers, and the one that runs a task), on a
 * SOCK_SEQPACKET socket.
 *
 * Every message is one packet: a header, then a body whose size and number of passed descriptors
 * depend on the type alone, by a table (ipc.c). A message that breaks the table never reaches a
 * handler. Both ends are the same binary; the version guards against one replaced while it runs.
 *
 *   front -> worker   ASSET (one for each asset of the next job), then JOB
 *   worker -> front   READY or FAILED once, then DONE for each JOB
 *   front -> job process   ASSET (one for each asset), then TASK, once
 *   job process -> front   PROGRESS, RESULT and PART, any number, then DONE, once
 *
 * Scenes, assets and bodies of replies are sealed memory files; faults travel as one of pairs of
 * 0-terminated strings (pointer, message), a pointer that is absent as the single byte 0x01. */
#ifndef PELT_SERVICE_IPC_H
#define PELT_SERVICE_IPC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/report.h"
#include "api/status.h"
#include "service/job.h"
#include "service/jobs.h"

enum { IPC_VERSION = 3, IPC_MAGIC = 0x746c6570 /* "pelt" */, IPC_WORKER_FD = 3 };

enum ipc_type {
    IPC_READY,
    IPC_FAILED,
    IPC_ASSET,
    IPC_JOB,
    IPC_DONE,
    IPC_TASK,
    IPC_PROGRESS,
    IPC_RESULT,
    IPC_PART,
    IPC_TYPE_COUNT
};

struct ipc_header {
    uint32_t magic;
    uint16_t version;
    uint16_t type; /* enum ipc_type */
    uint64_t job;  /* of the job or the task; 0 where none is meant */
};

struct ipc_ready {
    char backend[16], device[128], gl_renderer[128], gl_version[128], cpu[128];
    int32_t threads;
    int32_t clock; /* enum report_clock */
    double canary_ms;
};

struct ipc_failed {
    int32_t status;
    char message[1024];
};

struct ipc_asset { /* one descriptor */
    char name[JOB_ASSET_NAME_MAX];
    uint64_t bytes;
    unsigned char sha256[DIGEST_BYTES];
};

struct ipc_job {    /* one descriptor: the scene; of size 0 for a canary */
    int32_t kind;   /* enum job_kind */
    int32_t format; /* enum job_format */
    uint32_t asset_count;
    uint32_t reserved; /* 0 */
    uint64_t scene_bytes;
    double received_ms;
    double parse_ms, assets_ms; /* spent in the front */
};

struct ipc_done { /* one descriptor: the body, or the faults where status is not STATUS_OK */
    int32_t status;
    uint32_t faults_left_out;
    uint64_t body_bytes;
    double stage_ms[REPORT_STAGE_COUNT];
    double total_ms;
};

struct ipc_task { /* one descriptor: the scene */
    int32_t kind; /* index among task_kinds */
    uint32_t asset_count;
    uint64_t scene_bytes;
    char options[TASK_OPTIONS_MAX];
};

struct ipc_progress {
    uint64_t done, total;
    char what[TASK_NAME_MAX];
};

struct ipc_result { /* one descriptor: the output's bytes */
    char name[TASK_NAME_MAX], media_type[TASK_NAME_MAX];
    uint64_t bytes;    /* 0 where it grows: PARTs tell how far it has come */
    uint32_t growing;  /* 1: sealed against shrinking alone */
    uint32_t reserved; /* 0 */
};

struct ipc_part {             /* of the output that grows */
    char name[TASK_NAME_MAX]; /* "": what is between parts, or behind the last */
    uint64_t offset, bytes;   /* of the part in the output */
    uint64_t total;           /* that the output has now */
};

struct ipc_message {
    struct ipc_header header;
    union {
        struct ipc_ready ready;
        struct ipc_failed failed;
        struct ipc_asset asset;
        struct ipc_job job;
        struct ipc_done done;
        struct ipc_task task;
        struct ipc_progress progress;
        struct ipc_result result;
        struct ipc_part part;
    } body;
    int fd; /* -1: none; whoever receives a message owns it */
};

/* Sends message->header.type with its body and, if the type has one, message->fd (which stays the
 * caller's). Fills in the rest of the header. 0, or -1 with errno (EAGAIN where `flags` has
 * MSG_DONTWAIT and the other side does not read). */
int ipc_send(int socket, struct ipc_message *message, int flags);

/* Sends an ASSET for each of them, without blocking; the descriptors stay the caller's. False where
 * the other side does not read. */
bool ipc_send_assets(int socket, uint64_t job, const struct job_asset *assets, size_t count);

/* Receives one message. 1: it is there; 0: the other side has closed; -1: errno is EAGAIN (with
 * MSG_DONTWAIT) or EPROTO for what breaks the table. */
int ipc_receive(int socket, struct ipc_message *message, int flags);

/* Faults into and out of a memory file. *fd is -1 on failure. */
enum status ipc_faults_write(const struct error *from, int *fd, size_t *bytes);
void ipc_faults_read(int fd, size_t bytes, enum status status, struct error *to);

#endif
