/* The HTTP server: libmicrohttpd's life, and the way of a request through its callbacks.
 *
 * libmicrohttpd calls handle() when the head is there, for each piece of the body, when the body is
 * over, and again after a suspended connection was resumed. A reply can be queued at the head or at
 * the end, not between; so a request that is refused early has its body read and dropped (up to the
 * limit for bodies) before it is told, because a client that is still writing would otherwise see
 * its connection reset and not the reply. Where the client waits for `100 Continue`, or announces
 * more than the limit, it is told at once.
 *
 * libmicrohttpd 0.9.75 lets two Content-Lengths pass, and Content-Length beside Transfer-Encoding,
 * even in strict mode (measured). Behind a proxy that reads them the other way this smuggles
 * requests: they are refused here, and the connection is closed. */
#include "service/http.h"

#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <netdb.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <unistd.h>

#include "service/accept.h"
#include "service/monotonic.h"
#include "service/render_request.h"
#include "service/reply.h"
#include "service/request.h"
#include "service/routes.h"

enum {
    THREADS = 2,
    BACKLOG = 511,
    CONNECTION_MEMORY = 16 * 1024, /* also the largest head of a request */
    CONNECTION_STACK = 256 * 1024, /* jansson's recursion is limited by SCENE_DEPTH_MAX */
    INACTIVITY_S = 30
};

/* ---- the head ---- */

struct framing {
    int content_lengths, transfer_encodings, hosts;
    bool chunked, expects_continue, has_encoding;
    uint64_t content_length;
};

static enum MHD_Result look_at_header(void *user, enum MHD_ValueKind kind, const char *name,
                                      const char *value) {
    struct framing *framing = user;
    (void)kind;
    if (!value)
        return MHD_YES;
    if (strcasecmp(name, MHD_HTTP_HEADER_CONTENT_LENGTH) == 0) {
        framing->content_lengths++;
        framing->content_length = strtoull(value, NULL, 10);
    } else if (strcasecmp(name, MHD_HTTP_HEADER_TRANSFER_ENCODING) == 0) {
        framing->transfer_encodings++;
        framing->chunked = strcasecmp(value, "chunked") == 0;
    } else if (strcasecmp(name, MHD_HTTP_HEADER_EXPECT) == 0) {
        framing->expects_continue = strcasecmp(value, "100-continue") == 0;
    } else if (strcasecmp(name, MHD_HTTP_HEADER_CONTENT_ENCODING) == 0) {
        framing->has_encoding = strcasecmp(value, "identity") != 0;
    }
    return MHD_YES;
}

/* Joins the lines of a header with commas (RFC 9110, 5.3); what does not fit is left out. */
struct joined {
    const char *name;
    char text[1024];
};

static enum MHD_Result join_header(void *user, enum MHD_ValueKind kind, const char *name,
                                   const char *value) {
    struct joined *joined = user;
    (void)kind;
    size_t at = strlen(joined->text);
    if (value && strcasecmp(name, joined->name) == 0)
        snprintf(joined->text + at, sizeof joined->text - at, "%s%s", at ? "," : "", value);
    return MHD_YES;
}

int request_choose_type(struct request *request, const char *const *types, size_t count) {
    struct joined accept = {.name = MHD_HTTP_HEADER_ACCEPT};
    MHD_get_connection_values(request->mhd, MHD_HEADER_KIND, join_header, &accept);
    return accept_choose(accept.text, types, count);
}

/* What can be said against a request by its head alone. */
static enum status check_head(struct request *request, const struct framing *framing,
                              struct error *err) {
    const struct route *route = request->route;
    const struct http_options *options = &request->http->options;
    if (!route)
        return error_fault(err, STATUS_NOT_FOUND, NULL, "there is no %s here", request->path);
    if (!route_has_method(route, request->method))
        return error_fault(err, STATUS_METHOD_NOT_ALLOWED, NULL, "%s takes %s", request->path,
                           route_allow(route));
    if (route->types && strcmp(request->method, MHD_HTTP_METHOD_DELETE) != 0) {
        request->chosen_type = request_choose_type(request, route->types, route->type_count);
        if (request->chosen_type < 0) {
            char types[128] = "";
            for (size_t i = 0; i < route->type_count; i++) {
                size_t at = strlen(types);
                snprintf(types + at, sizeof types - at, "%s%s", i ? ", " : "", route->types[i]);
            }
            return error_fault(err, STATUS_NOT_ACCEPTABLE, NULL, "%s gives %s", request->path,
                               types);
        }
    }
    if (framing->content_length > options->body_bytes_max)
        return error_fault(err, STATUS_SCENE_TOO_LARGE, NULL,
                           "a request's body has at most %zu bytes", options->body_bytes_max);
    request->takes_scene = strcmp(request->method, MHD_HTTP_METHOD_POST) == 0;
    if (!request->takes_scene)
        return STATUS_OK;
    if (framing->has_encoding)
        return error_fault(err, STATUS_UNSUPPORTED_MEDIA_TYPE, NULL,
                           "Content-Encoding is not supported");
    return render_request_begin(
        request,
        MHD_lookup_connection_value(request->mhd, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_TYPE),
        err);
}

static enum MHD_Result handle_head(struct request *request, const char *path, const char *method) {
    struct framing framing = {0};
    MHD_get_connection_values(request->mhd, MHD_HEADER_KIND, look_at_header, &framing);
    snprintf(request->method, sizeof request->method, "%s", method);
    snprintf(request->path, sizeof request->path, "%s", path);
    if (!request_id_take(request->id, MHD_lookup_connection_value(request->mhd, MHD_HEADER_KIND,
                                                                  "X-Request-Id")))
        request_id_make(request->id);
    connections_name(&request->http->connections, request->connection, request->id);
    if (framing.content_lengths > 1 || framing.transfer_encodings > 1 ||
        (framing.transfer_encodings && (framing.content_lengths || !framing.chunked))) {
        error_fault(&request->error, STATUS_BAD_REQUEST, NULL,
                    "the length of the body is given twice or in a way that is not known");
        return reply_error(request, &request->error, 0, true);
    }
    request->route = route_find(path, request->captured);
    enum status status = check_head(request, &framing, &request->error);
    if (status == STATUS_OK || (!framing.expects_continue &&
                                framing.content_length <= request->http->options.body_bytes_max))
        return MHD_YES; /* a refusal is told when the body has been read */
    return reply_error(request, &request->error, 0, true);
}

/* ---- body and end ---- */

static enum MHD_Result handle_body(struct request *request, const char *data, size_t bytes) {
    struct http *http = request->http;
    request->body_bytes += bytes;
    if (request->body_bytes > http->options.body_bytes_max) { /* chunked: not announced */
        connections_cut(&http->connections, request->connection, STATUS_SCENE_TOO_LARGE,
                        "the request's body is larger than this server accepts");
        return MHD_NO;
    }
    if (request->error.status != STATUS_OK || !request->takes_scene)
        return MHD_YES; /* read and dropped */
    if (render_request_body(request, data, bytes, &request->error) != STATUS_OK) {
        free(request->scene);
        request->scene = NULL;
        request->scene_capacity = request->scene_bytes = 0;
    }
    return MHD_YES;
}

static enum MHD_Result handle_end(struct request *request) {
    /* From here on the receive deadline is over; a request that it has caught is not answered. */
    if (!request->submitted &&
        !connections_enter(&request->http->connections, request->connection, CONNECTION_WORKING, 0))
        return MHD_NO;
    if (request->error.status != STATUS_OK)
        return reply_error(request, &request->error,
                           request->error.status == STATUS_QUEUE_FULL ? 1 : 0, false);
    return request->route->answer(request);
}

static enum MHD_Result handle(void *user, struct MHD_Connection *mhd, const char *path,
                              const char *method, const char *version, const char *data,
                              size_t *bytes, void **context) {
    struct request *request = *context;
    (void)user;
    (void)version;
    if (!request)
        return MHD_NO; /* there was no memory for it */
    request->mhd = mhd;
    if (!request->head_read) {
        request->head_read = true;
        return handle_head(request, path, method);
    }
    if (*bytes > 0) {
        size_t got = *bytes;
        *bytes = 0;
        return handle_body(request, data, got);
    }
    return handle_end(request);
}

/* ---- life of requests and connections ---- */

static void *request_begins(void *user, const char *uri, struct MHD_Connection *mhd) {
    struct http *http = user;
    (void)uri;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    struct connection *connection = info ? info->socket_context : NULL;
    struct request *request = connection ? calloc(1, sizeof *request) : NULL;
    if (!request)
        return NULL;
    request->http = http;
    request->mhd = mhd;
    request->connection = connection;
    request->begun_ms = monotonic_ms();
    job_init(&request->job);
    connections_enter(&http->connections, connection, CONNECTION_RECEIVING, 0);
    return request;
}

void request_count(struct request *request) {
    if (request->counted)
        return;
    request->counted = true;
    metrics_reply(request->http->parts.metrics,
                  request->route ? request->route->endpoint : METRICS_ENDPOINT_other,
                  (int)request->http_status, monotonic_ms() - request->begun_ms,
                  request->body_bytes, request->reply_bytes);
}

static void request_ends(void *user, struct MHD_Connection *mhd, void **context,
                         enum MHD_RequestTerminationCode why) {
    struct http *http = user;
    struct request *request = *context;
    (void)mhd;
    *context = NULL;
    if (!request)
        return;
    double ms = monotonic_ms() - request->begun_ms;
    bool whole = why == MHD_REQUEST_TERMINATED_COMPLETED_OK;
    if (request->http_status == 0)
        request->http_status =
            (unsigned)connections_cut_status(&http->connections, request->connection);
    if (request->head_read) {
        request_count(request);
        log_event(http->parts.log, LOG_INFO, whole ? "request" : "request broken off",
                  LOG_TEXT("id", request->id), LOG_TEXT("method", request->method),
                  LOG_TEXT("path", request->path), LOG_NUMBER("status", request->http_status),
                  LOG_NUMBER("ms", ms), LOG_NUMBER("received", request->body_bytes),
                  LOG_NUMBER("sent", request->reply_bytes));
    }
    connections_enter(&http->connections, request->connection, CONNECTION_IDLE, 0);
    render_request_finish(request);
    error_clear(&request->error);
    free(request);
}

static void connection_changes(void *user, struct MHD_Connection *mhd, void **context,
                               enum MHD_ConnectionNotificationCode what) {
    struct http *http = user;
    if (what == MHD_CONNECTION_NOTIFY_STARTED) {
        const union MHD_ConnectionInfo *info =
            MHD_get_connection_info(mhd, MHD_CONNECTION_INFO_CONNECTION_FD);
        *context = info ? connections_open(&http->connections, info->connect_fd) : NULL;
    } else if (*context) {
        connections_close(&http->connections, *context);
        *context = NULL;
    }
}

/* libmicrohttpd's own complaints are about clients that break the protocol or leave: not worth a
 * line each, and they would let a client fill the log. */
static void drop_message(void *user, const char *format, va_list args) {
    (void)user;
    (void)format;
    (void)args;
}

/* ---- the listening socket ---- */

/* "127.0.0.1:8748", "[::1]:0", "localhost:8080". */
static enum status bind_listen(const char *listen_at, int *fd, char *address, size_t address_bytes,
                               struct error *err) {
    char host[256];
    const char *colon = strrchr(listen_at, ':');
    size_t length = colon ? (size_t)(colon - listen_at) : 0;
    bool bracketed = length >= 2 && listen_at[0] == '[' && listen_at[length - 1] == ']';
    if (!colon || length >= sizeof host || (!bracketed && memchr(listen_at, ':', length)))
        return error_fault(err, STATUS_USAGE, NULL, "--listen %s: expected ADDR:PORT", listen_at);
    snprintf(host, sizeof host, "%.*s", (int)(length - 2 * (size_t)bracketed),
             listen_at + bracketed);
    struct addrinfo hints = {.ai_socktype = SOCK_STREAM, .ai_flags = AI_PASSIVE | AI_NUMERICSERV};
    struct addrinfo *found = NULL;
    int failed = getaddrinfo(*host ? host : NULL, colon + 1, &hints, &found);
    if (failed)
        return error_fault(err, STATUS_USAGE, NULL, "--listen %s: %s", listen_at,
                           gai_strerror(failed));
    int yes = 1;
    *fd = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    struct sockaddr_storage actual;
    socklen_t actual_bytes = sizeof actual;
    char name[INET6_ADDRSTRLEN + 16], port[8];
    if (*fd < 0 || setsockopt(*fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
        bind(*fd, found->ai_addr, found->ai_addrlen) != 0 || listen(*fd, BACKLOG) != 0 ||
        getsockname(*fd, (struct sockaddr *)&actual, &actual_bytes) != 0 ||
        getnameinfo((struct sockaddr *)&actual, actual_bytes, name, sizeof name, port, sizeof port,
                    NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        error_fault(err, STATUS_IO_ERROR, NULL, "--listen %s: %s", listen_at, strerror(errno));
        if (*fd >= 0)
            close(*fd);
        *fd = -1;
    } else {
        snprintf(address, address_bytes, strchr(name, ':') ? "[%s]:%s" : "%s:%s", name, port);
    }
    freeaddrinfo(found);
    return *fd >= 0 ? STATUS_OK : STATUS_IO_ERROR;
}

enum status http_create(const struct http_options *options, const struct http_parts *parts,
                        struct http **out, struct error *err) {
    *out = NULL;
    int fd = -1;
    struct http *http = calloc(1, sizeof *http);
    if (!http)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the server");
    http->options = *options;
    http->parts = *parts;
    http->started_ms = monotonic_ms();
    if (connections_init(&http->connections, options->receive_ms, options->connections, parts->log,
                         parts->metrics) != 0) {
        free(http);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the server");
    }
    enum status status =
        bind_listen(options->listen, &fd, http->address, sizeof http->address, err);
    if (status == STATUS_OK) {
        http->daemon = MHD_start_daemon(
            MHD_USE_EPOLL_INTERNAL_THREAD | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG, 0, NULL,
            NULL, handle, http, MHD_OPTION_EXTERNAL_LOGGER, drop_message, NULL,
            MHD_OPTION_LISTEN_SOCKET, fd, MHD_OPTION_THREAD_POOL_SIZE, (unsigned)THREADS,
            MHD_OPTION_THREAD_STACK_SIZE, (size_t)CONNECTION_STACK,
            MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)CONNECTION_MEMORY,
            MHD_OPTION_CONNECTION_LIMIT, (unsigned)options->connections,
            MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)INACTIVITY_S, MHD_OPTION_STRICT_FOR_CLIENT, 1,
            MHD_OPTION_URI_LOG_CALLBACK, request_begins, http, MHD_OPTION_NOTIFY_COMPLETED,
            request_ends, http, MHD_OPTION_NOTIFY_CONNECTION, connection_changes, http,
            MHD_OPTION_END);
        if (!http->daemon) {
            close(fd);
            status = error_fault(err, STATUS_IO_ERROR, NULL, "the HTTP server does not start");
        }
    }
    if (status != STATUS_OK) {
        http_destroy(http);
        return status;
    }
    *out = http;
    return STATUS_OK;
}

void http_destroy(struct http *http) {
    if (!http)
        return;
    if (http->daemon)
        MHD_stop_daemon(http->daemon);
    connections_finish(&http->connections);
    free(http);
}

const char *http_address(const struct http *http) {
    return http->address;
}

void http_drain(struct http *http) {
    int fd = MHD_quiesce_daemon(http->daemon);
    if (fd != MHD_INVALID_SOCKET)
        close(fd);
    connections_drain(&http->connections);
}

int http_in_flight(struct http *http) {
    return connections_in_flight(&http->connections);
}

void http_expire(struct http *http, double now_ms) {
    connections_expire(&http->connections, now_ms);
}

double http_due_ms(struct http *http, double now_ms) {
    return connections_due_ms(&http->connections, now_ms);
}
