/* What is wrong with the options of a sweep, all of it, each with its pointer: see sweep.h. */
#include <stdio.h>
#include <string.h>

#include "renderer/sweep.h"

enum { THREADS_MAX = 256 };

bool sweep_wants(const struct sweep_options *options, const struct sweep_row *row) {
    for (size_t i = 0; i < options->series_count; i++)
        if (strcmp(options->series[i], row->name) == 0)
            return true;
    /* A ladder that is given for all of them is one of the paths' qualities. */
    return options->series_count == 0 && !(row->shadow && options->quality_count);
}

static void check_series(const struct sweep_options *options, struct error *err) {
    char pointer[32];
    if (options->series_count > SWEEP_SERIES_MAX)
        error_fault(err, STATUS_BAD_REQUEST, "/series", "%zu series: at most %d",
                    options->series_count, SWEEP_SERIES_MAX);
    for (size_t i = 0; i < options->series_count && i < SWEEP_SERIES_MAX; i++) {
        snprintf(pointer, sizeof pointer, "/series/%zu", i);
        if (!sweep_row_find(options->series[i])) {
            char names[512] = "";
            for (const struct sweep_row *row = sweep_rows; row->name; row++) {
                size_t length = strlen(names);
                snprintf(names + length, sizeof names - length, "%s%s", length ? ", " : "",
                         row->name);
            }
            error_fault(err, STATUS_BAD_REQUEST, pointer, "no series is named %.64s; there are %s",
                        options->series[i], names);
        }
        for (size_t k = 0; k < i; k++)
            if (strcmp(options->series[i], options->series[k]) == 0)
                error_fault(err, STATUS_BAD_REQUEST, pointer, "%.64s is there twice",
                            options->series[i]);
    }
}

static void check_qualities(const struct sweep_options *options, struct error *err) {
    char pointer[32];
    if (options->quality_count > SWEEP_QUALITIES_MAX) {
        error_fault(err, STATUS_BAD_REQUEST, "/quality", "%zu qualities: at most %d",
                    options->quality_count, SWEEP_QUALITIES_MAX);
        return;
    }
    for (size_t i = 0; i < options->quality_count; i++) {
        int quality = options->qualities[i];
        snprintf(pointer, sizeof pointer, "/quality/%zu", i);
        if (i && quality <= options->qualities[i - 1])
            error_fault(err, STATUS_BAD_REQUEST, pointer, "%d is not more than %d before it",
                        quality, options->qualities[i - 1]);
        for (const struct sweep_row *row = sweep_rows; row->name; row++)
            if (sweep_wants(options, row) &&
                (quality < sweep_row_min(row) || quality > sweep_row_max(row))) {
                error_fault(err, STATUS_BAD_REQUEST, pointer, "%d is not within %d to %d, %s of %s",
                            quality, sweep_row_min(row), sweep_row_max(row), row->quality,
                            row->name);
                break;
            }
    }
}

enum status sweep_check(const struct sweep_options *options, struct error *err) {
    struct error found = {0};
    check_series(options, &found);
    check_qualities(options, &found);
    if (options->repeats < 0 || options->repeats > SWEEP_REPEATS_MAX)
        error_fault(&found, STATUS_BAD_REQUEST, "/repeats", "%d is not within 1 to %d",
                    options->repeats, SWEEP_REPEATS_MAX);
    if (options->pixels == SWEEP_PIXELS_SOME && options->pixel_count == 0)
        error_fault(&found, STATUS_BAD_REQUEST, "/pixels", "no pixel tells nothing");
    if (options->threads < 0 || options->threads > THREADS_MAX)
        error_fault(&found, STATUS_BAD_REQUEST, "/threads", "%d is not within 1 to %d",
                    options->threads, THREADS_MAX);
    enum status status = found.status;
    error_move(err, &found);
    return status;
}
