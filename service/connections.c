/* Open connections and their absolute deadlines: connections.h says why. */
#include "service/connections.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "api/problem_write.h"
#include "service/monotonic.h"

/* A reply may take 30 s and then a second for every 64 KB: slower clients hold memory for nothing.
 */
enum { SEND_MS = 30000, SEND_BYTES_PER_MS = 64 };

int connections_init(struct connections *connections, double receive_ms, int limit,
                     const struct log *log, struct metrics *metrics) {
    *connections = (struct connections){
        .log = log, .metrics = metrics, .receive_ms = receive_ms, .limit = limit};
    return pthread_mutex_init(&connections->lock, NULL);
}

void connections_finish(struct connections *connections) {
    pthread_mutex_destroy(&connections->lock);
}

struct connection *connections_open(struct connections *connections, int fd) {
    struct connection *connection = calloc(1, sizeof *connection);
    if (!connection)
        return NULL;
    connection->fd = fd;
    connection->fresh = true;
    connection->phase_since_ms = monotonic_ms();
    connection->deadline_ms = connection->phase_since_ms + connections->receive_ms;
    pthread_mutex_lock(&connections->lock);
    connection->next = connections->first;
    if (connection->next)
        connection->next->previous = connection;
    connections->first = connection;
    connections->count++;
    pthread_mutex_unlock(&connections->lock);
    return connection;
}

void connections_close(struct connections *connections, struct connection *connection) {
    pthread_mutex_lock(&connections->lock);
    if (connection->previous)
        connection->previous->next = connection->next;
    else
        connections->first = connection->next;
    if (connection->next)
        connection->next->previous = connection->previous;
    connections->count--;
    pthread_mutex_unlock(&connections->lock);
    free(connection);
}

/* With the lock held. */
static void shut(struct connection *connection) {
    connection->cut = true;
    connection->deadline_ms = INFINITY;
    shutdown(connection->fd, SHUT_RDWR);
}

bool connections_enter(struct connections *connections, struct connection *connection,
                       enum connection_phase phase, double bytes) {
    double now = monotonic_ms();
    pthread_mutex_lock(&connections->lock);
    bool alive = !connection->cut;
    if (alive) {
        connection->fresh = connection->fresh && phase != CONNECTION_SENDING;
        connection->phase = phase;
        if (phase == CONNECTION_IDLE || phase == CONNECTION_RECEIVING)
            connection->request_id[0] = 0;
        connection->phase_since_ms = now;
        switch (phase) {
        case CONNECTION_IDLE:
        case CONNECTION_RECEIVING:
            connection->deadline_ms = now + connections->receive_ms;
            break;
        case CONNECTION_WORKING:
            connection->deadline_ms = INFINITY;
            break;
        case CONNECTION_SENDING:
            connection->deadline_ms = now + SEND_MS + bytes / SEND_BYTES_PER_MS;
            break;
        }
        if (phase == CONNECTION_IDLE && connections->draining)
            shut(connection);
    }
    pthread_mutex_unlock(&connections->lock);
    return alive;
}

/* With the lock held. The reply is small and nothing was sent before it, so the socket's buffer
 * takes it whole or the client is past helping. */
static void cut(struct connections *connections, struct connection *connection, enum status status,
                const char *text) {
    char *id = connection->request_id, head[512];
    struct error err = {0};
    if (!*id)
        request_id_make(id);
    error_fault(&err, status, NULL, "%s", text);
    char *body = problem_write(&err, id);
    error_clear(&err);
    int bytes = snprintf(head, sizeof head,
                         "HTTP/1.1 %d %s\r\nContent-Type: " PROBLEM_MEDIA_TYPE "\r\n"
                         "Content-Length: %zu\r\nConnection: close\r\nX-Request-Id: %s\r\n"
                         "Server-Timing: total;dur=%.0f\r\n\r\n",
                         status_http(status), status_slug(status), body ? strlen(body) : 0, id,
                         monotonic_ms() - connection->phase_since_ms);
    if (bytes > 0 && (size_t)bytes < sizeof head) {
        struct iovec parts[] = {{head, (size_t)bytes}, {body, body ? strlen(body) : 0}};
        struct msghdr reply = {.msg_iov = parts, .msg_iovlen = 2};
        ssize_t sent = sendmsg(connection->fd, &reply, MSG_DONTWAIT | MSG_NOSIGNAL);
        (void)sent;
    }
    free(body);
    log_event(connections->log, LOG_INFO, "request cut off", LOG_TEXT("id", id),
              LOG_NUMBER("status", status_http(status)));
    connection->cut_status = status_http(status);
    shut(connection);
}

void connections_cut(struct connections *connections, struct connection *connection,
                     enum status status, const char *text) {
    pthread_mutex_lock(&connections->lock);
    if (!connection->cut)
        cut(connections, connection, status, text);
    pthread_mutex_unlock(&connections->lock);
}

void connections_name(struct connections *connections, struct connection *connection,
                      const char id[REQUEST_ID_BYTES]) {
    pthread_mutex_lock(&connections->lock);
    memcpy(connection->request_id, id, REQUEST_ID_BYTES);
    pthread_mutex_unlock(&connections->lock);
}

int connections_cut_status(struct connections *connections, struct connection *connection) {
    pthread_mutex_lock(&connections->lock);
    int status = connection->cut_status;
    pthread_mutex_unlock(&connections->lock);
    return status;
}

void connections_expire(struct connections *connections, double now_ms) {
    pthread_mutex_lock(&connections->lock);
    for (struct connection *at = connections->first; at; at = at->next) {
        if (at->deadline_ms > now_ms)
            continue;
        metrics_add(connections->metrics, &connections->metrics->client_timeouts);
        if (at->phase == CONNECTION_RECEIVING || (at->phase == CONNECTION_IDLE && at->fresh))
            cut(connections, at, STATUS_REQUEST_TIMEOUT,
                "the request did not arrive within the server's time limit");
        else
            shut(at);
    }
    pthread_mutex_unlock(&connections->lock);
}

double connections_due_ms(struct connections *connections, double now_ms) {
    /* A connection that opens after this has its deadline no earlier than receive_ms from now. */
    double due = INFINITY;
    pthread_mutex_lock(&connections->lock);
    for (struct connection *at = connections->first; at; at = at->next)
        due = fmin(due, at->deadline_ms);
    pthread_mutex_unlock(&connections->lock);
    return fmin(due, now_ms + connections->receive_ms);
}

void connections_drain(struct connections *connections) {
    pthread_mutex_lock(&connections->lock);
    connections->draining = true;
    for (struct connection *at = connections->first; at; at = at->next)
        if (at->phase == CONNECTION_IDLE)
            shut(at);
    pthread_mutex_unlock(&connections->lock);
}

bool connections_draining(struct connections *connections) {
    pthread_mutex_lock(&connections->lock);
    bool draining = connections->draining;
    pthread_mutex_unlock(&connections->lock);
    return draining;
}

int connections_count(struct connections *connections) {
    pthread_mutex_lock(&connections->lock);
    int count = connections->count;
    pthread_mutex_unlock(&connections->lock);
    return count;
}

int connections_in_flight(struct connections *connections) {
    int count = 0;
    pthread_mutex_lock(&connections->lock);
    for (struct connection *at = connections->first; at; at = at->next)
        count += at->phase != CONNECTION_IDLE && !at->cut;
    pthread_mutex_unlock(&connections->lock);
    return count;
}
