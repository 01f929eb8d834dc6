/* Memory that runs out where a test wants it to: malloc() and its kin, interposed. Included by a
 * test program's one file. A sanitizer's own allocator does not allow it: INTERPOSED is 0 there. */
#ifndef PELT_TESTS_UNIT_FAILING_MALLOC_H
#define PELT_TESTS_UNIT_FAILING_MALLOC_H

#include <stddef.h>

#if defined(__SANITIZE_ADDRESS__)
#define INTERPOSED 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define INTERPOSED 0
#endif
#endif
#ifndef INTERPOSED
#define INTERPOSED 1
#endif

/* The program's own state, on purpose: malloc() has no argument to carry it. */
static long fail_at = -1; /* allocations until the one that fails; -1: none does */
static size_t fail_from;  /* bytes: smaller ones neither fail nor count */
static long live;         /* allocated and not freed */

#if INTERPOSED
#define EXPORTED __attribute__((visibility("default")))
void *__libc_malloc(size_t bytes);
void *__libc_calloc(size_t count, size_t bytes);
void *__libc_realloc(void *old, size_t bytes);
void __libc_free(void *data);

static int fails(size_t bytes) {
    return bytes >= fail_from && fail_at >= 0 && fail_at-- == 0;
}

EXPORTED void *malloc(size_t bytes) {
    void *data = fails(bytes) ? NULL : __libc_malloc(bytes);
    live += data != NULL;
    return data;
}

EXPORTED void *calloc(size_t count, size_t bytes) {
    void *data = fails(count * bytes) ? NULL : __libc_calloc(count, bytes);
    live += data != NULL;
    return data;
}

EXPORTED void *realloc(void *old, size_t bytes) {
    void *data = fails(bytes) ? NULL : __libc_realloc(old, bytes);
    live += data != NULL && !old;
    return data;
}

EXPORTED void free(void *data) {
    live -= data != NULL;
    __libc_free(data);
}
#endif

#endif
