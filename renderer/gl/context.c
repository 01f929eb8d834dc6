/* Choosing a backend, loading the functions, and refusing what cannot draw Pelt's pictures before
 * anything depends on it. The two ways to a GL are context_egl.c and context_osmesa.c; what is
 * asked of one is in selftest.c. */
#include "renderer/gl/context.h"

#include <glad/gl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/gl/clock.h"
#include "renderer/gl/driver.h"
#include "renderer/gl/selftest.h"

struct gl_context {
    const struct gl_driver *driver;
    void *state; /* the driver's */
    struct gl_info info;
};

const char *gl_library_name(const char *variable, const char *name) {
    const char *given = secure_getenv(variable);
    return given && *given ? given : name;
}

bool gl_debug_wanted(void) {
    const char *given = getenv("PELT_GL_DEBUG");
    return given && strcmp(given, "1") == 0;
}

const char *gl_error_name(unsigned code) {
    switch (code) {
    case GL_INVALID_ENUM:
        return "GL_INVALID_ENUM";
    case GL_INVALID_VALUE:
        return "GL_INVALID_VALUE";
    case GL_INVALID_OPERATION:
        return "GL_INVALID_OPERATION";
    case GL_INVALID_FRAMEBUFFER_OPERATION:
        return "GL_INVALID_FRAMEBUFFER_OPERATION";
    case GL_OUT_OF_MEMORY:
        return "GL_OUT_OF_MEMORY";
    case GL_STACK_OVERFLOW:
        return "GL_STACK_OVERFLOW";
    case GL_STACK_UNDERFLOW:
        return "GL_STACK_UNDERFLOW";
    case GL_CONTEXT_LOST:
        return "GL_CONTEXT_LOST";
    default:
        return "an unknown GL error";
    }
}

enum status gl_check(const char *what, struct error *err) {
    /* One flag for each kind may be set, so several can wait; the count is bounded because a lost
     * context may answer GL_CONTEXT_LOST for ever. Out of memory outweighs the rest: the others are
     * then often its consequences. */
    GLenum first = GL_NO_ERROR;
    for (int i = 0; i < 16; i++) {
        GLenum code = glGetError();
        if (code == GL_NO_ERROR)
            break;
        if (first == GL_NO_ERROR || code == GL_OUT_OF_MEMORY)
            first = code;
    }
    if (first == GL_NO_ERROR)
        return STATUS_OK;
    return error_fault(err, first == GL_OUT_OF_MEMORY ? STATUS_OUT_OF_MEMORY : STATUS_GL_ERROR,
                       NULL, "%s: %s", what, gl_error_name(first));
}

static void GLAD_API_PTR print_message(GLenum source, GLenum type, GLuint id, GLenum severity,
                                       GLsizei length, const GLchar *message, const void *user) {
    (void)source, (void)severity, (void)length, (void)user;
    fprintf(stderr, "gl: %s 0x%x: %s\n", type == GL_DEBUG_TYPE_ERROR ? "error" : "message", id,
            message);
}

static GLADapiproc find_function(void *context, const char *name) {
    const struct gl_context *gl = context;
    return gl->driver->find(gl->state, name);
}

/* Mesa's rasterisers without hardware, and the ones that others ship. */
static bool is_software(const char *renderer) {
    static const char *const names[] = {"llvmpipe", "softpipe", "swrast",     "Software Rasterizer",
                                        "SWR",      "lavapipe", "SwiftShader"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strstr(renderer, names[i]))
            return true;
    return false;
}

static void copy_string(char to[128], GLenum name) {
    const GLubyte *text = glGetString(name);
    snprintf(to, 128, "%s", text ? (const char *)text : "unknown");
}

static enum status inspect(struct gl_context *gl, const struct gl_options *options,
                           struct error *err) {
    struct gl_info *info = &gl->info;
    int version = gladLoadGLUserPtr(find_function, gl);
    if (!version)
        return error_fault(err, STATUS_NO_GL, NULL,
                           "%s: a context opens, but OpenGL's functions cannot be found",
                           info->backend);
    copy_string(info->vendor, GL_VENDOR);
    copy_string(info->renderer, GL_RENDERER);
    copy_string(info->version, GL_VERSION);
    info->software = is_software(info->renderer);
    if (version < GLAD_MAKE_VERSION(4, 5))
        return error_fault(err, STATUS_NO_GL, NULL, "%s: OpenGL 4.5 is needed, %s has %d.%d (%s)",
                           info->backend, info->renderer, GLAD_VERSION_MAJOR(version),
                           GLAD_VERSION_MINOR(version), info->version);
    if (options->require_hardware && info->software)
        return error_fault(err, STATUS_NO_GL, NULL,
                           "%s: hardware is required, and %s draws in software", info->backend,
                           info->renderer);
    if (gl_debug_wanted()) {
        glEnable(GL_DEBUG_OUTPUT);
        glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        glDebugMessageCallback(print_message, NULL);
    }
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &info->max_texture_size);
    glGetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &info->max_3d_texture_size);
    glGetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &info->max_texture_buffer_texels);
    return gl_selftest(info, err);
}

static enum status open_with(const struct gl_driver *driver, const struct gl_options *options,
                             struct gl_context **context, struct error *err) {
    struct gl_context *gl = calloc(1, sizeof *gl);
    if (!gl)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "the GL context: memory ran out");
    gl->driver = driver;
    snprintf(gl->info.backend, sizeof gl->info.backend, "%s", driver->name);
    enum status status = driver->open(options, &gl->state, gl->info.device, err);
    if (status == STATUS_OK)
        status = inspect(gl, options, err);
    if (status != STATUS_OK) {
        gl_context_destroy(gl);
        return status;
    }
    gl->info.clock = gl_clock_check();
    *context = gl;
    return STATUS_OK;
}

enum status gl_context_create(const struct gl_options *options, struct gl_context **context,
                              struct error *err) {
    *context = NULL;
    if (options->backend == GL_BACKEND_OSMESA)
        return open_with(&gl_driver_osmesa, options, context, err);
    if (options->backend == GL_BACKEND_EGL)
        return open_with(&gl_driver_egl, options, context, err);

    /* A wish that OSMesa can never fulfil is EGL's alone, or its refusal would hide the reason. */
    struct error why = {0};
    enum status status = open_with(&gl_driver_egl, options, context, &why);
    if (status == STATUS_NO_GL && options->device < 0 && !options->require_hardware)
        status = open_with(&gl_driver_osmesa, options, context, &why);
    if (status == STATUS_OK)
        error_clear(&why);
    else
        error_move(err, &why);
    return status;
}

void gl_context_destroy(struct gl_context *context) {
    if (!context)
        return;
    if (context->state)
        context->driver->close(context->state);
    free(context);
}

const struct gl_info *gl_context_info(const struct gl_context *context) {
    return &context->info;
}
