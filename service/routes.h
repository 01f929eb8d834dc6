/* The resources of the daemon, one row each. */
#ifndef PELT_SERVICE_ROUTES_H
#define PELT_SERVICE_ROUTES_H

#include "service/request.h"

struct route {
    const char *path;
    bool takes_scene; /* POST with a scene; otherwise GET and HEAD */
    enum metrics_endpoint endpoint;
    const char *const *types; /* media types it can reply in, the most wanted first; NULL: the
                                 Accept header does not count */
    size_t type_count;
    /* Called when the request has arrived whole, and once more after its job has come back
     * (request->submitted). Queues a reply, or suspends the connection by submitting a job. */
    enum MHD_Result (*answer)(struct request *request);
};

const struct route *route_find(const char *path);   /* NULL: no such resource */
const char *route_allow(const struct route *route); /* the value of Allow */
bool route_has_method(const struct route *route, const char *method);

#endif
