/* The settings of `pelt serve`: one row each in serve_options.c, from which --help is made. */
#ifndef PELT_SERVICE_SERVE_OPTIONS_H
#define PELT_SERVICE_SERVE_OPTIONS_H

#include <stdbool.h>

#include "api/status.h"
#include "renderer/render.h"
#include "service/log.h"

struct serve_options {
    const char *listen;
    const char *assets; /* NULL: none */
    int workers, queue, timeout_ms, receive_timeout_ms, connections, body_mib;
    int jobs_queue, jobs_keep_mib, jobs_keep_s, job_timeout_s;
    enum log_format log;
    struct renderer_options renderer;
    bool help;
};

/* Fills in defaults, then what argv says. STATUS_USAGE; the strings stay argv's. */
enum status serve_options_read(int argc, char **argv, struct serve_options *options,
                               struct error *err);

void serve_options_help(void); /* to stdout */

#endif
