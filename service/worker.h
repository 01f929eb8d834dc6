/* `pelt worker`: one GL context in a process of its own. Only the daemon starts it. */
#ifndef PELT_SERVICE_WORKER_H
#define PELT_SERVICE_WORKER_H

/* Draws what the front asks for over the socket that it inherited, until the front closes it;
 * argv[0] is the word "worker". Returns the exit code of the process. */
int worker_main(int argc, char **argv);

#endif
