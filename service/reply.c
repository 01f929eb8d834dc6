/* Headers, Server-Timing and problem documents of every reply. */
#include "service/reply.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "api/problem_write.h"
#include "service/monotonic.h"
#include "service/routes.h"

/* Server-Timing: a drawn picture's stages, and the total. The total of a picture is that of its
 * report; of all else it runs from the request line until now. */
static void add_timing(struct request *request, struct MHD_Response *response) {
    char text[512];
    size_t at = 0;
    double total_ms = monotonic_ms() - request->begun_ms;
    const struct job *job = &request->job;
    if (request->submitted && job->error.status == STATUS_OK && job->total_ms > 0) {
        total_ms = job->total_ms;
        for (int i = 0; i < REPORT_STAGE_COUNT && at < sizeof text - 64; i++)
            at += (size_t)snprintf(text + at, sizeof text - at, "%s;dur=%.3f, ",
                                   report_stage_name((enum report_stage)i), job->stage_ms[i]);
    }
    snprintf(text + at, sizeof text - at, "total;dur=%.3f", total_ms);
    MHD_add_response_header(response, "Server-Timing", text);
}

/* Queues the reply and gives the response back. A header that cannot be added (memory) is left out:
 * a reply without it is better than none. */
static enum MHD_Result queue(struct request *request, unsigned http_status, const char *type,
                             struct MHD_Response *response, uint64_t bytes, bool close) {
    if (!response)
        return MHD_NO;
    if (type)
        MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, type);
    if (*request->location)
        MHD_add_response_header(response, MHD_HTTP_HEADER_LOCATION, request->location);
    MHD_add_response_header(response, "X-Request-Id", request->id);
    MHD_add_response_header(response, "X-Content-Type-Options", "nosniff");
    MHD_add_response_header(response, MHD_HTTP_HEADER_CACHE_CONTROL, "no-store");
    if (request->route && (request->route->type_count > 1 || request->route->chooses))
        MHD_add_response_header(response, MHD_HTTP_HEADER_VARY, "Accept");
    add_timing(request, response);
    if (close || connections_draining(&request->http->connections))
        MHD_add_response_header(response, MHD_HTTP_HEADER_CONNECTION, "close");
    connections_enter(&request->http->connections, request->connection, CONNECTION_SENDING,
                      (double)bytes);
    request->http_status = http_status;
    request->reply_bytes = strcmp(request->method, "HEAD") == 0 ? 0 : bytes;
    request_count(request);
    enum MHD_Result result = MHD_queue_response(request->mhd, http_status, response);
    MHD_destroy_response(response);
    return result;
}

enum MHD_Result reply_text(struct request *request, unsigned http_status, const char *type,
                           char *text, size_t bytes) {
    if (!text) {
        struct error err = {.status = STATUS_OUT_OF_MEMORY};
        return reply_error(request, &err, 1, false);
    }
    struct MHD_Response *response =
        MHD_create_response_from_buffer(bytes, text, MHD_RESPMEM_MUST_FREE);
    if (!response)
        free(text);
    return queue(request, http_status, type, response, bytes, false);
}

enum MHD_Result reply_static(struct request *request, unsigned http_status, const char *type,
                             const char *text, size_t bytes) {
    /* libmicrohttpd takes a plain pointer, and only reads from it (MHD_RESPMEM_PERSISTENT). */
    return queue(
        request, http_status, type,
        MHD_create_response_from_buffer(bytes, (void *)(uintptr_t)text, MHD_RESPMEM_PERSISTENT),
        bytes, false);
}

enum MHD_Result reply_file(struct request *request, const char *type, int fd, size_t bytes) {
    struct MHD_Response *response = MHD_create_response_from_fd64(bytes, fd);
    if (!response)
        close(fd);
    return queue(request, MHD_HTTP_OK, type, response, bytes, false);
}

enum MHD_Result reply_part(struct request *request, const char *type, int fd, size_t offset,
                           size_t bytes) {
    struct MHD_Response *response =
        MHD_create_response_from_fd_at_offset64(bytes, fd, (uint64_t)offset);
    if (!response)
        close(fd);
    return queue(request, MHD_HTTP_OK, type, response, bytes, false);
}

enum MHD_Result reply_growing(struct request *request, const char *type,
                              struct MHD_Response *response) {
    enum MHD_Result result = queue(request, MHD_HTTP_OK, type, response, 0, false);
    connections_enter(&request->http->connections, request->connection, CONNECTION_WORKING, 0);
    return result;
}

enum MHD_Result reply_nothing(struct request *request) {
    return queue(request, MHD_HTTP_NO_CONTENT, NULL,
                 MHD_create_response_from_buffer(0, NULL, MHD_RESPMEM_PERSISTENT), 0, false);
}

enum MHD_Result reply_job(struct request *request, const char *type) {
    struct job *job = &request->job;
    int fd = job->body_fd;
    job->body_fd = -1;
    return reply_file(request, type, fd, job->body_bytes);
}

enum MHD_Result reply_error(struct request *request, const struct error *error,
                            double retry_after_s, bool close) {
    enum status status = error->status;
    /* Where there is no memory even for this, the reply is the bare status. */
    char *text = problem_write(error, request->id);
    size_t bytes = text ? strlen(text) : 0;
    struct MHD_Response *response =
        MHD_create_response_from_buffer(bytes, text, MHD_RESPMEM_MUST_FREE);
    if (!response) {
        free(text);
        return MHD_NO;
    }
    if (retry_after_s > 0) {
        char value[32];
        snprintf(value, sizeof value, "%.0f", ceil(retry_after_s));
        MHD_add_response_header(response, MHD_HTTP_HEADER_RETRY_AFTER, value);
    }
    if (status == STATUS_METHOD_NOT_ALLOWED && request->route)
        MHD_add_response_header(response, MHD_HTTP_HEADER_ALLOW, route_allow(request->route));
    return queue(request, (unsigned)status_http(status), PROBLEM_MEDIA_TYPE, response, bytes,
                 close);
}
