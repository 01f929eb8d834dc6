/* Bodies of replies. A body goes into a memory file as it is to leave the socket, so that the front
 * sends it with sendfile(2) and never holds a picture in its own memory. */
#include "service/worker_reply.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "service/encode.h"
#include "service/memfd.h"
#include "service/monotonic.h"

struct body {
    int fd;
    size_t bytes;
    enum status status; /* the first failure; later writes do nothing */
};

static void body_add(struct body *body, const void *data, size_t bytes, struct error *err) {
    if (body->status != STATUS_OK)
        return;
    body->status = memfd_write(body->fd, data, bytes, err);
    body->bytes += bytes;
}

static void body_add_text(struct body *body, const char *text, struct error *err) {
    body_add(body, text, strlen(text), err);
}

/* {"report": ...} or {"report": ..., "image": {...}}. */
static void body_add_json(struct body *body, const struct report *report, const char *image,
                          size_t image_length, struct error *err) {
    char *text = report_write(report);
    if (!text) {
        body->status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the report");
        return;
    }
    body_add_text(body, "{\"report\":", err);
    body_add_text(body, text, err);
    free(text);
    if (image) {
        body_add_text(
            body, ",\"image\":{\"media_type\":\"image/png\",\"encoding\":\"base64\",\"data\":\"",
            err);
        body_add(body, image, image_length, err);
        body_add_text(body, "\"}", err);
    }
    body_add_text(body, "}\n", err);
}

enum status worker_reply_make(enum worker_reply what, enum job_format format, double received_ms,
                              struct render_result *result, int *fd, size_t *bytes,
                              struct error *err) {
    double start_ms = monotonic_ms();
    struct report *report = &result->report;
    unsigned char *image = NULL;
    char *base64 = NULL;
    size_t image_bytes = 0, base64_length = 0;
    struct body body = {.fd = memfd_open("pelt-body"), .status = STATUS_OK};
    if (body.fd < 0)
        body.status =
            error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory file: %s", strerror(errno));
    bool json = what == WORKER_REPLY_PLAN || format == JOB_FORMAT_JSON;
    if (body.status == STATUS_OK && what == WORKER_REPLY_PICTURE)
        body.status =
            encode_image(format == JOB_FORMAT_EXR ? ENCODE_EXR : ENCODE_PNG, result->pixels,
                         result->width, result->height, &image, &image_bytes, err);
    if (body.status == STATUS_OK && image && json) {
        base64 = encode_base64(image, image_bytes, &base64_length);
        free(image);
        image = NULL;
        if (!base64)
            body.status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for base64");
    }
    if (body.status == STATUS_OK && !json)
        body_add(&body, image, image_bytes, err);
    double now_ms = monotonic_ms();
    report->stage_ms[REPORT_STAGE_encode] += now_ms - start_ms;
    report->total_ms = now_ms - received_ms;
    report_settle(report);
    if (body.status == STATUS_OK && json)
        body_add_json(&body, report, base64, base64_length, err);
    if (body.status == STATUS_OK)
        body.status = memfd_seal(body.fd, err);
    free(image);
    free(base64);
    if (body.status != STATUS_OK && body.fd >= 0) {
        close(body.fd);
        body.fd = -1;
    }
    *fd = body.fd;
    *bytes = body.bytes;
    return body.status;
}
