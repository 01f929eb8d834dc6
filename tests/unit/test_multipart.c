/* The multipart parser: whatever way the bytes are cut, the same parts come out. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "service/multipart.h"

/* Writes down what the parser says: [name]bytes; for each part. */
struct record {
    char text[4096];
    size_t length;
    const char *refuse; /* a part of this name is refused */
};

static void add(struct record *record, const char *data, size_t bytes) {
    assert_true(record->length + bytes <= sizeof record->text);
    memcpy(record->text + record->length, data, bytes);
    record->length += bytes;
}

static enum status begin(void *user, const char *name) {
    struct record *record = user;
    if (record->refuse && strcmp(name, record->refuse) == 0)
        return STATUS_TOO_COMPLEX;
    add(record, "[", 1);
    add(record, name, strlen(name));
    add(record, "]", 1);
    return STATUS_OK;
}

static enum status data(void *user, const char *bytes, size_t count) {
    assert_true(count > 0);
    add(user, bytes, count);
    return STATUS_OK;
}

static enum status end(void *user) {
    add(user, ";", 1);
    return STATUS_OK;
}

/* Feeds `body` in pieces of `piece` bytes; the status, and whether the closing delimiter came. */
static enum status parse(const char *type, const char *body, size_t bytes, size_t piece,
                         struct record *record, bool *complete) {
    struct multipart multipart;
    struct multipart_sink sink = {begin, data, end, record};
    *complete = false;
    record->length = 0;
    enum status status = multipart_init(&multipart, type, &sink, NULL);
    for (size_t at = 0; at < bytes && status == STATUS_OK; at += piece) {
        /* A copy of the exact size, so that a sanitizer sees reads beyond it. */
        size_t count = bytes - at < piece ? bytes - at : piece;
        char *copy = malloc(count);
        assert_non_null(copy);
        memcpy(copy, body + at, count);
        status = multipart_feed(&multipart, copy, count, NULL);
        free(copy);
    }
    if (status == STATUS_OK)
        *complete = multipart_is_complete(&multipart);
    return status;
}

#define TYPE       "multipart/form-data; boundary=bound"
#define PART(name) "Content-Disposition: form-data; name=\"" name "\"\r\n\r\n"

static void test_any_cut_gives_the_same(void **state) {
    /* Bodies full of what is nearly a delimiter. */
    static const char body[] = "preamble\r\n--boun\r\n\r\n--bound\r\n" PART(
        "a") "\r\n--boun\r\n-\r\r\n--bouncy\r\n\r\n"
             "\r\n--bound\r\n"
             "Content-Type: x/y\r\ncontent-disposition:form-data; filename=\"a;b\"; name=\"b "
             "c\"\r\n\r\n"
             "\r\n--bound \t\r\n" PART("empty") "\r\n--bound\r\n" PART(
                 "zero") "\0\0\r\n\r"
                         "\r\n--bound--\r\nepilogue\r\n--bound\r\n";
    static const char expected[] = "[a]\r\n--boun\r\n-\r\r\n--bouncy\r\n\r\n;[b c];[empty];[zero]"
                                   "\0\0\r\n\r;";
    struct record record = {.refuse = NULL};
    bool complete;
    (void)state;
    for (size_t piece = 1; piece <= sizeof body; piece++) {
        assert_int_equal(parse(TYPE, body, sizeof body - 1, piece, &record, &complete), STATUS_OK);
        assert_true(complete);
        assert_int_equal(record.length, sizeof expected - 1);
        assert_memory_equal(record.text, expected, sizeof expected - 1);
    }
}

static void test_delimiter_at_the_very_beginning(void **state) {
    static const char body[] = "--bound\r\n" PART("a") "x\r\n--bound--";
    struct record record = {.refuse = NULL};
    bool complete;
    (void)state;
    for (size_t piece = 1; piece <= sizeof body; piece++) {
        assert_int_equal(parse(TYPE, body, sizeof body - 1, piece, &record, &complete), STATUS_OK);
        assert_true(complete);
        assert_memory_equal(record.text, "[a]x;", 5);
    }
}

static void test_every_prefix_is_incomplete(void **state) {
    static const char body[] = "--bound\r\n" PART("a") "x\r\n--bound--";
    struct record record = {.refuse = NULL};
    bool complete;
    (void)state;
    for (size_t bytes = 0; bytes < sizeof body - 1; bytes++) {
        assert_int_equal(parse(TYPE, body, bytes, 7, &record, &complete), STATUS_OK);
        assert_false(complete);
    }
}

static void test_boundaries(void **state) {
    static const char longest[] = "multipart/form-data; boundary="
                                  "0123456789012345678901234567890123456789012345678901234567890123"
                                  "456789";
    static const char *const good[] = {longest, "multipart/form-data; charset=x; Boundary=\"b b\"",
                                       "m/f;boundary=b;x=y",
                                       "m/f ; x=\"boundary=no;\" ; boundary=b"};
    static const char *const bad[] = {
        "multipart/form-data",   "m/f; boundary=",    "m/f; boundary=\"\"", "m/f; boundary=\"b",
        "m/f; boundary=b\tb\"{", "m/f; boundary=a@b", "m/f; xboundary=b",   "boundary=b"};
    struct multipart multipart;
    struct multipart_sink sink = {begin, data, end, NULL};
    (void)state;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        if (multipart_init(&multipart, good[i], &sink, NULL) != STATUS_OK)
            fail_msg("refused: %s", good[i]);
    char text[sizeof longest + 1];
    snprintf(text, sizeof text, "%sx", longest);
    assert_int_equal(multipart_init(&multipart, text, &sink, NULL), STATUS_BAD_REQUEST);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        struct error err = {0};
        enum status status = multipart_init(&multipart, bad[i], &sink, &err);
        if (i == 4)
            assert_int_equal(status, STATUS_OK); /* the value ends at the tab */
        else if (status != STATUS_BAD_REQUEST || err.fault_count != 1)
            fail_msg("taken: %s", bad[i]);
        error_clear(&err);
    }
}

static void test_parts_that_are_refused(void **state) {
    char header[3000];
    struct record record = {.refuse = "b"};
    bool complete;
    (void)state;
    memset(header, 'x', sizeof header);
    memcpy(header, "--bound\r\n", 9);
    assert_int_equal(parse(TYPE, header, sizeof header, 100, &record, &complete),
                     STATUS_BAD_REQUEST);
    static const struct {
        const char *body;
        enum status status;
    } rows[] = {
        {"--bound\r\n\r\nno header", STATUS_BAD_REQUEST},
        {"--bound\r\nContent-Type: x/y\r\n\r\n", STATUS_BAD_REQUEST},
        {"--bound\r\nContent-Disposition: attachment; name=\"a\"\r\n\r\n", STATUS_BAD_REQUEST},
        {"--bound\r\nContent-Disposition: form-data\r\n\r\n", STATUS_BAD_REQUEST},
        {"--bound\r\nContent-Disposition: form-data; name=\"\"\r\n\r\n", STATUS_BAD_REQUEST},
        {"--bound\r\nContent-Disposition: form-data; name=\"a\r\n\r\n", STATUS_BAD_REQUEST},
        {"--boundx\r\n", STATUS_BAD_REQUEST},
        {"--bound\n\n", STATUS_BAD_REQUEST},
        {"--bound-x", STATUS_BAD_REQUEST},
        {"--bound\r\n" PART("b"), STATUS_TOO_COMPLEX}, /* as the sink said */
        {"--bound\r\n" PART("a"), STATUS_OK},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (size_t piece = 1; piece < 64; piece *= 3)
            if (parse(TYPE, rows[i].body, strlen(rows[i].body), piece, &record, &complete) !=
                rows[i].status)
                fail_msg("row %zu in pieces of %zu", i, piece);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_any_cut_gives_the_same),
        cmocka_unit_test(test_delimiter_at_the_very_beginning),
        cmocka_unit_test(test_every_prefix_is_incomplete),
        cmocka_unit_test(test_boundaries),
        cmocka_unit_test(test_parts_that_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
