/* Counters, gauges and histograms of the daemon, in Prometheus' text format.
 * Values that other parts hold (queue, workers) are asked for when the text is written. */
#ifndef PELT_SERVICE_METRICS_H
#define PELT_SERVICE_METRICS_H

#include <pthread.h>
#include <stddef.h>
#include <stdint.h>

#include "api/report.h"
#include "service/jobs.h"

enum { METRICS_BUCKETS = 12 };

/* Why a worker process came to its end. */
#define METRICS_ENDS(X) X(crash) X(killed) X(deadline) X(cancelled) X(start) X(protocol)

enum metrics_end {
#define METRICS_END_ENUM(name) METRICS_END_##name,
    METRICS_ENDS(METRICS_END_ENUM)
#undef METRICS_END_ENUM
        METRICS_END_COUNT
};

/* What is counted apart; any other resource counts as `other`. */
#define METRICS_ENDPOINTS(X)                                                                       \
    X(render)                                                                                      \
    X(plan)                                                                                        \
    X(jobs)                                                                                        \
    X(sweep)                                                                                       \
    X(sequences) X(assets) X(capabilities) X(livez) X(readyz) X(metrics) X(openapi) X(other)

enum metrics_endpoint {
#define METRICS_ENDPOINT_ENUM(name) METRICS_ENDPOINT_##name,
    METRICS_ENDPOINTS(METRICS_ENDPOINT_ENUM)
#undef METRICS_ENDPOINT_ENUM
        METRICS_ENDPOINT_COUNT
};

enum { METRICS_STATUS_MIN = 100, METRICS_STATUS_MAX = 599 };

struct metrics_histogram {
    uint64_t buckets[METRICS_BUCKETS + 1]; /* not cumulative; the last one is +Inf */
    double sum_s;
};

struct metrics {
    /* Guards everything below; held for a few additions, or one copy. */
    pthread_mutex_t lock;
    uint64_t replies[METRICS_ENDPOINT_COUNT][METRICS_STATUS_MAX - METRICS_STATUS_MIN + 1];
    struct metrics_histogram requests[METRICS_ENDPOINT_COUNT];
    struct metrics_histogram stages[REPORT_STAGE_COUNT];
    uint64_t worker_ends[METRICS_END_COUNT];
    uint64_t retries, cancelled, client_timeouts;
    uint64_t job_crashes; /* processes of tasks that died of themselves */
    uint64_t received_bytes, sent_bytes;
};

int metrics_init(struct metrics *metrics); /* 0, or an errno */
void metrics_finish(struct metrics *metrics);

void metrics_reply(struct metrics *metrics, enum metrics_endpoint endpoint, int http_status,
                   double ms, uint64_t received_bytes, uint64_t sent_bytes);
void metrics_stages(struct metrics *metrics, const double stage_ms[REPORT_STAGE_COUNT]);
void metrics_worker_end(struct metrics *metrics, enum metrics_end end);
void metrics_add(struct metrics *metrics, uint64_t *counter); /* one of its plain counters */

/* What the rest of the daemon holds at this moment. */
struct metrics_gauges {
    int queue_length, queue_limit;
    int workers_starting, workers_idle, workers_busy, workers_down;
    int connections, connections_limit;
    int quarantined;
    size_t store_bytes;
    struct jobs_view jobs;
    struct jobs_limits jobs_limits;
    double uptime_s;
};

/* The exposition, malloc'ed, 0-terminated, *bytes without the 0; NULL where memory ran out. */
char *metrics_write(struct metrics *metrics, const struct metrics_gauges *gauges, size_t *bytes);

#endif
