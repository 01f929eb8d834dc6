/* `pelt render --server URL`: the scene's own text and its assets go to a daemon as one multipart
 * request; the picture comes back, or the daemon's problem document as an error of ours. */
#include "service/remote.h"

#include <jansson.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/module.h"
#include "service/module/http_curl.h"

/* An EXR of 8192 x 8192 is at most 1 GiB; base64 adds a third. */
static const size_t reply_bytes_max = (size_t)3 << 29;

/* ---- the request ---- */

struct parts {
    const struct asset_source *source;
    struct http_part *part; /* [0] is the scene */
    struct asset_bytes *asset;
    size_t count, capacity;
    enum status status;
    struct error *err;
};

/* Adds the asset, unless an earlier use of the name did. */
static void add_asset(void *user, const char *name, const char *pointer) {
    struct parts *parts = user;
    if (parts->status != STATUS_OK)
        return;
    for (size_t i = 1; i < parts->count; i++)
        if (strcmp(parts->part[i].name, name) == 0)
            return;
    if (parts->count == parts->capacity) {
        size_t capacity = 2 * parts->capacity + 8;
        struct http_part *part = realloc(parts->part, capacity * sizeof *part);
        if (part)
            parts->part = part;
        struct asset_bytes *asset = part ? realloc(parts->asset, capacity * sizeof *asset) : NULL;
        if (!asset) {
            parts->status = error_fault(parts->err, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
            return;
        }
        parts->asset = asset;
        parts->capacity = capacity;
    }
    struct asset_bytes bytes = {0};
    parts->status = parts->source->open(parts->source->user, name, pointer, &bytes, parts->err);
    if (parts->status != STATUS_OK)
        return;
    parts->asset[parts->count] = bytes;
    parts->part[parts->count++] = (struct http_part){
        .name = name, .type = "application/octet-stream", .data = bytes.data, .bytes = bytes.size};
}

static void parts_finish(struct parts *parts) {
    for (size_t i = 1; i < parts->count; i++)
        parts->source->close(parts->source->user, &parts->asset[i]);
    free(parts->part);
    free(parts->asset);
}

/* ---- the answer ---- */

/* A problem document (RFC 9457) as faults; its type ends in the slug of the status. */
static enum status read_problem(const struct http_response *response, struct error *err) {
    json_t *problem = json_loadb((const char *)response->body, response->bytes, 0, NULL);
    const char *type = json_string_value(json_object_get(problem, "type"));
    if (!type) {
        json_decref(problem);
        return error_fault(err, STATUS_UNREACHABLE, NULL,
                           "the server answered %ld without saying why", response->status);
    }
    const char *slug = type;
    for (const char *c = type; *c; c++)
        if (*c == '/' || *c == ':' || *c == '#')
            slug = c + 1;
    enum status status = status_from_slug(slug);
    if (status == STATUS_OK)
        status = STATUS_INTERNAL;
    size_t index;
    json_t *row, *rows = json_object_get(problem, "errors");
    json_array_foreach(rows, index, row) {
        const char *detail = json_string_value(json_object_get(row, "detail"));
        error_fault(err, status, json_string_value(json_object_get(row, "pointer")), "%s",
                    detail ? detail : status_title(status));
    }
    if (json_array_size(rows) == 0) {
        const char *detail = json_string_value(json_object_get(problem, "detail"));
        error_fault(err, status, NULL, "the server: %s", detail ? detail : status_title(status));
    }
    json_decref(problem);
    return status;
}

/* {"report": {...}, "image": {"data": base64, ...}} */
static enum status read_report_and_image(const struct http_response *response,
                                         struct remote_reply *reply, struct error *err) {
    json_error_t why;
    json_t *root = json_loadb((const char *)response->body, response->bytes, 0, &why);
    json_t *report = json_object_get(root, "report");
    json_t *data = json_object_get(json_object_get(root, "image"), "data");
    reply->image =
        json_is_string(data)
            ? decode_base64(json_string_value(data), json_string_length(data), &reply->image_bytes)
            : NULL;
    reply->report = report ? json_dumps(report, JSON_INDENT(2)) : NULL;
    json_decref(root);
    if (!reply->image || !reply->report)
        return error_fault(err, STATUS_UNREACHABLE, NULL,
                           "the server's answer is not a report with an image");
    return STATUS_OK;
}

static enum status read_response(struct http_response *response, bool want_report,
                                 struct remote_reply *reply, struct error *err) {
    if (response->status != 200)
        return read_problem(response, err);
    memcpy(reply->timing, response->timing, sizeof reply->timing);
    if (want_report)
        return read_report_and_image(response, reply, err);
    if (strncmp(response->type, "image/", 6) != 0)
        return error_fault(err, STATUS_UNREACHABLE, NULL, "the server sent %s and no image",
                           response->type);
    reply->image = response->body;
    reply->image_bytes = response->bytes;
    response->body = NULL;
    return STATUS_OK;
}

enum status remote_render(const char *server, const struct cli_scene *scene,
                          const struct asset_source *assets, enum encode_format format,
                          bool want_report, struct remote_reply *reply, struct error *err) {
    static const struct module_spec spec = {"http_curl.so", "pelt_http_module", "libcurl",
                                            "libcurl3-gnutls"};
    *reply = (struct remote_reply){0};
    if (want_report && format == ENCODE_EXR)
        return error_fault(err, STATUS_USAGE, NULL,
                           "a server gives its report with PNG alone; leave --report or EXR out");
    const struct http_module *http = module_open_spec(&spec, err);
    if (!http)
        return STATUS_IO_ERROR;
    struct parts parts = {.source = assets, .err = err};
    struct http_response response = {0};
    char *url = NULL, message[320] = "";
    size_t length = strlen(server);
    while (length && server[length - 1] == '/')
        length--;
    parts.part = malloc(sizeof *parts.part);
    parts.asset = malloc(sizeof *parts.asset);
    if (!parts.part || !parts.asset || asprintf(&url, "%.*s/v1/render", (int)length, server) < 0) {
        url = NULL;
        parts.status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
        goto done;
    }
    parts.capacity = parts.count = 1;
    parts.part[0] = (struct http_part){
        .name = "scene", .type = "application/json", .data = scene->text, .bytes = scene->bytes};
    scene_visit_assets(&scene->scene, add_asset, &parts);
    if (parts.status != STATUS_OK)
        goto done;
    const char *accept = want_report            ? "application/json"
                         : format == ENCODE_EXR ? "image/x-exr"
                                                : "image/png";
    if (http->post(url, accept, parts.part, parts.count, reply_bytes_max, &response, message,
                   sizeof message) != 0)
        parts.status = error_fault(err, STATUS_UNREACHABLE, NULL, "%s: %s", url, message);
    else
        parts.status = read_response(&response, want_report, reply, err);
done:
    parts_finish(&parts);
    free(response.body);
    free(url);
    if (parts.status != STATUS_OK)
        remote_reply_finish(reply);
    return parts.status;
}

void remote_reply_finish(struct remote_reply *reply) {
    free(reply->image);
    free(reply->report);
    *reply = (struct remote_reply){0};
}
