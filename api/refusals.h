/* Refusals that the schema cannot express (refusals.def). */
#ifndef PELT_API_REFUSALS_H
#define PELT_API_REFUSALS_H

#include "api/status.h"

enum refusal {
#define REFUSAL(name, status, text) REFUSAL_##name,
#include "api/refusals.def"
#undef REFUSAL
    REFUSAL_COUNT
};

const char *refusal_name(enum refusal refusal); /* "EYE_AT_TARGET" */
const char *refusal_text(enum refusal refusal);
enum status refusal_status(enum refusal refusal);

/* error_fault() with the row's status and text; `format`: the particulars, "" for none. */
enum status refuse(struct error *err, enum refusal refusal, const char *pointer, const char *format,
                   ...) __attribute__((format(printf, 4, 5)));

#endif
