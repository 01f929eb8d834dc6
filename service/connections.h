/* Every open client connection, and how long it may stay as it is.
 *
 * libmicrohttpd's own time-out is one of inactivity: a client that sends one byte a second would
 * live for ever. So each phase of a connection has an absolute deadline here, kept by the main
 * thread: past it the descriptor is shut down, which libmicrohttpd sees as a client that left. */
#ifndef PELT_SERVICE_CONNECTIONS_H
#define PELT_SERVICE_CONNECTIONS_H

#include <pthread.h>
#include <stdbool.h>
#include <stddef.h>

#include "api/status.h"
#include "service/log.h"
#include "service/metrics.h"
#include "service/request_id.h"

enum connection_phase {
    CONNECTION_IDLE,      /* nothing of a request has been parsed */
    CONNECTION_RECEIVING, /* from the request line to the end of the body */
    CONNECTION_WORKING,   /* being answered; no deadline here, the supervisor has one */
    CONNECTION_SENDING    /* the reply is under way */
};

struct connection {
    struct connection *next, *previous;
    int fd; /* not owned */
    enum connection_phase phase;
    bool fresh;                         /* no request was completed on it */
    bool cut;                           /* shut down by us */
    int cut_status;                     /* HTTP status that it was told then; 0: none */
    char request_id[REQUEST_ID_BYTES];  /* of the request that is arriving; "": not known yet */
    double phase_since_ms, deadline_ms; /* monotonic; INFINITY: none */
};

struct connections {
    const struct log *log;
    struct metrics *metrics;
    double receive_ms; /* for a whole request, and for an idle connection */
    int limit;

    /* Guards what follows. Held while a canned reply is put into a socket's buffer (it does not
     * block), so that the descriptor cannot be closed and reused in between. */
    pthread_mutex_t lock;
    struct connection *first;
    int count;
    bool draining;
};

int connections_init(struct connections *connections, double receive_ms, int limit,
                     const struct log *log, struct metrics *metrics); /* 0, or an errno */
void connections_finish(struct connections *connections);

struct connection *connections_open(struct connections *connections, int fd); /* NULL: no memory */
void connections_close(struct connections *connections, struct connection *connection);

/* Enters a phase; `bytes` is what CONNECTION_SENDING has to send. False where the connection has
 * been cut: nothing more will come of it. */
bool connections_enter(struct connections *connections, struct connection *connection,
                       enum connection_phase phase, double bytes);

/* Answers at once, past libmicrohttpd, and shuts the descriptor down: for a request whose body is
 * still arriving, to which libmicrohttpd cannot reply. */
void connections_cut(struct connections *connections, struct connection *connection,
                     enum status status, const char *text);

/* The request that arrives is called this from now on. */
void connections_name(struct connections *connections, struct connection *connection,
                      const char id[REQUEST_ID_BYTES]);

/* The HTTP status with which the connection was cut; 0: it was not. */
int connections_cut_status(struct connections *connections, struct connection *connection);

/* Cuts whatever is past its deadline. Main thread. */
void connections_expire(struct connections *connections, double now_ms);
double connections_due_ms(struct connections *connections, double now_ms);

/* From now on connections do not outlive their request: idle ones are closed here and now. */
void connections_drain(struct connections *connections);
bool connections_draining(struct connections *connections);

int connections_count(struct connections *connections);
int connections_in_flight(struct connections *connections); /* those not idle */

#endif
