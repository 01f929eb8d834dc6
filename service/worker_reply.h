/* The body of a reply, made in the worker: a picture, or JSON that holds the report. */
#ifndef PELT_SERVICE_WORKER_REPLY_H
#define PELT_SERVICE_WORKER_REPLY_H

#include <stddef.h>

#include "renderer/render.h"
#include "service/job.h"

enum worker_reply { WORKER_REPLY_PICTURE, WORKER_REPLY_PLAN };

/* Encodes what `result` holds into a sealed memory file (the caller closes it). Adds the time to
 * result->report's `encode` stage and sets total_ms, counted from `received_ms` on the monotonic
 * clock; the report inside a JSON body already tells both. `format` counts for pictures only.
 * STATUS_OUT_OF_MEMORY, STATUS_IO_ERROR. */
enum status worker_reply_make(enum worker_reply what, enum job_format format, double received_ms,
                              struct render_result *result, int *fd, size_t *bytes,
                              struct error *err);

#endif
