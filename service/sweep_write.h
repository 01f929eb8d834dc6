/* A sweep as text: JSON after sweep.schema.json, CSV after RFC 4180, one self-contained page. No
 * file is touched: the command line writes what comes back, a daemon sends it. Each is malloc'ed
 * (caller frees); NULL where memory ran out. Thread: any. */
#ifndef PELT_SERVICE_SWEEP_WRITE_H
#define PELT_SERVICE_SWEEP_WRITE_H

#include <stdio.h>

#include "renderer/sweep.h"

char *sweep_json(const struct sweep *sweep);

/* A line of names, then a line for each point, refused ones with their reason and no figures.
 * Figures that are not known are empty. */
char *sweep_csv(const struct sweep *sweep);

/* `name`: of the scene, for the title; any text. Takes a second for a dozen pictures of 512 x 512:
 * they are encoded into the page. */
char *sweep_html(const struct sweep *sweep, const char *name);

/* For people: a line for each point, a line for each series. */
void sweep_print(FILE *out, const struct sweep *sweep);

/* A field of CSV, in quotes where it needs them. */
void sweep_csv_field(FILE *out, const char *text);

#endif
