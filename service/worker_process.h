/* Starting and ending worker processes. Main thread of the front only: a worker dies with the
 * thread that spawned it. */
#ifndef PELT_SERVICE_WORKER_PROCESS_H
#define PELT_SERVICE_WORKER_PROCESS_H

#include <sys/types.h>

#include "api/status.h"
#include "renderer/render.h"

struct worker_command {
    struct renderer_options renderer;
    int workers; /* how many share the machine, for the number of llvmpipe's threads */
};

/* Runs this binary again as `pelt worker`, with one end of a new socket as its descriptor
 * IPC_WORKER_FD; *socket is the other end, non-blocking. STATUS_IO_ERROR, STATUS_OUT_OF_MEMORY. */
enum status worker_process_spawn(const struct worker_command *command, pid_t *pid, int *socket,
                                 struct error *err);

#endif
