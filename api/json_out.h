/* Writes JSON text into growing memory.
 *
 * Why not jansson: a scene must read back to the last bit of every number, and jansson 2.14 prints
 * 0.1 as 0.10000000000000001. Here every number is the shortest text that reads back equal. */
#ifndef PELT_API_JSON_OUT_H
#define PELT_API_JSON_OUT_H

#include <stdbool.h>
#include <stddef.h>

/* Zero-initialise. Once memory has run out every call does nothing and `failed` stays set. */
struct json_out {
    char *text; /* malloc'ed, terminated once json_out_finish() has returned it */
    size_t length, capacity;
    bool failed;
};

void json_out_open(struct json_out *out, char bracket);  /* '{' or '[' */
void json_out_close(struct json_out *out, char bracket); /* '}' or ']' */
void json_out_key(struct json_out *out, const char *name);

/* Any bytes: what is not UTF-8 becomes U+FFFD, NULL becomes null. */
void json_out_string(struct json_out *out, const char *text);
void json_out_number(struct json_out *out, double value); /* null where it is not finite */
void json_out_integer(struct json_out *out, long long value);
void json_out_unsigned(struct json_out *out, unsigned long long value);
void json_out_boolean(struct json_out *out, bool value);
void json_out_raw(struct json_out *out, const char *json); /* a value, or the beginning of one */

/* The shortest decimal text that strtod() reads back as `value`, which is finite. */
enum { JSON_NUMBER_BYTES = 32 };
void json_number_text(double value, char text[JSON_NUMBER_BYTES]);

/* Hands the text over (caller frees); NULL, with everything released, where memory ran out. */
char *json_out_finish(struct json_out *out);

#endif
