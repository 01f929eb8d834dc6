/* libFuzzer target: bytes as the body of a multipart request. The parts that come out must not
 * depend on how the bytes are cut, and are never more than what went in.
 *
 * Input: one byte, the length of the pieces; the Content-Type, up to a newline; the body.
 * Built and run by tests/fuzz/multipart.sh. */
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "service/accept.h"
#include "service/multipart.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void require(int condition, const char *what) {
    if (condition)
        return;
    fprintf(stderr, "fuzz_multipart: %s\n", what);
    abort();
}

/* What the parser said: a hash of names and bytes, and their count. */
struct record {
    uint64_t hash, bytes;
    int parts, open;
};

static void mix(struct record *record, const char *data, size_t bytes) {
    for (size_t i = 0; i < bytes; i++)
        record->hash = (record->hash ^ (unsigned char)data[i]) * UINT64_C(0x100000001b3);
}

static enum status begin(void *user, const char *name) {
    struct record *record = user;
    require(!record->open && *name && strlen(name) < MULTIPART_NAME_MAX, "a part out of turn");
    record->open = 1;
    record->parts++;
    mix(record, name, strlen(name) + 1);
    return STATUS_OK;
}

static enum status add(void *user, const char *data, size_t bytes) {
    struct record *record = user;
    require(record->open && bytes > 0, "data out of turn");
    mix(record, data, bytes);
    record->bytes += bytes;
    return STATUS_OK;
}

static enum status end(void *user) {
    struct record *record = user;
    require(record->open, "an end out of turn");
    record->open = 0;
    return STATUS_OK;
}

static enum status parse(const char *type, const uint8_t *body, size_t bytes, size_t piece,
                         struct record *record) {
    struct multipart multipart;
    struct multipart_sink sink = {begin, add, end, record};
    enum status status = multipart_init(&multipart, type, &sink, NULL);
    for (size_t at = 0; at < bytes && status == STATUS_OK; at += piece) {
        size_t count = bytes - at < piece ? bytes - at : piece;
        char *copy = malloc(count); /* of the exact size, for the sanitizer */
        require(copy != NULL, "no memory");
        memcpy(copy, body + at, count);
        status = multipart_feed(&multipart, copy, count, NULL);
        free(copy);
    }
    require(status != STATUS_OK || !multipart_is_complete(&multipart) || !record->open,
            "complete with an open part");
    return status;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const types[] = {"image/png", "image/x-exr", "application/json"};
    const uint8_t *newline = size > 1 ? memchr(data + 1, '\n', size - 1) : NULL;
    if (!newline)
        return 0;
    size_t length = (size_t)(newline - data) - 1;
    char *type = malloc(length + 1);
    require(type != NULL, "no memory");
    memcpy(type, data + 1, length);
    type[length] = 0;
    const uint8_t *body = newline + 1;
    size_t bytes = size - length - 2;
    struct record whole = {0}, pieces = {0};
    enum status one = parse(type, body, bytes, bytes ? bytes : 1, &whole);
    enum status many = parse(type, body, bytes, (size_t)data[0] % 64 + 1, &pieces);
    require(one == many, "the status depends on the pieces");
    require(whole.hash == pieces.hash && whole.bytes == pieces.bytes && whole.parts == pieces.parts,
            "the parts depend on the pieces");
    require(whole.bytes <= bytes, "more came out than went in");
    int chosen = accept_choose(type, types, 3); /* any header will do */
    require(chosen >= -1 && chosen < 3, "a type that is not there");
    free(type);
    return 0;
}
