/* What is asked of a sweep, as text: the options of `pelt sweep`, and the query of POST /v1/sweep.
 */
#ifndef PELT_SERVICE_SWEEP_ASK_H
#define PELT_SERVICE_SWEEP_ASK_H

#include <stdbool.h>

#include "renderer/sweep.h"

/* Zeroed is everything left out. */
struct sweep_ask {
    struct sweep_options options; /* points into what follows */
    char *names;                  /* the series, cut at their commas */
    const char **series;
    int *qualities;
};

/* Sets one: `series` NAME,..., `quality` N,..., `repeats` N, `pixels` all|N, `threads` N. False
 * where there is no such name, the value cannot be read, or memory ran out; what lies outside a
 * range is told by sweep_check(). */
bool sweep_ask_set(struct sweep_ask *ask, const char *name, const char *value);
void sweep_ask_finish(struct sweep_ask *ask);

#endif
