/* A GL 4.5 core context without a screen: EGL (by device enumeration, then surfaceless) or OSMesa,
 * either opened at run time; one backend for each process. */
#ifndef PELT_RENDERER_GL_CONTEXT_H
#define PELT_RENDERER_GL_CONTEXT_H

#include <stdbool.h>

#include "api/report.h"
#include "api/status.h"

enum gl_backend { GL_BACKEND_AUTO, GL_BACKEND_EGL, GL_BACKEND_OSMESA };

struct gl_options {
    enum gl_backend backend;
    int device;            /* -1: the first that works, hardware first */
    bool require_hardware; /* refuse a software rasteriser */
};

struct gl_info {
    char backend[16]; /* "egl", "osmesa" */
    char device[128]; /* what was opened: "device 0 (/dev/dri/card0)", "surfaceless", ... */
    char vendor[128], renderer[128], version[128];
    bool software;
    int max_texture_size, max_3d_texture_size, max_texture_buffer_texels;
    enum report_clock clock; /* what timings can be trusted here; see clock.h */
};

struct gl_context;

/* Opens, makes current on this thread, loads the functions, checks the version and that fp32 render
 * targets with blending work, and checks the clock. STATUS_NO_GL: `err` names what is missing and
 * what to install. */
enum status gl_context_create(const struct gl_options *options, struct gl_context **context,
                              struct error *err);
void gl_context_destroy(struct gl_context *context); /* takes NULL */
const struct gl_info *gl_context_info(const struct gl_context *context);

/* Drains glGetError; STATUS_GL_ERROR or STATUS_OUT_OF_MEMORY naming `what`. */
enum status gl_check(const char *what, struct error *err);

#endif
