/* multipart/form-data (RFC 7578, RFC 2046), as it arrives. Knows nothing of what the parts mean.
 * Memory is bounded: a delimiter, one part's header lines, and nothing of its body. */
#ifndef PELT_SERVICE_MULTIPART_H
#define PELT_SERVICE_MULTIPART_H

#include <stdbool.h>
#include <stddef.h>

#include "api/status.h"

enum {
    MULTIPART_BOUNDARY_MAX = 70, /* RFC 2046 */
    MULTIPART_HEADER_MAX = 2048, /* all header lines of one part */
    MULTIPART_NAME_MAX = 256     /* with the terminating 0 */
};

struct multipart_sink {
    /* A part begins, has more bytes, ends. Anything but STATUS_OK stops the parser, which returns
     * it. The fault is the sink's to record. */
    enum status (*begin)(void *user, const char *name);
    enum status (*data)(void *user, const char *data, size_t bytes);
    enum status (*end)(void *user);
    void *user;
};

struct multipart {
    struct multipart_sink sink;
    enum {
        MULTIPART_PREAMBLE,
        MULTIPART_AFTER_DELIMITER, /* rest of the delimiter's line */
        MULTIPART_HEADERS,
        MULTIPART_BODY,
        MULTIPART_EPILOGUE
    } state;
    char delimiter[MULTIPART_BOUNDARY_MAX + 5]; /* CR LF - - boundary */
    size_t delimiter_length;
    size_t matched; /* of the delimiter, at the end of what came so far */
    char header[MULTIPART_HEADER_MAX];
    size_t header_length;
    char tail[2]; /* of the delimiter's line */
    size_t tail_length;
};

/* `content_type`: the request's, whose boundary parameter counts. STATUS_BAD_REQUEST. */
enum status multipart_init(struct multipart *multipart, const char *content_type,
                           const struct multipart_sink *sink, struct error *err);

/* The next bytes of the body, in pieces of any size. STATUS_BAD_REQUEST, or what the sink said. */
enum status multipart_feed(struct multipart *multipart, const char *data, size_t bytes,
                           struct error *err);

bool multipart_is_complete(const struct multipart *multipart); /* the closing delimiter has come */

#endif
