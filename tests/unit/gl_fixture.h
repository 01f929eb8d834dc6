/* A GL context for a group of tests: by EGL where nothing else is asked for. */
#ifndef PELT_TESTS_UNIT_GL_FIXTURE_H
#define PELT_TESTS_UNIT_GL_FIXTURE_H

#include <stdio.h>

#include "renderer/gl/context.h"

/* For cmocka's group set-up and tear-down; *state is the struct gl_context. */
static inline int gl_fixture_open(void **state) {
    const struct gl_options options = {GL_BACKEND_AUTO, -1, false};
    struct gl_context *context;
    struct error err = {0};
    if (gl_context_create(&options, &context, &err) != STATUS_OK) {
        for (size_t i = 0; i < err.fault_count; i++)
            fprintf(stderr, "%s\n", err.faults[i].message);
        error_clear(&err);
        return -1;
    }
    *state = context;
    return 0;
}

static inline int gl_fixture_close(void **state) {
    gl_context_destroy(*state);
    return 0;
}

#endif
