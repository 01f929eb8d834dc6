/* What the tests of the built-in materials share: making one, and looking at its voxels. */
#ifndef PELT_TESTS_UNIT_VOLUME_FIXTURE_H
#define PELT_TESTS_UNIT_VOLUME_FIXTURE_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/volume.h"
#include "renderer/asset/volume_generators.h"

static inline struct volume make(enum scene_builtin builtin, uint32_t seed, int nx, int ny,
                                 int nz) {
    struct scene_material spec = {
        .kind = SCENE_MATERIAL_BUILTIN, .builtin = builtin, .seed = seed, .lit = true};
    struct volume volume = {.size = {nx, ny, nz}};
    assert_true(volume_builtin_exists(builtin));
    assert_int_equal(volume_make_builtin(&spec, &volume), STATUS_OK);
    return volume;
}

static inline void drop(struct volume *volume) {
    free(volume->medium);
    free(volume->solid);
}

static inline size_t count_of(const struct volume *volume) {
    return (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
}

/* Element of a voxel; u and v wrap. */
static inline size_t voxel_at(const struct volume *volume, int x, int y, int z) {
    const int *n = volume->size;
    size_t row = (size_t)z * (size_t)n[1] + (size_t)((y + n[1]) % n[1]);
    return 4 * (row * (size_t)n[0] + (size_t)((x + n[0]) % n[0]));
}

/* Every voxel of a field: finite, not negative, colour within its weight. Returns the largest
 * weight. */
static inline float check_field(const struct volume *volume, const float *f) {
    float max = 0.0f;
    for (size_t i = 0; i < count_of(volume); i++, f += 4) {
        for (int c = 0; c < 4; c++)
            assert_true(isfinite(f[c]) && f[c] >= 0.0f);
        for (int c = 0; c < 3; c++)
            assert_true(f[c] <= f[3] * 1.0001f);
        max = fmaxf(max, f[3]);
    }
    return max;
}

/* Both fields, and what they promise one another. */
static inline void check_voxels(const struct volume *volume) {
    assert_true(volume->medium || volume->solid);
    if (volume->medium)
        assert_true(check_field(volume, volume->medium) == volume->medium_max);
    if (volume->solid)
        assert_true(check_field(volume, volume->solid) <= 1.0f);
    for (size_t i = 0; volume->medium && volume->solid && i < 4 * count_of(volume); i += 4)
        assert_true(volume->solid[i + 3] < 0.5f || volume->medium[i + 3] == 0.0f);
}

#endif
