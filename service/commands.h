/* The sub-commands of pelt. Each gets the arguments from its own name on (argv[0] is "render") and
 * gives the exit code of the process (api/status.def). main.c holds the table. */
#ifndef PELT_SERVICE_COMMANDS_H
#define PELT_SERVICE_COMMANDS_H

int render_main(int argc, char **argv);   /* render.c: one or many scenes, in this process */
int validate_main(int argc, char **argv); /* render.c: reads scenes, draws nothing, opens no GL */
int plan_main(int argc, char **argv);     /* render.c: what would be drawn, and what left out */
int serve_main(int argc, char **argv);    /* serve.c: the daemon */
int worker_main(int argc, char **argv);   /* worker.c: one GL context of the daemon */
int doctor_main(int argc, char **argv);   /* doctor.c: what this machine can draw with */

#endif
