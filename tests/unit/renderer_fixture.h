/* One renderer for all tests of a program: cmocka_run_group_tests(tests, open_renderer,
 * close_renderer). */
#ifndef PELT_TESTS_UNIT_RENDERER_FIXTURE_H
#define PELT_TESTS_UNIT_RENDERER_FIXTURE_H

#include "tests/support.h"

static struct renderer *renderer;

static int open_renderer(void **state) {
    (void)state;
    renderer = support_renderer();
    return 0;
}

static int close_renderer(void **state) {
    (void)state;
    renderer_destroy(renderer);
    return 0;
}

#endif
