/* The --assets folder. Paths are resolved by openat2(2) with RESOLVE_BENEATH, so the kernel refuses
 * whatever would leave the folder, races included; the check of the name before it is for the
 * message.
 *
 * A cached copy is used while device, inode, size, mtime and ctime are as they were when it was
 * made. The least recently used copies make room. */
#include "service/store.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/openat2.h>
#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "service/files.h"
#include "service/memfd.h"

enum { COPY_BYTES = 64 * 1024 };

struct file_identity {
    dev_t device;
    ino_t inode;
    off_t size;
    struct timespec mtime, ctime;
};

struct copy {
    bool used;
    struct file_identity identity;
    int fd;
    size_t bytes;
    unsigned char sha256[DIGEST_BYTES];
    uint64_t last_use;
};

struct store {
    int folder; /* -1: none */
    /* Guards the copies. Not held while a file is read: two requests that miss at once read it
     * twice, and the second copy replaces the first. */
    pthread_mutex_t lock;
    struct copy copies[STORE_FILES_MAX];
    uint64_t uses;
    size_t bytes;
};

enum status store_create(const char *folder, struct store **out, struct error *err) {
    *out = NULL;
    struct store *store = calloc(1, sizeof *store);
    if (!store || pthread_mutex_init(&store->lock, NULL) != 0) {
        free(store);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the asset store");
    }
    store->folder = -1;
    if (folder) {
        store->folder = open(folder, O_PATH | O_DIRECTORY | O_CLOEXEC);
        if (store->folder < 0) {
            error_fault(err, STATUS_IO_ERROR, NULL, "--assets %s: %s", folder, strerror(errno));
            store_destroy(store);
            return STATUS_IO_ERROR;
        }
    }
    *out = store;
    return STATUS_OK;
}

static void drop(struct store *store, struct copy *copy) {
    close(copy->fd);
    store->bytes -= copy->bytes;
    *copy = (struct copy){0};
}

void store_destroy(struct store *store) {
    if (!store)
        return;
    for (int i = 0; i < STORE_FILES_MAX; i++)
        if (store->copies[i].used)
            drop(store, &store->copies[i]);
    if (store->folder >= 0)
        close(store->folder);
    pthread_mutex_destroy(&store->lock);
    free(store);
}

static bool same(const struct file_identity *a, const struct file_identity *b) {
    return a->device == b->device && a->inode == b->inode && a->size == b->size &&
           a->mtime.tv_sec == b->mtime.tv_sec && a->mtime.tv_nsec == b->mtime.tv_nsec &&
           a->ctime.tv_sec == b->ctime.tv_sec && a->ctime.tv_nsec == b->ctime.tv_nsec;
}

static enum status give(const struct copy *copy, struct job_asset *asset, struct error *err) {
    asset->fd = fcntl(copy->fd, F_DUPFD_CLOEXEC, 0);
    if (asset->fd < 0)
        return error_fault(err, STATUS_IO_ERROR, NULL, "no descriptor left: %s", strerror(errno));
    asset->bytes = copy->bytes;
    memcpy(asset->sha256, copy->sha256, DIGEST_BYTES);
    return STATUS_OK;
}

/* Keeps a copy; takes copy->fd over. With the lock held. */
static void keep(struct store *store, const struct copy *copy) {
    struct copy *place = NULL;
    for (;;) {
        struct copy *oldest = NULL;
        place = NULL;
        for (int i = 0; i < STORE_FILES_MAX; i++) {
            struct copy *at = &store->copies[i];
            if (at->used && same(&at->identity, &copy->identity))
                drop(store, at);
            if (!at->used)
                place = at;
            else if (!oldest || at->last_use < oldest->last_use)
                oldest = at;
        }
        if (!oldest || (place && store->bytes + copy->bytes <= STORE_BYTES_MAX))
            break;
        drop(store, oldest);
    }
    *place = *copy;
    place->used = true;
    place->last_use = ++store->uses;
    store->bytes += copy->bytes;
}

static int open_beneath(int folder, const char *name) {
    struct open_how how = {.flags = O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY,
                           .resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS};
    long fd;
    do /* EAGAIN: something was renamed while the kernel looked */
        fd = syscall(SYS_openat2, folder, name, &how, sizeof how);
    while (fd < 0 && (errno == EINTR || errno == EAGAIN));
    return (int)fd;
}

/* The whole file into a sealed memory file, hashed on the way. */
static enum status copy_file(int file, const char *name, const char *pointer, struct copy *copy,
                             struct error *err) {
    struct digest digest = {0};
    char *buffer = malloc(COPY_BYTES);
    enum status status = STATUS_OK;
    copy->fd = memfd_open("pelt-asset");
    if (!buffer || copy->fd < 0 || digest_start(&digest) != 0)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for an asset");
    while (status == STATUS_OK) {
        ssize_t got = read(file, buffer, COPY_BYTES);
        if (got < 0 && errno == EINTR)
            continue;
        if (got < 0)
            status = error_fault(err, STATUS_IO_ERROR, pointer, "reading \"%s\": %s", name,
                                 strerror(errno));
        if (got <= 0)
            break;
        copy->bytes += (size_t)got;
        if (copy->bytes > STORE_FILE_BYTES_MAX) /* it grew */
            status = error_fault(err, STATUS_BAD_ASSET, pointer, "\"%s\" is larger than %d bytes",
                                 name, STORE_FILE_BYTES_MAX);
        else if (digest_add(&digest, buffer, (size_t)got) != 0)
            status = error_fault(err, STATUS_INTERNAL, NULL, "hashing failed");
        else
            status = memfd_write(copy->fd, buffer, (size_t)got, err);
    }
    if (status == STATUS_OK)
        status = memfd_seal(copy->fd, err);
    if (status == STATUS_OK)
        digest_finish(&digest, copy->sha256);
    digest_abandon(&digest);
    free(buffer);
    if (status != STATUS_OK && copy->fd >= 0)
        close(copy->fd);
    return status;
}

static enum status open_file(struct store *store, const char *name, const char *pointer, int *file,
                             struct file_identity *identity, struct error *err) {
    struct stat info;
    *file = open_beneath(store->folder, name);
    if (*file < 0 && (errno == ENOENT || errno == ENOTDIR || errno == ENAMETOOLONG))
        return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "there is no asset named \"%s\"",
                           name);
    if (*file < 0 && (errno == EXDEV || errno == ELOOP))
        return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer,
                           "\"%s\" leads out of the assets folder", name);
    if (*file < 0)
        return error_fault(err, errno == EACCES ? STATUS_BAD_ASSET : STATUS_IO_ERROR, pointer,
                           "\"%s\": %s", name, strerror(errno));
    if (fstat(*file, &info) != 0 || !S_ISREG(info.st_mode)) {
        close(*file);
        return error_fault(err, STATUS_BAD_ASSET, pointer, "\"%s\" is not a regular file", name);
    }
    if (info.st_size > STORE_FILE_BYTES_MAX) {
        close(*file);
        return error_fault(err, STATUS_BAD_ASSET, pointer, "\"%s\" is larger than %d bytes", name,
                           STORE_FILE_BYTES_MAX);
    }
    *identity =
        (struct file_identity){info.st_dev, info.st_ino, info.st_size, info.st_mtim, info.st_ctim};
    return STATUS_OK;
}

enum status store_open(struct store *store, const char *name, const char *pointer,
                       struct job_asset *asset, struct error *err) {
    if (!files_asset_name_ok(name))
        return error_fault(err, STATUS_INVALID_SCENE, pointer,
                           "\"%s\" is not the name of an asset: a relative path without \"..\"",
                           name);
    if (store->folder < 0 || strlen(name) >= sizeof asset->name)
        return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "there is no asset named \"%s\"",
                           name);
    int file;
    struct copy fresh = {.fd = -1};
    enum status status = open_file(store, name, pointer, &file, &fresh.identity, err);
    if (status != STATUS_OK)
        return status;
    memcpy(asset->name, name, strlen(name) + 1);
    bool found = false;
    pthread_mutex_lock(&store->lock);
    for (int i = 0; i < STORE_FILES_MAX && !found; i++) {
        struct copy *copy = &store->copies[i];
        found = copy->used && same(&copy->identity, &fresh.identity);
        if (found) {
            copy->last_use = ++store->uses;
            status = give(copy, asset, err);
        }
    }
    pthread_mutex_unlock(&store->lock);
    if (!found)
        status = copy_file(file, name, pointer, &fresh, err);
    close(file);
    if (found || status != STATUS_OK)
        return status;
    status = give(&fresh, asset, err);
    pthread_mutex_lock(&store->lock);
    keep(store, &fresh);
    pthread_mutex_unlock(&store->lock);
    return status;
}

size_t store_bytes(struct store *store) {
    pthread_mutex_lock(&store->lock);
    size_t bytes = store->bytes;
    pthread_mutex_unlock(&store->lock);
    return bytes;
}
