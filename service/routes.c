/* The table of resources, and those that need no worker. */
#include "service/routes.h"

#include <stdlib.h>
#include <string.h>

#include "api/embedded.h"
#include "service/capabilities.h"
#include "service/jobs_http.h"
#include "service/monotonic.h"
#include "service/render_request.h"
#include "service/reply.h"

/* A success this recent shows that the daemon can draw; see DESIGN.md on /readyz. */
enum { READY_MS = 10000 };

#define TYPE_PLAIN "text/plain; charset=utf-8"

static enum MHD_Result answer_livez(struct request *request) {
    return reply_static(request, MHD_HTTP_OK, TYPE_PLAIN, "alive\n", 6);
}

/* Ready: something was drawn within the last ten seconds, or a worker is busy (being busy is not
 * being unready), or a canary picture can be drawn here and now. */
static enum MHD_Result answer_readyz(struct request *request) {
    struct http *http = request->http;
    struct job *job = &request->job;
    struct supervisor_view view;
    if (request->submitted) {
        if (job->error.status == STATUS_CANCELLED)
            return MHD_NO;
        if (job->error.status != STATUS_OK)
            return reply_error(request, &job->error, job->retry_after_s, false);
        return reply_static(request, MHD_HTTP_OK, TYPE_PLAIN, "ready\n", 6);
    }
    supervisor_view(http->parts.supervisor, &view);
    if (view.busy > 0 || (view.idle > 0 && monotonic_ms() - view.last_success_ms < READY_MS))
        return reply_static(request, MHD_HTTP_OK, TYPE_PLAIN, "ready\n", 6);
    if (view.idle == 0) {
        struct error err = {0};
        error_fault(&err, STATUS_QUEUE_FULL, NULL, "no worker is running: %d starting, %d down",
                    view.starting, view.down);
        enum MHD_Result result = reply_error(request, &err, 1, false);
        error_clear(&err);
        return result;
    }
    return render_request_canary(request);
}

static enum MHD_Result answer_metrics(struct request *request) {
    struct http *http = request->http;
    const struct http_parts *parts = &http->parts;
    struct supervisor_view view;
    supervisor_view(parts->supervisor, &view);
    double now = monotonic_ms();
    struct metrics_gauges gauges = {
        .queue_length = view.queue_length,
        .queue_limit = view.queue_limit,
        .workers_starting = view.starting,
        .workers_idle = view.idle,
        .workers_busy = view.busy,
        .workers_down = view.down,
        .connections = connections_count(&http->connections),
        .connections_limit = http->options.connections,
        .quarantined = quarantine_count(parts->quarantine, now),
        .store_bytes = store_bytes(parts->store),
        .jobs = jobs_view(parts->jobs),
        .jobs_limits = parts->jobs->limits,
        .uptime_s = (now - http->started_ms) * 1e-3,
    };
    size_t bytes = 0;
    char *text = metrics_write(parts->metrics, &gauges, &bytes);
    return reply_text(request, MHD_HTTP_OK, "text/plain; version=0.0.4; charset=utf-8", text,
                      bytes);
}

static enum MHD_Result answer_openapi(struct request *request) {
    const struct embedded *file = embedded_find("api/openapi.yaml");
    if (!file) {
        struct error err = {.status = STATUS_NOT_FOUND};
        return reply_error(request, &err, 0, false);
    }
    return reply_static(request, MHD_HTTP_OK, "application/yaml", file->begin,
                        (size_t)(file->end - file->begin));
}

static enum MHD_Result answer_capabilities(struct request *request) {
    struct http *http = request->http;
    struct supervisor_view view;
    supervisor_view(http->parts.supervisor, &view);
    char *text = capabilities_write(&http->options, &view, http->parts.jobs);
    return reply_text(request, MHD_HTTP_OK, "application/json", text, text ? strlen(text) : 0);
}

static const char *const json_types[] = {"application/json"};

static const struct route routes[] = {
    {"/v1/render", ROUTE_POST, METRICS_ENDPOINT_render, render_request_types, RENDER_REQUEST_TYPES,
     false, render_request_answer},
    {"/v1/plan", ROUTE_POST, METRICS_ENDPOINT_plan, json_types, 1, false, render_request_answer},
    {"/v1/jobs", ROUTE_GET_POST, METRICS_ENDPOINT_jobs, json_types, 1, false, jobs_http_answer},
    {"/v1/sweep", ROUTE_POST, METRICS_ENDPOINT_sweep, json_types, 1, false, jobs_http_answer},
    {"/v1/sequences", ROUTE_POST, METRICS_ENDPOINT_sequences, json_types, 1, false,
     jobs_http_answer},
    {"/v1/jobs/*", ROUTE_GET_DELETE, METRICS_ENDPOINT_jobs, json_types, 1, false,
     jobs_http_answer_one},
    {"/v1/jobs/*/result", ROUTE_GET, METRICS_ENDPOINT_jobs, NULL, 0, true, jobs_http_answer_result},
    {"/v1/jobs/*/result/*", ROUTE_GET, METRICS_ENDPOINT_jobs, NULL, 0, false,
     jobs_http_answer_result},
    {"/v1/capabilities", ROUTE_GET, METRICS_ENDPOINT_capabilities, json_types, 1, false,
     answer_capabilities},
    {"/livez", ROUTE_GET, METRICS_ENDPOINT_livez, NULL, 0, false, answer_livez},
    {"/readyz", ROUTE_GET, METRICS_ENDPOINT_readyz, NULL, 0, false, answer_readyz},
    {"/metrics", ROUTE_GET, METRICS_ENDPOINT_metrics, NULL, 0, false, answer_metrics},
    {"/openapi.yaml", ROUTE_GET, METRICS_ENDPOINT_openapi, NULL, 0, false, answer_openapi},
};

/* Segment by segment; `*` takes one that is not empty and not longer than a capture. */
static bool matches(const char *pattern, const char *path,
                    char captured[REQUEST_CAPTURES][REQUEST_CAPTURE_BYTES]) {
    size_t count = 0;
    for (; *pattern; pattern++) {
        if (*pattern != '*') {
            if (*path++ != *pattern)
                return false;
            continue;
        }
        size_t length = strcspn(path, "/");
        if (length == 0 || length >= REQUEST_CAPTURE_BYTES || count == REQUEST_CAPTURES)
            return false;
        memcpy(captured[count], path, length);
        captured[count++][length] = 0;
        path += length;
    }
    return *path == 0;
}

const struct route *route_find(const char *path,
                               char captured[REQUEST_CAPTURES][REQUEST_CAPTURE_BYTES]) {
    for (size_t i = 0; i < sizeof routes / sizeof *routes; i++)
        if (matches(routes[i].path, path, captured))
            return &routes[i];
    return NULL;
}

static const char *const methods[ROUTE_METHODS][4] = {
    [ROUTE_GET] = {"GET", "HEAD", NULL},
    [ROUTE_POST] = {"POST", NULL},
    [ROUTE_GET_POST] = {"GET", "HEAD", "POST", NULL},
    [ROUTE_GET_DELETE] = {"GET", "HEAD", "DELETE", NULL},
};

const char *route_allow(const struct route *route) {
    static const char *const texts[ROUTE_METHODS] = {
        [ROUTE_GET] = "GET, HEAD",
        [ROUTE_POST] = "POST",
        [ROUTE_GET_POST] = "GET, HEAD, POST",
        [ROUTE_GET_DELETE] = "GET, HEAD, DELETE",
    };
    return texts[route->methods];
}

bool route_has_method(const struct route *route, const char *method) {
    for (const char *const *has = methods[route->methods]; *has; has++)
        if (strcmp(*has, method) == 0)
            return true;
    return false;
}
