/* An output of a job that is sent while it is still being made. */
#ifndef PELT_SERVICE_JOBS_STREAM_H
#define PELT_SERVICE_JOBS_STREAM_H

#include "service/jobs.h"
#include "service/request.h"

/* Queues a reply that follows the growing output of the running task `id`; `fd`, its own, is taken
 * over. The connection sleeps while there is nothing new, and costs no thread. The reply ends with
 * the output; where the task fails, is deleted or expires first it is broken off, without the end
 * of a chunked body, so that nobody takes it for whole. */
enum MHD_Result jobs_stream_reply(struct request *request, const char *id, const char *media_type,
                                  int fd);

#endif
