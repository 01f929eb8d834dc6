/* Volumes as textures: what is uploaded, what is left out, what is kept. Needs a GL. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/volume.h"
#include "renderer/bake/normals.h"
#include "renderer/bake/volume_texture.h"
#include "shaders/interface.h"
#include "tests/unit/gl_fixture.h"

enum { NX = 16, NY = 8, NZ = 4, VOXELS = NX * NY * NZ };

struct kit {
    struct volume_cache *volumes;
    struct bake_cache *bakes;
    const struct volume *volume;
};

static struct kit open_kit(enum scene_builtin builtin, uint32_t seed, size_t bake_bytes) {
    struct scene_material spec = {.kind = SCENE_MATERIAL_BUILTIN,
                                  .builtin = builtin,
                                  .size = {NX, NY, NZ},
                                  .seed = seed,
                                  .extinction = 1,
                                  .lit = true};
    struct kit kit = {volume_cache_create(1 << 20), bake_cache_create(bake_bytes), NULL};
    bool made;
    assert_int_equal(volume_acquire(kit.volumes, &spec, 1.0, "/m", NULL, &kit.volume, &made, NULL),
                     STATUS_OK);
    return kit;
}

static void close_kit(struct kit *kit) {
    volume_release(kit->volumes, kit->volume);
    bake_cache_destroy(kit->bakes);
    volume_cache_destroy(kit->volumes);
    assert_int_equal(gl_check("the test", NULL), STATUS_OK);
}

static const struct baked *acquire(struct kit *kit, bool lit, bool expect_made,
                                   uint64_t expect_bytes) {
    const struct baked *baked;
    bool made = false;
    uint64_t bytes = 0;
    struct error err = {0};
    assert_int_equal(bake_acquire(kit->bakes, kit->volume, lit, &baked, &made, &bytes, NULL, &err),
                     STATUS_OK);
    assert_int_equal(made, expect_made);
    assert_int_equal(bytes, expect_bytes);
    assert_non_null(baked);
    return baked;
}

static GLint parameter(GLuint texture, GLenum name) {
    GLint value = 0;
    glGetTextureParameteriv(texture, name, &value);
    return value;
}

static void voxels_arrive_unchanged(void **state) {
    (void)state;
    struct kit kit = open_kit(SCENE_BUILTIN_FUR, 1, 0);
    const struct baked *baked = acquire(&kit, true, true, VOXELS * 24);
    assert_true(baked->medium && baked->medium_gradient);
    assert_int_equal(baked->solid, 0);
    assert_int_equal(baked->solid_gradient, 0);

    static float texels[VOXELS * 4];
    glGetTextureImage(baked->medium, 0, GL_RGBA, GL_FLOAT, sizeof texels, texels);
    assert_memory_equal(texels, kit.volume->medium, sizeof texels);
    static uint16_t halves[VOXELS * 4], expected[VOXELS * 4];
    glGetTextureImage(baked->medium_gradient, 0, GL_RGBA, GL_HALF_FLOAT, sizeof halves, halves);
    assert_int_equal(bake_gradients(kit.volume, BAKE_FIELD_MEDIUM, expected), STATUS_OK);
    for (int i = 0; i < VOXELS * 4; i++) /* 0 may come back as -0 or 0 */
        assert_true(bake_float_from_half(halves[i]) == bake_float_from_half(expected[i]));

    const GLuint textures[] = {baked->medium, baked->medium_gradient};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(parameter(textures[i], GL_TEXTURE_WRAP_S), GL_REPEAT);
        assert_int_equal(parameter(textures[i], GL_TEXTURE_WRAP_T), GL_REPEAT);
        assert_int_equal(parameter(textures[i], GL_TEXTURE_WRAP_R), GL_CLAMP_TO_EDGE);
        assert_int_equal(parameter(textures[i], GL_TEXTURE_MIN_FILTER), GL_LINEAR);
        assert_int_equal(parameter(textures[i], GL_TEXTURE_MAG_FILTER), GL_LINEAR);
    }
    bake_release(kit.bakes, baked);
    close_kit(&kit);
}

static void solids_have_solid_textures(void **state) {
    (void)state;
    struct kit kit = open_kit(SCENE_BUILTIN_CHAIN, 1, 0);
    const struct baked *baked = acquire(&kit, true, true, VOXELS * 24);
    assert_true(baked->solid && baked->solid_gradient);
    assert_int_equal(baked->medium, 0);
    assert_int_equal(baked->medium_gradient, 0);
    bake_release(kit.bakes, baked);
    close_kit(&kit);
}

static void homogeneous_needs_no_texture(void **state) {
    (void)state;
    struct kit kit = open_kit(SCENE_BUILTIN_HOMOGENEOUS, 1, 0);
    const struct baked *baked = acquire(&kit, true, false, 0);
    assert_int_equal(baked->medium | baked->solid, 0);
    assert_int_equal(baked->medium_gradient | baked->solid_gradient, 0);
    bake_release(kit.bakes, baked);
    close_kit(&kit);
}

/* Unlit first: no gradient is made; lit later: the gradient alone is added. */
static void gradients_come_when_wanted(void **state) {
    (void)state;
    struct kit kit = open_kit(SCENE_BUILTIN_FUR, 1, 1 << 20);
    const struct baked *baked = acquire(&kit, false, true, VOXELS * 16);
    GLuint medium = baked->medium;
    assert_int_equal(baked->medium_gradient, 0);
    bake_release(kit.bakes, baked);
    baked = acquire(&kit, true, true, VOXELS * 8);
    assert_int_equal(baked->medium, medium);
    assert_true(baked->medium_gradient);
    bake_release(kit.bakes, baked);
    bake_release(kit.bakes, acquire(&kit, true, false, 0));
    close_kit(&kit);
}

/* The volume is forgotten and made again at whatever address: its textures are still known; and
 * those of another seed are not taken for them. */
static void textures_are_known_by_their_voxels(void **state) {
    (void)state;
    struct kit kit = open_kit(SCENE_BUILTIN_FUR, 1, 1 << 20);
    bake_release(kit.bakes, acquire(&kit, true, true, VOXELS * 24));
    struct kit again = open_kit(SCENE_BUILTIN_FUR, 1, 0), other = open_kit(SCENE_BUILTIN_FUR, 2, 0);
    const struct volume *first = kit.volume;
    kit.volume = again.volume;
    bake_release(kit.bakes, acquire(&kit, true, false, 0));
    kit.volume = other.volume;
    bake_release(kit.bakes, acquire(&kit, true, true, VOXELS * 24));
    kit.volume = first;
    close_kit(&kit);
    close_kit(&again);
    close_kit(&other);
}

/* Past the budget unused textures go, oldest first; used ones stay. */
static void textures_are_freed(void **state) {
    (void)state;
    struct kit kit = open_kit(SCENE_BUILTIN_FUR, 1, VOXELS * 24);
    struct kit other = open_kit(SCENE_BUILTIN_FUR, 2, 0);
    const struct volume *first = kit.volume;
    const struct baked *held = acquire(&kit, true, true, VOXELS * 24);
    GLuint name = held->medium;
    kit.volume = other.volume;
    bake_release(kit.bakes, acquire(&kit, true, true, VOXELS * 24));
    assert_true(glIsTexture(name)); /* in use: the other one went */
    bake_release(kit.bakes, acquire(&kit, true, true, VOXELS * 24));
    bake_release(kit.bakes, held);
    bake_release(kit.bakes, acquire(&kit, true, true, VOXELS * 24));
    assert_false(glIsTexture(name));
    bake_release(kit.bakes, NULL);
    kit.volume = first;
    close_kit(&kit);
    close_kit(&other);
}

static void too_large_a_volume_is_refused(void **state) {
    (void)state;
    float voxel[4] = {0};
    struct volume volume = {.size = {1 << 20, 1, 1}, .medium = voxel};
    struct bake_cache *cache = bake_cache_create(0);
    const struct baked *baked;
    struct error err = {0};
    assert_int_equal(bake_acquire(cache, &volume, false, &baked, NULL, NULL, NULL, &err),
                     STATUS_TOO_COMPLEX);
    assert_null(baked);
    assert_int_equal(err.fault_count, 1);
    error_clear(&err);
    bake_cache_destroy(cache);
}

/* The clock is moved to the stages that the work belongs to, and only where there is some. */
static void time_is_told_by_stage(void **state) {
    (void)state;
    struct kit kit = open_kit(SCENE_BUILTIN_CLOUDS, 1, 1 << 20);
    double ms[REPORT_STAGE_COUNT] = {0};
    struct stage_clock clock;
    const struct baked *baked;
    stage_clock_start(&clock, ms, REPORT_STAGE_assets);
    assert_int_equal(bake_acquire(kit.bakes, kit.volume, true, &baked, NULL, NULL, &clock, NULL),
                     STATUS_OK);
    assert_int_equal(clock.stage, REPORT_STAGE_upload);
    bake_release(kit.bakes, baked);
    stage_clock_stop(&clock, true);
    assert_true(ms[REPORT_STAGE_bake] > 0 && ms[REPORT_STAGE_upload] > 0);
    close_kit(&kit);
}

/* Shaders take tangents from a tile as deep as the generators think it is. */
static void tiles_are_as_deep_as_made(void **state) {
    (void)state;
    assert_true(TILE_DEPTH == VOLUME_TILE_DEPTH);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_are_as_deep_as_made),
        cmocka_unit_test(voxels_arrive_unchanged),
        cmocka_unit_test(solids_have_solid_textures),
        cmocka_unit_test(homogeneous_needs_no_texture),
        cmocka_unit_test(gradients_come_when_wanted),
        cmocka_unit_test(textures_are_known_by_their_voxels),
        cmocka_unit_test(textures_are_freed),
        cmocka_unit_test(too_large_a_volume_is_refused),
        cmocka_unit_test(time_is_told_by_stage),
    };
    return cmocka_run_group_tests(tests, gl_fixture_open, gl_fixture_close);
}
