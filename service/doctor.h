/* `pelt doctor`: what this machine can draw with, what is missing, and what to install. */
#ifndef PELT_SERVICE_DOCTOR_H
#define PELT_SERVICE_DOCTOR_H

#include <jansson.h>
#include <stdio.h>

/* The command; argv[0] is its own name. 0 where a picture can be drawn, 6 where not, 2 for wrong
 * usage. Call from the main thread; blocks for about half a second, at most for --wait seconds for
 * each of four probes. */
int doctor_main(int argc, char **argv);

/* Findings (the object that --json prints) as text for people. */
void doctor_print(FILE *out, const json_t *findings);

#endif
