/* What this daemon can do. Nothing here is a list kept by hand beside the code: whether a path, a
 * material or a shape can be drawn is asked of the reader itself, with the least scene that needs
 * it. Names are those of the scene's contract (DESIGN.md, "The scene, version 1"). */
#include "service/capabilities.h"

#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/scene.h"
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

/* An array of {"name", "state"} for `names`, each put between `before` and `after`. */
static json_t *states(const char *before, const char *after, const char *const *names) {
    char json[512];
    json_t *rows = json_array();
    for (; *names; names++) {
        int n = snprintf(json, sizeof json, "%s%s%s", before, *names, after);
        const char *state = n > 0 && (size_t)n < sizeof json ? state_of(json) : NULL;
        if (state)
            json_array_append_new(rows, json_pack("{s:s, s:s}", "name", *names, "state", state));
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

char *capabilities_write(const struct http_options *options, const struct supervisor_view *view) {
    static const char *const paths[] = {"tetra",  "slicing", "gdm", "distance",
                                        "frusta", "auto",    NULL};
    static const char *const materials[] = {"homogeneous", "fur",    "clouds", "fog",
                                            "weave",       "chain",  "rocks",  "trees",
                                            "grate",       "scales", "bark",   NULL};
    static const char *const sources[] = {"\"volume\":\"a\"", "\"height\":\"a\"",
                                          "\"geometry\":{\"asset\":\"a\"}", NULL};
    static const char *const shapes[] = {"plane",   "sphere", "torus", "cylinder",
                                         "terrain", "teapot", NULL};
    json_t *root = json_pack(
        "{s:{s:s}, s:o, s:o, s:o, s:o, s:o, s:o, s:{s:i, s:i, s:i, s:I, s:i, s:i, s:i, s:f, s:f}}",
        "build", "version", PELT_VERSION, //
        "renderer", backend_of(view),     //
        "media_types", types(),           //
        "paths",
        states("{\"objects\":[{\"shell\":{\"mesh\":{\"shape\":\"sphere\"},"
               "\"material\":{\"builtin\":\"fur\"}},\"path\":\"",
               "\"}]}", paths),
        "materials",
        states("{\"objects\":[{\"shell\":{\"mesh\":{\"shape\":\"sphere\"},"
               "\"material\":{\"builtin\":\"",
               "\"}}}]}", materials),
        "material_sources",
        states("{\"objects\":[{\"shell\":{\"mesh\":{\"shape\":\"sphere\"},\"material\":{", "}}}]}",
               sources),
        "shapes",
        states("{\"objects\":[{\"shell\":{\"mesh\":{\"shape\":\"",
               "\"},\"material\":{\"builtin\":\"fur\"}}}]}", shapes),
        "limits", "scene_bytes", SCENE_BYTES_MAX, "scene_depth", SCENE_DEPTH_MAX, "image_side",
        SCENE_IMAGE_SIDE_MAX, "body_bytes", (json_int_t)options->body_bytes_max, "assets",
        JOB_ASSETS_MAX, "queue", view->queue_limit, "workers", view->workers, "timeout_ms",
        options->timeout_ms, "receive_timeout_ms", options->receive_ms);
    char *text = root ? json_dumps(root, JSON_COMPACT) : NULL;
    json_decref(root);
    return text;
}
