/* Memory runs out at every place where a volume or an image takes some: the answer is a clean
 * status, and nothing stays allocated. Skipped under sanitizers (failing_malloc.h). */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/asset/volume.h"
#include "renderer/bake/normals.h"
#include "tests/unit/asset_files.h"
#include "tests/unit/failing_malloc.h"

/* The bytes are there before anything fails: the source is not what is tested. */
struct kept {
    struct asset_bytes height, color;
};

static enum status open_kept(void *user, const char *name, const char *pointer,
                             struct asset_bytes *bytes, struct error *err) {
    (void)pointer, (void)err;
    const struct kept *kept = user;
    *bytes = strcmp(name, "height") == 0 ? kept->height : kept->color;
    return STATUS_OK;
}

static void close_kept(void *user, struct asset_bytes *bytes) {
    (void)user, (void)bytes;
}

/* One run: *done where nothing failed any more. Returns what it left allocated. */
static long run_once(const struct scene_material *spec, const struct asset_source *source, long n,
                     bool *done) {
    long before = live;
    const struct volume *volume = NULL;
    bool made = false;
    struct error err = {0};
    struct volume_cache *cache = volume_cache_create(1 << 20);
    fail_at = n;
    enum status status = volume_acquire(cache, spec, 1.0, "/m", source, &volume, &made, &err);
    *done = fail_at >= 0 || n < 0;
    fail_at = -1;
    /* A reader that goes without memory may call its file damaged. */
    if (status != STATUS_OK && status != STATUS_OUT_OF_MEMORY &&
        !(status == STATUS_BAD_ASSET &&
          (spec->kind == SCENE_MATERIAL_HEIGHT || spec->kind == SCENE_MATERIAL_VOLUME)))
        fail_msg("allocation %ld: %s", n, status_slug(status));
    assert_true((status == STATUS_OK) == (volume != NULL));
    assert_int_equal(made, volume != NULL);
    error_clear(&err);
    volume_release(cache, volume);
    volume_cache_destroy(cache);
    return live - before;
}

/* Only allocations of `from` bytes and more fail. Returns how many there were. */
static long torture(const struct scene_material *spec, const struct asset_source *source,
                    size_t from) {
    bool done = false;
    run_once(spec, source, -1, &done); /* opens the module, sets up what is kept for good */
    fail_from = from;
    run_once(spec, source, 0, &done); /* the first exception ever sets up its own memory */
    long n = 0;
    for (done = false; !done; n++)
        assert_int_equal(run_once(spec, source, n, &done), 0);
    fail_from = 0;
    return n;
}

static void built_in_materials_survive(void **state) {
    (void)state;
    for (int kind = SCENE_BUILTIN_HOMOGENEOUS; kind <= SCENE_BUILTIN_BARK; kind++) {
        struct scene_material spec = {.kind = SCENE_MATERIAL_BUILTIN,
                                      .builtin = (enum scene_builtin)kind,
                                      .size = {6, 6, 4},
                                      .lit = true};
        assert_true(torture(&spec, NULL, 0) >= 3); /* the interposed allocator is in use */
    }
}

static void geometry_survives(void **state) {
    (void)state;
    struct scene_material spec = {
        .kind = SCENE_MATERIAL_GEOMETRY,
        .geometry = {.kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {6, 4}},
        .size = {6, 6, 4},
        .lit = true};
    assert_true(torture(&spec, NULL, 0) >= 15);
}

/* Images: what is a kilobyte and more. Below that it is the libraries' own bookkeeping, some of it
 * in destructors, where C++ can but end the process. */
static void height_fields_survive(void **state) {
    (void)state;
    int open = 0;
    struct kept kept;
    assert_int_equal(
        files_open(&open, "api/examples/assets/pebbles-height.png", "", &kept.height, NULL),
        STATUS_OK);
    assert_int_equal(
        files_open(&open, "api/examples/assets/pebbles-color.png", "", &kept.color, NULL),
        STATUS_OK);
    struct asset_source source = {open_kept, close_kept, &kept};
    struct scene_material spec = {.kind = SCENE_MATERIAL_HEIGHT,
                                  .height = "height",
                                  .color_image = "color",
                                  .size = {64, 64, 8},
                                  .lit = true};
    assert_true(torture(&spec, &source, 1024) >= 8);
    files_close(&open, &kept.height);
    files_close(&open, &kept.color);
}

static void volumes_survive(void **state) {
    (void)state;
    int open = 0;
    struct kept kept;
    assert_int_equal(files_open(&open, "tests/data/volume/pages.tif", "", &kept.color, NULL),
                     STATUS_OK);
    struct asset_source source = {open_kept, close_kept, &kept};
    struct scene_material spec = {
        .kind = SCENE_MATERIAL_VOLUME, .volume = "pages", .size = {64, 64, 8}, .lit = true};
    assert_true(torture(&spec, &source, 512) >= 5);
    files_close(&open, &kept.color);
}

static void gradients_survive(void **state) {
    (void)state;
    static float voxels[4 * 4 * 4 * 4];
    static uint16_t halves[4 * 4 * 4 * 4];
    struct volume volume = {.size = {4, 4, 4}, .solid = voxels};
    long before = live;
    fail_at = 0;
    assert_int_equal(bake_gradients(&volume, BAKE_FIELD_SOLID, halves), STATUS_OUT_OF_MEMORY);
    fail_at = -1;
    assert_int_equal(bake_gradients(&volume, BAKE_FIELD_SOLID, halves), STATUS_OK);
    assert_int_equal(live, before);
}

int main(void) {
    if (!INTERPOSED) {
        puts("a sanitizer has its own allocator");
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(built_in_materials_survive), cmocka_unit_test(height_fields_survive),
        cmocka_unit_test(geometry_survives),          cmocka_unit_test(volumes_survive),
        cmocka_unit_test(gradients_survive),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
