/* `pelt render`, `pelt plan` and `pelt validate`: scenes from files, without a daemon. Each gives
 * the exit code of the process; argv[0] is the command's own name. Call from the main thread. */
#ifndef PELT_SERVICE_RENDER_H
#define PELT_SERVICE_RENDER_H

int render_main(int argc, char **argv);   /* draws, in this process or by --server */
int plan_main(int argc, char **argv);     /* says what would be drawn, and what left out */
int validate_main(int argc, char **argv); /* reads only; opens no GL */

#endif
