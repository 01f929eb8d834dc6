/* Tables made from status.def, and the error record. */
#include "api/status.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const struct {
    const char *slug, *title;
    int http, retryable, exit_code;
} table[STATUS_COUNT] = {
#define STATUS(name, slug, title, http, retryable, exit_code)                                      \
    [STATUS_##name] = {slug, title, http, retryable, exit_code},
#include "api/status.def"
#undef STATUS
};

const char *status_slug(enum status status) {
    assert(status < STATUS_COUNT);
    return table[status].slug;
}

const char *status_title(enum status status) {
    assert(status < STATUS_COUNT);
    return table[status].title;
}

int status_http(enum status status) {
    assert(status < STATUS_COUNT);
    return table[status].http;
}

bool status_retryable(enum status status) {
    assert(status < STATUS_COUNT);
    return table[status].retryable != 0;
}

int status_exit_code(enum status status) {
    assert(status < STATUS_COUNT);
    return table[status].exit_code;
}

enum status status_from_slug(const char *slug) {
    for (int i = 0; i < STATUS_COUNT; i++)
        if (strcmp(table[i].slug, slug) == 0)
            return (enum status)i;
    return STATUS_INTERNAL;
}

enum status(error_fault)(struct error *err, enum status status, const char *pointer,
                         const char *format, ...) {
    assert(status != STATUS_OK && status < STATUS_COUNT);
    if (!err)
        return status;
    if (err->status == STATUS_OK)
        err->status = status;
    if (err->fault_count >= ERROR_FAULTS_MAX) {
        err->faults_left_out++;
        return status;
    }
    struct fault *grown = realloc(err->faults, (err->fault_count + 1) * sizeof *grown);
    if (!grown) {
        err->faults_left_out++;
        return status;
    }
    err->faults = grown;
    char text[1024];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    err->faults[err->fault_count++] =
        (struct fault){pointer ? strdup(pointer) : NULL, strdup(text)};
    return status;
}

void error_move(struct error *to, struct error *from) {
    if (!to) {
        error_clear(from);
        return;
    }
    if (to->status == STATUS_OK)
        to->status = from->status;
    for (size_t i = 0; i < from->fault_count; i++)
        error_fault(to, from->status, from->faults[i].pointer, "%s",
                    from->faults[i].message ? from->faults[i].message : "");
    to->faults_left_out += from->faults_left_out;
    error_clear(from);
}

void error_clear(struct error *err) {
    if (!err)
        return;
    for (size_t i = 0; i < err->fault_count; i++) {
        free(err->faults[i].pointer);
        free(err->faults[i].message);
    }
    free(err->faults);
    *err = (struct error){0};
}
