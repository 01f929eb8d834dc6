/* Every row of api/refusals.def has a document that it refuses, at its pointer; and a document just
 * beside it that is accepted, so that a rule that refuses everything fails too. */
#include "tests/unit/scene_fixture.h"

#include "api/refusals.h"

#define OBJECT(beside)                                                                             \
    "{\"objects\": [{\"shell\": {\"mesh\": {\"shape\": \"sphere\"}, \"material\": "                \
    "{\"builtin\": \"fur\"}}" beside "}]}"
#define SKELETON(segments)                                                                         \
    "{\"objects\": [{\"skeleton\": {\"joints\": [{\"position\": [0, 0, 0], \"radius\": 1}, "       \
    "{\"position\": [0, 0, 1], \"radius\": 0}], \"segments\": " segments "}}]}"
#define TEN(x)  x x x x x x x x x x
#define OPEN31  TEN("[") TEN("[") TEN("[") "["
#define CLOSE31 TEN("]") TEN("]") TEN("]") "]"

static const struct {
    enum refusal refusal;
    const char *refused, *pointer;
    const char *accepted; /* NULL: nothing near it is accepted */
} rows[] = {
    {REFUSAL_SYNTAX, "{\"objects\": [}", "/objects/0", LEAST("")},
    {REFUSAL_SYNTAX, "", "", NULL},
    {REFUSAL_SYNTAX, LEAST("") " x", "", LEAST("") " \n"},
    {REFUSAL_NOT_A_NUMBER, LEAST(", \"ambient\": [0, NaN, 0]"), "/ambient/1",
     LEAST(", \"ambient\": [0, 0.5, 0]")},
    {REFUSAL_NOT_A_NUMBER, LEAST(", \"ambient\": [0, 0, -Infinity]"), "/ambient/2", NULL},
    {REFUSAL_ENCODING, LEAST(", \"\xC0\xAF\": 1"), "", NULL},
    {REFUSAL_ENCODING, SHELL_SCENE("{\"asset\": \"\xED\xA0\x80\"}", "{\"builtin\": \"fur\"}", ""),
     "/objects/0/shell/mesh/asset",
     SHELL_SCENE("{\"asset\": \"\xC3\xA9\"}", "{\"builtin\": \"fur\"}", "")},
    {REFUSAL_ENCODING, SHELL_SCENE("{\"asset\": \"\\udc00\"}", "{\"builtin\": \"fur\"}", ""),
     "/objects/0/shell/mesh/asset",
     SHELL_SCENE("{\"asset\": \"\\ud83d\\ude00\"}", "{\"builtin\": \"fur\"}", "")},
    {REFUSAL_NUL, SHELL_SCENE("{\"asset\": \"a\\u0000b\"}", "{\"builtin\": \"fur\"}", ""),
     "/objects/0/shell/mesh/asset",
     SHELL_SCENE("{\"asset\": \"a\\u0062b\"}", "{\"builtin\": \"fur\"}", "")},
    {REFUSAL_TOO_DEEP, LEAST(", \"x\": " OPEN31 "[" CLOSE31 "]"),
     "/x" TEN("/0") TEN("/0") TEN("/0") "/0", NULL},
    {REFUSAL_DUPLICATE, LEAST(", \"image\": {\"width\": 8, \"w\\u0069dth\": 9}"), "/image/width",
     LEAST(", \"image\": {\"width\": 8, \"height\": 9}")},
    {REFUSAL_OVERFLOW, LEAST(", \"ambient\": [1e999, 0, 0]"), "/ambient/0",
     LEAST(", \"ambient\": [1e-999, 0, 0]")},
    {REFUSAL_EYE_AT_TARGET, LEAST(", \"camera\": {\"eye\": [1, 2, 3], \"target\": [1, 2, 3]}"),
     "/camera/target",
     LEAST(", \"camera\": {\"eye\": [1, 2, 3], \"target\": [1, 2, 3.0001]"
           ", \"up\": [1, 0, 0]}")},
    {REFUSAL_EYE_AT_TARGET, LEAST(", \"camera\": {\"eye\": [0, 0, 0]}"), "/camera", NULL},
    {REFUSAL_UP_PARALLEL, LEAST(", \"camera\": {\"eye\": [1, 1, 1], \"up\": [-2, -2, -2]}"),
     "/camera/up", LEAST(", \"camera\": {\"eye\": [1, 1, 1], \"up\": [-2, -2, -2.00001]}")},
    {REFUSAL_UP_PARALLEL, LEAST(", \"camera\": {\"eye\": [0, 0, 9]}"), "/camera", NULL},
    {REFUSAL_ZERO_DIRECTION, LEAST(", \"camera\": {\"eye\": [1, 0, 0], \"up\": [0, 0, 0]}"),
     "/camera/up", NULL},
    {REFUSAL_ZERO_DIRECTION, LEAST(", \"lights\": [{}, {\"direction\": [0, 0, 0]}]"),
     "/lights/1/direction", LEAST(", \"lights\": [{}, {\"direction\": [0, 0, 1e-11]}]")},
    {REFUSAL_NOT_AFFINE,
     OBJECT(", \"transform\": {\"matrix\": [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}"),
     "/objects/0/transform/matrix",
     OBJECT(", \"transform\": {\"matrix\": [1,0,0,0, 0,1,0,0, 0,0,1,0, 7,8,9,1]}")},
    {REFUSAL_SINGULAR, OBJECT(", \"transform\": {\"scale\": [1, 0, 1]}"),
     "/objects/0/transform/scale", OBJECT(", \"transform\": {\"scale\": [1e-9, -1e9, 1]}")},
    {REFUSAL_SINGULAR,
     OBJECT(", \"transform\": {\"matrix\": [1,2,3,0, 2,4,6,0, 0,0,1,0, 0,0,0,1]}"),
     "/objects/0/transform/matrix",
     OBJECT(", \"transform\": {\"matrix\": [1,2,3,0, 2,4,7,0, 0,1,1,0, 0,0,0,1]}")},
    {REFUSAL_SEGMENT_INDEX, SKELETON("[[0, 1], [1, 2]]"), "/objects/0/skeleton/segments/1/1",
     SKELETON("[[0, 1], [1, 0]]")},
    {REFUSAL_SEGMENT_LOOP, SKELETON("[[1, 1]]"), "/objects/0/skeleton/segments/0",
     SKELETON("[[1, 0]]")},
    {REFUSAL_PICTURE_COST, LEAST(", \"image\": {\"width\": 8192, \"height\": 1, \"samples\": 9}"),
     "/image", LEAST(", \"image\": {\"width\": 8192, \"height\": 1, \"samples\": 4}")},
    {REFUSAL_PICTURE_COST, LEAST(", \"image\": {\"width\": 1, \"height\": 8192, \"samples\": 9}"),
     "/image", LEAST(", \"image\": {\"width\": 1, \"height\": 8192, \"samples\": 4}")},
    {REFUSAL_PICTURE_COST,
     LEAST(", \"image\": {\"width\": 2049, \"height\": 2048, \"samples\": 4}"), "/image",
     LEAST(", \"image\": {\"width\": 2048, \"height\": 2048, \"samples\": 4}")},
    {REFUSAL_TRIANGLES,
     SHELL_SCENE("{\"shape\": \"plane\", \"divisions\": [2001, 1000]}", "{\"builtin\": \"fur\"}",
                 ""),
     "/objects/0/shell/mesh",
     SHELL_SCENE("{\"shape\": \"plane\", \"divisions\": [2000, 1000]}", "{\"builtin\": \"fur\"}",
                 "")},
    {REFUSAL_TRIANGLES,
     SHELL_SCENE("{\"shape\": \"teapot\", \"divisions\": [250, 251]}", "{\"builtin\": \"fur\"}",
                 ""),
     "/objects/0/shell/mesh",
     SHELL_SCENE("{\"shape\": \"teapot\", \"divisions\": [250, 250]}", "{\"builtin\": \"fur\"}",
                 "")},
};

static void each_row_refuses(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct read read;
        read_text(&read, rows[i].refused);
        if (read.status != refusal_status(rows[i].refusal))
            fail_msg("%s: %s is answered with %s", refusal_name(rows[i].refusal), rows[i].refused,
                     status_slug(read.status));
        assert_fault(&read.err, rows[i].pointer, refusal_text(rows[i].refusal));
        read_finish(&read);
    }
}

static void what_lies_beside_is_accepted(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        if (!rows[i].accepted)
            continue;
        struct read read;
        read_text(&read, rows[i].accepted);
        if (read.status != STATUS_OK)
            fail_msg("%s: %s is refused: %s %s", refusal_name(rows[i].refusal), rows[i].accepted,
                     read.err.faults[0].pointer, read.err.faults[0].message);
        read_finish(&read);
    }
}

/* The one row whose document is too long for a literal. */
static void too_large(void **state) {
    (void)state;
    size_t bytes = SCENE_BYTES_MAX + 1;
    char *text = malloc(bytes);
    assert_non_null(text);
    memset(text, ' ', bytes);
    memcpy(text, LEAST(""), strlen(LEAST("")));
    struct read read;
    read_bytes(&read, text, bytes);
    assert_int_equal(read.status, STATUS_SCENE_TOO_LARGE);
    assert_fault(&read.err, "", refusal_text(REFUSAL_TOO_LARGE));
    read_finish(&read);
    read_bytes(&read, text, bytes - 1);
    assert_int_equal(read.status, STATUS_OK);
    read_finish(&read);
    free(text);
}

static void no_row_is_forgotten(void **state) {
    (void)state;
    bool covered[REFUSAL_COUNT] = {[REFUSAL_TOO_LARGE] = true};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        covered[rows[i].refusal] = true;
    for (int i = 0; i < REFUSAL_COUNT; i++)
        if (!covered[i])
            fail_msg("%s has no test", refusal_name((enum refusal)i));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(each_row_refuses),
        cmocka_unit_test(what_lies_beside_is_accepted),
        cmocka_unit_test(too_large),
        cmocka_unit_test(no_row_is_forgotten),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
