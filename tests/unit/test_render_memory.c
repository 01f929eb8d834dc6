/* Memory runs out at every place where Pelt itself takes some while a picture is drawn, measured
 * and aimed at a target, or a scene is swept: the answer is a clean status, nothing stays
 * allocated, and the next picture is the same as before. Allocations of the GL driver and of
 * libraries do not fail here: only those whose caller lies in this program. Skipped under
 * sanitizers, which bring their own allocator. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/sweep.h"
#include "service/sweep_write.h"
#include "tests/support.h"

#if defined(__SANITIZE_ADDRESS__)
#define INTERPOSED 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define INTERPOSED 0
#endif
#endif
#ifndef INTERPOSED
#define INTERPOSED 1
#endif

/* The program's own state, on purpose: malloc() has no argument to carry it. */
static long fail_at = -1; /* allocations of this program until the one that fails; -1: none does */
static long live;         /* made by this program and not freed */

#if INTERPOSED
#define EXPORTED __attribute__((visibility("default")))
void *__libc_malloc(size_t bytes);
void *__libc_calloc(size_t count, size_t bytes);
void *__libc_realloc(void *old, size_t bytes);
void __libc_free(void *data);
extern const char __executable_start, etext;

/* What this program has allocated: an open hash table of addresses. Drivers have threads. */
enum { SLOTS = 1 << 16 };
static void *slots[SLOTS];
static int lock;

static void *slot_change(void *old, void *new) {
    while (__atomic_exchange_n(&lock, 1, __ATOMIC_ACQUIRE))
        ;
    size_t at = ((uintptr_t)(old ? old : new) >> 4) * 2654435761u % SLOTS;
    void *found = NULL;
    for (size_t n = 0; n < SLOTS; n++, at = (at + 1) % SLOTS) {
        if (old ? slots[at] == old : slots[at] == NULL || slots[at] == (void *)1) {
            found = slots[at];
            slots[at] = old ? (void *)1 : new; /* 1: was used, look on */
            live += old ? -1 : 1;
            break;
        }
        if (old && slots[at] == NULL)
            break;
    }
    __atomic_store_n(&lock, 0, __ATOMIC_RELEASE);
    return found;
}

static int is_ours(const char *caller) {
    return caller >= &__executable_start && caller < &etext;
}

static int fails(int ours) {
    return ours && fail_at >= 0 && fail_at-- == 0;
}

static void *keep(void *data, int ours) {
    if (data && ours)
        slot_change(NULL, data);
    return data;
}

EXPORTED void *malloc(size_t bytes) {
    int ours = is_ours(__builtin_return_address(0));
    return fails(ours) ? NULL : keep(__libc_malloc(bytes), ours);
}

EXPORTED void *calloc(size_t count, size_t bytes) {
    int ours = is_ours(__builtin_return_address(0));
    return fails(ours) ? NULL : keep(__libc_calloc(count, bytes), ours);
}

EXPORTED void *realloc(void *old, size_t bytes) {
    int ours = is_ours(__builtin_return_address(0));
    if (fails(ours))
        return NULL;
    void *data = __libc_realloc(old, bytes);
    if (data && old)
        slot_change(old, NULL);
    return keep(data, ours);
}

EXPORTED void free(void *data) {
    if (data)
        slot_change(data, NULL);
    __libc_free(data);
}
#endif

static struct renderer *renderer;

static int open_renderer(void **state) {
    (void)state;
    setenv("LP_NUM_THREADS", "1", 1); /* the reference, too, then uses one: the same order always */
    renderer = support_renderer();
    return 0;
}

static int close_renderer(void **state) {
    (void)state;
    renderer_destroy(renderer);
    return 0;
}

#define SHELL(material, rest)                                                                      \
    "{\"shell\": {\"mesh\": {\"shape\": \"sphere\", \"divisions\": [6, 4]}, \"base\": {\"color\":" \
    " [0.5, 0.5, 0.5]}, \"material\": {\"builtin\": \"" material "\", \"size\": [8, 8, 8]}}" rest  \
    "}"
#define SCENE(objects, rest)                                                                       \
    "{\"image\": {\"width\": 12, \"height\": 10, \"samples\": 1}, \"objects\": [" objects "]" rest \
    "}"

/* One picture; *done where nothing failed any more. */
static enum status run_once(const struct scene *scene, long n, bool *done, float *pixels) {
    struct asset_source source = {.open = support_no_asset};
    struct render_result result;
    struct error err = {0};
    fail_at = n;
    enum status status = renderer_render(renderer, scene, &source, &result, &err);
    *done = fail_at >= 0 || n < 0;
    fail_at = -1;
    if (status == STATUS_OK) {
        memcpy(pixels, result.pixels, 12 * 10 * 4 * sizeof *pixels);
        render_result_finish(&result);
    }
    error_clear(&err);
    return status;
}

/* `timed`: how finely it is drawn is up to the clock, so not the same twice. */
static void torture_scene(const char *json, bool timed) {
    struct arena arena = {0};
    struct scene scene;
    float good[12 * 10 * 4], after[12 * 10 * 4];
    bool done = false;
    assert_int_equal(scene_read(json, strlen(json), &arena, &scene, NULL), STATUS_OK);
    /* Meshes, shells and materials are in the caches from now on: their own tests torture those. */
    assert_int_equal(run_once(&scene, -1, &done, good), STATUS_OK);
    assert_int_equal(run_once(&scene, -1, &done, good), STATUS_OK);
    long n = 0, failures = 0, kept = live;
    for (done = false; !done; n++) {
        enum status status = run_once(&scene, n, &done, after);
        failures += status != STATUS_OK;
        if (status != STATUS_OK && status != STATUS_OUT_OF_MEMORY)
            fail_msg("allocation %ld: %s", n, status_slug(status));
        if (live > kept) /* fewer: what stays between pictures was let go */
            fail_msg("allocation %ld of %s: %ld left", n, json, live - kept);
    }
    print_message("%ld allocations, %ld failures\n", n - 1, failures);
    assert_true(failures >= 4); /* the interposed allocator is in use */
    assert_int_equal(run_once(&scene, -1, &done, after), STATUS_OK);
    if (!timed)
        assert_memory_equal(good, after, sizeof good);
    for (size_t i = 0; i < sizeof after / sizeof *after; i++)
        assert_true(isfinite(after[i]));
    arena_free(&arena);
}

static void torture(const char *json) {
    torture_scene(json, false);
}

static void pictures_survive(void **state) {
    (void)state;
    torture(SCENE(SHELL("clouds", ""), ""));
    torture(SCENE(SHELL("chain", ", \"quality\": {\"order\": \"sorted\"}"), ""));
    torture(SCENE(SHELL("clouds", ", \"quality\": {\"order\": \"sorted\"}"), ""));
}

static void slices_survive(void **state) {
    (void)state;
    torture(SCENE(SHELL("clouds", ", \"path\": \"slicing\""), ""));
    torture(SCENE(SHELL("chain", ", \"quality\": {\"slices\": 600}"), ""));
    torture(SCENE(SHELL("clouds", ", \"quality\": {\"slices\": 600}"), ""));
    torture(SCENE(SHELL("clouds", ", \"quality\": {\"method\": \"software\"}"), ""));
    torture(SCENE(SHELL("clouds", ", \"quality\": {\"method\": \"hardware\"}"),
                  ", \"report\": {\"error\": \"estimate\"}"));
}

static void errors_survive(void **state) {
    (void)state;
    torture(SCENE(SHELL("clouds", ""), ", \"report\": {\"error\": \"estimate\"}"));
    torture(SCENE(SHELL("chain", ""), ", \"report\": {\"error\": \"reference\"}"));
}

#define MIST(color)                                                                                \
    "{\"shell\": {\"mesh\": {\"shape\": \"plane\", \"divisions\": [1, 1]}, \"material\": "         \
    "{\"builtin\": \"homogeneous\", \"color\": [" color "]}}}"
#define MISTS                                                                                      \
    MIST("1, 0, 0")                                                                                \
    ", " MIST("0, 1, 0") ", " MIST("0, 0, 1") ", " MIST("1, 1, 0") ", " MIST("0, 1, 1") ", " MIST( \
        "1, 0, 1")

/* Another path after the first was made ready, and both tried. */
static void choices_survive(void **state) {
    (void)state;
    torture(SCENE(MISTS, ""));
    torture(SCENE(MIST("1, 0, 0"), ", \"target\": {\"deadline_ms\": 60000}"));
}

static void targets_survive(void **state) {
    (void)state;
    torture(SCENE(SHELL("clouds", ""), ", \"target\": {\"max_error\": 0.05}"));
    torture_scene(SCENE(SHELL("clouds", ""), ", \"target\": {\"deadline_ms\": 1}"), true);
}

/* A sweep, and what is written of it. */
static bool sweep_once(const struct scene *scene, long n) {
    static const char *const series[] = {"tetra-walk"};
    static const int qualities[] = {2, 4};
    struct sweep_options options = {.series = series,
                                    .series_count = 1,
                                    .qualities = qualities,
                                    .quality_count = 2,
                                    .repeats = 1,
                                    .threads = 1};
    struct asset_source source = {.open = support_no_asset};
    struct sweep *sweep;
    struct error err = {0};
    fail_at = n;
    enum status status = sweep_run(renderer, scene, &source, &options, &sweep, &err);
    if ((status != STATUS_OK && status != STATUS_OUT_OF_MEMORY) ||
        (status == STATUS_OK) != (sweep != NULL))
        fail_msg("allocation %ld: %s", n, status_slug(status));
    if (sweep) {
        free(sweep_json(sweep));
        free(sweep_csv(sweep));
        free(sweep_html(sweep, "name"));
    }
    bool done = fail_at >= 0 || n < 0;
    fail_at = -1;
    sweep_destroy(sweep);
    error_clear(&err);
    return done;
}

static void sweeps_survive(void **state) {
    (void)state;
    static const char json[] = SCENE(SHELL("clouds", ""), "");
    struct arena arena = {0};
    struct scene scene;
    assert_int_equal(scene_read(json, strlen(json), &arena, &scene, NULL), STATUS_OK);
    sweep_once(&scene, -1);
    sweep_once(&scene, -1);
    long n = 0, kept = live;
    for (bool done = false; !done; n++) {
        done = sweep_once(&scene, n);
        if (live > kept)
            fail_msg("allocation %ld: %ld left", n, live - kept);
    }
    print_message("%ld allocations\n", n - 1);
    assert_true(n > 100);
    arena_free(&arena);
}

int main(void) {
    if (!INTERPOSED) {
        puts("a sanitizer brings its own allocator");
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(choices_survive), cmocka_unit_test(pictures_survive),
        cmocka_unit_test(slices_survive),  cmocka_unit_test(errors_survive),
        cmocka_unit_test(targets_survive), cmocka_unit_test(sweeps_survive),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
