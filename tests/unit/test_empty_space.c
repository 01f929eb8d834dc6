/* How far it is to what holds something: against every distance measured, at all sizes; u and v go
 * around, w does not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/bake/empty_space.h"

static int around(int a, int b, int n) {
    int d = abs(a - b);
    return d < n - d ? d : n - d;
}

static int most(int a, int b) {
    return a > b ? a : b;
}

/* One voxel in `rarely` holds something; those below the threshold must not count. */
static void check(int nu, int nv, int nw, uint32_t rarely, enum bake_field field) {
    size_t count = (size_t)nu * (size_t)nv * (size_t)nw;
    float *voxels = calloc(count, 4 * sizeof *voxels);
    uint8_t *distance = malloc(count);
    assert_true(voxels && distance);
    uint32_t seed = 7;
    for (size_t i = 0; i < count; i++) {
        seed = seed * 1664525u + 1013904223u;
        bool full = rarely && (seed >> 8) % rarely == 0;
        voxels[4 * i + 3] = field == BAKE_FIELD_SOLID ? (full ? 0.5f : 0.499f) : full ? 1e-20f : 0;
    }
    struct volume volume = {.size = {nu, nv, nw}};
    *(field == BAKE_FIELD_SOLID ? &volume.solid : &volume.medium) = voxels;
    assert_int_equal(empty_space(&volume, field, distance), STATUS_OK);
    for (size_t i = 0; i < count; i++) {
        int u = (int)(i % (size_t)nu), v = (int)(i / (size_t)nu % (size_t)nv),
            w = (int)(i / (size_t)nu / (size_t)nv);
        int nearest = EMPTY_SPACE_MAX;
        for (size_t k = 0; k < count; k++) {
            int ku = (int)(k % (size_t)nu), kv = (int)(k / (size_t)nu % (size_t)nv);
            int kw = (int)(k / (size_t)nu / (size_t)nv);
            bool full =
                field == BAKE_FIELD_SOLID ? voxels[4 * k + 3] >= 0.5f : voxels[4 * k + 3] > 0;
            int d = most(most(around(u, ku, nu), around(v, kv, nv)), abs(w - kw));
            if (full && d < nearest)
                nearest = d;
        }
        assert_int_equal(distance[i], nearest);
    }
    free(voxels);
    free(distance);
}

static void distances_are_those_measured(void **state) {
    (void)state;
    static const int sizes[][3] = {{1, 1, 1}, {2, 1, 3}, {1, 2, 1},  {16, 1, 1}, {1, 1, 16},
                                   {3, 3, 3}, {9, 7, 5}, {80, 3, 2}, {2, 2, 90}, {24, 20, 12}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        for (uint32_t rarely = 1; rarely <= 625; rarely *= 5)
            for (int field = BAKE_FIELD_MEDIUM; field <= BAKE_FIELD_SOLID; field++)
                check(sizes[i][0], sizes[i][1], sizes[i][2], rarely, (enum bake_field)field);
}

static void nothing_is_far_from_everywhere(void **state) {
    (void)state;
    check(12, 5, 4, 0, BAKE_FIELD_MEDIUM);
    check(12, 5, 4, 0, BAKE_FIELD_SOLID);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(distances_are_those_measured),
        cmocka_unit_test(nothing_is_far_from_everywhere),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
