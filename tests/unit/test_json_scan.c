/* json_scan(): where in the text a fault stands and what was expected, and that what it mends can
 * be parsed by jansson. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "api/json_scan.h"

static char *copy_of(const char *text) {
    char *copy = malloc(strlen(text) + 1);
    assert_non_null(copy);
    return strcpy(copy, text);
}

static void syntax_faults(void **state) {
    (void)state;
    static const struct {
        const char *text, *pointer, *message;
    } rows[] = {
        {"", "", "line 1, column 1: expected a value, found the end"},
        {"  \n", "", "line 2, column 1: expected a value, found the end"},
        {"{\n \"a\": 1,\n}", "", "line 3, column 1: expected a member's name in quotes, found '}'"},
        {"{\"a\" 1}", "", "line 1, column 6: expected a colon, found '1'"},
        {"{\"a\": 1 \"b\"}", "", "expected a comma or a closing brace, found '\"'"},
        {"[1 2]", "", "expected a comma or a closing bracket, found '2'"},
        {"[1,]", "/1", "expected a value, found ']'"},
        {"[0, 01]", "", "expected a comma or a closing bracket, found '1'"},
        {"{\"x\": [3, -]}", "/x/1", "expected a digit, found ']'"},
        {"[1.]", "/0", "expected a digit"},
        {"[1e+]", "/0", "expected a digit"},
        {"[.5]", "/0", "expected a value"},
        {"[+1]", "/0", "expected a value"},
        {"[tru]", "/0", "expected a value"},
        {"['a']", "/0", "expected a value, found '''"},
        {"[\"\\q\"]", "/0", "after a backslash, found 'q'"},
        {"[\"\\u12g4\"]", "/0", "four hexadecimal digits"},
        {"[\"\\u12", "/0", "four hexadecimal digits"},
        {"[\"a\tb\"]", "/0", "no control character in a string, found byte 0x09"},
        {"[\"abc", "/0", "expected a closing quote, found the end"},
        {"[\"abc\\", "/0", "expected an escape, found the end"},
        {"[] []", "", "line 1, column 4: expected the end, found '['"},
        {"\xEF\xBB\xBF{}", "", "expected a value, found byte 0xef"},
        {"[\"\xC3\xA9\xE2\x82\xAC\" x]", "", "line 1, column 7: expected a comma"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char *text = copy_of(rows[i].text);
        struct error err = {0};
        bool duplicates;
        enum status status = json_scan(text, strlen(text), 32, &duplicates, &err);
        assert_int_equal(status, STATUS_BAD_JSON);
        assert_int_equal(err.fault_count, 1);
        assert_string_equal(err.faults[0].pointer, rows[i].pointer);
        if (!strstr(err.faults[0].message, rows[i].message))
            fail_msg("%s: \"%s\" does not say \"%s\"", rows[i].text, err.faults[0].message,
                     rows[i].message);
        error_clear(&err);
        free(text);
    }
}

static void what_is_mended_can_be_parsed(void **state) {
    (void)state;
    static const struct {
        const char *text;
        size_t faults;
    } rows[] = {
        {"[NaN, -NaN, Infinity, -Infinity, nan, inf, -inf]", 7},
        {"[1e400, -1e400, 1e308, 1e-400]", 2},
        {"{\"a\": 1, \"a\": 2, \"a\": 3, \"b\": {\"c\": 0, \"c\": 0}}", 2},
        {"[\"\\u0000\", \"\\ud800\", \"\\udc00\\ud800\", \"\\ud800\\u0041\"]", 4},
        {"[\"\\ud83d\\ue000\", \"\\udbff\\udfff\", \"\\ud800\\udbff\"]", 2},
        {"{\"\\u0000\": \"\\ud83d\\ude00\"}", 1},
        {"[\"\xFF\", \"\xC0\x80\", \"\xED\xA0\x80\", \"\xF5\x80\x80\x80\", \"\xE2\x82\"]", 5},
        {"{\"a\": 0, \"\\u0061\": 0, \"\\ud83d\\ude00\": 0, \"\xF0\x9F\x98\x80\": 0, \"\\n\": 0}",
         2},
        {"{\"\": 0, \"ab\": 0, \"abc\": 0, \"b\": [{\"ab\": 1}, {\"ab\": 1}]}", 0},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char *text = copy_of(rows[i].text);
        struct error err = {0};
        bool duplicates;
        assert_int_equal(json_scan(text, strlen(text), 32, &duplicates, &err), STATUS_OK);
        if (err.fault_count != rows[i].faults)
            fail_msg("%s: %zu faults", rows[i].text, err.fault_count);
        json_error_t why;
        json_t *json = json_loads(text, duplicates ? 0 : JSON_REJECT_DUPLICATES, &why);
        if (!json)
            fail_msg("%s, mended to %s: %s", rows[i].text, text, why.text);
        json_decref(json);
        error_clear(&err);
        free(text);
    }
}

static void pointers_of_duplicates_are_escaped(void **state) {
    (void)state;
    char *text = copy_of("{\"x\": [0, {\"a/b~c\": 1, \"a\\/b\\u007ec\": 2}]}");
    struct error err = {0};
    bool duplicates;
    assert_int_equal(json_scan(text, strlen(text), 32, &duplicates, &err), STATUS_OK);
    assert_true(duplicates);
    assert_int_equal(err.fault_count, 1);
    assert_string_equal(err.faults[0].pointer, "/x/1/a~1b~0c");
    error_clear(&err);
    free(text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(syntax_faults),
        cmocka_unit_test(what_is_mended_can_be_parsed),
        cmocka_unit_test(pointers_of_duplicates_are_escaped),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
