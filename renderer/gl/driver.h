/* What context.c asks of the two ways to a GL: context_egl.c and context_osmesa.c, one row of
 * functions each. Private to renderer/gl.
 *
 * A driver opens its library at run time, so that `pelt` starts on a machine that has neither, and
 * only the one that is used costs its memory. */
#ifndef PELT_RENDERER_GL_DRIVER_H
#define PELT_RENDERER_GL_DRIVER_H

#include "renderer/gl/context.h"

typedef void (*gl_function)(void);

struct gl_driver {
    const char *name; /* gl_info.backend */

    /* Opens the library, makes a core 4.5 context and makes it current on this thread. `*state` is
     * freed by close(). `device`: gl_info.device. On failure nothing stays open, and `err` says
     * what is missing and which package holds it. */
    enum status (*open)(const struct gl_options *options, void **state, char device[128],
                        struct error *err);

    /* The address of a GL function, NULL if the library has none of that name. */
    gl_function (*find)(void *state, const char *name);

    void (*close)(void *state);
};

#define GL_OSMESA_LIBRARY "libOSMesa.so.8"

extern const struct gl_driver gl_driver_egl, gl_driver_osmesa;

/* The name to give dlopen(): the environment's `variable` if set and not empty, else `name`. */
const char *gl_library_name(const char *variable, const char *name);

/* True where PELT_GL_DEBUG=1 asks for a debug context. */
bool gl_debug_wanted(void);

#endif
