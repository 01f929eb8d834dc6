/* What benches of scenes share: scenes from files, processor time, lists of figures. */
#ifndef PELT_TESTS_BENCH_SUPPORT_H
#define PELT_TESTS_BENCH_SUPPORT_H

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "api/scene.h"
#include "tests/unit/asset_files.h"

/* Of all threads of this process. */
static inline double bench_processor_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

/* Tells on stderr, and clears `err`; false, so that it can be returned. */
static inline bool bench_failed(const char *bench, const char *what, struct error *err) {
    fprintf(stderr, "%s: %s: %s\n", bench, what,
            err->fault_count ? err->faults[0].message : status_title(err->status));
    error_clear(err);
    return false;
}

/* A scene file, whose assets are relative to the current folder; `arena` owns what it holds. */
static inline enum status bench_read_scene(const char *path, struct arena *arena,
                                           struct scene *scene, struct error *err) {
    enum { SCENE_BYTES = 1 << 16 };
    char *json = malloc(SCENE_BYTES);
    FILE *file = json ? fopen(path, "rb") : NULL;
    size_t length = file ? fread(json, 1, SCENE_BYTES, file) : 0;
    enum status status =
        file ? scene_read(json, length, arena, scene, err)
             : error_fault(err, STATUS_ASSET_NOT_FOUND, NULL, "%s cannot be read", path);
    if (file)
        fclose(file);
    free(json);
    return status;
}

static inline void bench_print_list(const char *name, const double *values, int count) {
    printf("\"%s\": [", name);
    for (int n = 0; n < count; n++)
        printf("%s%.2f", n ? ", " : "", values[n]);
    printf("], ");
}

#endif
