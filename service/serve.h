/* `pelt serve`: the daemon. */
#ifndef PELT_SERVICE_SERVE_H
#define PELT_SERVICE_SERVE_H

/* Runs the daemon until SIGTERM or SIGINT; argv[0] is the word "serve". Returns the exit code of
 * the process (api/status.def tells what each means). Call it from the main thread, before any
 * other thread exists: it blocks signals, and workers are tied to the thread that spawns them. */
int serve_main(int argc, char **argv);

#endif
