/* Replies: every one carries X-Request-Id and Server-Timing, every error is a problem document. */
#ifndef PELT_SERVICE_REPLY_H
#define PELT_SERVICE_REPLY_H

#include <stddef.h>

#include "service/request.h"

/* All of them queue a reply and return what the handler is to return. */

/* `text` is malloc'ed and taken over. NULL: an out-of-memory problem is sent. */
enum MHD_Result reply_text(struct request *request, unsigned http_status, const char *type,
                           char *text, size_t bytes);

/* Text that lives as long as the program. */
enum MHD_Result reply_static(struct request *request, unsigned http_status, const char *type,
                             const char *text, size_t bytes);

/* A memory file with `bytes` bytes; the descriptor is taken over. */
enum MHD_Result reply_file(struct request *request, const char *type, int fd, size_t bytes);

/* A part of one: `bytes` bytes from `offset`. */
enum MHD_Result reply_part(struct request *request, const char *type, int fd, size_t offset,
                           size_t bytes);

/* A reply whose length is not known yet; the response is taken over. It has no time limit until
 * connections_enter() gives it one. */
enum MHD_Result reply_growing(struct request *request, const char *type,
                              struct MHD_Response *response);

/* 204: done, and nothing to say. */
enum MHD_Result reply_nothing(struct request *request);

/* The body that a worker made for request->job; takes its descriptor over. */
enum MHD_Result reply_job(struct request *request, const char *type);

/* A problem document for `error`, with Retry-After where `retry_after_s` > 0 and Allow where the
 * method is at fault. `close`: the connection ends with this reply. */
enum MHD_Result reply_error(struct request *request, const struct error *error,
                            double retry_after_s, bool close);

#endif
