/* Reads a scene from a string literal; for the tests of api/. */
#ifndef PELT_TESTS_SCENE_FIXTURE_H
#define PELT_TESTS_SCENE_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "api/scene.h"

struct read {
    struct arena arena;
    struct scene scene;
    struct error err;
    enum status status;
};

static inline void read_bytes(struct read *read, const char *json, size_t bytes) {
    *read = (struct read){0};
    /* A copy of the exact size, so that a sanitizer sees a step past the end. */
    char *copy = malloc(bytes ? bytes : 1);
    assert_non_null(copy);
    memcpy(copy, json, bytes);
    read->status = scene_read(copy, bytes, &read->arena, &read->scene, &read->err);
    free(copy);
    assert_int_equal(read->status, read->err.status);
}

static inline void read_text(struct read *read, const char *json) {
    read_bytes(read, json, strlen(json));
}

static inline void read_finish(struct read *read) {
    error_clear(&read->err);
    arena_free(&read->arena);
}

/* Whether there is a fault at `pointer` whose message holds `text`; prints all if not. */
static inline void assert_fault(const struct error *err, const char *pointer, const char *text) {
    for (size_t i = 0; i < err->fault_count; i++)
        if (strcmp(err->faults[i].pointer, pointer) == 0 && strstr(err->faults[i].message, text))
            return;
    for (size_t i = 0; i < err->fault_count; i++)
        print_error("%s: %s\n", err->faults[i].pointer, err->faults[i].message);
    fail_msg("no fault at \"%s\" that says \"%s\"", pointer, text);
}

/* The text between the braces of the one shell of a scene, and what stands beside `objects`. */
#define SHELL_SCENE(mesh, material, beside)                                                        \
    "{\"objects\": [{\"shell\": {\"mesh\": " mesh ", \"material\": " material "}}]" beside "}"
#define LEAST(beside) SHELL_SCENE("{\"shape\": \"sphere\"}", "{\"builtin\": \"fur\"}", beside)

#endif
