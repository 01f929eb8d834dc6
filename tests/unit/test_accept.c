/* Content negotiation and request ids: what a client may write into these headers. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "service/accept.h"
#include "service/request_id.h"

static const char *const types[] = {"image/png", "image/x-exr", "application/json"};
enum { NONE = -1, PNG, EXR, JSON };

static void test_choice(void **state) {
    static const struct {
        const char *header;
        int chosen;
    } rows[] = {
        {NULL, PNG},
        {"", PNG},
        {" , ,", PNG},
        {"*/*", PNG},
        {"image/*", PNG},
        {"application/*", JSON},
        {"image/png", PNG},
        {"IMAGE/X-EXR", EXR},
        {"text/html", NONE},
        {"image", NONE},
        {"image/", NONE},
        {"image/pngx", NONE},
        {"*/png", NONE},
        {"*", NONE},
        {"image/x-exr, image/png", PNG}, /* equal: the server's order */
        {"image/x-exr;q=0.9, image/png;q=0.8", EXR},
        {"image/x-exr;q=0.009, image/png;q=0.008", EXR},
        {"*/*;q=0.1, application/json", JSON},
        {"*/*, image/png;q=0", EXR}, /* the more specific range forbids it */
        {"image/png;q=0, */*", EXR},
        {"image/*;q=0, */*", JSON},
        {"image/*;q=0, image/x-exr;q=0.1, */*;q=0.05", EXR},
        {"image/png;q=0", NONE},
        {"*/*;q=0.0", NONE},
        {"image/png;q=1.1", NONE}, /* no quality: as if it were not there */
        {"image/png;q=", NONE},
        {"image/png;q=0.5.5", NONE},
        {"image/png;q=-1, image/x-exr", EXR},
        {"image/png ; level=1 ; Q=0.3 , application/json;q=0.4", JSON},
        {"image/png;x=\"a,b;q=0\", application/json;q=0.5", PNG},
        {"text/html;x=\"unclosed, image/png", NONE},
        {"text/html;x=\"\\\", image/png\", image/x-exr", EXR},
    };
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        int chosen = accept_choose(rows[i].header, types, 3);
        if (chosen != rows[i].chosen)
            fail_msg("Accept: %s gave %d, not %d", rows[i].header ? rows[i].header : "(none)",
                     chosen, rows[i].chosen);
    }
    assert_int_equal(accept_choose("*/*", types, 0), -1);
}

static void test_request_ids(void **state) {
    char id[REQUEST_ID_BYTES] = "before", other[REQUEST_ID_BYTES], longest[REQUEST_ID_BYTES + 1];
    (void)state;
    memset(longest, 'x', sizeof longest);
    longest[REQUEST_ID_BYTES] = 0;
    static const char *const bad[] = {NULL, "", "a b", "a\nb", "\"", "a,b", "\xc3\xa9", "<x>"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_false(request_id_take(id, bad[i]));
    assert_false(request_id_take(id, longest));
    assert_string_equal(id, "before");
    longest[REQUEST_ID_BYTES - 1] = 0;
    assert_true(request_id_take(id, longest));
    assert_string_equal(id, longest);
    assert_true(request_id_take(id, "Az09._:+/=-"));
    request_id_make(id);
    request_id_make(other);
    assert_int_equal(strlen(id), 16);
    assert_string_not_equal(id, other);
    assert_true(request_id_take(other, id));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_choice),
        cmocka_unit_test(test_request_ids),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
