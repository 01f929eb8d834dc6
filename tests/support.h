/* For tests that draw: a scene as JSON goes in, linear pixels come out. */
#ifndef PELT_TESTS_SUPPORT_H
#define PELT_TESTS_SUPPORT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "api/scene.h"
#include "renderer/render.h"

/* Quotes in the JSON are written as ' so that scenes can be read. */
static inline void support_quote(char *json) {
    for (; *json; json++)
        if (*json == '\'')
            *json = '"';
}

static inline enum status support_no_asset(void *user, const char *name, const char *pointer,
                                           struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s in this test", name);
}

static inline struct renderer *support_renderer(void) {
    struct renderer *renderer = NULL;
    struct error err = {0};
    struct renderer_options options = {.device = -1};
    if (renderer_create(&options, &renderer, &err) != STATUS_OK)
        fail_msg("%s", err.fault_count ? err.faults[0].message : "no renderer");
    error_clear(&err);
    return renderer;
}

/* The status of drawing a scene given as JSON with ' for ", which are replaced in place. */
static inline enum status support_draw_json(struct renderer *renderer,
                                            const struct asset_source *source, char *json,
                                            struct render_result *result) {
    support_quote(json);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    enum status status = scene_read(json, strlen(json), &arena, &scene, &err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, &scene, source, result, &err);
    for (size_t i = 0; i < err.fault_count; i++)
        print_message("%s: %s\n", err.faults[i].pointer ? err.faults[i].pointer : "-",
                      err.faults[i].message);
    error_clear(&err);
    arena_free(&arena);
    return status;
}

/* The same for printf-formatted JSON that names no assets. */
__attribute__((format(printf, 3, 4))) static inline enum status
support_draw(struct renderer *renderer, struct render_result *result, const char *format, ...) {
    char json[8192];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(json, sizeof json, format, args);
    va_end(args);
    assert_true(length > 0 && (size_t)length < sizeof json);
    struct asset_source source = {.open = support_no_asset};
    return support_draw_json(renderer, &source, json, result);
}

static inline const float *support_pixel(const struct render_result *result, int x, int y) {
    return result->pixels + 4 * ((size_t)y * (size_t)result->width + (size_t)x);
}

#endif
