/* A parser of multipart/form-data that runs as the bytes come, a state machine with one state for
 * each region of the body. The delimiter CR LF -- boundary is matched byte by byte; where a match
 * breaks off, what had matched is body after all. Only its first byte is a CR, so a broken match
 * can only begin anew at the byte that broke it, and no table of prefixes is needed.
 *
 * Left out: Content-Transfer-Encoding (obsolete, RFC 7578 4.7), nested multipart/mixed, `filename`.
 */
#include "service/multipart.h"

#include <assert.h>
#include <string.h>
#include <strings.h>

/* The value of a parameter such as boundary=x or name="y" in a header's value; false where it is
 * not there, not closed or too long. Only quoted values may hold separators. */
static bool read_parameter(const char *value, const char *name, char *out, size_t out_bytes) {
    size_t name_length = strlen(name);
    for (const char *at = strchr(value, ';'); at; at = strchr(at, ';')) {
        at += 1 + strspn(at + 1, " \t");
        bool wanted = strncasecmp(at, name, name_length) == 0 && at[name_length] == '=';
        at += strcspn(at, "=;");
        if (*at != '=')
            continue;
        at++;
        bool quoted = *at == '"';
        at += quoted;
        size_t length = 0;
        for (; quoted ? *at && *at != '"' : *at && !strchr("; \t", *at); at++) {
            /* Browsers write %22 for a quote; the RFC's \" is taken too. */
            if (quoted && *at == '\\' && (at[1] == '"' || at[1] == '\\'))
                at++;
            if (wanted && length + 1 < out_bytes)
                out[length] = *at;
            length++;
        }
        if (quoted && *at != '"')
            return false;
        if (wanted) {
            if (length == 0 || length >= out_bytes)
                return false;
            out[length] = 0;
            return true;
        }
    }
    return false;
}

enum status multipart_init(struct multipart *multipart, const char *content_type,
                           const struct multipart_sink *sink, struct error *err) {
    static const char allowed[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                  "0123456789'()+_,-./:=? ";
    char boundary[MULTIPART_BOUNDARY_MAX + 1];
    *multipart = (struct multipart){.sink = *sink, .state = MULTIPART_PREAMBLE};
    if (!read_parameter(content_type, "boundary", boundary, sizeof boundary) ||
        boundary[strspn(boundary, allowed)] != 0)
        return error_fault(err, STATUS_BAD_REQUEST, NULL,
                           "multipart/form-data without a proper boundary of 1 to %d characters",
                           MULTIPART_BOUNDARY_MAX);
    memcpy(multipart->delimiter, "\r\n--", 4);
    multipart->delimiter_length = 4 + strlen(boundary);
    memcpy(multipart->delimiter + 4, boundary, strlen(boundary) + 1);
    multipart->matched = 2; /* the first delimiter may stand at the very beginning, without CR LF */
    return STATUS_OK;
}

/* Finds Content-Disposition: form-data; name="..." among the part's header lines. */
static enum status begin_part(struct multipart *multipart, struct error *err) {
    char name[MULTIPART_NAME_MAX];
    multipart->header[multipart->header_length] = 0;
    for (char *line = multipart->header, *next; line; line = next) {
        next = strstr(line, "\r\n");
        if (next) {
            *next = 0;
            next += 2;
        }
        static const char key[] = "content-disposition:";
        if (strncasecmp(line, key, sizeof key - 1) != 0)
            continue;
        const char *value = line + sizeof key - 1;
        value += strspn(value, " \t");
        if (strncasecmp(value, "form-data", 9) == 0 &&
            read_parameter(value, "name", name, sizeof name))
            return multipart->sink.begin(multipart->sink.user, name);
    }
    return error_fault(err, STATUS_BAD_REQUEST, NULL,
                       "a part without Content-Disposition: form-data and a name of less than %d "
                       "bytes",
                       MULTIPART_NAME_MAX);
}

/* One byte of a part's header lines, which end with an empty one. */
static enum status feed_header(struct multipart *multipart, char c, struct error *err) {
    if (c == 0 || multipart->header_length + 1 >= sizeof multipart->header)
        return error_fault(err, STATUS_BAD_REQUEST, NULL,
                           "a part's header lines hold a 0 byte or more than %d bytes",
                           MULTIPART_HEADER_MAX);
    multipart->header[multipart->header_length++] = c;
    size_t length = multipart->header_length;
    const char *end = multipart->header + length;
    bool empty = length == 2 && memcmp(end - 2, "\r\n", 2) == 0;
    bool over = length >= 4 && memcmp(end - 4, "\r\n\r\n", 4) == 0;
    if (!empty && !over)
        return STATUS_OK;
    multipart->state = MULTIPART_BODY;
    multipart->matched = 0;
    return begin_part(multipart, err);
}

/* What follows a delimiter on its line: CR LF, or -- for the last one (then nothing counts). */
static enum status feed_tail(struct multipart *multipart, char c, struct error *err) {
    if ((c == ' ' || c == '\t') && multipart->tail_length == 0)
        return STATUS_OK; /* RFC 2046 allows padding here */
    multipart->tail[multipart->tail_length++] = c;
    if (multipart->tail_length < 2)
        return STATUS_OK;
    if (memcmp(multipart->tail, "--", 2) == 0) {
        multipart->state = MULTIPART_EPILOGUE;
        return STATUS_OK;
    }
    if (memcmp(multipart->tail, "\r\n", 2) != 0)
        return error_fault(err, STATUS_BAD_REQUEST, NULL, "a multipart delimiter is malformed");
    multipart->state = MULTIPART_HEADERS;
    multipart->header_length = 0;
    return STATUS_OK;
}

/* Body (or preamble, whose bytes are dropped) up to the end of the data or of a delimiter; returns
 * how many bytes were used. */
static size_t feed_body(struct multipart *multipart, const char *data, size_t bytes,
                        enum status *status) {
    bool body = multipart->state == MULTIPART_BODY;
    const struct multipart_sink *sink = &multipart->sink;
    size_t i = 0, from = 0;              /* data[from, i - matched) is known to be body */
    size_t carried = multipart->matched; /* matched bytes that lie before `data` */
    *status = STATUS_OK;
    for (; i < bytes && multipart->matched < multipart->delimiter_length; i++) {
        if (multipart->matched == 0 && data[i] != '\r') {
            const char *next = memchr(data + i, '\r', bytes - i);
            if (!next) {
                i = bytes;
                break;
            }
            i = (size_t)(next - data);
        }
        if (data[i] == multipart->delimiter[multipart->matched]) {
            multipart->matched++;
            continue;
        }
        if (carried > 0 && body) {
            *status = sink->data(sink->user, multipart->delimiter, carried);
            if (*status != STATUS_OK)
                return i;
        }
        carried = 0;
        multipart->matched = data[i] == '\r';
    }
    size_t held = multipart->matched - carried; /* of the match, within `data` */
    size_t known = carried > 0 ? from : i - held;
    if (body && known > from)
        *status = sink->data(sink->user, data + from, known - from);
    if (*status == STATUS_OK && multipart->matched == multipart->delimiter_length) {
        multipart->state = MULTIPART_AFTER_DELIMITER;
        multipart->tail_length = 0;
        if (body)
            *status = sink->end(sink->user);
    }
    return i;
}

enum status multipart_feed(struct multipart *multipart, const char *data, size_t bytes,
                           struct error *err) {
    enum status status = STATUS_OK;
    for (size_t i = 0; i < bytes && status == STATUS_OK;) {
        switch (multipart->state) {
        case MULTIPART_PREAMBLE:
        case MULTIPART_BODY:
            i += feed_body(multipart, data + i, bytes - i, &status);
            break;
        case MULTIPART_AFTER_DELIMITER:
            status = feed_tail(multipart, data[i++], err);
            break;
        case MULTIPART_HEADERS:
            status = feed_header(multipart, data[i++], err);
            break;
        case MULTIPART_EPILOGUE:
            return STATUS_OK;
        }
    }
    return status;
}

bool multipart_is_complete(const struct multipart *multipart) {
    return multipart->state == MULTIPART_EPILOGUE;
}
