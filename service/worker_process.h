/* Starting the front's processes: workers, and the one that runs a task. Main thread of the front
 * only: they die with the thread that spawned them. */
#ifndef PELT_SERVICE_WORKER_PROCESS_H
#define PELT_SERVICE_WORKER_PROCESS_H

#include <sys/types.h>

#include "api/status.h"
#include "renderer/render.h"

struct worker_command {
    struct renderer_options renderer;
    int workers; /* how many share the machine, for the number of llvmpipe's threads */
};

enum process_role {
    PROCESS_WORKER, /* `pelt worker` */
    PROCESS_JOB     /* `pelt job`: beside the workers, with what llvmpipe threads they leave */
};

/* Runs this binary again in that role, with one end of a new socket as its descriptor
 * IPC_WORKER_FD; *socket is the other end, non-blocking. STATUS_IO_ERROR, STATUS_OUT_OF_MEMORY. */
enum status worker_process_spawn(const struct worker_command *command, enum process_role role,
                                 pid_t *pid, int *socket, struct error *err);

#endif
