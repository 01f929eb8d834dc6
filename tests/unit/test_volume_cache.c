/* The cache of volumes: same material, same voxels; sharing; references; refusals. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/volume.h"

static struct scene_material material(enum scene_builtin builtin) {
    return (struct scene_material){.kind = SCENE_MATERIAL_BUILTIN,
                                   .builtin = builtin,
                                   .size = {16, 8, 4},
                                   .seed = 1,
                                   .extinction = 2.5,
                                   .color = {0.25, 0.5, 1.0},
                                   .shininess = 32.0,
                                   .lit = true};
}

static const struct volume *acquire(struct volume_cache *cache, const struct scene_material *spec,
                                    bool expect_made) {
    const struct volume *volume = NULL;
    bool made = !expect_made;
    struct error err = {0};
    assert_int_equal(volume_acquire(cache, spec, 1.0, "/m", NULL, &volume, &made, &err), STATUS_OK);
    assert_int_equal(made, expect_made);
    assert_int_equal(err.fault_count, 0);
    assert_non_null(volume);
    return volume;
}

static void same_material_is_made_once(void **state) {
    (void)state;
    struct volume_cache *cache = volume_cache_create(1 << 20);
    struct scene_material spec = material(SCENE_BUILTIN_FUR);
    const struct volume *first = acquire(cache, &spec, true);
    const struct volume *second = acquire(cache, &spec, false);
    assert_ptr_equal(first, second);
    assert_int_equal(first->references, 2);
    volume_release(cache, first);
    volume_release(cache, second);
    spec.color[0] = 0.75; /* has_color is false: a member that plays no part */
    volume_release(cache, acquire(cache, &spec, false));
    spec.has_color = true;
    volume_release(cache, acquire(cache, &spec, true));
    spec.seed = 2;
    volume_release(cache, acquire(cache, &spec, true));
    volume_cache_destroy(cache);
}

static void lighting_shares_voxels(void **state) {
    (void)state;
    struct volume_cache *cache = volume_cache_create(1 << 20);
    struct scene_material spec = material(SCENE_BUILTIN_CHAIN);
    const struct volume *lit = acquire(cache, &spec, true);
    spec.specular = 0.5;
    const struct volume *shiny = acquire(cache, &spec, false);
    spec.lit = false;
    const struct volume *unlit = acquire(cache, &spec, false);
    assert_ptr_not_equal(lit, shiny);
    assert_ptr_equal(lit->solid, shiny->solid);
    assert_ptr_equal(lit->solid, unlit->solid);
    assert_memory_equal(lit->key, unlit->key, sizeof lit->key);
    assert_true(lit->lit && shiny->lit && !unlit->lit);
    assert_true(shiny->specular == 0.5f && unlit->specular == 0.0f);
    volume_release(cache, lit);
    volume_release(cache, shiny);
    volume_release(cache, unlit);
    volume_cache_destroy(cache);
}

static void homogeneous_is_constants(void **state) {
    (void)state;
    struct volume_cache *cache = volume_cache_create(0);
    struct scene_material spec = material(SCENE_BUILTIN_HOMOGENEOUS);
    const struct volume *volume = acquire(cache, &spec, true);
    assert_true(volume->homogeneous);
    assert_false(volume->lit);
    assert_null(volume->medium);
    assert_null(volume->solid);
    assert_true(volume->extinction == 2.5);
    assert_true(volume->radiance[2] == 1.0);
    assert_int_equal(volume->size[0] * volume->size[1] * volume->size[2], 1);
    volume_release(cache, volume);
    volume_cache_destroy(cache);
}

/* A cache that may hold two of three volumes forgets the one that was used longest ago. */
static void oldest_is_forgotten(void **state) {
    (void)state;
    size_t one = 16 * 8 * 4 * 16;
    struct volume_cache *cache = volume_cache_create(one * 5 / 2);
    struct scene_material a = material(SCENE_BUILTIN_FUR), b = a, c = a;
    b.seed = 2;
    c.seed = 3;
    volume_release(cache, acquire(cache, &a, true));
    volume_release(cache, acquire(cache, &b, true));
    volume_release(cache, acquire(cache, &a, false)); /* b is now the oldest */
    volume_release(cache, acquire(cache, &c, true));
    volume_release(cache, acquire(cache, &a, false));
    volume_release(cache, acquire(cache, &b, true));
    volume_cache_destroy(cache);
}

static void held_volumes_outlive_the_budget(void **state) {
    (void)state;
    struct volume_cache *cache = volume_cache_create(0);
    struct scene_material a = material(SCENE_BUILTIN_FUR), b = a;
    b.seed = 2;
    const struct volume *held = acquire(cache, &a, true);
    volume_release(cache, acquire(cache, &b, true));
    assert_true(held->medium[3] >= 0.0f); /* read under the sanitizer: still there */
    volume_release(cache, acquire(cache, &a, false));
    volume_release(cache, held);
    volume_release(cache, acquire(cache, &a, true)); /* nothing is kept unused */
    volume_cache_destroy(cache);
}

static void refused(const struct scene_material *spec, enum status status, const char *pointer) {
    struct volume_cache *cache = volume_cache_create(1 << 20);
    const struct volume *volume = (const struct volume *)1;
    bool made = true;
    struct error err = {0};
    assert_int_equal(volume_acquire(cache, spec, 1.0, "/m", NULL, &volume, &made, &err), status);
    assert_null(volume);
    assert_false(made);
    assert_int_equal(err.status, status);
    assert_int_equal(err.fault_count, 1);
    assert_string_equal(err.faults[0].pointer, pointer);
    error_clear(&err);
    volume_cache_destroy(cache);
}

static void what_cannot_be_made_is_refused(void **state) {
    (void)state;
    struct scene_material spec = material((enum scene_builtin)99);
    refused(&spec, STATUS_NOT_IMPLEMENTED, "/m/builtin");
    spec.kind = SCENE_MATERIAL_VOLUME;
    refused(&spec, STATUS_INVALID_SCENE, "/m/volume");
    spec.kind = SCENE_MATERIAL_HEIGHT;
    refused(&spec, STATUS_INVALID_SCENE, "/m/height");
    spec = material(SCENE_BUILTIN_FUR);
    spec.size[0] = 513;
    refused(&spec, STATUS_TOO_COMPLEX, "/m/size");
    spec.size[0] = 0;
    refused(&spec, STATUS_TOO_COMPLEX, "/m/size");
    spec.size[0] = 16;
    spec.size[2] = 65;
    refused(&spec, STATUS_TOO_COMPLEX, "/m/size");
}

/* Thousands of tiny materials do not pile up, though they hardly weigh anything. */
static void many_small_ones_do_not_pile_up(void **state) {
    (void)state;
    struct volume_cache *cache = volume_cache_create(1 << 30);
    struct scene_material spec = material(SCENE_BUILTIN_HOMOGENEOUS);
    for (int i = 0; i < 2000; i++) {
        spec.extinction = i;
        volume_release(cache, acquire(cache, &spec, true));
    }
    spec.extinction = 0;
    volume_release(cache, acquire(cache, &spec, true)); /* forgotten long ago */
    volume_cache_destroy(cache);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_material_is_made_once),
        cmocka_unit_test(lighting_shares_voxels),
        cmocka_unit_test(homogeneous_is_constants),
        cmocka_unit_test(oldest_is_forgotten),
        cmocka_unit_test(held_volumes_outlive_the_budget),
        cmocka_unit_test(what_cannot_be_made_is_refused),
        cmocka_unit_test(many_small_ones_do_not_pile_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
