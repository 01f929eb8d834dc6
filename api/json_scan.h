/* One strict pass over a JSON text before jansson reads it.
 *
 * jansson stops at the first thing it dislikes and tells where in the text it stands; a caller
 * wants every fault, each with its JSON Pointer. So this pass finds what a tree no longer shows:
 * duplicate members, NaN and Infinity, numbers too large for a double, NUL characters, text that is
 * not UTF-8, nesting too deep, and whatever is not JSON (RFC 8259), which ends it. It builds no
 * tree. */
#ifndef PELT_API_JSON_SCAN_H
#define PELT_API_JSON_SCAN_H

#include <stdbool.h>
#include <stddef.h>

#include "api/status.h"

/* `text`: `bytes` of JSON followed by a 0 byte. What is wrong yet does not end the pass is recorded
 * in `err` and then mended in place (a NaN becomes 0), so that the rest of the scene can still be
 * read and judged. STATUS_OK: the text can be parsed, whatever `err` holds; else it cannot
 * (STATUS_BAD_JSON, STATUS_INVALID_SCENE for nesting, STATUS_OUT_OF_MEMORY), and `err` tells why.
 */
enum status json_scan(char *text, size_t bytes, int depth_max, bool *duplicates, struct error *err);

#endif
