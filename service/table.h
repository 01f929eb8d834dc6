/* A report as a table for people. */
#ifndef PELT_SERVICE_TABLE_H
#define PELT_SERVICE_TABLE_H

#include <stdio.h>

#include "api/report.h"

/* Prints what each stage took, what was drawn and what left out, and the warnings. `start_ms`: what
 * it took to open OpenGL, which no stage counts; 0 leaves the line out. */
void table_print(FILE *out, const struct report *report, double start_ms);

/* The passes, what was left out, and the warnings alone. */
void table_print_plan(FILE *out, const struct report *report);

/* The same of a Server-Timing header ("name;dur=1.5, ..."), where a daemon has drawn. */
void table_print_timing(FILE *out, const char *server_timing);

#endif
