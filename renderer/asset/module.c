/* Opening Pelt's own modules on first use.
 *
 * Why: OpenImageIO alone brings 261 shared libraries and 0.4 s, and most scenes read no image. The
 * program therefore links neither it nor tinygltf; each sits behind a small shared object that
 * exports one table of functions.
 *
 * There is no list of open handles here: the dynamic loader keeps one already, and RTLD_NOLOAD asks
 * it. So this file holds no state, a second open is a look-up, and a module stays open until the
 * process ends (RTLD_NODELETE: OpenImageIO and its plugins do not survive being unloaded). */
#include "renderer/asset/module.h"

#include <dlfcn.h>
#include <limits.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const struct module_spec table[MODULE_COUNT] = {
    [MODULE_MESH_GLTF] = {"mesh_gltf.so", "pelt_mesh_module", "tinygltf", "libtinygltf2d"},
    [MODULE_IMAGE_OIIO] = {"image_oiio.so", "pelt_image_module", "OpenImageIO",
                           "libopenimageio2.4"},
};

enum { CANDIDATES_MAX = 3 };

struct candidates {
    int count;
    char path[CANDIDATES_MAX][PATH_MAX];
};

static void __attribute__((format(printf, 2, 3)))
candidates_add(struct candidates *candidates, const char *format, ...) {
    char *path = candidates->path[candidates->count];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(path, PATH_MAX, format, args);
    va_end(args);
    if (length > 0 && length < PATH_MAX)
        candidates->count++;
}

/* Where the module may lie, best first. PELT_LIBDIR, where set, is the only place: whoever sets it
 * wants that module or a failure. */
static void candidates_list(const char *file, struct candidates *candidates) {
    candidates->count = 0;
    const char *chosen = secure_getenv("PELT_LIBDIR");
    if (chosen && *chosen) {
        candidates_add(candidates, "%s/%s", chosen, file);
        return;
    }
    char program[PATH_MAX];
    ssize_t length = readlink("/proc/self/exe", program, sizeof program - 1);
    if (length > 0) {
        program[length] = 0;
        char *slash = strrchr(program, '/');
        if (slash) {
            *slash = 0;
            candidates_add(candidates, "%s/lib/pelt/%s", program, file);
            candidates_add(candidates, "%s/../lib/pelt/%s", program, file);
        }
    }
    candidates_add(candidates, "%s/%s", PELT_LIBDIR, file);
}

/* The handle of a module that this process has opened before, else NULL. The reference this takes
 * is given back at once: RTLD_NODELETE keeps the module. */
static void *handle_if_open(const struct candidates *candidates) {
    for (int i = 0; i < candidates->count; i++) {
        void *handle = dlopen(candidates->path[i], RTLD_NOW | RTLD_NOLOAD);
        if (handle) {
            dlclose(handle);
            return handle;
        }
    }
    return NULL;
}

const void *module_open_spec(const struct module_spec *spec, struct error *err) {
    struct candidates candidates;
    candidates_list(spec->file, &candidates);
    void *handle = handle_if_open(&candidates);
    for (int i = 0; !handle && i < candidates.count; i++) {
        if (access(candidates.path[i], F_OK) != 0)
            continue;
        handle = dlopen(candidates.path[i], RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
        if (!handle) {
            /* Present, but it does not load: a later candidate would only hide why. */
            const char *why = dlerror();
            error_fault(err, STATUS_IO_ERROR, NULL,
                        "the %s module does not load (%s); is the package %s installed?",
                        spec->name, why ? why : "unknown error", spec->package);
            return NULL;
        }
    }
    if (!handle) {
        error_fault(
            err, STATUS_IO_ERROR, NULL,
            "the %s module was not found (last looked for %s); it is part of Pelt and needs "
            "the package %s",
            spec->name, candidates.count ? candidates.path[candidates.count - 1] : spec->file,
            spec->package);
        return NULL;
    }
    const void *functions = dlsym(handle, spec->symbol);
    if (!functions)
        error_fault(err, STATUS_IO_ERROR, NULL,
                    "the %s module lacks the symbol %s: it is not of "
                    "this version of Pelt",
                    spec->name, spec->symbol);
    return functions;
}

const void *module_open(enum module module, struct error *err) {
    return module_open_spec(&table[module], err);
}

const struct module_spec *module_describe(enum module module) {
    return &table[module];
}

size_t module_loaded(const char *names[MODULE_COUNT]) {
    size_t count = 0;
    for (int i = 0; i < MODULE_COUNT; i++) {
        struct candidates candidates;
        candidates_list(table[i].file, &candidates);
        if (handle_if_open(&candidates))
            names[count++] = table[i].name;
    }
    return count;
}
