/* The part of a process' life that workers (worker.c) and the process of a task (job_process.c)
 * share; child.h tells it. */
#include "service/child.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include "service/memfd.h"

/* An address space of 3 GB turns what would eat the machine into GL_OUT_OF_MEMORY (measured: clean
 * with llvmpipe). A sanitizer reserves terabytes for its shadow, so there the cap is left out. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ADDRESS_SPACE_CAPPED 0
#else
#define ADDRESS_SPACE_CAPPED 1
#endif
static const rlim_t address_space_bytes = (rlim_t)3 << 30;

bool child_arguments(int argc, char **argv, long *parent, struct renderer_options *options) {
    static const char *const backends[] = {[RENDER_BACKEND_AUTO] = "auto",
                                           [RENDER_BACKEND_EGL] = "egl",
                                           [RENDER_BACKEND_OSMESA] = "osmesa"};
    if (argc != 5 || fcntl(IPC_WORKER_FD, F_SETFD, FD_CLOEXEC) != 0)
        return false;
    *parent = strtol(argv[1], NULL, 10);
    *options = (struct renderer_options){.device = (int)strtol(argv[3], NULL, 10),
                                         .require_hardware = strcmp(argv[4], "hardware") == 0};
    for (size_t i = 0; i < sizeof backends / sizeof *backends; i++) {
        options->backend = (enum render_backend)i;
        if (strcmp(argv[2], backends[i]) == 0)
            return true;
    }
    return false;
}

static void limit(int what, rlim_t value) {
    struct rlimit now;
    if (getrlimit(what, &now) == 0 && (now.rlim_max == RLIM_INFINITY || value <= now.rlim_max)) {
        now.rlim_cur = now.rlim_max = value;
        if (setrlimit(what, &now) != 0)
            fprintf(stderr, "pelt: setrlimit: %s\n", strerror(errno));
    }
}

/* SIGTERM and SIGINT reach the whole group (a terminal, systemd's KillMode): the front finishes
 * what is in flight and needs its workers for that, so they leave when their socket closes and no
 * sooner. */
int child_settle(long parent) {
    signal(SIGTERM, SIG_IGN);
    signal(SIGINT, SIG_IGN);
    signal(SIGPIPE, SIG_IGN);
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0)
        return -1;
    if (getppid() != parent)
        return -1; /* it died before the line above */
    limit(RLIMIT_CORE, 0);
    if (ADDRESS_SPACE_CAPPED)
        limit(RLIMIT_AS, address_space_bytes);
    return 0;
}

/* ---- assets ---- */

bool child_assets_take(struct child_assets *assets, struct ipc_message *message) {
    struct ipc_asset *asset = &message->body.asset;
    if (assets->count == JOB_ASSETS_MAX || !memfd_is_sealed(message->fd, asset->bytes))
        return false;
    struct child_asset *held = &assets->list[assets->count++];
    memcpy(held->name, asset->name, sizeof held->name);
    held->name[sizeof held->name - 1] = 0;
    memcpy(held->sha256, asset->sha256, sizeof held->sha256);
    held->bytes = asset->bytes;
    held->fd = message->fd;
    message->fd = -1;
    return true;
}

void child_assets_drop(struct child_assets *assets) {
    for (size_t i = 0; i < assets->count; i++)
        close(assets->list[i].fd);
    assets->count = 0;
}

static enum status asset_open(void *user, const char *name, const char *pointer,
                              struct asset_bytes *bytes, struct error *err) {
    struct child_assets *assets = user;
    for (size_t i = 0; i < assets->count; i++) {
        struct child_asset *asset = &assets->list[i];
        if (strcmp(asset->name, name) != 0)
            continue;
        const void *data;
        enum status status = memfd_map(asset->fd, asset->bytes, &data, err);
        if (status != STATUS_OK)
            return status;
        *bytes = (struct asset_bytes){.data = data, .size = asset->bytes};
        memcpy(bytes->sha256, asset->sha256, sizeof bytes->sha256);
        return STATUS_OK;
    }
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "there is no asset named \"%s\"",
                       name);
}

static void asset_close(void *user, struct asset_bytes *bytes) {
    (void)user;
    memfd_unmap(bytes->data, bytes->size);
}

struct asset_source child_assets_source(struct child_assets *assets) {
    return (struct asset_source){asset_open, asset_close, assets};
}

/* ---- answers ---- */

bool child_answer(int socket, uint64_t id, enum status status, struct ipc_done *done, int body_fd,
                  struct error *err) {
    if (status != STATUS_OK) {
        size_t bytes = 0;
        memset(done, 0, sizeof *done);
        if (ipc_faults_write(err, &body_fd, &bytes) != STATUS_OK)
            body_fd = -1;
        done->body_bytes = bytes;
        done->faults_left_out = (uint32_t)err->faults_left_out;
    }
    done->status = (int32_t)status;
    struct ipc_message reply = {
        .header = {.type = IPC_DONE, .job = id}, .body.done = *done, .fd = body_fd};
    bool told = body_fd >= 0 && ipc_send(socket, &reply, 0) == 0;
    if (body_fd >= 0)
        close(body_fd);
    return told;
}
