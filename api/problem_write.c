/* RFC 9457: `type`, `title`, `status`, `detail`; Pelt adds `retryable`, `request_id`, and `errors`
 * with a JSON Pointer each, as the RFC's own example does. `instance` is left out: a request has no
 * resource of its own to point to. */
#include "api/problem_write.h"

#include <stdio.h>

#include "api/json_out.h"

/* One fault is the detail; of more, the first and how many. */
static void write_detail(struct json_out *out, const struct error *err) {
    char detail[1400];
    size_t count = err->fault_count + err->faults_left_out;
    if (err->fault_count == 0)
        return;
    const struct fault *first = &err->faults[0];
    const char *message = first->message ? first->message : "";
    snprintf(detail, sizeof detail, "%s%s%s",
             first->pointer && *first->pointer ? first->pointer : "",
             first->pointer && *first->pointer ? ": " : "", message);
    json_out_key(out, "detail");
    if (count == 1) {
        json_out_string(out, detail);
        return;
    }
    char more[1500];
    snprintf(more, sizeof more, "%s (and %zu more)", detail, count - 1);
    json_out_string(out, more);
}

char *problem_write(const struct error *err, const char *request_id) {
    enum status status = err->status == STATUS_OK ? STATUS_INTERNAL : err->status;
    char type[80];
    snprintf(type, sizeof type, "/problems/%s", status_slug(status));
    struct json_out out = {0};
    json_out_open(&out, '{');
    json_out_key(&out, "type");
    json_out_string(&out, type);
    json_out_key(&out, "title");
    json_out_string(&out, status_title(status));
    json_out_key(&out, "status");
    json_out_integer(&out, status_http(status));
    write_detail(&out, err);
    json_out_key(&out, "retryable");
    json_out_boolean(&out, status_retryable(status));
    if (request_id) {
        json_out_key(&out, "request_id");
        json_out_string(&out, request_id);
    }
    json_out_key(&out, "errors");
    json_out_open(&out, '[');
    for (size_t i = 0; i < err->fault_count; i++) {
        json_out_open(&out, '{');
        if (err->faults[i].pointer) {
            json_out_key(&out, "pointer");
            json_out_string(&out, err->faults[i].pointer);
        }
        json_out_key(&out, "detail");
        json_out_string(&out, err->faults[i].message ? err->faults[i].message : "");
        json_out_close(&out, '}');
    }
    json_out_close(&out, ']');
    if (err->faults_left_out) {
        json_out_key(&out, "errors_left_out");
        json_out_unsigned(&out, err->faults_left_out);
    }
    json_out_close(&out, '}');
    return json_out_finish(&out);
}
