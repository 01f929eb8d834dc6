/* A context by OSMesa: llvmpipe drawing into memory, without EGL, devices or a display.
 *
 * Kept beside EGL because it needs nothing of the machine but the library itself; it runs where a
 * container hides /dev/dri and the EGL vendor files. Newer Mesa has dropped it, hence the opening
 * at run time, and hence the few declarations below in place of <GL/osmesa.h>, whose package is
 * gone with it. They are the interface of Mesa 11.2 and later (OSMesaCreateContextAttribs).
 *
 * OSMesa insists on a colour buffer of the caller's. Pelt draws into framebuffer objects only, so
 * it gets one pixel. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

#include "renderer/gl/driver.h"

enum {
    OSMESA_RGBA = 0x1908,
    OSMESA_UNSIGNED_BYTE = 0x1401,
    OSMESA_FORMAT = 0x22,
    OSMESA_DEPTH_BITS = 0x30,
    OSMESA_STENCIL_BITS = 0x31,
    OSMESA_ACCUM_BITS = 0x32,
    OSMESA_PROFILE = 0x33,
    OSMESA_CORE_PROFILE = 0x34,
    OSMESA_CONTEXT_MAJOR_VERSION = 0x36,
    OSMESA_CONTEXT_MINOR_VERSION = 0x37
};

struct osmesa {
    void *library, *context;
    void *(*create_context_attribs)(const int *attributes, void *share);
    void (*destroy_context)(void *context);
    unsigned char (*make_current)(void *context, void *buffer, unsigned type, int width,
                                  int height);
    gl_function (*get_proc_address)(const char *name);
    unsigned char pixel[4];
};

static void osmesa_close(void *state) {
    struct osmesa *osmesa = state;
    if (osmesa->context) {
        osmesa->make_current(NULL, NULL, 0, 0, 0);
        osmesa->destroy_context(osmesa->context);
    }
    dlclose(osmesa->library); /* its destructor ends llvmpipe's threads; nothing else does */
    free(osmesa);
}

static gl_function osmesa_find(void *state, const char *name) {
    const struct osmesa *osmesa = state;
    return osmesa->get_proc_address(name);
}

static enum status osmesa_open(const struct gl_options *options, void **state, char device[128],
                               struct error *err) {
    if (options->device >= 0)
        return error_fault(err, STATUS_NO_GL, NULL,
                           "OSMesa has no devices to choose from: leave --device %d out, or use "
                           "--backend egl",
                           options->device);
    if (options->require_hardware)
        return error_fault(err, STATUS_NO_GL, NULL,
                           "OSMesa draws in software only, and hardware is required");
    const char *name = gl_library_name("PELT_OSMESA_LIBRARY", GL_OSMESA_LIBRARY);
    void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        return error_fault(err, STATUS_NO_GL, NULL,
                           "OSMesa: the library %s cannot be opened (%s). Debian's package "
                           "libosmesa6 holds it",
                           name, dlerror());
    struct osmesa *osmesa = calloc(1, sizeof *osmesa);
    if (!osmesa) {
        dlclose(library);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "OSMesa: memory ran out");
    }
    osmesa->library = library;

    /* POSIX allows a function's address to come as an object pointer; ISO C does not let one be
     * cast to the other, so it is stored through the pointer's representation. */
    *(void **)&osmesa->create_context_attribs = dlsym(library, "OSMesaCreateContextAttribs");
    *(void **)&osmesa->destroy_context = dlsym(library, "OSMesaDestroyContext");
    *(void **)&osmesa->make_current = dlsym(library, "OSMesaMakeCurrent");
    *(void **)&osmesa->get_proc_address = dlsym(library, "OSMesaGetProcAddress");
    if (!osmesa->create_context_attribs || !osmesa->destroy_context || !osmesa->make_current ||
        !osmesa->get_proc_address) {
        osmesa_close(osmesa);
        return error_fault(err, STATUS_NO_GL, NULL,
                           "OSMesa: %s lacks OSMesaCreateContextAttribs; Mesa 11.2 or later has it "
                           "(Debian's package libosmesa6)",
                           name);
    }

    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              0,
                              OSMESA_STENCIL_BITS,
                              0,
                              OSMESA_ACCUM_BITS,
                              0,
                              OSMESA_PROFILE,
                              OSMESA_CORE_PROFILE,
                              OSMESA_CONTEXT_MAJOR_VERSION,
                              4,
                              OSMESA_CONTEXT_MINOR_VERSION,
                              5,
                              0,
                              0};
    osmesa->context = osmesa->create_context_attribs(attributes, NULL);
    if (!osmesa->context) {
        osmesa_close(osmesa);
        return error_fault(
            err, STATUS_NO_GL, NULL,
            "OSMesa: no core 4.5 context can be made; Mesa 20.0 or later with LLVM is "
            "needed (Debian's package libosmesa6)");
    }
    if (!osmesa->make_current(osmesa->context, osmesa->pixel, OSMESA_UNSIGNED_BYTE, 1, 1)) {
        osmesa_close(osmesa);
        return error_fault(err, STATUS_NO_GL, NULL, "OSMesa: the context cannot be made current");
    }
    snprintf(device, 128, "memory");
    *state = osmesa;
    return STATUS_OK;
}

const struct gl_driver gl_driver_osmesa = {"osmesa", osmesa_open, osmesa_find, osmesa_close};
