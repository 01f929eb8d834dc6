/* A context by EGL without a screen: every device that EGL_EXT_device_enumeration names, hardware
 * first, then EGL_MESA_platform_surfaceless.
 *
 * Sources: EGL 1.5; EGL_EXT_device_base, _enumeration, _query, _drm; EGL_EXT_platform_device;
 * EGL_MESA_platform_surfaceless; EGL_MESA_device_software; EGL_KHR_no_config_context;
 * EGL_KHR_surfaceless_context.
 *
 * A context is made without a config and made current without a surface: Pelt draws into
 * framebuffer objects only. Displays that lack either extension are passed over with that reason;
 * pbuffers as a way round it are left out, since every driver with GL 4.5 has both. */
#define EGL_NO_X11 /* no window system: the headers of X are not needed */
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/driver.h"

enum { DEVICES_MAX = 64 };

struct egl {
    void *library;
    EGLDisplay display;
    EGLContext context;
    PFNEGLGETPROCADDRESSPROC get_proc_address;
    PFNEGLQUERYSTRINGPROC query_string;
    PFNEGLGETERRORPROC get_error;
    PFNEGLINITIALIZEPROC initialize;
    PFNEGLTERMINATEPROC terminate;
    PFNEGLBINDAPIPROC bind_api;
    PFNEGLCREATECONTEXTPROC create_context;
    PFNEGLDESTROYCONTEXTPROC destroy_context;
    PFNEGLMAKECURRENTPROC make_current;
    PFNEGLRELEASETHREADPROC release_thread;
    PFNEGLGETPLATFORMDISPLAYEXTPROC
    get_platform_display;                               /* NULL: EGL_EXT_platform_base is absent */
    PFNEGLQUERYDEVICESEXTPROC query_devices;            /* NULL: cannot enumerate */
    PFNEGLQUERYDEVICESTRINGEXTPROC query_device_string; /* NULL: cannot ask a device its name */
};

/* Why each way was passed over, for the one message that the caller sees. */
struct reasons {
    char text[640];
    size_t used;
};

__attribute__((format(printf, 2, 3))) static void reasons_add(struct reasons *reasons,
                                                              const char *format, ...) {
    va_list args;
    va_start(args, format);
    if (reasons->used && reasons->used + 2 < sizeof reasons->text) {
        strcpy(reasons->text + reasons->used, "; ");
        reasons->used += 2;
    }
    int length = vsnprintf(reasons->text + reasons->used, sizeof reasons->text - reasons->used,
                           format, args);
    va_end(args);
    if (length > 0)
        reasons->used += (size_t)length;
    if (reasons->used >= sizeof reasons->text)
        reasons->used = sizeof reasons->text - 1;
}

/* Whole words only: "EGL_EXT_device_drm" is not in "EGL_EXT_device_drm_render_node". */
static bool has_word(const char *list, const char *word) {
    size_t length = strlen(word);
    for (const char *at = list; at && (at = strstr(at, word)); at += length)
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || at[length] == 0))
            return true;
    return false;
}

static const char *error_name(EGLint code) {
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

static void close_display(struct egl *egl) {
    if (egl->context != EGL_NO_CONTEXT) {
        egl->make_current(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        egl->destroy_context(egl->display, egl->context);
        egl->context = EGL_NO_CONTEXT;
    }
    if (egl->display != EGL_NO_DISPLAY) {
        egl->terminate(egl->display);
        egl->display = EGL_NO_DISPLAY;
    }
}

static void egl_close(void *state) {
    struct egl *egl = state;
    close_display(egl);
    egl->release_thread(); /* what EGL keeps for this thread would outlive the library otherwise */
    dlclose(egl->library);
    free(egl);
}

static gl_function egl_find(void *state, const char *name) {
    const struct egl *egl = state;
    return egl->get_proc_address(name);
}

/* Fills in egl->display and egl->context, current on this thread, or says why not. */
static bool try_display(struct egl *egl, EGLDisplay display, const char *what,
                        struct reasons *reasons) {
    if (display == EGL_NO_DISPLAY) {
        reasons_add(reasons, "%s: no display (%s)", what, error_name(egl->get_error()));
        return false;
    }
    if (!egl->initialize(display, NULL, NULL)) {
        reasons_add(reasons, "%s: its driver does not start (%s)", what,
                    error_name(egl->get_error()));
        return false;
    }
    egl->display = display;
    static const char *const needed[] = {"EGL_KHR_surfaceless_context", "EGL_KHR_create_context"};
    const char *extensions = egl->query_string(display, EGL_EXTENSIONS);
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
        if (!has_word(extensions, needed[i])) {
            reasons_add(reasons, "%s: lacks %s", what, needed[i]);
            goto fail;
        }
    if (!has_word(extensions, "EGL_KHR_no_config_context") &&
        !has_word(extensions, "EGL_MESA_configless_context")) {
        reasons_add(reasons, "%s: lacks EGL_KHR_no_config_context", what);
        goto fail;
    }
    if (!egl->bind_api(EGL_OPENGL_API)) {
        reasons_add(reasons, "%s: has no desktop OpenGL", what);
        goto fail;
    }
    const EGLint attributes[] = {EGL_CONTEXT_MAJOR_VERSION_KHR,
                                 4,
                                 EGL_CONTEXT_MINOR_VERSION_KHR,
                                 5,
                                 EGL_CONTEXT_OPENGL_PROFILE_MASK_KHR,
                                 EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT_KHR,
                                 EGL_CONTEXT_FLAGS_KHR,
                                 gl_debug_wanted() ? EGL_CONTEXT_OPENGL_DEBUG_BIT_KHR : 0,
                                 EGL_NONE};
    egl->context = egl->create_context(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (egl->context == EGL_NO_CONTEXT) {
        reasons_add(reasons, "%s: makes no core 4.5 context (%s)", what,
                    error_name(egl->get_error()));
        goto fail;
    }
    if (!egl->make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl->context)) {
        reasons_add(reasons, "%s: its context cannot be made current (%s)", what,
                    error_name(egl->get_error()));
        goto fail;
    }
    return true;
fail:
    close_display(egl);
    return false;
}

struct device {
    EGLDeviceEXT handle;
    int index;
    bool software;
    char name[96]; /* "device 0 (/dev/dri/card0)" */
};

static void describe_device(const struct egl *egl, struct device *device) {
    const char *extensions = NULL, *node = NULL;
    if (egl->query_device_string) {
        extensions = egl->query_device_string(device->handle, EGL_EXTENSIONS);
        if (has_word(extensions, "EGL_EXT_device_drm"))
            node = egl->query_device_string(device->handle, EGL_DRM_DEVICE_FILE_EXT);
    }
    device->software = has_word(extensions, "EGL_MESA_device_software");
    snprintf(device->name, sizeof device->name, "device %d (%s)", device->index,
             device->software ? "software"
             : node           ? node
                              : "no device node");
}

/* 0 where EGL cannot enumerate. */
static int list_devices(const struct egl *egl, struct device devices[DEVICES_MAX]) {
    EGLDeviceEXT handles[DEVICES_MAX];
    EGLint count = 0;
    if (!egl->query_devices || !egl->query_devices(DEVICES_MAX, handles, &count))
        return 0;
    for (int i = 0; i < count; i++) {
        devices[i] = (struct device){.handle = handles[i], .index = i};
        describe_device(egl, &devices[i]);
    }
    return count;
}

static bool open_device(struct egl *egl, const struct device *device, struct reasons *reasons) {
    EGLDisplay display = egl->get_platform_display(EGL_PLATFORM_DEVICE_EXT, device->handle, NULL);
    return try_display(egl, display, device->name, reasons);
}

/* In turn: hardware devices, software devices, no device at all. */
static bool open_any(struct egl *egl, const struct gl_options *options, const char *client,
                     char name[128], struct reasons *reasons) {
    struct device devices[DEVICES_MAX];
    int count = 0;
    bool by_device = egl->get_platform_display && has_word(client, "EGL_EXT_platform_device");
    if (by_device)
        count = list_devices(egl, devices);

    if (options->device >= 0) {
        if (options->device >= count) {
            reasons_add(reasons, "there is no device %d, EGL lists %d", options->device, count);
            return false;
        }
        snprintf(name, 128, "%s", devices[options->device].name);
        return open_device(egl, &devices[options->device], reasons);
    }
    for (int software = 0; software <= (options->require_hardware ? 0 : 1); software++)
        for (int i = 0; i < count; i++)
            if (devices[i].software == (software != 0) && open_device(egl, &devices[i], reasons)) {
                snprintf(name, 128, "%s", devices[i].name);
                return true;
            }
    if (count == 0)
        reasons_add(reasons, by_device ? "no devices" : "devices cannot be listed");
    if (egl->get_platform_display && has_word(client, "EGL_MESA_platform_surfaceless")) {
        snprintf(name, 128, "surfaceless");
        EGLDisplay display =
            egl->get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
        return try_display(egl, display, name, reasons);
    }
    reasons_add(reasons, "no surfaceless platform");
    return false;
}

static bool load_functions(struct egl *egl) {
    *(void **)&egl->get_proc_address = dlsym(egl->library, "eglGetProcAddress");
    *(void **)&egl->query_string = dlsym(egl->library, "eglQueryString");
    *(void **)&egl->get_error = dlsym(egl->library, "eglGetError");
    *(void **)&egl->initialize = dlsym(egl->library, "eglInitialize");
    *(void **)&egl->terminate = dlsym(egl->library, "eglTerminate");
    *(void **)&egl->bind_api = dlsym(egl->library, "eglBindAPI");
    *(void **)&egl->create_context = dlsym(egl->library, "eglCreateContext");
    *(void **)&egl->destroy_context = dlsym(egl->library, "eglDestroyContext");
    *(void **)&egl->make_current = dlsym(egl->library, "eglMakeCurrent");
    *(void **)&egl->release_thread = dlsym(egl->library, "eglReleaseThread");
    return egl->get_proc_address && egl->query_string && egl->get_error && egl->initialize &&
           egl->terminate && egl->bind_api && egl->create_context && egl->destroy_context &&
           egl->make_current && egl->release_thread;
}

static enum status egl_open(const struct gl_options *options, void **state, char device[128],
                            struct error *err) {
    const char *name = gl_library_name("PELT_EGL_LIBRARY", "libEGL.so.1");
    void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (!library)
        return error_fault(err, STATUS_NO_GL, NULL,
                           "EGL: the library %s cannot be opened (%s). Debian's package libegl1 "
                           "holds it; libegl-mesa0 and libgl1-mesa-dri hold the driver behind it",
                           name, dlerror());
    struct egl *egl = calloc(1, sizeof *egl);
    if (!egl) {
        dlclose(library);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "EGL: memory ran out");
    }
    egl->library = library;
    egl->display = EGL_NO_DISPLAY;
    egl->context = EGL_NO_CONTEXT;
    if (!load_functions(egl)) {
        dlclose(library);
        free(egl);
        return error_fault(err, STATUS_NO_GL, NULL,
                           "EGL: %s is no EGL library; Debian's package libegl1 holds one", name);
    }
    const char *client = egl->query_string(EGL_NO_DISPLAY, EGL_EXTENSIONS);
    if (has_word(client, "EGL_EXT_platform_base"))
        egl->get_platform_display =
            (PFNEGLGETPLATFORMDISPLAYEXTPROC)egl->get_proc_address("eglGetPlatformDisplayEXT");
    if (has_word(client, "EGL_EXT_device_enumeration") || has_word(client, "EGL_EXT_device_base"))
        egl->query_devices = (PFNEGLQUERYDEVICESEXTPROC)egl->get_proc_address("eglQueryDevicesEXT");
    if (has_word(client, "EGL_EXT_device_query") || has_word(client, "EGL_EXT_device_base"))
        egl->query_device_string =
            (PFNEGLQUERYDEVICESTRINGEXTPROC)egl->get_proc_address("eglQueryDeviceStringEXT");

    struct reasons reasons = {0};
    if (!open_any(egl, options, client, device, &reasons)) {
        egl_close(egl);
        return error_fault(err, STATUS_NO_GL, NULL,
                           "EGL: %s opens, but no OpenGL 4.5 context can be made: %s. Debian's "
                           "packages libegl-mesa0 and libgl1-mesa-dri hold Mesa's drivers",
                           name, reasons.text);
    }
    *state = egl;
    return STATUS_OK;
}

const struct gl_driver gl_driver_egl = {"egl", egl_open, egl_find, egl_close};
