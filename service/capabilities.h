/* GET /v1/capabilities: what this daemon can draw, with what, and up to which limits. */
#ifndef PELT_SERVICE_CAPABILITIES_H
#define PELT_SERVICE_CAPABILITIES_H

#include "service/http.h"

/* JSON, malloc'ed; NULL where memory ran out. Thread: any. */
char *capabilities_write(const struct http_options *options, const struct supervisor_view *view,
                         const struct jobs *jobs);

#endif
