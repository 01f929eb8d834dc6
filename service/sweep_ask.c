/* See sweep_ask.h. */
#include "service/sweep_ask.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>

/* One whole number from `min` to `max`, up to `*end`. */
static bool parse_number(const char *text, const char **end, long min, long max, long *number) {
    char *stop;
    errno = 0;
    *number = strtol(text, &stop, 10);
    *end = stop;
    return !errno && stop != text && *text >= '0' && *text <= '9' && *number >= min &&
           *number <= max;
}

static bool parse_whole(const char *text, int max, int *number) {
    long value;
    const char *end;
    if (!parse_number(text, &end, 1, max, &value) || *end)
        return false;
    *number = (int)value;
    return true;
}

static size_t count_items(const char *text) {
    size_t count = 1;
    for (; *text; text++)
        count += *text == ',';
    return count;
}

/* What lies outside a member's range is told by sweep_check(), which knows the members. */
static bool parse_qualities(const char *text, struct sweep_ask *ask) {
    size_t count = count_items(text);
    free(ask->qualities);
    ask->qualities = malloc(count * sizeof *ask->qualities);
    if (!ask->qualities)
        return false;
    for (size_t i = 0; i < count; i++) {
        long value;
        if (!parse_number(text, &text, 0, INT_MAX, &value) || *text != (i + 1 < count ? ',' : 0))
            return false;
        text++;
        ask->qualities[i] = (int)value;
    }
    ask->options.qualities = ask->qualities;
    ask->options.quality_count = count;
    return true;
}

static bool parse_series(const char *text, struct sweep_ask *ask) {
    size_t count = count_items(text);
    free(ask->names);
    free(ask->series);
    ask->names = strdup(text);
    ask->series = malloc(count * sizeof *ask->series);
    if (!ask->names || !ask->series)
        return false;
    char *at = ask->names;
    for (size_t i = 0; i < count; i++) {
        ask->series[i] = at;
        at += strcspn(at, ",");
        *at++ = 0;
    }
    ask->options.series = ask->series;
    ask->options.series_count = count;
    return true;
}

static bool parse_pixels(const char *text, struct sweep_options *options) {
    int count;
    options->pixels = SWEEP_PIXELS_ALL;
    if (strcmp(text, "all") == 0)
        return true;
    if (!parse_whole(text, INT_MAX, &count))
        return false;
    options->pixels = SWEEP_PIXELS_SOME;
    options->pixel_count = (size_t)count;
    return true;
}

bool sweep_ask_set(struct sweep_ask *ask, const char *name, const char *value) {
    if (strcmp(name, "series") == 0)
        return parse_series(value, ask);
    if (strcmp(name, "quality") == 0)
        return parse_qualities(value, ask);
    if (strcmp(name, "repeats") == 0)
        return parse_whole(value, INT_MAX, &ask->options.repeats);
    if (strcmp(name, "pixels") == 0)
        return parse_pixels(value, &ask->options);
    if (strcmp(name, "threads") == 0)
        return parse_whole(value, INT_MAX, &ask->options.threads);
    return false;
}

void sweep_ask_finish(struct sweep_ask *ask) {
    free(ask->names);
    free(ask->series);
    free(ask->qualities);
    *ask = (struct sweep_ask){0};
}
