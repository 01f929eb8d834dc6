/* Built-in materials that move: clouds by their phase, fur by its growth. */
#include "tests/unit/volume_fixture.h"

static struct volume make_moving(enum scene_builtin builtin, double growth, double phase) {
    struct scene_material spec = {.kind = SCENE_MATERIAL_BUILTIN,
                                  .builtin = builtin,
                                  .has_growth = builtin == SCENE_BUILTIN_FUR,
                                  .growth = growth,
                                  .phase = phase};
    struct volume volume = {.size = {32, 32, 16}};
    assert_int_equal(volume_make_builtin(&spec, &volume), STATUS_OK);
    return volume;
}

static double difference(const struct volume *a, const struct volume *b) {
    double sum = 0, all = 0;
    for (size_t i = 3; i < 4 * count_of(a); i += 4) {
        sum += fabs((double)a->medium[i] - (double)b->medium[i]);
        all += (double)a->medium[i];
    }
    return sum / all;
}

/* A whole turn is where it began; a thousandth of one changes little, a quarter much. */
static void clouds_move_in_a_loop(void **state) {
    (void)state;
    struct volume still = make(SCENE_BUILTIN_CLOUDS, 0, 32, 32, 16);
    static const double phases[] = {0, 1, 7, 0.001, 0.999, 0.25, 0.5};
    for (size_t i = 0; i < sizeof phases / sizeof *phases; i++) {
        struct volume moved = make_moving(SCENE_BUILTIN_CLOUDS, 0, phases[i]);
        check_voxels(&moved);
        double change = difference(&still, &moved);
        if (i < 3)
            assert_true(change == 0);
        else if (i < 5)
            assert_true(change > 0 && change < 0.02); /* measured: 0.005 */
        else
            assert_true(change > 0.2);
        drop(&moved);
    }
    for (int i = 0; i < 20; i++) { /* no jump anywhere on the way */
        struct volume a = make_moving(SCENE_BUILTIN_CLOUDS, 0, i / 20.0);
        struct volume b = make_moving(SCENE_BUILTIN_CLOUDS, 0, i / 20.0 + 1e-4);
        assert_true(difference(&a, &b) < 0.003);
        drop(&a);
        drop(&b);
    }
    drop(&still);
}

/* Hairs reach as high as they have grown: the layers above are empty, and of a bare skin all. */
static void fur_grows(void **state) {
    (void)state;
    struct volume whole = make(SCENE_BUILTIN_FUR, 0, 32, 32, 16);
    double before = 0;
    for (int g = 0; g <= 16; g++) {
        struct volume grown = make_moving(SCENE_BUILTIN_FUR, g / 16.0, 0);
        double sum = 0;
        size_t layer = (size_t)32 * 32;
        check_voxels(&grown);
        for (size_t i = 0; i < count_of(&grown); i++) {
            assert_true(i / layer < (size_t)g || grown.medium[4 * i + 3] == 0);
            sum += (double)grown.medium[4 * i + 3];
        }
        assert_true(g == 0 ? sum == 0 : sum > before);
        before = sum;
        if (g == 16)
            assert_true(difference(&whole, &grown) == 0);
        drop(&grown);
    }
    drop(&whole);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clouds_move_in_a_loop),
        cmocka_unit_test(fur_grows),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
