/* The thin face of libcurl (http_curl.c, built as a module and opened by `pelt render --server`
 * alone), so that pelt itself does not link it. */
#ifndef PELT_SERVICE_MODULE_HTTP_CURL_H
#define PELT_SERVICE_MODULE_HTTP_CURL_H

#include <stddef.h>

struct http_part { /* of multipart/form-data; data stays the caller's */
    const char *name, *type;
    const unsigned char *data;
    size_t bytes;
};

struct http_response {
    long status;
    unsigned char *body; /* malloc'ed, with a 0 byte behind it */
    size_t bytes;
    char type[128];    /* Content-Type, "" where none */
    char timing[1024]; /* Server-Timing, "" where none */
};

/* A table, so that the module needs one symbol (`pelt_http_module`). */
struct http_module {
    /* Posts the parts and waits for the whole answer, of at most body_max bytes. 0 where there was
     * an answer of any status, else a message. Blocks for at most ten minutes. */
    int (*post)(const char *url, const char *accept, const struct http_part *parts, size_t count,
                size_t body_max, struct http_response *response, char *message,
                size_t message_bytes);
    const char *(*version)(void);
};

#endif
