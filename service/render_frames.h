/* `pelt render SEQUENCE.json --frames`: the frames of a sequence as numbered pictures, or as one
 * animated GIF. Parts of render.c's options, as they were given. */
#ifndef PELT_SERVICE_RENDER_FRAMES_H
#define PELT_SERVICE_RENDER_FRAMES_H

#include <stdbool.h>

#include "renderer/render.h"

struct render_frames {
    const char *sequence;                 /* a file, or "-" */
    const char *range;                    /* as sequence_range() takes it; NULL: all */
    const char *output, *assets, *report; /* the latter two may be NULL */
    const char *format;                   /* NULL: by the output's extension */
    bool quiet, progress;
    struct renderer_options gl;
};

/* Does it; returns the exit code. Faults are printed. */
int render_frames(const struct render_frames *options);

#endif
