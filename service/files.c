/* Whole files in and out, and the assets that lie beside a scene.
 *
 * Assets are read, not mapped: a mapped file that another process truncates kills with SIGBUS. */
#include "service/files.h"

#include <errno.h>
#include <fcntl.h>
#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { READ_STEP = 65536 };

/* All that a descriptor gives, up to bytes_max and one byte more, which tells that there is more.
 */
static int read_all(int fd, size_t expected, size_t bytes_max, unsigned char **data,
                    size_t *bytes) {
    size_t capacity = expected < bytes_max ? expected : bytes_max;
    unsigned char *buffer = malloc(capacity + 2);
    size_t used = 0;
    while (buffer) {
        size_t room = capacity + 1 - used;
        ssize_t got = read(fd, buffer + used, room);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0) {
            int code = errno;
            free(buffer);
            return code;
        }
        if (got == 0)
            break;
        used += (size_t)got;
        if (used > bytes_max)
            break;
        if (used > capacity) {
            capacity = used + used / 2 + READ_STEP;
            unsigned char *grown = realloc(buffer, capacity + 2);
            if (!grown)
                free(buffer);
            buffer = grown;
        }
    }
    if (!buffer)
        return ENOMEM;
    buffer[used] = 0;
    *data = buffer;
    *bytes = used;
    return used > bytes_max ? EFBIG : 0;
}

enum status files_read(const char *path, size_t bytes_max, unsigned char **data, size_t *bytes,
                       struct error *err) {
    bool is_stdin = strcmp(path, "-") == 0;
    *data = NULL;
    *bytes = 0;
    int fd = is_stdin ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return error_fault(err,
                           errno == ENOENT || errno == ENOTDIR ? STATUS_NOT_FOUND : STATUS_IO_ERROR,
                           NULL, "cannot be read: %s", strerror(errno));
    struct stat info;
    size_t expected = READ_STEP;
    if (fstat(fd, &info) == 0 && S_ISREG(info.st_mode) && info.st_size > 0)
        expected = (size_t)info.st_size;
    int code = read_all(fd, expected, bytes_max, data, bytes);
    if (!is_stdin)
        close(fd);
    if (code == 0)
        return STATUS_OK;
    free(*data);
    *data = NULL;
    *bytes = 0;
    if (code == EFBIG)
        return error_fault(err, STATUS_SCENE_TOO_LARGE, NULL, "larger than %zu bytes", bytes_max);
    return error_fault(err, code == ENOMEM ? STATUS_OUT_OF_MEMORY : STATUS_IO_ERROR, NULL,
                       "cannot be read: %s", strerror(code));
}

static int write_all(int fd, const void *data, size_t bytes) {
    const unsigned char *next = data;
    while (bytes) {
        ssize_t written = write(fd, next, bytes);
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return errno;
        next += written;
        bytes -= (size_t)written;
    }
    return 0;
}

/* Through a temporary file beside `path`, which takes its place when it is complete. */
static int write_beside(const char *path, const void *data, size_t bytes) {
    static const char suffix[] = ".XXXXXX";
    size_t length = strlen(path);
    char *temporary = malloc(length + sizeof suffix);
    if (!temporary)
        return ENOMEM;
    memcpy(temporary, path, length);
    memcpy(temporary + length, suffix, sizeof suffix);
    int fd = mkostemp(temporary, O_CLOEXEC);
    int code = fd < 0 ? errno : 0;
    if (fd >= 0) {
        /* mkstemp() made it private; a picture is as public as the user's mask lets it be. */
        mode_t mask = umask(0);
        umask(mask);
        code = write_all(fd, data, bytes);
        if (code == 0 && fchmod(fd, 0666 & ~mask) != 0)
            code = errno;
        if (close(fd) != 0 && code == 0)
            code = errno;
        if (code == 0 && rename(temporary, path) != 0)
            code = errno;
        if (code != 0)
            unlink(temporary);
    }
    free(temporary);
    return code;
}

enum status files_write(const char *path, const void *data, size_t bytes, struct error *err) {
    struct stat info;
    int code;
    if (strcmp(path, "-") == 0) {
        code = write_all(STDOUT_FILENO, data, bytes);
    } else if (stat(path, &info) == 0 && !S_ISREG(info.st_mode)) {
        int fd = open(path, O_WRONLY | O_CLOEXEC); /* a pipe or a device: nothing to rename over */
        code = fd < 0 ? errno : write_all(fd, data, bytes);
        if (fd >= 0 && close(fd) != 0 && code == 0)
            code = errno;
    } else {
        code = write_beside(path, data, bytes);
    }
    if (code != 0)
        return error_fault(err, STATUS_IO_ERROR, NULL, "%s cannot be written: %s", path,
                           strerror(code));
    return STATUS_OK;
}

bool files_asset_name_ok(const char *name) {
    const char *start = name;
    for (const char *c = name;; c++) {
        if (*c == '/' || *c == '\0') {
            size_t length = (size_t)(c - start);
            if (length == 0 || (length == 1 && start[0] == '.') ||
                (length == 2 && start[0] == '.' && start[1] == '.'))
                return false;
            if (*c == '\0')
                return true;
            start = c + 1;
        } else if (*c == '\\' || (unsigned char)*c < 0x20 || *c == 0x7f) {
            return false;
        }
    }
}

enum status file_assets_init(struct file_assets *assets, const char *folder, const char *scene_path,
                             struct error *err) {
    const char *slash = strrchr(scene_path, '/');
    if (folder)
        assets->folder = strdup(folder);
    else if (!slash || strcmp(scene_path, "-") == 0)
        assets->folder = strdup(".");
    else
        assets->folder = strndup(scene_path, (size_t)(slash - scene_path) + 1);
    if (!assets->folder)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
    return STATUS_OK;
}

void file_assets_finish(struct file_assets *assets) {
    free(assets->folder);
    assets->folder = NULL;
}

static enum status open_regular(const struct file_assets *assets, const char *name,
                                const char *pointer, int *fd, size_t *size, struct error *err) {
    char *path = NULL;
    if (asprintf(&path, "%s/%s", assets->folder, name) < 0)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "memory ran out");
    /* Not to hang on a named pipe that nobody writes to. */
    *fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    int code = errno;
    free(path);
    struct stat info;
    if (*fd < 0)
        return error_fault(
            err, code == ENOENT || code == ENOTDIR ? STATUS_ASSET_NOT_FOUND : STATUS_BAD_ASSET,
            pointer, "%s in %s: %s", name, assets->folder, strerror(code));
    enum status status = STATUS_OK;
    if (fstat(*fd, &info) != 0 || !S_ISREG(info.st_mode))
        status = error_fault(err, STATUS_BAD_ASSET, pointer, "%s is not a regular file", name);
    else if (info.st_size > FILES_ASSET_BYTES_MAX)
        status = error_fault(err, STATUS_BAD_ASSET, pointer, "%s is larger than %d MiB", name,
                             FILES_ASSET_BYTES_MAX >> 20);
    if (status != STATUS_OK)
        close(*fd);
    else
        *size = (size_t)info.st_size;
    return status;
}

static enum status assets_open(void *user, const char *name, const char *pointer,
                               struct asset_bytes *result, struct error *err) {
    const struct file_assets *assets = user;
    *result = (struct asset_bytes){0};
    if (!files_asset_name_ok(name))
        return error_fault(err, STATUS_INVALID_SCENE, pointer,
                           "an asset is named by a relative path without '..'");
    int fd = -1;
    size_t size = 0, bytes = 0;
    enum status status = open_regular(assets, name, pointer, &fd, &size, err);
    if (status != STATUS_OK)
        return status;
    unsigned char *data = NULL;
    int code = read_all(fd, size, FILES_ASSET_BYTES_MAX, &data, &bytes);
    close(fd);
    if (code == 0 && gnutls_hash_fast(GNUTLS_DIG_SHA256, data, bytes, result->sha256) < 0)
        code = EIO;
    if (code != 0) {
        free(data);
        return error_fault(err, code == ENOMEM ? STATUS_OUT_OF_MEMORY : STATUS_BAD_ASSET, pointer,
                           "%s: %s", name, strerror(code));
    }
    result->data = result->handle = data;
    result->size = bytes;
    return STATUS_OK;
}

static void assets_close(void *user, struct asset_bytes *bytes) {
    (void)user;
    free(bytes->handle);
    *bytes = (struct asset_bytes){0};
}

struct asset_source file_assets_source(struct file_assets *assets) {
    return (struct asset_source){.open = assets_open, .close = assets_close, .user = assets};
}
