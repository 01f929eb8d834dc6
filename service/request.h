/* One HTTP request on its way through the handlers. Belongs to the libmicrohttpd thread that calls
 * them; while suspended, its job belongs to the supervisor and nobody touches the rest. */
#ifndef PELT_SERVICE_REQUEST_H
#define PELT_SERVICE_REQUEST_H

#include <microhttpd.h>
#include <stdatomic.h>
#include <stdbool.h>

#include "api/status.h"
#include "service/connections.h"
#include "service/http.h"
#include "service/job.h"
#include "service/multipart.h"
#include "service/request_id.h"

struct http {
    struct http_options options;
    struct http_parts parts;
    struct MHD_Daemon *daemon;
    struct connections connections;
    char address[128];
    double started_ms;
    atomic_size_t held_bytes; /* bodies being received or waiting, all requests together */
};

struct route;

enum { REQUEST_CAPTURES = 2, REQUEST_CAPTURE_BYTES = 64 };

struct request {
    struct http *http;
    struct MHD_Connection *mhd;
    struct connection *connection;
    const struct route *route; /* NULL: no such resource */
    char id[REQUEST_ID_BYTES];
    char method[16], path[128];                             /* for the log; cut off */
    char captured[REQUEST_CAPTURES][REQUEST_CAPTURE_BYTES]; /* what `*` in the route stands for */
    double begun_ms;     /* monotonic: the request line was read */
    bool head_read;      /* the first call of the handler has been made */
    bool takes_scene;    /* the body is a scene */
    bool submitted;      /* the job is, or has been, the supervisor's */
    int chosen_type;     /* index among the route's media types */
    struct error error;  /* why it is refused; told once the body has been read off */
    uint64_t body_bytes; /* received so far */
    size_t held_bytes;   /* of http->held_bytes */

    /* The scene's text, and where a multipart body is being taken apart. */
    char *scene;
    size_t scene_bytes, scene_capacity;
    bool is_multipart;
    struct multipart multipart;
    struct digest digest; /* of the part that is arriving */
    bool scene_seen, in_scene;

    struct job job;

    char location[96];    /* of the reply, where something was made; "": no such header */
    unsigned http_status; /* of the reply; 0: none yet */
    uint64_t reply_bytes;
    bool counted; /* in the metrics */
};

/* Counts the request in the metrics, once: when its reply is handed to the network, so that a
 * client that has its reply finds it counted, or else when it ends without one. */
void request_count(struct request *request);

/* The index of the media type that its Accept headers prefer; -1: none. */
int request_choose_type(struct request *request, const char *const *types, size_t count);

#endif
