/* Failures as RFC 9457 problem documents, after problem.schema.json. */
#ifndef PELT_API_PROBLEM_WRITE_H
#define PELT_API_PROBLEM_WRITE_H

#include "api/status.h"

#define PROBLEM_MEDIA_TYPE "application/problem+json"

/* The document for a failure, malloc'ed (caller frees); NULL where memory ran out. `type` is
 * "/problems/" and the status's slug, stable for ever. `request_id`: as in X-Request-Id, NULL to
 * leave it out. An `err` without a status is STATUS_INTERNAL. Thread: any. */
char *problem_write(const struct error *err, const char *request_id);

#endif
