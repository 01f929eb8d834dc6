/* service/files.c: whole files, and assets below one folder. */
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
/* cmocka wants the headers above first. */
#include <cmocka.h>

#include "service/files.h"

struct folder {
    char path[64];
};

static int make_folder(void **state) {
    struct folder *folder = calloc(1, sizeof *folder);
    strcpy(folder->path, "/tmp/pelt-test-XXXXXX");
    *state = folder;
    return mkdtemp(folder->path) ? 0 : -1;
}

static int remove_folder(void **state) {
    struct folder *folder = *state;
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder->path);
    int code = system(command);
    free(folder);
    return code;
}

static const char *in(const struct folder *folder, const char *name, char path[256]) {
    snprintf(path, 256, "%s/%s", folder->path, name);
    return path;
}

static void put(const struct folder *folder, const char *name, const char *text) {
    char path[256];
    FILE *file = fopen(in(folder, name, path), "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static void test_names(void **state) {
    (void)state;
    static const char *const good[] = {"a", "a.glb", "a/b.png", "..a", "a..", "a/...", "\xc3\xa9"};
    static const char *const bad[] = {"",      "/",      "/a",   "a/",   "a//b",
                                      ".",     "..",     "../a", "a/..", "./a",
                                      "a/./b", "a/../b", "a\\b", "a\nb", "\x7f"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        assert_true(files_asset_name_ok(good[i]));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_false(files_asset_name_ok(bad[i]));
}

static void test_reads_up_to_the_limit_and_no_further(void **state) {
    char path[256];
    unsigned char *data;
    size_t bytes;
    put(*state, "ten", "0123456789");
    in(*state, "ten", path);
    assert_int_equal(files_read(path, 10, &data, &bytes, NULL), STATUS_OK);
    assert_int_equal(bytes, 10);
    assert_string_equal((char *)data, "0123456789");
    free(data);
    assert_int_equal(files_read(path, 9, &data, &bytes, NULL), STATUS_SCENE_TOO_LARGE);
    assert_null(data);
    put(*state, "empty", "");
    assert_int_equal(files_read(in(*state, "empty", path), 10, &data, &bytes, NULL), STATUS_OK);
    assert_int_equal(bytes, 0);
    assert_int_equal(data[0], 0);
    free(data);
}

static void test_reads_what_has_no_size(void **state) {
    (void)state;
    unsigned char *data;
    size_t bytes;
    assert_int_equal(files_read("/proc/self/status", 1 << 20, &data, &bytes, NULL), STATUS_OK);
    assert_true(bytes > 100);
    assert_int_equal(strlen((char *)data), bytes);
    free(data);
    assert_int_equal(files_read("/dev/zero", 1 << 20, &data, &bytes, NULL), STATUS_SCENE_TOO_LARGE);
}

static void test_says_why_it_cannot_read(void **state) {
    char path[256];
    unsigned char *data;
    size_t bytes;
    struct error err = {0};
    assert_int_equal(files_read(in(*state, "none", path), 10, &data, &bytes, &err),
                     STATUS_NOT_FOUND);
    assert_non_null(strstr(err.faults[0].message, "No such file"));
    error_clear(&err);
    assert_int_equal(files_read(in(*state, "", path), 10, &data, &bytes, &err), STATUS_IO_ERROR);
    assert_null(data);
    error_clear(&err);
}

static void test_writes_all_or_nothing(void **state) {
    char path[256];
    unsigned char *data;
    size_t bytes;
    put(*state, "out", "old");
    assert_int_equal(files_write(in(*state, "out", path), "new!", 4, NULL), STATUS_OK);
    assert_int_equal(files_read(path, 10, &data, &bytes, NULL), STATUS_OK);
    assert_string_equal((char *)data, "new!");
    free(data);
    struct stat info;
    assert_int_equal(stat(path, &info), 0);
    assert_int_equal(info.st_mode & 0111, 0);
    assert_int_equal(files_write(in(*state, "none/out", path), "x", 1, NULL), STATUS_IO_ERROR);
    assert_int_equal(files_write(in(*state, "", path), "x", 1, NULL), STATUS_IO_ERROR);
    assert_int_equal(files_write("/dev/null", "x", 1, NULL), STATUS_OK);
    assert_int_equal(files_write("/dev/full", "x", 1, NULL), STATUS_IO_ERROR);
    char command[320];
    snprintf(command, sizeof command, "test \"$(ls -A %s)\" = out",
             ((struct folder *)*state)->path);
    assert_int_equal(system(command), 0); /* no temporary file is left */
}

static enum status try_open(struct folder *folder, const char *name) {
    char scene[256];
    struct file_assets assets;
    assert_int_equal(file_assets_init(&assets, NULL, in(folder, "scene.json", scene), NULL),
                     STATUS_OK);
    struct asset_source source = file_assets_source(&assets);
    struct asset_bytes bytes;
    struct error err = {0};
    enum status status =
        source.open(source.user, name, "/objects/0/shell/mesh/asset", &bytes, &err);
    if (status == STATUS_OK) {
        source.close(source.user, &bytes);
    } else {
        assert_int_equal(err.status, status);
        assert_string_equal(err.faults[0].pointer, "/objects/0/shell/mesh/asset");
    }
    assert_null(bytes.data);
    error_clear(&err);
    file_assets_finish(&assets);
    return status;
}

static void test_assets_lie_beside_the_scene_and_nowhere_else(void **state) {
    char path[256];
    put(*state, "a.bin", "abc");
    assert_int_equal(mkdir(in(*state, "sub", path), 0700), 0);
    put(*state, "sub/b.bin", "b");
    assert_int_equal(mkfifo(in(*state, "pipe", path), 0600), 0);
    assert_int_equal(try_open(*state, "a.bin"), STATUS_OK);
    assert_int_equal(try_open(*state, "sub/b.bin"), STATUS_OK);
    assert_int_equal(try_open(*state, "none"), STATUS_ASSET_NOT_FOUND);
    assert_int_equal(try_open(*state, "a.bin/b"), STATUS_ASSET_NOT_FOUND);
    assert_int_equal(try_open(*state, "sub"), STATUS_BAD_ASSET);
    assert_int_equal(try_open(*state, "pipe"), STATUS_BAD_ASSET);
    assert_int_equal(try_open(*state, "sub/../a.bin"), STATUS_INVALID_SCENE);
    assert_int_equal(try_open(*state, "/etc/passwd"), STATUS_INVALID_SCENE);
}

static void test_an_asset_carries_its_sha256(void **state) {
    struct file_assets assets;
    put(*state, "a.bin", "abc");
    assert_int_equal(
        file_assets_init(&assets, ((struct folder *)*state)->path, "elsewhere/scene.json", NULL),
        STATUS_OK);
    struct asset_source source = file_assets_source(&assets);
    struct asset_bytes bytes;
    assert_int_equal(source.open(source.user, "a.bin", "", &bytes, NULL), STATUS_OK);
    assert_int_equal(bytes.size, 3);
    assert_memory_equal(bytes.data, "abc", 3);
    /* FIPS 180-2, appendix B.1 */
    static const unsigned char expected[32] = {0xba, 0x78, 0x16, 0xbf, 0x8f, 0x01, 0xcf, 0xea,
                                               0x41, 0x41, 0x40, 0xde, 0x5d, 0xae, 0x22, 0x23,
                                               0xb0, 0x03, 0x61, 0xa3, 0x96, 0x17, 0x7a, 0x9c,
                                               0xb4, 0x10, 0xff, 0x61, 0xf2, 0x00, 0x15, 0xad};
    assert_memory_equal(bytes.sha256, expected, 32);
    source.close(source.user, &bytes);
    file_assets_finish(&assets);
}

int main(void) {
#define IN_FOLDER(test) cmocka_unit_test_setup_teardown(test, make_folder, remove_folder)
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_names),
        IN_FOLDER(test_reads_up_to_the_limit_and_no_further),
        cmocka_unit_test(test_reads_what_has_no_size),
        IN_FOLDER(test_says_why_it_cannot_read),
        IN_FOLDER(test_writes_all_or_nothing),
        IN_FOLDER(test_assets_lie_beside_the_scene_and_nowhere_else),
        IN_FOLDER(test_an_asset_carries_its_sha256),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
