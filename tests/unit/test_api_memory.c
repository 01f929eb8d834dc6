/* Every allocation that reading, writing and reporting makes is failed in turn: the answer is
 * STATUS_OUT_OF_MEMORY or a complete one, nothing is leaked, nothing crashes.
 *
 * The allocator of the program is replaced; a sanitizer has its own, so this test is left out
 * there. */
#include "tests/unit/scene_fixture.h"

#include "api/problem_write.h"
#include "api/report.h"

#if defined(__SANITIZE_ADDRESS__)
#define SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SANITIZED 1
#endif
#endif

#ifdef SANITIZED
int main(void) {
    puts("left out: the sanitizer has its own allocator");
    return 77;
}
#else

void *__libc_malloc(size_t bytes);
void *__libc_calloc(size_t count, size_t bytes);
void *__libc_realloc(void *old, size_t bytes);
void __libc_free(void *old);

static long fail_at = -1; /* counts down while >= 0; the allocation at 0 fails */
static long live;         /* allocations made while counting, less those given back */
static bool counting;

static bool fails(void) {
    return counting && fail_at >= 0 && fail_at-- == 0;
}

/* Seen by the libraries too, whatever visibility the program is built with. */
#define REPLACES_LIBC __attribute__((visibility("default")))

REPLACES_LIBC void *malloc(size_t bytes) {
    if (fails())
        return NULL;
    live += counting;
    return __libc_malloc(bytes);
}

REPLACES_LIBC void *calloc(size_t count, size_t bytes) {
    if (fails())
        return NULL;
    live += counting;
    return __libc_calloc(count, bytes);
}

REPLACES_LIBC void *realloc(void *old, size_t bytes) {
    if (fails())
        return NULL;
    live += counting && !old;
    return __libc_realloc(old, bytes);
}

REPLACES_LIBC void free(void *old) {
    live -= counting && old;
    __libc_free(old);
}

static const char *const texts[] = {
    LEAST(", \"camera\": {\"eye\": [0, -3, 2]}, \"lights\": [{}, {}]"),
    "{\"objects\": [{\"skeleton\": {\"joints\": [{\"position\": [0, 0, 0], \"radius\": 1}, "
    "{\"position\": [0, 0, 1], \"radius\": 1}], \"segments\": [[0, 1]], \"relief\": {\"height\": "
    "\"h\", \"color\": \"\\u0063\"}}}]}",
    "{\"\\u0061\": NaN, \"a\": 1e999, \"image\": {\"width\": 0}, \"objects\": 3}",
    "[1, 2",
};

/* One reading of `text`, and all that can follow from it. */
static enum status once(const char *text) {
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    enum status status = scene_read(text, strlen(text), &arena, &scene, &err);
    if (status == STATUS_OK) {
        char *written = scene_write(&scene);
        static struct report report;
        report.resolved = scene;
        char *document = report_write(&report);
        status = written && document ? STATUS_OK : STATUS_OUT_OF_MEMORY;
        free(written);
        free(document);
        report.resolved = (struct scene){0};
    }
    char *problem = problem_write(&err, "id");
    if (!problem)
        status = STATUS_OUT_OF_MEMORY;
    free(problem);
    error_clear(&err);
    arena_free(&arena);
    return status;
}

static void each_allocation_fails_once(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        enum status wanted = once(texts[i]);
        long failures = 0;
        for (long n = 0;; n++) {
            live = 0;
            fail_at = n;
            counting = true;
            enum status status = once(texts[i]);
            counting = false;
            if (live != 0)
                fail_msg("text %zu, allocation %ld: %ld left", i, n, live);
            if (fail_at >= 0)
                break; /* it needs fewer than n allocations */
            failures++;
            /* A fault whose text is lost leaves the status as it is. */
            if (status != STATUS_OUT_OF_MEMORY && status != wanted)
                fail_msg("text %zu, allocation %ld: %s", i, n, status_slug(status));
        }
        assert_true(failures > 5);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(each_allocation_fails_once)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
#endif
