/* The table of refusals.def. */
#include "api/refusals.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>

static const struct {
    const char *name, *text;
    enum status status;
} table[REFUSAL_COUNT] = {
#define REFUSAL(name, status, text) {#name, text, STATUS_##status},
#include "api/refusals.def"
#undef REFUSAL
};

const char *refusal_name(enum refusal refusal) {
    assert(refusal < REFUSAL_COUNT);
    return table[refusal].name;
}

const char *refusal_text(enum refusal refusal) {
    assert(refusal < REFUSAL_COUNT);
    return table[refusal].text;
}

enum status refusal_status(enum refusal refusal) {
    assert(refusal < REFUSAL_COUNT);
    return table[refusal].status;
}

enum status refuse(struct error *err, enum refusal refusal, const char *pointer, const char *format,
                   ...) {
    char particulars[512];
    va_list args;
    va_start(args, format);
    vsnprintf(particulars, sizeof particulars, format, args);
    va_end(args);
    return error_fault(err, table[refusal].status, pointer, "%s%s%s", table[refusal].text,
                       particulars[0] ? ": " : "", particulars);
}
