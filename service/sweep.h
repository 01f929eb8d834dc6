/* `pelt sweep`: error against run time of one scene, as files. */
#ifndef PELT_SERVICE_SWEEP_H
#define PELT_SERVICE_SWEEP_H

int sweep_main(int argc, char **argv);

#endif
