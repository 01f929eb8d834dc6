/* Metrics in Prometheus' text exposition format, version 0.0.4. Times are in seconds, as its naming
 * rules ask; bucket bounds span a cached thumbnail to a request at the default limit. */
#include "service/metrics.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const double bounds_s[METRICS_BUCKETS] = {0.001, 0.0025, 0.005, 0.01, 0.025, 0.05,
                                                 0.1,   0.25,   0.5,   1,    5,     30};

static const char *const endpoint_names[METRICS_ENDPOINT_COUNT] = {
#define NAME(name) #name,
    METRICS_ENDPOINTS(NAME)};

static const char *const end_names[METRICS_END_COUNT] = {METRICS_ENDS(NAME)};
#undef NAME

int metrics_init(struct metrics *metrics) {
    *metrics = (struct metrics){0};
    return pthread_mutex_init(&metrics->lock, NULL);
}

void metrics_finish(struct metrics *metrics) {
    pthread_mutex_destroy(&metrics->lock);
}

static void observe(struct metrics_histogram *histogram, double ms) {
    int bucket = 0;
    while (bucket < METRICS_BUCKETS && ms * 1e-3 > bounds_s[bucket])
        bucket++;
    histogram->buckets[bucket]++;
    histogram->sum_s += ms * 1e-3;
}

void metrics_reply(struct metrics *metrics, enum metrics_endpoint endpoint, int http_status,
                   double ms, uint64_t received_bytes, uint64_t sent_bytes) {
    pthread_mutex_lock(&metrics->lock);
    if (http_status >= METRICS_STATUS_MIN && http_status <= METRICS_STATUS_MAX)
        metrics->replies[endpoint][http_status - METRICS_STATUS_MIN]++;
    observe(&metrics->requests[endpoint], ms);
    metrics->received_bytes += received_bytes;
    metrics->sent_bytes += sent_bytes;
    pthread_mutex_unlock(&metrics->lock);
}

void metrics_stages(struct metrics *metrics, const double stage_ms[REPORT_STAGE_COUNT]) {
    pthread_mutex_lock(&metrics->lock);
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        observe(&metrics->stages[i], stage_ms[i]);
    pthread_mutex_unlock(&metrics->lock);
}

void metrics_worker_end(struct metrics *metrics, enum metrics_end end) {
    metrics_add(metrics, &metrics->worker_ends[end]);
}

void metrics_add(struct metrics *metrics, uint64_t *counter) {
    pthread_mutex_lock(&metrics->lock);
    (*counter)++;
    pthread_mutex_unlock(&metrics->lock);
}

static void write_head(FILE *out, const char *name, const char *type, const char *help) {
    fprintf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void write_one(FILE *out, const char *name, const char *type, const char *help,
                      double value) {
    write_head(out, name, type, help);
    fprintf(out, "%s %.17g\n", name, value);
}

static void write_histogram(FILE *out, const char *name, const char *label, const char *value,
                            const struct metrics_histogram *histogram) {
    uint64_t count = 0;
    for (int i = 0; i <= METRICS_BUCKETS; i++) {
        count += histogram->buckets[i];
        if (i < METRICS_BUCKETS)
            fprintf(out, "%s_bucket{%s=\"%s\",le=\"%g\"} %llu\n", name, label, value, bounds_s[i],
                    (unsigned long long)count);
    }
    fprintf(out, "%s_bucket{%s=\"%s\",le=\"+Inf\"} %llu\n", name, label, value,
            (unsigned long long)count);
    fprintf(out, "%s_sum{%s=\"%s\"} %.9g\n", name, label, value, histogram->sum_s);
    fprintf(out, "%s_count{%s=\"%s\"} %llu\n", name, label, value, (unsigned long long)count);
}

static void write_requests(FILE *out, const struct metrics *metrics) {
    write_head(out, "pelt_requests_total", "counter", "Requests answered, by resource and status.");
    for (int endpoint = 0; endpoint < METRICS_ENDPOINT_COUNT; endpoint++)
        for (int i = 0; i <= METRICS_STATUS_MAX - METRICS_STATUS_MIN; i++)
            if (metrics->replies[endpoint][i] > 0)
                fprintf(out, "pelt_requests_total{resource=\"%s\",status=\"%d\"} %llu\n",
                        endpoint_names[endpoint], i + METRICS_STATUS_MIN,
                        (unsigned long long)metrics->replies[endpoint][i]);
    write_head(out, "pelt_request_seconds", "histogram",
               "From the request line to the moment when the reply goes to the network.");
    for (int endpoint = 0; endpoint < METRICS_ENDPOINT_COUNT; endpoint++)
        write_histogram(out, "pelt_request_seconds", "resource", endpoint_names[endpoint],
                        &metrics->requests[endpoint]);
    write_head(out, "pelt_stage_seconds", "histogram", "Time of each stage of a drawn picture.");
    for (int i = 0; i < REPORT_STAGE_COUNT; i++)
        write_histogram(out, "pelt_stage_seconds", "stage", report_stage_name((enum report_stage)i),
                        &metrics->stages[i]);
}

static void write_workers(FILE *out, const struct metrics *metrics,
                          const struct metrics_gauges *gauges) {
    write_head(out, "pelt_workers", "gauge", "Worker processes, by state.");
    fprintf(out, "pelt_workers{state=\"starting\"} %d\n", gauges->workers_starting);
    fprintf(out, "pelt_workers{state=\"idle\"} %d\n", gauges->workers_idle);
    fprintf(out, "pelt_workers{state=\"busy\"} %d\n", gauges->workers_busy);
    fprintf(out, "pelt_workers{state=\"down\"} %d\n", gauges->workers_down);
    write_head(out, "pelt_worker_restarts_total", "counter",
               "Worker processes that ended and were replaced, by reason.");
    for (int i = 0; i < METRICS_END_COUNT; i++)
        fprintf(out, "pelt_worker_restarts_total{reason=\"%s\"} %llu\n", end_names[i],
                (unsigned long long)metrics->worker_ends[i]);
    write_one(out, "pelt_retries_total", "counter",
              "Requests given to a second worker after the first one died.",
              (double)metrics->retries);
    write_one(out, "pelt_cancelled_total", "counter", "Requests whose client went away.",
              (double)metrics->cancelled);
    write_one(out, "pelt_client_timeouts_total", "counter",
              "Clients that took too long to send a request or to take a reply.",
              (double)metrics->client_timeouts);
    write_one(out, "pelt_quarantined_scenes", "gauge", "Scenes refused because they crash workers.",
              gauges->quarantined);
}

static void write_jobs(FILE *out, const struct metrics *metrics,
                       const struct metrics_gauges *gauges) {
    const struct jobs_view *jobs = &gauges->jobs;
    write_head(out, "pelt_jobs", "gauge", "Long jobs that wait, run, or are kept, by state.");
    fprintf(out, "pelt_jobs{state=\"queued\"} %d\n", jobs->queued);
    fprintf(out, "pelt_jobs{state=\"running\"} %d\n", jobs->running);
    fprintf(out, "pelt_jobs{state=\"finished\"} %d\n", jobs->finished);
    write_head(out, "pelt_jobs_total", "counter", "Long jobs that have ended, by how they did.");
    fprintf(out, "pelt_jobs_total{state=\"done\"} %llu\n", (unsigned long long)jobs->done);
    fprintf(out, "pelt_jobs_total{state=\"failed\"} %llu\n", (unsigned long long)jobs->failed);
    fprintf(out, "pelt_jobs_total{state=\"cancelled\"} %llu\n",
            (unsigned long long)jobs->cancelled);
    write_head(out, "pelt_job_seconds", "summary", "How long jobs ran, whatever became of them.");
    fprintf(out, "pelt_job_seconds_sum %.9g\npelt_job_seconds_count %llu\n", jobs->ran_s,
            (unsigned long long)jobs->ran);
    write_one(out, "pelt_job_crashes_total", "counter",
              "Processes of jobs that ended before they had answered.",
              (double)metrics->job_crashes);
    write_one(out, "pelt_job_retries_total", "counter",
              "Jobs given to a second process after the first one was killed from outside.",
              (double)jobs->retried);
    write_one(out, "pelt_jobs_expired_total", "counter",
              "Finished jobs that were dropped for their age, or for room.", (double)jobs->expired);
    write_one(out, "pelt_jobs_queue_limit", "gauge", "Jobs that may wait at once.",
              gauges->jobs_limits.queue);
    write_one(out, "pelt_job_result_bytes", "gauge", "Bytes of results held in memory files.",
              (double)jobs->output_bytes);
    write_one(out, "pelt_job_result_bytes_limit", "gauge", "Bytes of results that may be held.",
              (double)gauges->jobs_limits.keep_bytes);
}

/* Resident set of this process, from /proc/self/statm; 0 where it cannot be read. */
static double resident_bytes(void) {
    FILE *file = fopen("/proc/self/statm", "re");
    if (!file)
        return 0;
    unsigned long total = 0, resident = 0;
    bool ok = fscanf(file, "%lu %lu", &total, &resident) == 2;
    fclose(file);
    return ok ? (double)resident * (double)sysconf(_SC_PAGESIZE) : 0;
}

char *metrics_write(struct metrics *metrics, const struct metrics_gauges *gauges, size_t *bytes) {
    struct metrics *copy = malloc(sizeof *copy);
    char *text = NULL;
    FILE *out = copy ? open_memstream(&text, bytes) : NULL;
    if (!out) {
        free(copy);
        return NULL;
    }
    pthread_mutex_lock(&metrics->lock);
    memcpy(copy, metrics, sizeof *copy);
    pthread_mutex_unlock(&metrics->lock);

    write_head(out, "pelt_build_info", "gauge", "Version of the running binary.");
    fprintf(out, "pelt_build_info{version=\"%s\"} 1\n", PELT_VERSION);
    write_requests(out, copy);
    write_one(out, "pelt_queue_length", "gauge", "Requests waiting for a worker.",
              gauges->queue_length);
    write_one(out, "pelt_queue_limit", "gauge", "Requests that may wait at once.",
              gauges->queue_limit);
    write_workers(out, copy, gauges);
    write_jobs(out, copy, gauges);
    write_one(out, "pelt_connections", "gauge", "Open client connections.", gauges->connections);
    write_one(out, "pelt_connections_limit", "gauge", "Client connections that may be open.",
              gauges->connections_limit);
    write_one(out, "pelt_received_bytes_total", "counter", "Bytes of request bodies received.",
              (double)copy->received_bytes);
    write_one(out, "pelt_sent_bytes_total", "counter", "Bytes of reply bodies sent.",
              (double)copy->sent_bytes);
    write_one(out, "pelt_asset_store_bytes", "gauge", "Bytes of assets held in memory files.",
              (double)gauges->store_bytes);
    write_one(out, "pelt_uptime_seconds", "gauge", "Since the daemon was started.",
              gauges->uptime_s);
    write_one(out, "process_resident_memory_bytes", "gauge",
              "Resident memory of the front process.", resident_bytes());
    free(copy);
    bool failed = ferror(out) != 0;
    if (fclose(out) != 0 || failed) {
        free(text);
        return NULL;
    }
    return text;
}
