/* One piece of work for a worker: what it asks for and what came of it.
 *
 * Ownership: the HTTP side makes a job and fills in the first part; from supervisor_submit() until
 * `finished` is called it belongs to the supervisor (main thread), then to the HTTP side again.
 * There is never more than one owner, so a job has no lock. */
#ifndef PELT_SERVICE_JOB_H
#define PELT_SERVICE_JOB_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/report.h"
#include "api/status.h"
#include "service/digest.h"

enum job_kind { JOB_RENDER, JOB_PLAN, JOB_CANARY };

/* What the body of the reply is made as. */
enum job_format { JOB_FORMAT_PNG, JOB_FORMAT_EXR, JOB_FORMAT_JSON };

enum {
    JOB_ASSETS_MAX = 64,      /* assets of one request; each costs a descriptor in two processes */
    JOB_ASSET_NAME_MAX = 256, /* bytes, with the terminating 0 */
    JOB_REQUEST_ID_MAX = 65
};

struct job_asset {
    char name[JOB_ASSET_NAME_MAX]; /* as the scene names it */
    int fd;                        /* sealed memory file, owned by the job */
    size_t bytes;
    unsigned char sha256[DIGEST_BYTES];
};

struct job {
    /* What is asked; not changed after submission. */
    enum job_kind kind;
    enum job_format format;
    char request_id[JOB_REQUEST_ID_MAX];
    int scene_fd; /* sealed memory file with the scene's JSON, owned by the job; -1: none */
    size_t scene_bytes;
    size_t asset_count;
    struct job_asset *assets;          /* owned */
    unsigned char key[DIGEST_BYTES];   /* of scene and assets, for the quarantine */
    double received_ms;                /* monotonic: the last byte of the request */
    double parse_ms, assets_ms;        /* spent in the front */
    int client_fd;                     /* watched for the client's leaving; -1: none. Not owned. */
    void (*finished)(struct job *job); /* called once, on the main thread, without locks held */
    void *owner;

    /* The supervisor's. */
    uint64_t id;
    struct job *next;
    double queued_ms;       /* monotonic: when it was submitted */
    double run_deadline_ms; /* monotonic; 0 until a worker has been given it first */
    int attempts;           /* workers it has been given to */
    bool crashed;           /* a worker died of it */

    /* What came of it; valid once `finished` has been called. */
    struct error error; /* error.status STATUS_OK: the body below is there */
    int body_fd;        /* sealed memory file, owned by the job; -1: none */
    size_t body_bytes;
    double stage_ms[REPORT_STAGE_COUNT];
    double total_ms;      /* from received_ms until the worker had encoded the picture */
    double retry_after_s; /* > 0 where a later attempt may succeed */
};

/* Zeroed, with every descriptor -1. */
void job_init(struct job *job);
void job_finish(struct job *job); /* closes and frees what it owns; not the struct */

#endif
