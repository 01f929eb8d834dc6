/* The daemon's log: one line for each event on stderr, as text or as JSON. */
#ifndef PELT_SERVICE_LOG_H
#define PELT_SERVICE_LOG_H

enum log_format { LOG_FORMAT_TEXT, LOG_FORMAT_JSON };
enum log_level { LOG_INFO, LOG_WARNING, LOG_ERROR };

struct log {
    enum log_format format;
    int fd;
};

struct log_field {
    const char *name; /* NULL ends a list */
    const char *text; /* NULL: `number` is the value */
    double number;
};

#define LOG_TEXT(field_name, value)   ((struct log_field){(field_name), (value), 0})
#define LOG_NUMBER(field_name, value) ((struct log_field){(field_name), NULL, (double)(value)})

/* Writes one line: time, level, event, fields. Control characters and quotes in texts are escaped,
 * so that a client cannot forge a line. Cut at 2 KB. Thread: any (one write(2) for each line). A
 * log that cannot be written is no reason to fail a request: errors are ignored. */
void log_fields(const struct log *log, enum log_level level, const char *event,
                const struct log_field *fields);

/* log_event(log, LOG_INFO, "request", LOG_TEXT("id", id), LOG_NUMBER("ms", ms)) */
#define log_event(log, level, event, ...)                                                          \
    log_fields((log), (level), (event), (const struct log_field[]){__VA_ARGS__, {NULL, NULL, 0}})

#endif
