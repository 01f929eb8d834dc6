/* json_out.h: texts escaped, whatever their bytes; numbers shortest and exact. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <math.h>

#include "api/json_out.h"

static void values_and_commas(void **state) {
    (void)state;
    struct json_out out = {0};
    json_out_open(&out, '{');
    json_out_key(&out, "a");
    json_out_open(&out, '[');
    json_out_integer(&out, -1);
    json_out_unsigned(&out, 18446744073709551615ull);
    json_out_boolean(&out, true);
    json_out_boolean(&out, false);
    json_out_string(&out, NULL);
    json_out_string(&out, "ends in [{:,");
    json_out_raw(&out, "{}");
    json_out_close(&out, ']');
    json_out_key(&out, "b");
    json_out_open(&out, '{');
    json_out_close(&out, '}');
    json_out_key(&out, "");
    json_out_number(&out, 0.1);
    json_out_close(&out, '}');
    char *text = json_out_finish(&out);
    assert_string_equal(text,
                        "{\"a\":[-1,18446744073709551615,true,false,null,\"ends in [{:,\",{}],"
                        "\"b\":{},\"\":0.1}");
    free(text);
}

static void texts_of_any_bytes(void **state) {
    (void)state;
    static const struct {
        const char *text, *json;
    } rows[] = {
        {"\"\\/", "\"\\\"\\\\/\""},
        {"\n\x01\x7f", "\"\\u000a\\u0001\\u007f\""},
        {"\xC3\xA9", "\"\xC3\xA9\""},
        {"a\xC3", "\"a\xEF\xBF\xBD\""},
        {"\xC0\xAFz", "\"\xEF\xBF\xBD\xEF\xBF\xBDz\""},
        {"\xED\xA0\x80", "\"\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD\""},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct json_out out = {0};
        json_out_string(&out, rows[i].text);
        char *text = json_out_finish(&out);
        assert_string_equal(text, rows[i].json);
        free(text);
    }
}

static void numbers_read_back_equal(void **state) {
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 200000; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        uint64_t bits = seed ^ seed >> 29;
        double value;
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value))
            continue;
        char text[JSON_NUMBER_BYTES];
        json_number_text(value, text);
        double back = strtod(text, NULL);
        assert_memory_equal(&back, &value, sizeof value);
    }
    char text[JSON_NUMBER_BYTES];
    json_number_text(0.3, text);
    assert_string_equal(text, "0.3");
    json_number_text(-0.0, text);
    assert_string_equal(text, "-0");
    json_number_text(1048576, text);
    assert_string_equal(text, "1048576");
}

static void what_is_no_number_is_null(void **state) {
    (void)state;
    struct json_out out = {0};
    json_out_open(&out, '[');
    json_out_number(&out, NAN);
    json_out_number(&out, -INFINITY);
    json_out_close(&out, ']');
    char *text = json_out_finish(&out);
    assert_string_equal(text, "[null,null]");
    free(text);
}

static void large_documents_grow(void **state) {
    (void)state;
    struct json_out out = {0};
    json_out_open(&out, '[');
    for (int i = 0; i < 100000; i++)
        json_out_integer(&out, i % 10);
    json_out_close(&out, ']');
    char *text = json_out_finish(&out);
    assert_int_equal(strlen(text), 200001);
    free(text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_and_commas),       cmocka_unit_test(texts_of_any_bytes),
        cmocka_unit_test(numbers_read_back_equal), cmocka_unit_test(what_is_no_number_is_null),
        cmocka_unit_test(large_documents_grow),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
