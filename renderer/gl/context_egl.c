/* A context by EGL without a screen: every device that EGL_EXT_device_enumeration names, hardware
 * first, then EGL_MESA_platform_surfaceless.
 *
 * Sources: EGL_EXT_platform_device; EGL_MESA_platform_surfaceless; EGL_KHR_create_context;
 * EGL_KHR_no_config_context; EGL_KHR_surfaceless_context.
 *
 * A context is made without a config and made current without a surface: Pelt draws into
 * framebuffer objects only. Displays that lack either extension are passed over with that reason;
 * pbuffers as a way round it are left out, since every driver with GL 4.5 has both. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/driver.h"
#include "renderer/gl/egl_library.h"

struct egl {
    struct egl_library library;
    EGLDisplay display;
    EGLContext context;
};

/* Why each way was passed over, for the one message that the caller sees. */
struct reasons {
    char text[640];
    size_t used;
};

__attribute__((format(printf, 2, 3))) static void reasons_add(struct reasons *reasons,
                                                              const char *format, ...) {
    static const char separator[] = "; ";
    if (reasons->used && reasons->used + sizeof separator <= sizeof reasons->text) {
        memcpy(reasons->text + reasons->used, separator, sizeof separator);
        reasons->used += sizeof separator - 1;
    }
    va_list args;
    va_start(args, format);
    int length = vsnprintf(reasons->text + reasons->used, sizeof reasons->text - reasons->used,
                           format, args);
    va_end(args);
    if (length > 0)
        reasons->used += (size_t)length;
    if (reasons->used >= sizeof reasons->text)
        reasons->used = sizeof reasons->text - 1;
}

static void close_display(struct egl *egl) {
    if (egl->context != EGL_NO_CONTEXT) {
        egl->library.make_current(egl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
        egl->library.destroy_context(egl->display, egl->context);
        egl->context = EGL_NO_CONTEXT;
    }
    if (egl->display != EGL_NO_DISPLAY) {
        egl->library.terminate(egl->display);
        egl->display = EGL_NO_DISPLAY;
    }
}

static void egl_close(void *state) {
    struct egl *egl = state;
    close_display(egl);
    egl->library
        .release_thread(); /* what EGL keeps for this thread would outlive the library otherwise */
    egl_library_close(&egl->library);
    free(egl);
}

static gl_function egl_find(void *state, const char *name) {
    const struct egl *egl = state;
    return egl->library.get_proc_address(name);
}

/* Fills in egl->display and egl->context, current on this thread, or says why not. */
static bool try_display(struct egl *egl, EGLDisplay display, const char *what,
                        struct reasons *reasons) {
    if (display == EGL_NO_DISPLAY) {
        reasons_add(reasons, "%s: no display (%s)", what, egl_error_name(egl->library.get_error()));
        return false;
    }
    if (!egl->library.initialize(display, NULL, NULL)) {
        reasons_add(reasons, "%s: its driver does not start (%s)", what,
                    egl_error_name(egl->library.get_error()));
        return false;
    }
    egl->display = display;
    static const char *const needed[] = {"EGL_KHR_surfaceless_context", "EGL_KHR_create_context"};
    const char *extensions = egl->library.query_string(display, EGL_EXTENSIONS);
    for (size_t i = 0; i < sizeof needed / sizeof *needed; i++)
        if (!egl_has_word(extensions, needed[i])) {
            reasons_add(reasons, "%s: lacks %s", what, needed[i]);
            goto fail;
        }
    if (!egl_has_word(extensions, "EGL_KHR_no_config_context") &&
        !egl_has_word(extensions, "EGL_MESA_configless_context")) {
        reasons_add(reasons, "%s: lacks EGL_KHR_no_config_context", what);
        goto fail;
    }
    if (!egl->library.bind_api(EGL_OPENGL_API)) {
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
    egl->context =
        egl->library.create_context(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes);
    if (egl->context == EGL_NO_CONTEXT) {
        reasons_add(reasons, "%s: makes no core 4.5 context (%s)", what,
                    egl_error_name(egl->library.get_error()));
        goto fail;
    }
    if (!egl->library.make_current(display, EGL_NO_SURFACE, EGL_NO_SURFACE, egl->context)) {
        reasons_add(reasons, "%s: its context cannot be made current (%s)", what,
                    egl_error_name(egl->library.get_error()));
        goto fail;
    }
    return true;
fail:
    close_display(egl);
    return false;
}

static bool open_device(struct egl *egl, const struct egl_device *device, struct reasons *reasons) {
    EGLDisplay display =
        egl->library.get_platform_display(EGL_PLATFORM_DEVICE_EXT, device->handle, NULL);
    return try_display(egl, display, device->name, reasons);
}

/* In turn: hardware devices, software devices, no device at all. */
static bool open_any(struct egl *egl, const struct gl_options *options, char name[128],
                     struct reasons *reasons) {
    struct egl_device devices[EGL_DEVICES_MAX];
    int count = 0;
    bool by_device = egl->library.get_platform_display &&
                     egl_has_word(egl->library.client, "EGL_EXT_platform_device");
    if (by_device)
        count = egl_library_devices(&egl->library, devices);

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
    if (egl->library.get_platform_display &&
        egl_has_word(egl->library.client, "EGL_MESA_platform_surfaceless")) {
        snprintf(name, 128, "surfaceless");
        EGLDisplay display = egl->library.get_platform_display(EGL_PLATFORM_SURFACELESS_MESA,
                                                               EGL_DEFAULT_DISPLAY, NULL);
        return try_display(egl, display, name, reasons);
    }
    reasons_add(reasons, "no surfaceless platform");
    return false;
}

static enum status egl_open(const struct gl_options *options, void **state, char device[128],
                            struct error *err) {
    struct egl *egl = calloc(1, sizeof *egl);
    if (!egl)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "EGL: memory ran out");
    egl->display = EGL_NO_DISPLAY;
    egl->context = EGL_NO_CONTEXT;
    enum status status = egl_library_open(&egl->library, err);
    if (status != STATUS_OK) {
        free(egl);
        return status;
    }
    struct reasons reasons = {0};
    if (!open_any(egl, options, device, &reasons)) {
        status = error_fault(err, STATUS_NO_GL, NULL,
                             "EGL: %s opens, but no OpenGL 4.5 context can be made: %s. Debian's "
                             "packages libegl-mesa0 and libgl1-mesa-dri hold Mesa's drivers",
                             egl->library.name, reasons.text);
        egl_close(egl);
        return status;
    }
    *state = egl;
    return STATUS_OK;
}

const struct gl_driver gl_driver_egl = {"egl", egl_open, egl_find, egl_close};
