/* The resources of the daemon, one row each. */
#ifndef PELT_SERVICE_ROUTES_H
#define PELT_SERVICE_ROUTES_H

#include "service/request.h"

/* Which methods a resource has; every POST takes a scene. */
enum route_methods { ROUTE_GET, ROUTE_POST, ROUTE_GET_POST, ROUTE_GET_DELETE, ROUTE_METHODS };

struct route {
    const char *path; /* `*` stands for one segment */
    enum route_methods methods;
    enum metrics_endpoint endpoint;
    const char *const *types; /* media types it can reply in, the most wanted first; NULL: the
                                 Accept header does not count */
    size_t type_count;
    bool chooses; /* by Accept, but only once it is known what there is */
    /* Called when the request has arrived whole, and once more after its job has come back
     * (request->submitted). Queues a reply, or suspends the connection by submitting a job. */
    enum MHD_Result (*answer)(struct request *request);
};

/* NULL: no such resource. `captured` gets the segments that `*` stood for. */
const struct route *route_find(const char *path,
                               char captured[REQUEST_CAPTURES][REQUEST_CAPTURE_BYTES]);
const char *route_allow(const struct route *route); /* the value of Allow */
bool route_has_method(const struct route *route, const char *method);

#endif
