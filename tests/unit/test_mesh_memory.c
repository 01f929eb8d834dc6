/* Memory runs out at every place where it can: each allocation of a run fails in turn. The answer
 * is STATUS_OUT_OF_MEMORY, and nothing stays allocated.
 *
 * The allocator is interposed, which a sanitizer's own does not allow: skipped there. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/asset/mesh.h"
#include "renderer/asset/module.h"
#include "tests/unit/asset_files.h"
#include "tests/unit/failing_malloc.h"

/* One run: *done where nothing failed any more. Returns what it left allocated. */
static long run_once(struct scene_mesh spec, struct asset_source *source, long n, bool *done) {
    const struct mesh *mesh = NULL;
    long before = live;
    struct mesh_cache *cache = mesh_cache_create(1 << 26);
    /* The record of the fault needs memory too, and does without: what counts is the status. */
    struct error err = {0};
    fail_at = n;
    enum status status = mesh_acquire(cache, &spec, true, "/mesh", source, &mesh, &err);
    *done = fail_at >= 0 || status == STATUS_OK;
    fail_at = -1;
    error_clear(&err);
    if (status == STATUS_OK) {
        assert_non_null(mesh);
    } else {
        if (status != STATUS_OUT_OF_MEMORY)
            fail_msg("allocation %ld: %s", n, status_slug(status));
        assert_null(mesh);
    }
    mesh_cache_destroy(cache);
    return live - before;
}

static void torture(struct scene_mesh spec, struct asset_source *source, size_t from) {
    bool done = false;
    run_once(spec, source, -1, &done); /* opens the modules */
    done = false;
    fail_from = from;
    run_once(spec, source, 0, &done); /* the first exception ever sets up its own memory */
    long n = 0;
    for (; !done; n++)
        assert_int_equal(run_once(spec, source, n, &done), 0);
    fail_from = 0;
    assert_true(n > 10); /* the interposed allocator is in use */
}

static void shapes_survive(void **state) {
    (void)state;
    torture(
        (struct scene_mesh){
            .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {8, 8}},
        NULL, 0);
    torture((struct scene_mesh){.kind = SCENE_MESH_TEAPOT, .divisions = {8, 8}}, NULL, 0);
}

/* The bytes are there before anything fails: the source is not what is tested. */
static enum status open_kept(void *user, const char *name, const char *pointer,
                             struct asset_bytes *bytes, struct error *err) {
    (void)name, (void)pointer, (void)err;
    *bytes = *(struct asset_bytes *)user;
    return STATUS_OK;
}

static void close_kept(void *user, struct asset_bytes *bytes) {
    (void)user, (void)bytes;
}

/* Only what is large: tinygltf's JSON library takes small memory in destructors, where C++ can but
 * end the process. The shim sees to it that there is some (mesh_gltf.cc, parse). */
static void assets_survive(void **state) {
    (void)state;
    static const char bunny[] = "api/examples/assets/bunny.glb";
    int open = 0;
    struct asset_bytes bytes;
    assert_int_equal(files_open(&open, bunny, "", &bytes, NULL), STATUS_OK);
    struct asset_source source = {open_kept, close_kept, &bytes};
    torture((struct scene_mesh){.kind = SCENE_MESH_ASSET, .asset = bunny}, &source, 4096);
    files_close(&open, &bytes);
}

int main(void) {
    if (!INTERPOSED) {
        puts("the sanitizer has an allocator of its own");
        return 77;
    }
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shapes_survive),
        cmocka_unit_test(assets_survive),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
