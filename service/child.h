/* What the front's processes have in common, workers and the one that runs a task: how they are
 * called, how they tie themselves to the front, how they hold assets, how they answer. */
#ifndef PELT_SERVICE_CHILD_H
#define PELT_SERVICE_CHILD_H

#include <stdbool.h>
#include <stddef.h>

#include "renderer/asset/source.h"
#include "renderer/render.h"
#include "service/ipc.h"

/* Reads `WORD PARENT auto|egl|osmesa DEVICE hardware|any`; false for anything else, and where
 * IPC_WORKER_FD is not open. */
bool child_arguments(int argc, char **argv, long *parent, struct renderer_options *options);

/* Ties this process to its parent, so that it dies with the thread that spawned it, lets SIGTERM,
 * SIGINT and SIGPIPE pass, and caps its address space and cores. 0, or -1 where the parent is gone.
 */
int child_settle(long parent);

/* Assets of what comes next. */
struct child_assets {
    size_t count;
    struct child_asset {
        char name[JOB_ASSET_NAME_MAX];
        unsigned char sha256[DIGEST_BYTES];
        int fd;
        size_t bytes;
    } list[JOB_ASSETS_MAX];
};

/* Takes an ASSET's descriptor over; false for one that cannot be. */
bool child_assets_take(struct child_assets *assets, struct ipc_message *message);
void child_assets_drop(struct child_assets *assets);
struct asset_source child_assets_source(struct child_assets *assets); /* for the renderer */

/* Sends DONE with the body, which is closed, or with `err` where status is not STATUS_OK. False
 * where that cannot be told. Blocks until the front reads. */
bool child_answer(int socket, uint64_t id, enum status status, struct ipc_done *done, int body_fd,
                  struct error *err);

#endif
