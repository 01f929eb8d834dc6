/* An asset source for tests: names are paths from the root of the tree, where tests run. */
#ifndef PELT_TESTS_UNIT_ASSET_FILES_H
#define PELT_TESTS_UNIT_ASSET_FILES_H

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/asset/source.h"

/* Counts what is open, so that a test can see that everything was closed. `user` is an int *. */
static enum status files_open(void *user, const char *name, const char *pointer,
                              struct asset_bytes *bytes, struct error *err) {
    FILE *file = fopen(name, "rb");
    if (!file)
        return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no file %s", name);
    fseek(file, 0, SEEK_END);
    long size = ftell(file);
    rewind(file);
    unsigned char *data = malloc(size > 0 ? (size_t)size : 1);
    if (!data || fread(data, 1, (size_t)size, file) != (size_t)size)
        abort();
    fclose(file);
    *bytes = (struct asset_bytes){.data = data, .size = (size_t)size, .handle = data};
    gnutls_hash_fast(GNUTLS_DIG_SHA256, data, (size_t)size, bytes->sha256);
    ++*(int *)user;
    return STATUS_OK;
}

static void files_close(void *user, struct asset_bytes *bytes) {
    free(bytes->handle);
    --*(int *)user;
}

#endif
