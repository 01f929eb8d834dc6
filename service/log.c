/* Lines of the log. A line is put together in a buffer of its own and leaves in one write(2), so
 * that threads and processes that share stderr do not mix within a line. What it leaves out: files
 * and rotation, which are the business of whoever holds the other end of stderr. */
#include "service/log.h"

#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "api/json_utf8.h"

enum { LINE_MAX_BYTES = 2048 };

struct line {
    size_t length;
    char text[LINE_MAX_BYTES];
};

static void line_add(struct line *line, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static void line_add(struct line *line, const char *format, ...) {
    size_t room = sizeof line->text - line->length;
    va_list args;
    va_start(args, format);
    int n = vsnprintf(line->text + line->length, room, format, args);
    va_end(args);
    if (n < 0)
        return;
    line->length += (size_t)n < room ? (size_t)n : room - 1;
}

/* A JSON string; also the form of a text field, where it is always quoted. What is no UTF-8 (a path
 * may hold any byte) becomes U+FFFD, so that a line is always well-formed. */
static void line_add_quoted(struct line *line, const char *text) {
    size_t left = strlen(text);
    line_add(line, "\"");
    /* Stops in time for the closing quote, brace and newline. */
    while (left > 0 && line->length < sizeof line->text - 64) {
        unsigned char c = (unsigned char)*text;
        size_t length = json_utf8_length(text, left);
        if (length == 0)
            line_add(line, "\\ufffd");
        else if (c == '"' || c == '\\')
            line_add(line, "\\%c", c);
        else if (c < 0x20 || c == 0x7f)
            line_add(line, "\\u%04x", c);
        else
            line_add(line, "%.*s", (int)length, text);
        length += length == 0;
        text += length;
        left -= length;
    }
    line_add(line, "\"");
}

static void line_add_number(struct line *line, double value) {
    if (!isfinite(value))
        line_add(line, "null");
    else if (value == floor(value) && fabs(value) < 1e15)
        line_add(line, "%.0f", value);
    else
        line_add(line, "%.3f", value);
}

void log_fields(const struct log *log, enum log_level level, const char *event,
                const struct log_field *fields) {
    static const char *const levels[] = {"info", "warning", "error"};
    bool json = log->format == LOG_FORMAT_JSON;
    struct line line = {0};
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    struct tm utc;
    gmtime_r(&now.tv_sec, &utc);
    char stamp[32];
    strftime(stamp, sizeof stamp, "%Y-%m-%dT%H:%M:%S", &utc);
    int ms = (int)(now.tv_nsec / 1000000);
    if (json) {
        line_add(&line, "{\"time\":\"%s.%03dZ\",\"level\":\"%s\",\"event\":", stamp, ms,
                 levels[level]);
        line_add_quoted(&line, event);
    } else {
        line_add(&line, "%s.%03dZ %-7s %s", stamp, ms, levels[level], event);
    }
    for (const struct log_field *field = fields; field->name; field++) {
        if (line.length > sizeof line.text - 256)
            break;
        line_add(&line, json ? ",\"%s\":" : " %s=", field->name);
        if (field->text)
            line_add_quoted(&line, field->text);
        else
            line_add_number(&line, field->number);
    }
    line_add(&line, json ? "}\n" : "\n");
    ssize_t written = write(log->fd, line.text, line.length);
    (void)written;
}
