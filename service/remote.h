/* `pelt render --server URL`: the same scene, drawn by a daemon. */
#ifndef PELT_SERVICE_REMOTE_H
#define PELT_SERVICE_REMOTE_H

#include <stdbool.h>

#include "renderer/asset/source.h"
#include "service/cli.h"
#include "service/encode.h"

struct remote_reply {
    unsigned char *image; /* malloc'ed: the file's bytes, as the daemon made them */
    size_t image_bytes;
    char *report;      /* malloc'ed JSON text; NULL where it was not asked for */
    char timing[1024]; /* the Server-Timing header, "" where there was none */
};

/* Sends the scene's own text with every asset that it names. `want_report` asks for JSON with the
 * image inside, else for the image alone. A problem document of the daemon becomes `err`, with its
 * status and pointers. STATUS_UNREACHABLE where there is no answer, STATUS_IO_ERROR where the
 * module that holds libcurl is not installed. Blocks until the reply is complete. */
enum status remote_render(const char *server, const struct cli_scene *scene,
                          const struct asset_source *assets, enum encode_format format,
                          bool want_report, struct remote_reply *reply, struct error *err);
void remote_reply_finish(struct remote_reply *reply);

#endif
