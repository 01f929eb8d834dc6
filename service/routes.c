/* The table of resources, and those that need no worker. */
#include "service/routes.h"

#include <stdlib.h>
#include <string.h>

#include "api/embedded.h"
#include "service/capabilities.h"
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
    char *text = capabilities_write(&http->options, &view);
    return reply_text(request, MHD_HTTP_OK, "application/json", text, text ? strlen(text) : 0);
}

static const char *const json_types[] = {"application/json"};

static const struct route routes[] = {
    {"/v1/render", true, METRICS_ENDPOINT_render, render_request_types, RENDER_REQUEST_TYPES,
     render_request_answer},
    {"/v1/plan", true, METRICS_ENDPOINT_plan, json_types, 1, render_request_answer},
    {"/v1/capabilities", false, METRICS_ENDPOINT_capabilities, json_types, 1, answer_capabilities},
    {"/livez", false, METRICS_ENDPOINT_livez, NULL, 0, answer_livez},
    {"/readyz", false, METRICS_ENDPOINT_readyz, NULL, 0, answer_readyz},
    {"/metrics", false, METRICS_ENDPOINT_metrics, NULL, 0, answer_metrics},
    {"/openapi.yaml", false, METRICS_ENDPOINT_openapi, NULL, 0, answer_openapi},
};

const struct route *route_find(const char *path) {
    for (size_t i = 0; i < sizeof routes / sizeof *routes; i++)
        if (strcmp(routes[i].path, path) == 0)
            return &routes[i];
    return NULL;
}

const char *route_allow(const struct route *route) {
    return route->takes_scene ? "POST" : "GET, HEAD";
}

bool route_has_method(const struct route *route, const char *method) {
    if (route->takes_scene)
        return strcmp(method, "POST") == 0;
    return strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0;
}
