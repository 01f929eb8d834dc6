/* The HTTP side of the daemon: libmicrohttpd with epoll and a small pool of threads; requests that
 * wait for a worker are suspended and hold no thread. */
#ifndef PELT_SERVICE_HTTP_H
#define PELT_SERVICE_HTTP_H

#include <stdbool.h>
#include <stddef.h>

#include "api/status.h"
#include "service/jobs.h"
#include "service/log.h"
#include "service/metrics.h"
#include "service/quarantine.h"
#include "service/store.h"
#include "service/supervisor.h"

struct http_options {
    const char *listen; /* ADDR:PORT or [ADDR]:PORT; port 0: any */
    size_t body_bytes_max;
    double receive_ms;
    double timeout_ms;     /* told by /v1/capabilities */
    double job_timeout_ms; /* likewise */
    int connections;       /* at most */
};

/* What the handlers stand on; all of it outlives the server. */
struct http_parts {
    struct supervisor *supervisor;
    struct store *store;
    struct jobs *jobs;
    struct quarantine *quarantine;
    struct metrics *metrics;
    const struct log *log;
};

struct http;

/* Binds, listens and answers from now on. STATUS_USAGE for an address that cannot be read,
 * STATUS_IO_ERROR, STATUS_OUT_OF_MEMORY. Main thread. */
enum status http_create(const struct http_options *options, const struct http_parts *parts,
                        struct http **http, struct error *err);

/* Every job has been finished by then. Takes NULL. Blocks until the threads have ended. */
void http_destroy(struct http *http);

const char *http_address(const struct http *http); /* "127.0.0.1:8748", with the real port */

/* Takes no new connection; closes those that are idle. */
void http_drain(struct http *http);
int http_in_flight(struct http *http); /* requests being received, worked on or answered */

/* Cuts clients that are past a deadline; the next time at which that is due. Main thread. */
void http_expire(struct http *http, double now_ms);
double http_due_ms(struct http *http, double now_ms);

#endif
