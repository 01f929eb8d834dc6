/* Scenes that crash workers. A scene (with its assets) that made a worker die twice by a signal of
 * its own making is refused for an hour. Cleared when the daemon restarts. */
#ifndef PELT_SERVICE_QUARANTINE_H
#define PELT_SERVICE_QUARANTINE_H

#include <pthread.h>
#include <stdbool.h>

#include "service/digest.h"

enum {
    QUARANTINE_ENTRIES = 1024, /* the one that crashed longest ago makes room */
    QUARANTINE_CRASHES = 2,
    QUARANTINE_MS = 3600 * 1000
};

struct quarantine {
    /* Guards the entries: the HTTP threads ask, the main thread records. Held for one scan. */
    pthread_mutex_t lock;
    struct quarantine_entry {
        unsigned char key[DIGEST_BYTES];
        int crashes;    /* 0: the entry is free */
        double last_ms; /* monotonic */
    } entries[QUARANTINE_ENTRIES];
};

int quarantine_init(struct quarantine *quarantine); /* 0, or an errno */
void quarantine_finish(struct quarantine *quarantine);

/* True for the signals that a scene can cause: SEGV, BUS, ILL, FPE, ABRT. */
bool quarantine_counts(int signal);

/* Records one crash; true where the scene is refused from now on. */
bool quarantine_record(struct quarantine *quarantine, const unsigned char key[DIGEST_BYTES],
                       double now_ms);

/* Milliseconds for which the scene is still refused; 0: it is not. */
double quarantine_left_ms(struct quarantine *quarantine, const unsigned char key[DIGEST_BYTES],
                          double now_ms);

int quarantine_count(struct quarantine *quarantine, double now_ms); /* scenes refused now */

#endif
