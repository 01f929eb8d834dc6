/* spelling_distance(): known distances, and the laws of one. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "api/spelling.h"

static void known_distances(void **state) {
    (void)state;
    static const struct {
        const char *a, *b;
        size_t distance;
    } rows[] = {
        {"", "", 0},
        {"", "abc", 3},
        {"height", "height", 0},
        {"heigth", "height", 1},
        {"hight", "height", 1},
        {"kitten", "sitting", 3},
        {"tile", "tiles", 1},
        {"colour", "color", 1},
        {"ca", "abc", 3},
        {"abcdefghijklmnopqrstuvwxyz012345", "a", 32},
        {"abcdefghijklmnopqrstuvwxyz01234", "abcdefghijklmnopqrstuvwxyz01243", 1},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        assert_int_equal(spelling_distance(rows[i].a, rows[i].b), rows[i].distance);
        assert_int_equal(spelling_distance(rows[i].b, rows[i].a), rows[i].distance);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(known_distances)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
