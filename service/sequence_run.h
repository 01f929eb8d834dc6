/* The frames of a sequence, drawn one after another by one renderer, whose caches keep what does
 * not change: what `pelt render --frames` and POST /v1/sequences have in common. */
#ifndef PELT_SERVICE_SEQUENCE_RUN_H
#define PELT_SERVICE_SEQUENCE_RUN_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>

#include "api/json_out.h"
#include "api/sequence.h"
#include "renderer/render.h"
#include "service/encode.h"

struct sequence_order {
    int first, last;              /* frames */
    bool pictures, gif;           /* what is wanted: a file for each frame, one for all */
    enum encode_format format;    /* of the pictures */
    const atomic_bool *cancelled; /* NULL, or looked at between frames */
    /* After each frame: its picture (NULL where none is wanted), which is lent, and its report,
     * with all stages filled in. Anything but STATUS_OK ends the run. */
    enum status (*frame)(void *user, int frame, const unsigned char *data, size_t bytes,
                         const struct report *report, struct error *err);
    void *user;
};

/* Draws. Every asset is opened once. `*gif`: malloc'ed (caller frees), NULL where none is wanted or
 * on failure. Faults are told as sequence_frame() tells them; STATUS_CANCELLED. Blocks. */
enum status sequence_run(struct renderer *renderer, struct sequence *sequence,
                         const struct asset_source *assets, const struct sequence_order *order,
                         unsigned char **gif, size_t *gif_bytes, struct error *err);

/* "A-B", "A-" or "A", each a frame of the sequence; NULL or "": all. False for anything else. */
bool sequence_range(const char *text, int frames, int *first, int *last);

/* The index of what was drawn, as JSON (api/sequence_index.schema.json): begin, a row for each
 * frame, end. `name` of the picture may be NULL. */
void sequence_index_begin(struct json_out *out, const struct sequence *sequence, int width,
                          int height);
void sequence_index_add(struct json_out *out, const struct sequence *sequence, int frame,
                        const char *name, size_t bytes, const struct report *report);
void sequence_index_end(struct json_out *out);

#endif
