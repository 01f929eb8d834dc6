/* libEGL opened at run time: its functions, its devices, its words. Private to renderer/gl:
 * context_egl.c makes a context with it, probe.c only looks. */
#ifndef PELT_RENDERER_GL_EGL_LIBRARY_H
#define PELT_RENDERER_GL_EGL_LIBRARY_H

#define EGL_NO_X11 /* no window system: the headers of X are not needed */
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <stdbool.h>

#include "api/status.h"

enum { EGL_DEVICES_MAX = 64 };

struct egl_library {
    void *handle;
    const char *name;   /* what was given to dlopen() */
    const char *client; /* client extensions, NULL where EGL is older than those */
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

struct egl_device {
    EGLDeviceEXT handle;
    int index; /* what --device N counts */
    bool software;
    char name[96]; /* "device 0 (/dev/dri/card0)" */
};

/* Opens libEGL.so.1, or what PELT_EGL_LIBRARY names. STATUS_NO_GL, naming the package. On success
 * egl_library_close() is the caller's to call. */
enum status egl_library_open(struct egl_library *egl, struct error *err);
void egl_library_close(struct egl_library *egl);

/* The devices that EGL knows; 0 where it cannot enumerate. */
int egl_library_devices(const struct egl_library *egl, struct egl_device devices[EGL_DEVICES_MAX]);

/* Whether `word` is in the space-separated `list` (NULL: empty), as a whole word. */
bool egl_has_word(const char *list, const char *word);

const char *egl_error_name(EGLint code); /* static storage */

#endif
