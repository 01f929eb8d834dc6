/* Parts of a report's JSON that other documents hold as well: each writes a key and its value into
 * an open object. */
#ifndef PELT_API_REPORT_PARTS_H
#define PELT_API_REPORT_PARTS_H

#include "api/json_out.h"
#include "api/report.h"

void report_write_build(struct json_out *out); /* "build": version and commit */
void report_write_renderer(struct json_out *out, const struct report *report);
void report_write_timing(struct json_out *out, const struct report *report);
void report_write_reuse(struct json_out *out, const struct report *report);
void report_write_work(struct json_out *out, const struct report_work *work);
void report_write_warnings(struct json_out *out, const struct report *report);

const char *report_commit(void); /* of this build; static storage */

#endif
