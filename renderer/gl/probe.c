/* Looking at a backend without wanting to draw with it. */
#include "renderer/gl/probe.h"

#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

#include "renderer/gl/clock.h"
#include "renderer/gl/driver.h"
#include "renderer/gl/egl_library.h"

static void look_at_egl(struct gl_probe *probe) {
    struct egl_library egl;
    enum status status = egl_library_open(&egl, NULL);
    snprintf(probe->library, sizeof probe->library, "%s", egl.name);
    if (status != STATUS_OK)
        return;
    probe->library_opened = true;
    /* Only a display has a version before EGL 1.5; the library's own is asked of no display. */
    const char *version = egl.query_string(EGL_NO_DISPLAY, EGL_VERSION);
    snprintf(probe->library_version, sizeof probe->library_version, "%s", version ? version : "");
    struct egl_device devices[EGL_DEVICES_MAX];
    int count = egl_library_devices(&egl, devices);
    for (int i = 0; i < count && i < GL_PROBE_DEVICES_MAX; i++) {
        struct gl_probe_device *device = &probe->devices[probe->device_count++];
        memcpy(device->name, devices[i].name, sizeof device->name);
        device->software = devices[i].software;
    }
    egl_library_close(&egl);
}

static void look_at_osmesa(struct gl_probe *probe) {
    const char *name = gl_library_name("PELT_OSMESA_LIBRARY", GL_OSMESA_LIBRARY);
    snprintf(probe->library, sizeof probe->library, "%s", name);
    void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    probe->library_opened = library != NULL;
    if (library)
        dlclose(library);
}

void gl_probe_backend(enum gl_backend backend, struct gl_probe *probe) {
    *probe = (struct gl_probe){0};
    if (backend == GL_BACKEND_EGL)
        look_at_egl(probe);
    else
        look_at_osmesa(probe);

    const struct gl_options options = {backend, -1, false};
    struct gl_context *context;
    struct error err = {0};
    double start_ms = clock_now_ms();
    enum status status = gl_context_create(&options, &context, &err);
    probe->open_ms = clock_now_ms() - start_ms;
    probe->usable = status == STATUS_OK;
    if (probe->usable)
        probe->info = *gl_context_info(context);
    else
        snprintf(probe->why, sizeof probe->why, "%s",
                 err.fault_count && err.faults[0].message ? err.faults[0].message
                                                          : status_title(status));
    gl_context_destroy(context);
    error_clear(&err);
}
