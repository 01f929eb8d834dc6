/* The one clock of the daemon: CLOCK_MONOTONIC in milliseconds, the same in every process of a
 * machine, so that a worker can tell how long a request waited in the front. */
#ifndef PELT_SERVICE_MONOTONIC_H
#define PELT_SERVICE_MONOTONIC_H

#include <time.h>

static inline double monotonic_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

#endif
