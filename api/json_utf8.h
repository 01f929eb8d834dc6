/* One character of UTF-8, strictly (RFC 3629): no overlong forms, no surrogates, nothing past
 * U+10FFFF. */
#ifndef PELT_API_JSON_UTF8_H
#define PELT_API_JSON_UTF8_H

#include <stddef.h>

/* Bytes of the well-formed character at text[0..bytes), 0 if there is none. */
size_t json_utf8_length(const char *text, size_t bytes);

/* Characters of a well-formed, terminated string. */
size_t json_utf8_count(const char *text);

#endif
