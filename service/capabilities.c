/* What this daemon can do. Nothing here is a list kept by hand beside the code: whether a path, a
 * material or a shape can be drawn is asked of the reader itself, with the least scene that needs
 * it. Names are those of the scene's contract (DESIGN.md, "The scene, version 1"). */
#include "service/capabilities.h"

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/scene.h"
#include "service/job_kinds.h"
#include "service/render_request.h"

/* "ready", "planned" (in the contract, not drawn by this version) or NULL (not in the contract). */
static const char *state_of(const char *json) {
    struct arena arena = {0};
    struct scene scene;
    const char *state = NULL;
    if (scene_read(json, strlen(json), &arena, &scene, NULL) == STATUS_OK)
        state = scene_check_implemented(&scene, NULL) == STATUS_OK ? "ready" : "planned";
    arena_free(&arena);
    return state;
}

/* What is asked about, and how a scene says it; `said` NULL: as its name in quotes. */
struct question {
    const char *name, *said;
};

/* An array of {"name", "state"}: each question put between `before` and `after`. */
static json_t *states(const char *before, const char *after, const struct question *questions) {
    char json[512];
    json_t *rows = json_array();
    for (; questions->name; questions++) {
        const char *quote = questions->said ? "" : "\"";
        int n = snprintf(json, sizeof json, "%s%s%s%s%s", before, quote,
                         questions->said ? questions->said : questions->name, quote, after);
        const char *state = n > 0 && (size_t)n < sizeof json ? state_of(json) : NULL;
        if (state)
            json_array_append_new(rows,
                                  json_pack("{s:s, s:s}", "name", questions->name, "state", state));
    }
    return rows;
}

static json_t *backend_of(const struct supervisor_view *view) {
    const struct ipc_ready *ready = &view->ready;
    if (!view->ever_ready)
        return json_null();
    return json_pack("{s:s, s:s, s:s, s:s, s:s, s:i, s:s}", "backend", ready->backend, "device",
                     ready->device, "gl_renderer", ready->gl_renderer, "gl_version",
                     ready->gl_version, "cpu", ready->cpu, "threads", (int)ready->threads, "clock",
                     ready->clock == REPORT_CLOCK_QUERY ? "query" : "fence");
}

static json_t *types(void) {
    json_t *list = json_array();
    for (int i = 0; i < RENDER_REQUEST_TYPES; i++)
        json_array_append_new(list, json_string(render_request_types[i]));
    return list;
}

static json_t *limits_of(const struct http_options *options, const struct supervisor_view *view) {
    return json_pack("{s:i, s:i, s:i, s:I, s:i, s:i, s:i, s:f, s:f}", "scene_bytes",
                     SCENE_BYTES_MAX, "scene_depth", SCENE_DEPTH_MAX, "image_side",
                     SCENE_IMAGE_SIDE_MAX, "body_bytes", (json_int_t)options->body_bytes_max,
                     "assets", JOB_ASSETS_MAX, "queue", view->queue_limit, "workers", view->workers,
                     "timeout_ms", options->timeout_ms, "receive_timeout_ms", options->receive_ms);
}

/* Long work: its kinds, and where each is posted. */
static json_t *jobs_of(const struct http_options *options, const struct jobs *jobs) {
    json_t *kinds = json_array();
    for (int i = 0; i < task_kind_count; i++)
        json_array_append_new(kinds, json_pack("{s:s, s:s}", "name", task_kinds[i].name, "route",
                                               task_kinds[i].route));
    return json_pack("{s:o, s:i, s:I, s:f, s:f}", "kinds", kinds, "queue", jobs->limits.queue,
                     "keep_bytes", (json_int_t)jobs->limits.keep_bytes, "keep_s",
                     jobs->limits.keep_ms * 1e-3, "timeout_s", options->job_timeout_ms * 1e-3);
}

#define SHELL_OF(mesh) "{\"objects\":[{\"shell\":{\"mesh\":{\"shape\":" mesh
#define MATERIAL_OF    "},\"material\":{"

/* One array of the document: what is asked, and the least scene around each question. */
static const struct subject {
    const char *member, *before, *after;
    struct question questions[16]; /* ends with a row of NULLs */
} subjects[] = {
    {"paths",
     SHELL_OF("\"sphere\"") MATERIAL_OF "\"builtin\":\"fur\"}},\"path\":",
     "}]}",
     {{"tetra", NULL},
      {"slicing", NULL},
      {"gdm", NULL},
      {"distance", NULL},
      {"frusta", NULL},
      {"auto", NULL}}},
    {"materials",
     SHELL_OF("\"sphere\"") MATERIAL_OF "\"builtin\":",
     "}}}]}",
     {{"homogeneous", NULL},
      {"fur", NULL},
      {"clouds", NULL},
      {"fog", NULL},
      {"weave", NULL},
      {"chain", NULL},
      {"rocks", NULL},
      {"trees", NULL},
      {"grate", NULL},
      {"scales", NULL},
      {"bark", NULL}}},
    {"material_sources",
     SHELL_OF("\"sphere\"") MATERIAL_OF,
     "}}}]}",
     {{"volume", "\"volume\":\"a\""},
      {"height", "\"height\":\"a\""},
      {"geometry", "\"geometry\":{\"asset\":\"a\"}"}}},
    {"shapes",
     SHELL_OF(""),
     MATERIAL_OF "\"builtin\":\"fur\"}}}]}",
     {{"plane", NULL},
      {"sphere", NULL},
      {"torus", NULL},
      {"cylinder", NULL},
      {"terrain", NULL},
      {"teapot", NULL}}},
};

char *capabilities_write(const struct http_options *options, const struct supervisor_view *view,
                         const struct jobs *jobs) {
    json_t *root = json_pack("{s:{s:s}, s:o, s:o}", "build", "version", PELT_VERSION, "renderer",
                             backend_of(view), "media_types", types());
    bool complete = root != NULL;
    for (size_t i = 0; i < sizeof subjects / sizeof *subjects && complete; i++)
        complete = json_object_set_new(
                       root, subjects[i].member,
                       states(subjects[i].before, subjects[i].after, subjects[i].questions)) == 0;
    complete = complete && json_object_set_new(root, "jobs", jobs_of(options, jobs)) == 0;
    complete = complete && json_object_set_new(root, "limits", limits_of(options, view)) == 0;
    char *text = complete ? json_dumps(root, JSON_COMPACT) : NULL;
    json_decref(root);
    return text;
}
