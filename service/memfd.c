/* Sealed memory files (memfd_create(2), fcntl(2) F_ADD_SEALS). */
#include "service/memfd.h"

#include <errno.h>
#include <fcntl.h>
#include <stdint.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { SEALS = F_SEAL_SEAL | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_WRITE };

int memfd_open(const char *name) {
    return memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING);
}

enum status memfd_write(int fd, const void *data, size_t bytes, struct error *err) {
    const unsigned char *at = data;
    while (bytes > 0) {
        ssize_t n = write(fd, at, bytes);
        if (n < 0 && errno == EINTR)
            continue;
        if (n < 0 && (errno == ENOSPC || errno == ENOMEM))
            return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %zu bytes", bytes);
        if (n <= 0)
            return error_fault(err, STATUS_IO_ERROR, NULL, "writing to a memory file: %s",
                               strerror(errno));
        at += n;
        bytes -= (size_t)n;
    }
    return STATUS_OK;
}

enum status memfd_seal(int fd, struct error *err) {
    if (fcntl(fd, F_ADD_SEALS, SEALS) != 0)
        return error_fault(err, STATUS_IO_ERROR, NULL, "sealing a memory file: %s",
                           strerror(errno));
    return STATUS_OK;
}

bool memfd_is_sealed(int fd, size_t bytes) {
    struct stat info;
    return fcntl(fd, F_GET_SEALS) == SEALS && fstat(fd, &info) == 0 && info.st_size >= 0 &&
           (uintmax_t)info.st_size == bytes;
}

enum status memfd_seal_growing(int fd, struct error *err) {
    if (fcntl(fd, F_ADD_SEALS, F_SEAL_SHRINK) != 0)
        return error_fault(err, STATUS_IO_ERROR, NULL, "sealing a memory file: %s",
                           strerror(errno));
    return STATUS_OK;
}

bool memfd_holds(int fd, size_t bytes) {
    struct stat info;
    int seals = fcntl(fd, F_GET_SEALS);
    return seals >= 0 && (seals & F_SEAL_SHRINK) && fstat(fd, &info) == 0 && info.st_size >= 0 &&
           (uintmax_t)info.st_size >= bytes;
}

enum status memfd_map(int fd, size_t bytes, const void **data, struct error *err) {
    *data = NULL;
    if (bytes == 0)
        return STATUS_OK;
    void *map = mmap(NULL, bytes, PROT_READ, MAP_SHARED, fd, 0);
    if (map == MAP_FAILED)
        return error_fault(err, errno == ENOMEM ? STATUS_OUT_OF_MEMORY : STATUS_IO_ERROR, NULL,
                           "mapping %zu bytes: %s", bytes, strerror(errno));
    *data = map;
    return STATUS_OK;
}

void memfd_unmap(const void *data, size_t bytes) {
    /* munmap takes a plain pointer though it changes nothing behind it. */
    if (data)
        munmap((void *)(uintptr_t)data, bytes);
}
