/* `pelt reference`: the true picture of a scene, and how far another is from it. */
#ifndef PELT_SERVICE_REFERENCE_H
#define PELT_SERVICE_REFERENCE_H

int reference_main(int argc, char **argv);

#endif
