/* POST /v1/render and /v1/plan, and whatever else takes a scene: from the body as it arrives to the
 * job and its reply. */
#ifndef PELT_SERVICE_RENDER_REQUEST_H
#define PELT_SERVICE_RENDER_REQUEST_H

#include "api/scene.h"
#include "service/request.h"

enum { RENDER_REQUEST_TYPES = 3 };
extern const char *const render_request_types[RENDER_REQUEST_TYPES];

/* The head is there: prepares for a body of that Content-Type. STATUS_UNSUPPORTED_MEDIA_TYPE,
 * STATUS_BAD_REQUEST. */
enum status render_request_begin(struct request *request, const char *content_type,
                                 struct error *err);

/* The next bytes of the body. STATUS_SCENE_TOO_LARGE, STATUS_BAD_REQUEST, STATUS_QUEUE_FULL (too
 * much is held for others), STATUS_OUT_OF_MEMORY. After a failure the rest may be dropped. */
enum status render_request_body(struct request *request, const char *data, size_t bytes,
                                struct error *err);

/* The route's `answer`. */
enum MHD_Result render_request_answer(struct request *request);

/* The body has come whole: validates the scene, asks `check` (may be NULL) once that stands, finds
 * the assets, asks the quarantine, and puts the text into a memory file; request->job has it all.
 * Where the text is no scene, `read` (else NULL) reads it and visits its assets, in place of both.
 * What scene_read(), scene_check_implemented(), `check` and store_open() return;
 * STATUS_BAD_REQUEST, STATUS_BAD_JSON; STATUS_QUARANTINED with *retry_after_s;
 * STATUS_OUT_OF_MEMORY. */
enum status render_request_prepare(struct request *request,
                                   enum status (*check)(void *user, const struct scene *scene,
                                                        struct error *err),
                                   enum status (*read)(void *user, const char *text, size_t bytes,
                                                       scene_asset_visit *visit, void *visit_user,
                                                       struct error *err),
                                   void *user, double *retry_after_s, struct error *err);

/* A canary for /readyz: suspends the connection until a worker has drawn it, or replies. */
enum MHD_Result render_request_canary(struct request *request);

void render_request_finish(struct request *request); /* frees what it holds */

#endif
