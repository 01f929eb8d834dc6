/* What a backend has to offer on this machine, for `pelt doctor`.
 *
 * Drivers crash and hang, and only one backend may be opened in a process: call this in a child
 * process of its own, once. */
#ifndef PELT_RENDERER_GL_PROBE_H
#define PELT_RENDERER_GL_PROBE_H

#include "renderer/gl/context.h"

enum { GL_PROBE_DEVICES_MAX = 64 };

struct gl_probe_device {
    char name[96]; /* "device 0 (/dev/dri/card0)"; its place in the list is --device's N */
    bool software;
};

struct gl_probe {
    char library[128]; /* name of the library */
    bool library_opened;
    char library_version[128]; /* EGL's own, "" where it does not tell (and OSMesa never does) */
    size_t device_count;       /* EGL only */
    struct gl_probe_device devices[GL_PROBE_DEVICES_MAX];
    bool usable;         /* a context was made and passed the self-test */
    struct gl_info info; /* where usable */
    double open_ms;      /* what making it took, clock check included */
    char why[1024];      /* where not usable */
};

/* Looks, opens a context, closes it. `backend`: EGL or OSMesa. Blocks for tens of milliseconds, or
 * as long as a driver likes. */
void gl_probe_backend(enum gl_backend backend, struct gl_probe *probe);

#endif
