/* The cache of meshes: what shares an entry, what does not, who goes first, and what is reported.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/asset/mesh.h"
#include "renderer/asset/module.h"
#include "tests/unit/asset_files.h"

static const struct mesh *take(struct mesh_cache *cache, struct scene_mesh spec) {
    const struct mesh *mesh = NULL;
    assert_int_equal(mesh_acquire(cache, &spec, true, "/mesh", NULL, &mesh, NULL), STATUS_OK);
    return mesh;
}

static struct scene_mesh sphere(double radius, int n) {
    return (struct scene_mesh){.kind = SCENE_MESH_SPHERE, .radius = radius, .divisions = {n, n}};
}

static void equal_shapes_share_a_mesh(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 26);
    const struct mesh *a = take(cache, sphere(1, 8));
    struct scene_mesh same = sphere(1, 8);
    same.size[0] = same.tube = same.height = 7; /* not a sphere's members */
    same.seed = 9;
    const struct mesh *b = take(cache, same);
    assert_ptr_equal(a, b);
    assert_int_equal(a->references, 2);
    assert_ptr_not_equal(a, take(cache, sphere(2, 8)));
    assert_ptr_not_equal(a, take(cache, sphere(1, 9)));
    struct scene_mesh cylinder = {
        .kind = SCENE_MESH_CYLINDER, .radius = 1, .height = 1, .divisions = {8, 8}};
    const struct mesh *c = take(cache, cylinder);
    cylinder.height = 2;
    assert_ptr_not_equal(c, take(cache, cylinder));
    mesh_release(cache, a);
    mesh_release(cache, b);
    assert_int_equal(a->references, 0);
    mesh_cache_destroy(cache);
}

/* What other rooms make of a mesh is found again by its number: never 0, never another mesh's, and
 * not that of one that was forgotten. */
static void every_mesh_has_a_number_of_its_own(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(0);
    uint64_t numbers[4];
    for (int i = 0; i < 4; i++) {
        const struct mesh *mesh = take(cache, sphere(i == 3 ? 1 : 1 + i, 4));
        numbers[i] = mesh->serial;
        mesh_release(cache, mesh);
        assert_int_not_equal(numbers[i], 0);
        for (int j = 0; j < i; j++)
            assert_int_not_equal(numbers[i], numbers[j]);
    }
    mesh_cache_destroy(cache);
}

static void the_least_recently_used_goes_first(void **state) {
    (void)state;
    struct mesh_cache *probe = mesh_cache_create(1 << 26);
    size_t each = take(probe, sphere(1, 16))->bytes;
    mesh_cache_destroy(probe);

    struct mesh_cache *cache = mesh_cache_create(2 * each + each / 2);
    const struct mesh *a = take(cache, sphere(1, 16));
    mesh_release(cache, a);
    const struct mesh *b = take(cache, sphere(2, 16));
    b->position[0][0] = 42;
    mesh_release(cache, b);
    assert_ptr_equal(take(cache, sphere(1, 16)), a); /* used again: b is the older one now */
    mesh_release(cache, a);
    a->position[0][0] = 42; /* a mark that a mesh made anew would not have */
    const struct mesh *c = take(cache, sphere(3, 16)); /* does not fit beside both */
    mesh_release(cache, c);
    const struct mesh *again = take(cache, sphere(1, 16));
    assert_true(again->position[0][0] == 42);
    mesh_release(cache, again);
    again = take(cache, sphere(2, 16)); /* b was let go, and is made anew */
    assert_true(again->position[0][0] == 0);
    mesh_release(cache, again);
    mesh_cache_destroy(cache);
}

static void meshes_in_use_stay(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(0);
    const struct mesh *a = take(cache, sphere(1, 16)), *b = take(cache, sphere(2, 16));
    assert_true(a->vertex_count == b->vertex_count && a->position[0][2] == -1 &&
                b->position[0][2] == -2);
    assert_ptr_equal(take(cache, sphere(1, 16)), a);
    assert_int_equal(a->references, 2);
    mesh_release(cache, a);
    mesh_release(cache, a);
    mesh_release(cache, b);
    mesh_release(cache, NULL);
    mesh_cache_destroy(cache);
    mesh_cache_destroy(NULL);
}

static void assets_are_known_by_their_bytes(void **state) {
    (void)state;
    int open = 0;
    struct asset_source source = {files_open, files_close, &open};
    struct mesh_cache *cache = mesh_cache_create(1 << 26);
    struct scene_mesh spec = {.kind = SCENE_MESH_ASSET, .asset = "tests/data/gltf/plain.glb"};
    const struct mesh *a = NULL, *b = NULL;
    assert_int_equal(mesh_acquire(cache, &spec, true, "/mesh", &source, &a, NULL), STATUS_OK);
    spec.asset = "tests/../tests/data/gltf/plain.glb"; /* another name; and it has no textures */
    assert_int_equal(mesh_acquire(cache, &spec, false, "/mesh", &source, &b, NULL), STATUS_OK);
    assert_ptr_equal(a, b);
    struct error err = {0};
    spec.asset = "tests/data/gltf/absent.glb";
    assert_int_equal(mesh_acquire(cache, &spec, true, "/mesh", &source, &b, &err),
                     STATUS_ASSET_NOT_FOUND);
    assert_string_equal(err.faults[0].pointer, "/mesh/asset");
    assert_null(b);
    error_clear(&err);
    assert_int_equal(open, 0);
    mesh_cache_destroy(cache);
}

/* Before anything else in this program has opened a module. */
static void only_what_is_needed_is_loaded(void **state) {
    (void)state;
    const char *names[MODULE_COUNT];
    int open = 0;
    struct asset_source source = {files_open, files_close, &open};
    struct mesh_cache *cache = mesh_cache_create(1 << 26);
    mesh_release(cache, take(cache, sphere(1, 8)));
    assert_int_equal(module_loaded(names), 0);
    const struct mesh *mesh;
    struct scene_mesh spec = {.kind = SCENE_MESH_ASSET, .asset = "tests/data/gltf/materials.glb"};
    assert_int_equal(mesh_acquire(cache, &spec, false, "/mesh", &source, &mesh, NULL), STATUS_OK);
    assert_int_equal(module_loaded(names), 1);
    assert_string_equal(names[0], "tinygltf");
    assert_int_equal(mesh_acquire(cache, &spec, true, "/mesh", &source, &mesh, NULL), STATUS_OK);
    assert_int_equal(module_loaded(names), 2);
    assert_string_equal(names[1], "OpenImageIO");
    mesh_cache_destroy(cache);
}

static void a_missing_module_says_what_to_install(void **state) {
    (void)state;
    char *kept = strdup(getenv("PELT_LIBDIR"));
    setenv("PELT_LIBDIR", "/nonexistent", 1);
    struct error err = {0};
    assert_null(module_open(MODULE_MESH_GLTF, &err));
    assert_int_equal(err.status, STATUS_IO_ERROR);
    assert_non_null(strstr(err.faults[0].message, "libtinygltf2d"));
    assert_non_null(strstr(err.faults[0].message, "/nonexistent/mesh_gltf.so"));
    error_clear(&err);
    setenv("PELT_LIBDIR", kept, 1);
    free(kept);
}

static void findings_become_warnings(void **state) {
    (void)state;
    int open = 0;
    struct asset_source source = {files_open, files_close, &open};
    struct mesh_cache *cache = mesh_cache_create(1 << 26);
    struct scene_mesh spec = {.kind = SCENE_MESH_ASSET, .asset = "tests/data/gltf/degenerate.glb"};
    const struct mesh *mesh;
    assert_int_equal(mesh_acquire(cache, &spec, true, "/mesh", &source, &mesh, NULL), STATUS_OK);
    struct report *report = calloc(1, sizeof *report);
    mesh_warn(mesh, "/objects/0/shell/mesh", report);
    assert_int_equal(report->warning_count, 3);
    static const char *const codes[] = {"zero-area-triangles", "normals-made", "uvs-made"};
    static const uint64_t counts[] = {3, 4, 4};
    for (int i = 0; i < 3; i++) {
        assert_string_equal(report->warnings[i].code, codes[i]);
        assert_string_equal(report->warnings[i].pointer, "/objects/0/shell/mesh");
        assert_int_equal(report->warnings[i].count, counts[i]);
        assert_true(strlen(report->warnings[i].message) > 20);
    }
    assert_int_equal(report->warnings[0].first, 1);
    mesh_warn(take(cache, sphere(1, 8)), "", report);
    assert_int_equal(report->warning_count, 3); /* nothing is wrong with a sphere */
    free(report);
    mesh_cache_destroy(cache);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(only_what_is_needed_is_loaded),
        cmocka_unit_test(equal_shapes_share_a_mesh),
        cmocka_unit_test(every_mesh_has_a_number_of_its_own),
        cmocka_unit_test(the_least_recently_used_goes_first),
        cmocka_unit_test(meshes_in_use_stay),
        cmocka_unit_test(assets_are_known_by_their_bytes),
        cmocka_unit_test(a_missing_module_says_what_to_install),
        cmocka_unit_test(findings_become_warnings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
