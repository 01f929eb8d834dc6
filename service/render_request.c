/* A scene's way through the front: body, validation, assets, quarantine, queue.
 *
 * The scene is validated here, before it costs a worker anything; assets are only fetched and
 * hashed here, their contents are parsed in workers alone. Parts of a multipart request that the
 * scene does not name are dropped. */
#include "service/render_request.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#include "api/scene.h"
#include "service/files.h"
#include "service/memfd.h"
#include "service/monotonic.h"
#include "service/reply.h"
#include "service/routes.h"

/* Bodies of all requests together, as multiples of the largest single one. */
enum { HELD_BODIES_MAX = 8 };

/* In the order of enum job_format. */
const char *const render_request_types[RENDER_REQUEST_TYPES] = {
    [JOB_FORMAT_PNG] = "image/png",
    [JOB_FORMAT_EXR] = "image/x-exr",
    [JOB_FORMAT_JSON] = "application/json",
};

/* ---- the body ---- */

static enum status scene_add(struct request *request, const char *data, size_t bytes,
                             struct error *err) {
    if (bytes > SCENE_BYTES_MAX - request->scene_bytes)
        return error_fault(err, STATUS_SCENE_TOO_LARGE, "", "a scene has at most %d bytes",
                           SCENE_BYTES_MAX);
    if (request->scene_bytes + bytes > request->scene_capacity) {
        size_t capacity = request->scene_capacity ? request->scene_capacity : 4096;
        while (capacity < request->scene_bytes + bytes)
            capacity *= 2;
        char *grown = realloc(request->scene, capacity);
        if (!grown)
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the scene");
        request->scene = grown;
        request->scene_capacity = capacity;
    }
    memcpy(request->scene + request->scene_bytes, data, bytes);
    request->scene_bytes += bytes;
    return STATUS_OK;
}

static enum status part_begin(void *user, const char *name) {
    struct request *request = user;
    struct error *err = &request->error;
    struct job *job = &request->job;
    request->in_scene = strcmp(name, "scene") == 0;
    if (request->in_scene) {
        if (request->scene_seen)
            return error_fault(err, STATUS_BAD_REQUEST, NULL, "two parts are named \"scene\"");
        request->scene_seen = true;
        return STATUS_OK;
    }
    for (size_t i = 0; i < job->asset_count; i++)
        if (strcmp(job->assets[i].name, name) == 0)
            return error_fault(err, STATUS_BAD_REQUEST, NULL, "two parts are named \"%s\"", name);
    if (job->asset_count == JOB_ASSETS_MAX)
        return error_fault(err, STATUS_BAD_REQUEST, NULL, "more than %d assets", JOB_ASSETS_MAX);
    if (!job->assets)
        job->assets = calloc(JOB_ASSETS_MAX, sizeof *job->assets);
    int fd = job->assets ? memfd_open("pelt-upload") : -1;
    if (fd < 0 || digest_start(&request->digest) != 0) {
        if (fd >= 0)
            close(fd);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for an asset");
    }
    struct job_asset *asset = &job->assets[job->asset_count++];
    asset->fd = fd;
    memcpy(asset->name, name, strlen(name) + 1); /* MULTIPART_NAME_MAX is JOB_ASSET_NAME_MAX */
    return STATUS_OK;
}

static enum status part_data(void *user, const char *data, size_t bytes) {
    struct request *request = user;
    if (request->in_scene)
        return scene_add(request, data, bytes, &request->error);
    struct job_asset *asset = &request->job.assets[request->job.asset_count - 1];
    asset->bytes += bytes;
    if (digest_add(&request->digest, data, bytes) != 0)
        return error_fault(&request->error, STATUS_INTERNAL, NULL, "hashing failed");
    return memfd_write(asset->fd, data, bytes, &request->error);
}

static enum status part_end(void *user) {
    struct request *request = user;
    if (request->in_scene)
        return STATUS_OK;
    struct job_asset *asset = &request->job.assets[request->job.asset_count - 1];
    digest_finish(&request->digest, asset->sha256);
    return memfd_seal(asset->fd, &request->error);
}

/* Whether a Content-Type's media type, without its parameters, is this one. */
static bool is_type(const char *content_type, const char *type) {
    size_t length = strcspn(content_type, "; \t");
    return length == strlen(type) && strncasecmp(content_type, type, length) == 0;
}

enum status render_request_begin(struct request *request, const char *content_type,
                                 struct error *err) {
    _Static_assert((int)MULTIPART_NAME_MAX <= (int)JOB_ASSET_NAME_MAX, "a part's name fits a job");
    if (content_type && is_type(content_type, "application/json")) {
        request->scene_seen = true;
        return STATUS_OK;
    }
    if (content_type && is_type(content_type, "multipart/form-data")) {
        struct multipart_sink sink = {part_begin, part_data, part_end, request};
        request->is_multipart = true;
        return multipart_init(&request->multipart, content_type, &sink, err);
    }
    return error_fault(err, STATUS_UNSUPPORTED_MEDIA_TYPE, NULL,
                       "Content-Type %s: a scene is application/json, or multipart/form-data with "
                       "the scene in a part named scene and each asset in a part of its name",
                       content_type ? content_type : "is missing");
}

enum status render_request_body(struct request *request, const char *data, size_t bytes,
                                struct error *err) {
    struct http *http = request->http;
    size_t held = atomic_fetch_add(&http->held_bytes, bytes) + bytes;
    request->held_bytes += bytes;
    if (held / HELD_BODIES_MAX > http->options.body_bytes_max)
        return error_fault(err, STATUS_QUEUE_FULL, NULL,
                           "the uploads of all clients together are too large at the moment");
    if (request->is_multipart)
        return multipart_feed(&request->multipart, data, bytes, err);
    return scene_add(request, data, bytes, err);
}

/* ---- from the body to a job ---- */

struct gathering {
    struct request *request;
    struct job_asset *wanted; /* JOB_ASSETS_MAX of them */
    size_t count;
    struct error *err;
};

/* Finds one asset of the scene: a part of the request, or a file of the server's folder. Every
 * asset that is missing gets its fault. */
static void gather(void *user, const char *name, const char *pointer) {
    struct gathering *gathering = user;
    struct request *request = gathering->request;
    for (size_t i = 0; i < gathering->count; i++)
        if (strcmp(gathering->wanted[i].name, name) == 0)
            return;
    if (gathering->count == JOB_ASSETS_MAX) {
        error_fault(gathering->err, STATUS_TOO_COMPLEX, pointer, "more than %d assets",
                    JOB_ASSETS_MAX);
        return;
    }
    if (!files_asset_name_ok(name)) {
        error_fault(gathering->err, STATUS_INVALID_SCENE, pointer,
                    "\"%s\" is not the name of an asset: a relative path without \"..\"", name);
        return;
    }
    struct job_asset *wanted = &gathering->wanted[gathering->count];
    for (size_t i = 0; i < request->job.asset_count; i++) {
        struct job_asset *part = &request->job.assets[i];
        if (strcmp(part->name, name) != 0)
            continue;
        *wanted = *part;
        part->fd = -1; /* moved */
        gathering->count++;
        return;
    }
    if (store_open(request->http->parts.store, name, pointer, wanted, gathering->err) == STATUS_OK)
        gathering->count++;
}

/* The parts that are wanted take the place of those that came. */
static void keep_gathered(struct request *request, struct gathering *gathering) {
    for (size_t i = 0; i < request->job.asset_count; i++)
        if (request->job.assets[i].fd >= 0)
            close(request->job.assets[i].fd);
    free(request->job.assets);
    request->job.assets = gathering->wanted;
    request->job.asset_count = gathering->count;
}

static enum status make_key(struct request *request, struct error *err) {
    struct job *job = &request->job;
    struct digest digest = {0};
    int failed = digest_start(&digest);
    if (!failed) {
        failed |= digest_add(&digest, request->scene, request->scene_bytes);
        for (size_t i = 0; i < job->asset_count; i++) {
            const struct job_asset *asset = &job->assets[i];
            failed |= digest_add(&digest, asset->name, strlen(asset->name) + 1);
            failed |= digest_add(&digest, asset->sha256, DIGEST_BYTES);
        }
        digest_finish(&digest, job->key);
    }
    return failed ? error_fault(err, STATUS_INTERNAL, NULL, "hashing failed") : STATUS_OK;
}

enum status render_request_prepare(struct request *request,
                                   enum status (*check)(void *user, const struct scene *scene,
                                                        struct error *err),
                                   enum status (*read)(void *user, const char *text, size_t bytes,
                                                       scene_asset_visit *visit, void *visit_user,
                                                       struct error *err),
                                   void *user, double *retry_after_s, struct error *err) {
    struct job *job = &request->job;
    double start_ms = monotonic_ms();
    job->received_ms = start_ms;
    if (request->is_multipart && !multipart_is_complete(&request->multipart))
        return error_fault(err, STATUS_BAD_REQUEST, NULL, "the multipart body is cut short");
    if (!request->scene_seen)
        return error_fault(err, STATUS_BAD_REQUEST, NULL, "there is no part named scene");
    if (request->scene_bytes == 0)
        return error_fault(err, STATUS_BAD_JSON, "", "the scene is empty");

    struct gathering gathering = {
        .request = request, .wanted = calloc(JOB_ASSETS_MAX, sizeof *gathering.wanted), .err = err};
    if (!gathering.wanted)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the assets");
    double read_ms;
    enum status status;
    if (read) { /* the times are one: assets are found while it is read */
        status = read(user, request->scene, request->scene_bytes, gather, &gathering, err);
        read_ms = monotonic_ms();
    } else {
        struct arena arena = {0};
        struct scene scene;
        status = scene_read(request->scene, request->scene_bytes, &arena, &scene, err);
        if (status == STATUS_OK)
            status = scene_check_implemented(&scene, err);
        if (status == STATUS_OK && check)
            status = check(user, &scene, err);
        read_ms = monotonic_ms();
        if (status == STATUS_OK)
            scene_visit_assets(&scene, gather, &gathering);
        arena_free(&arena);
    }
    keep_gathered(request, &gathering);
    if (status == STATUS_OK)
        status = err->status; /* of an asset that is missing */
    if (status == STATUS_OK)
        status = make_key(request, err);
    if (status != STATUS_OK)
        return status;
    double left_ms = quarantine_left_ms(request->http->parts.quarantine, job->key, read_ms);
    if (left_ms > 0) {
        *retry_after_s = left_ms * 1e-3;
        return error_fault(err, STATUS_QUARANTINED, "",
                           "this scene with these assets crashed a worker twice");
    }
    job->scene_fd = memfd_open("pelt-scene");
    if (job->scene_fd < 0)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the scene");
    status = memfd_write(job->scene_fd, request->scene, request->scene_bytes, err);
    if (status == STATUS_OK)
        status = memfd_seal(job->scene_fd, err);
    job->scene_bytes = request->scene_bytes;
    free(request->scene);
    request->scene = NULL;
    job->parse_ms = read_ms - start_ms;
    job->assets_ms = monotonic_ms() - read_ms;
    return status;
}

static void job_is_back(struct job *job) {
    struct request *request = job->owner;
    MHD_resume_connection(request->mhd);
}

/* Suspends the connection and hands the job over. The order matters: the supervisor may be done,
 * and resume, before supervisor_submit() returns. */
static enum MHD_Result submit(struct request *request) {
    struct job *job = &request->job;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(request->mhd, MHD_CONNECTION_INFO_CONNECTION_FD);
    job->client_fd = info ? info->connect_fd : -1;
    job->finished = job_is_back;
    job->owner = request;
    memcpy(job->request_id, request->id, sizeof job->request_id);
    if (!connections_enter(&request->http->connections, request->connection, CONNECTION_WORKING, 0))
        return MHD_NO;
    request->submitted = true;
    MHD_suspend_connection(request->mhd);
    if (supervisor_submit(request->http->parts.supervisor, job) != STATUS_OK)
        MHD_resume_connection(request->mhd); /* which comes back with job->error */
    return MHD_YES;
}

enum MHD_Result render_request_answer(struct request *request) {
    struct job *job = &request->job;
    if (request->submitted) {
        if (job->error.status == STATUS_CANCELLED) {
            request->http_status = (unsigned)status_http(STATUS_CANCELLED);
            return MHD_NO;
        }
        if (job->error.status != STATUS_OK)
            return reply_error(request, &job->error, job->retry_after_s, false);
        return reply_job(request, job->kind == JOB_PLAN ? "application/json"
                                                        : render_request_types[job->format]);
    }
    double retry_after_s = 0;
    if (render_request_prepare(request, NULL, NULL, NULL, &retry_after_s, &request->error) !=
        STATUS_OK)
        return reply_error(request, &request->error, retry_after_s, false);
    bool plan = request->route->endpoint == METRICS_ENDPOINT_plan;
    job->kind = plan ? JOB_PLAN : JOB_RENDER;
    job->format = plan ? JOB_FORMAT_JSON : (enum job_format)request->chosen_type;
    return submit(request);
}

enum MHD_Result render_request_canary(struct request *request) {
    struct job *job = &request->job;
    job->kind = JOB_CANARY;
    job->received_ms = monotonic_ms();
    job->scene_fd = memfd_open("pelt-canary"); /* empty: the worker has its own */
    if (job->scene_fd < 0 || memfd_seal(job->scene_fd, NULL) != STATUS_OK) {
        struct error err = {.status = STATUS_OUT_OF_MEMORY};
        return reply_error(request, &err, 1, false);
    }
    return submit(request);
}

void render_request_finish(struct request *request) {
    atomic_fetch_sub(&request->http->held_bytes, request->held_bytes);
    digest_abandon(&request->digest);
    free(request->scene);
    job_finish(&request->job);
}
