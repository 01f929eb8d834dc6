/* JSON text, written value by value. A comma is due wherever the last byte written ended a value:
 * no value ends in an opening bracket, a colon or a comma. */
#include "api/json_out.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/json_utf8.h"

static void put(struct json_out *out, const char *bytes, size_t count) {
    if (out->failed)
        return;
    if (out->capacity - out->length < count) {
        size_t capacity = out->capacity ? out->capacity : 1024;
        while (capacity - out->length < count) {
            if (capacity > (size_t)1 << 40) {
                out->failed = true;
                return;
            }
            capacity *= 2;
        }
        char *grown = realloc(out->text, capacity);
        if (!grown) {
            out->failed = true;
            return;
        }
        out->text = grown;
        out->capacity = capacity;
    }
    memcpy(out->text + out->length, bytes, count);
    out->length += count;
}

static void begin_value(struct json_out *out) {
    if (out->length && !strchr("{[:,", out->text[out->length - 1]))
        put(out, ",", 1);
}

void json_out_open(struct json_out *out, char bracket) {
    assert(bracket == '{' || bracket == '[');
    begin_value(out);
    put(out, &bracket, 1);
}

void json_out_close(struct json_out *out, char bracket) {
    assert(bracket == '}' || bracket == ']');
    put(out, &bracket, 1);
}

static void put_string(struct json_out *out, const char *text) {
    size_t left = strlen(text);
    put(out, "\"", 1);
    while (left) {
        size_t length = json_utf8_length(text, left);
        unsigned char c = (unsigned char)*text;
        if (length == 0) {
            put(out, "\xEF\xBF\xBD", 3);
            length = 1;
        } else if (c == '"' || c == '\\') {
            put(out, (char[]){'\\', (char)c}, 2);
        } else if (c < 0x20 || c == 0x7F) {
            char escape[8];
            snprintf(escape, sizeof escape, "\\u%04x", c);
            put(out, escape, 6);
        } else {
            put(out, text, length);
        }
        text += length;
        left -= length;
    }
    put(out, "\"", 1);
}

void json_out_key(struct json_out *out, const char *name) {
    begin_value(out);
    put_string(out, name);
    put(out, ":", 1);
}

void json_out_string(struct json_out *out, const char *text) {
    begin_value(out);
    if (text)
        put_string(out, text);
    else
        put(out, "null", 4);
}

/* 15 digits print every decimal that has no more of them as it was typed; 17 tell any two doubles
 * apart. Pelt never calls setlocale(), so the decimal point is one. */
void json_number_text(double value, char text[JSON_NUMBER_BYTES]) {
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, JSON_NUMBER_BYTES, "%.*g", digits, value);
        if (strtod(text, NULL) == value)
            return;
    }
}

void json_out_number(struct json_out *out, double value) {
    begin_value(out);
    if (!isfinite(value)) {
        put(out, "null", 4);
        return;
    }
    char text[JSON_NUMBER_BYTES];
    json_number_text(value, text);
    put(out, text, strlen(text));
}

void json_out_integer(struct json_out *out, long long value) {
    char text[24];
    begin_value(out);
    put(out, text, (size_t)snprintf(text, sizeof text, "%lld", value));
}

void json_out_unsigned(struct json_out *out, unsigned long long value) {
    char text[24];
    begin_value(out);
    put(out, text, (size_t)snprintf(text, sizeof text, "%llu", value));
}

void json_out_boolean(struct json_out *out, bool value) {
    begin_value(out);
    put(out, value ? "true" : "false", value ? 4 : 5);
}

void json_out_raw(struct json_out *out, const char *json) {
    begin_value(out);
    put(out, json, strlen(json));
}

char *json_out_finish(struct json_out *out) {
    put(out, "", 1);
    char *text = out->text;
    if (out->failed) {
        free(text);
        text = NULL;
    }
    *out = (struct json_out){0};
    return text;
}
