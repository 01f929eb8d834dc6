/* Opening libEGL, finding its functions, and listing its devices.
 *
 * Sources: EGL 1.5; EGL_EXT_device_base, _enumeration, _query, _drm; EGL_EXT_platform_base;
 * EGL_MESA_device_software, by which a software device says that it is one. */
#include "renderer/gl/egl_library.h"

#include <dlfcn.h>
#include <stdio.h>
#include <string.h>

#include "renderer/gl/driver.h"

/* Whole words only: "EGL_EXT_device_drm" is not in "EGL_EXT_device_drm_render_node". */
bool egl_has_word(const char *list, const char *word) {
    size_t length = strlen(word);
    for (const char *at = list; at && (at = strstr(at, word)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || at[length] == 0))
            return true;
    return false;
}

const char *egl_error_name(EGLint code) {
    switch (code) {
    case EGL_SUCCESS:
        return "no error given";
    case EGL_NOT_INITIALIZED:
        return "EGL_NOT_INITIALIZED";
    case EGL_BAD_ACCESS:
        return "EGL_BAD_ACCESS";
    case EGL_BAD_ALLOC:
        return "EGL_BAD_ALLOC";
    case EGL_BAD_ATTRIBUTE:
        return "EGL_BAD_ATTRIBUTE";
    case EGL_BAD_CONFIG:
        return "EGL_BAD_CONFIG";
    case EGL_BAD_CONTEXT:
        return "EGL_BAD_CONTEXT";
    case EGL_BAD_DISPLAY:
        return "EGL_BAD_DISPLAY";
    case EGL_BAD_MATCH:
        return "EGL_BAD_MATCH";
    case EGL_BAD_PARAMETER:
        return "EGL_BAD_PARAMETER";
    case EGL_CONTEXT_LOST:
        return "EGL_CONTEXT_LOST";
    default:
        return "an unknown EGL error";
    }
}

static void describe_device(const struct egl_library *egl, struct egl_device *device) {
    const char *extensions = NULL, *node = NULL;
    if (egl->query_device_string) {
        extensions = egl->query_device_string(device->handle, EGL_EXTENSIONS);
        if (egl_has_word(extensions, "EGL_EXT_device_drm"))
            node = egl->query_device_string(device->handle, EGL_DRM_DEVICE_FILE_EXT);
    }
    device->software = egl_has_word(extensions, "EGL_MESA_device_software");
    snprintf(device->name, sizeof device->name, "device %d (%s)", device->index,
             device->software ? "software"
             : node           ? node
                              : "no device node");
}

int egl_library_devices(const struct egl_library *egl, struct egl_device devices[EGL_DEVICES_MAX]) {
    EGLDeviceEXT handles[EGL_DEVICES_MAX];
    EGLint count = 0;
    if (!egl->query_devices || !egl->query_devices(EGL_DEVICES_MAX, handles, &count))
        return 0;
    for (int i = 0; i < count; i++) {
        devices[i] = (struct egl_device){.handle = handles[i], .index = i};
        describe_device(egl, &devices[i]);
    }
    return count;
}

static bool load_functions(struct egl_library *egl) {
    *(void **)&egl->get_proc_address = dlsym(egl->handle, "eglGetProcAddress");
    *(void **)&egl->query_string = dlsym(egl->handle, "eglQueryString");
    *(void **)&egl->get_error = dlsym(egl->handle, "eglGetError");
    *(void **)&egl->initialize = dlsym(egl->handle, "eglInitialize");
    *(void **)&egl->terminate = dlsym(egl->handle, "eglTerminate");
    *(void **)&egl->bind_api = dlsym(egl->handle, "eglBindAPI");
    *(void **)&egl->create_context = dlsym(egl->handle, "eglCreateContext");
    *(void **)&egl->destroy_context = dlsym(egl->handle, "eglDestroyContext");
    *(void **)&egl->make_current = dlsym(egl->handle, "eglMakeCurrent");
    *(void **)&egl->release_thread = dlsym(egl->handle, "eglReleaseThread");
    return egl->get_proc_address && egl->query_string && egl->get_error && egl->initialize &&
           egl->terminate && egl->bind_api && egl->create_context && egl->destroy_context &&
           egl->make_current && egl->release_thread;
}

enum status egl_library_open(struct egl_library *egl, struct error *err) {
    *egl = (struct egl_library){.name = gl_library_name("PELT_EGL_LIBRARY", "libEGL.so.1")};
    egl->handle = dlopen(egl->name, RTLD_NOW | RTLD_LOCAL);
    if (!egl->handle)
        return error_fault(err, STATUS_NO_GL, NULL,
                           "EGL: the library %s cannot be opened (%s). Debian's package libegl1 "
                           "holds it; libegl-mesa0 and libgl1-mesa-dri hold the driver behind it",
                           egl->name, dlerror());
    if (!load_functions(egl)) {
        egl_library_close(egl);
        return error_fault(err, STATUS_NO_GL, NULL,
                           "EGL: %s is no EGL library; Debian's package libegl1 holds one",
                           egl->name);
    }
    egl->client = egl->query_string(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (egl_has_word(egl->client, "EGL_EXT_platform_base"))
        egl->get_platform_display =
            (PFNEGLGETPLATFORMDISPLAYEXTPROC)egl->get_proc_address("eglGetPlatformDisplayEXT");
    bool base = egl_has_word(egl->client, "EGL_EXT_device_base");
    if (base || egl_has_word(egl->client, "EGL_EXT_device_enumeration"))
        egl->query_devices = (PFNEGLQUERYDEVICESEXTPROC)egl->get_proc_address("eglQueryDevicesEXT");
    if (base || egl_has_word(egl->client, "EGL_EXT_device_query"))
        egl->query_device_string =
            (PFNEGLQUERYDEVICESTRINGEXTPROC)egl->get_proc_address("eglQueryDeviceStringEXT");
    return STATUS_OK;
}

void egl_library_close(struct egl_library *egl) {
    dlclose(egl->handle);
    egl->handle = NULL;
}
