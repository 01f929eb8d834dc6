/* Spawns a worker, or the process of a task: the same binary again (fork without exec is unsafe in
 * a threaded process, and a worker must not share the front's memory), with a socket, an
 * environment of its own and default signal handling.
 *
 * The environment gets two variables unless the caller has set them:
 * - LP_NUM_THREADS: usable processors / workers, at least 1. Two workers of one llvmpipe thread
 *   each measured as fast on two cores as one worker of two. A task's process has those that the
 *   workers leave, at least 1.
 * - MESA_SHADER_CACHE_DIR: a `pelt` folder of the user's cache, or the service's own under systemd.
 *   A first draw costs 235 ms without it, 9 ms with it (measured). */
#include "service/worker_process.h"

#include <errno.h>
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "service/ipc.h"

extern char **environ;

enum { VARIABLES_ADDED = 2, PATH_BYTES = 1024 };

struct environment {
    char threads[64], cache[PATH_BYTES + 64];
    char **list; /* points into environ and into this struct */
};

static bool cache_dir(char path[PATH_BYTES]) {
    const char *own = getenv("CACHE_DIRECTORY"); /* systemd's CacheDirectory= */
    const char *xdg = getenv("XDG_CACHE_HOME");
    const char *home = getenv("HOME");
    int n = -1;
    if (own && *own == '/' && !strchr(own, ':'))
        n = snprintf(path, PATH_BYTES, "%s/shaders", own);
    else if (xdg && *xdg == '/')
        n = snprintf(path, PATH_BYTES, "%s/pelt", xdg);
    else if (home && *home == '/')
        n = snprintf(path, PATH_BYTES, "%s/.cache/pelt", home);
    return n > 0 && n < PATH_BYTES;
}

static int environment_make(struct environment *environment, enum process_role role, int workers) {
    size_t count = 0;
    while (environ[count])
        count++;
    environment->list = calloc(count + VARIABLES_ADDED + 1, sizeof *environment->list);
    if (!environment->list)
        return -1;
    if (count > 0)
        memcpy(environment->list, environ, count * sizeof *environ);
    char path[PATH_BYTES];
    if (!getenv("LP_NUM_THREADS")) {
        cpu_set_t usable;
        long processors = sched_getaffinity(0, sizeof usable, &usable) == 0
                              ? CPU_COUNT(&usable)
                              : sysconf(_SC_NPROCESSORS_ONLN);
        long threads = processors > workers ? processors / workers : 1;
        if (role == PROCESS_JOB)
            threads = processors > threads * workers ? processors - threads * workers : 1;
        snprintf(environment->threads, sizeof environment->threads, "LP_NUM_THREADS=%ld", threads);
        environment->list[count++] = environment->threads;
    }
    if (!getenv("MESA_SHADER_CACHE_DIR") && cache_dir(path)) {
        snprintf(environment->cache, sizeof environment->cache, "MESA_SHADER_CACHE_DIR=%s", path);
        environment->list[count++] = environment->cache;
    }
    return 0;
}

/* 0 or an errno. The worker ties itself to this process and sets its own limits (worker.c): what
 * posix_spawn cannot do would need code between fork and exec. */
static int spawn(const struct worker_command *command, enum process_role role, int socket,
                 char **environment, pid_t *pid) {
    char device[16], parent[16], name[] = "pelt", worker[] = "worker", job[] = "job";
    char backend_auto[] = "auto", backend_egl[] = "egl", backend_osmesa[] = "osmesa";
    char hardware_yes[] = "hardware", hardware_no[] = "any";
    char *const backends[] = {[RENDER_BACKEND_AUTO] = backend_auto,
                              [RENDER_BACKEND_EGL] = backend_egl,
                              [RENDER_BACKEND_OSMESA] = backend_osmesa};
    snprintf(device, sizeof device, "%d", command->renderer.device);
    snprintf(parent, sizeof parent, "%ld", (long)getpid());
    char *const argv[] = {name,   role == PROCESS_JOB ? job : worker,
                          parent, backends[command->renderer.backend],
                          device, command->renderer.require_hardware ? hardware_yes : hardware_no,
                          NULL};
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    int error = posix_spawn_file_actions_init(&actions);
    if (error)
        return error;
    error = posix_spawnattr_init(&attributes);
    if (error) {
        posix_spawn_file_actions_destroy(&actions);
        return error;
    }
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    if (!error)
        error = posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    if (!error) /* stdout is the front's: its one line is the address */
        error = posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
    if (!error)
        error = posix_spawn_file_actions_adddup2(&actions, socket, IPC_WORKER_FD);
    if (!error)
        error = posix_spawn_file_actions_addclosefrom_np(&actions, IPC_WORKER_FD + 1);
    if (!error)
        error =
            posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    if (!error)
        error = posix_spawnattr_setsigmask(&attributes, &none);
    if (!error)
        error = posix_spawnattr_setsigdefault(&attributes, &all);
    if (!error)
        error = posix_spawn(pid, "/proc/self/exe", &actions, &attributes, argv, environment);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return error;
}

enum status worker_process_spawn(const struct worker_command *command, enum process_role role,
                                 pid_t *pid, int *socket, struct error *err) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0)
        return error_fault(err, STATUS_IO_ERROR, NULL, "socketpair: %s", strerror(errno));
    struct environment environment = {0};
    int error = environment_make(&environment, role, command->workers) == 0 ? 0 : ENOMEM;
    if (!error && fcntl(ends[0], F_SETFL, O_NONBLOCK) != 0)
        error = errno;
    if (!error)
        error = spawn(command, role, ends[1], environment.list, pid);
    free(environment.list);
    close(ends[1]);
    if (error) {
        close(ends[0]);
        return error_fault(err, STATUS_IO_ERROR, NULL, "starting a process: %s", strerror(error));
    }
    *socket = ends[0];
    return STATUS_OK;
}
