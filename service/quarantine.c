/* A small table with the oldest entry replaced; quarantine.h says what is refused, and for how
 * long. */
#include "service/quarantine.h"

#include <signal.h>
#include <string.h>

int quarantine_init(struct quarantine *quarantine) {
    memset(quarantine->entries, 0, sizeof quarantine->entries);
    return pthread_mutex_init(&quarantine->lock, NULL);
}

void quarantine_finish(struct quarantine *quarantine) {
    pthread_mutex_destroy(&quarantine->lock);
}

bool quarantine_counts(int signal) {
    return signal == SIGSEGV || signal == SIGBUS || signal == SIGILL || signal == SIGFPE ||
           signal == SIGABRT;
}

static bool is_alive(const struct quarantine_entry *entry, double now_ms) {
    return entry->crashes > 0 && now_ms - entry->last_ms < QUARANTINE_MS;
}

static struct quarantine_entry *find(struct quarantine *quarantine, const unsigned char *key,
                                     double now_ms) {
    for (int i = 0; i < QUARANTINE_ENTRIES; i++) {
        struct quarantine_entry *entry = &quarantine->entries[i];
        if (is_alive(entry, now_ms) && memcmp(entry->key, key, DIGEST_BYTES) == 0)
            return entry;
    }
    return NULL;
}

bool quarantine_record(struct quarantine *quarantine, const unsigned char key[DIGEST_BYTES],
                       double now_ms) {
    pthread_mutex_lock(&quarantine->lock);
    struct quarantine_entry *entry = find(quarantine, key, now_ms);
    if (!entry) {
        entry = &quarantine->entries[0];
        for (int i = 0; i < QUARANTINE_ENTRIES && is_alive(entry, now_ms); i++) {
            struct quarantine_entry *other = &quarantine->entries[i];
            if (!is_alive(other, now_ms) || other->last_ms < entry->last_ms)
                entry = other;
        }
        memcpy(entry->key, key, DIGEST_BYTES);
        entry->crashes = 0;
    }
    entry->crashes++;
    entry->last_ms = now_ms;
    bool refused = entry->crashes >= QUARANTINE_CRASHES;
    pthread_mutex_unlock(&quarantine->lock);
    return refused;
}

double quarantine_left_ms(struct quarantine *quarantine, const unsigned char key[DIGEST_BYTES],
                          double now_ms) {
    pthread_mutex_lock(&quarantine->lock);
    const struct quarantine_entry *entry = find(quarantine, key, now_ms);
    double left = 0;
    if (entry && entry->crashes >= QUARANTINE_CRASHES)
        left = QUARANTINE_MS - (now_ms - entry->last_ms);
    pthread_mutex_unlock(&quarantine->lock);
    return left;
}

int quarantine_count(struct quarantine *quarantine, double now_ms) {
    int count = 0;
    pthread_mutex_lock(&quarantine->lock);
    for (int i = 0; i < QUARANTINE_ENTRIES; i++)
        count += is_alive(&quarantine->entries[i], now_ms) &&
                 quarantine->entries[i].crashes >= QUARANTINE_CRASHES;
    pthread_mutex_unlock(&quarantine->lock);
    return count;
}
