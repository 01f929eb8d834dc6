/* `pelt job`: one task in a process of its own. Only the daemon starts it. */
#ifndef PELT_SERVICE_JOB_PROCESS_H
#define PELT_SERVICE_JOB_PROCESS_H

/* Does the one TASK that comes over the socket that it inherited, and ends; argv[0] is the word
 * "job". Returns the exit code of the process. */
int job_process_main(int argc, char **argv);

#endif
