/* Outcomes (status.def) and the one record in which a failure travels.
 *
 * Detail is written once, where it arises: error_fault() adds a (JSON Pointer, message) pair;
 * callers pass the record up untouched and only the edge (HTTP reply, command line) prints it. */
#ifndef PELT_API_STATUS_H
#define PELT_API_STATUS_H

#include <stdbool.h>
#include <stddef.h>

enum status {
#define STATUS(name, slug, title, http, retryable, exit_code) STATUS_##name,
#include "api/status.def"
#undef STATUS
    STATUS_COUNT
};

const char *status_slug(enum status status);  /* "invalid-scene"; static storage */
const char *status_title(enum status status); /* one sentence; static storage */
int status_http(enum status status);
bool status_retryable(enum status status);
int status_exit_code(enum status status);

/* The status whose slug this is; STATUS_INTERNAL if none. */
enum status status_from_slug(const char *slug);

/* One thing that is wrong. `pointer` is an RFC 6901 JSON Pointer into the scene, "" for the whole
 * document, NULL where no document is involved. Both strings are owned by the error. */
struct fault {
    char *pointer;
    char *message;
};

enum { ERROR_FAULTS_MAX = 256 };

/* Zero-initialise ({0}) before use; error_clear() frees. The first fault's status is kept, further
 * faults append. Past ERROR_FAULTS_MAX they are only counted. */
struct error {
    enum status status;
    size_t fault_count;     /* faults stored */
    size_t faults_left_out; /* faults counted but not stored */
    struct fault *faults;
};

/* Records a fault and returns `status`, so that `return error_fault(err, ...)` reads well.
 * `err` may be NULL. Thread: any, one at a time for each record. Never fails: out of memory drops
 * the text and keeps the status. */
enum status error_fault(struct error *err, enum status status, const char *pointer,
                        const char *format, ...) __attribute__((format(printf, 4, 5)));

#ifdef __clang_analyzer__ /* which reads one file at a time: what comes back is what went in */
#define error_fault(err, status, ...) ((void)error_fault(err, status, __VA_ARGS__), (status))
#endif

/* Moves everything in `from` behind what `to` holds; `from` is left empty. */
void error_move(struct error *to, struct error *from);

void error_clear(struct error *err); /* frees; the record may be used again */

#endif
