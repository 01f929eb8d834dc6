/* What the commands that read scenes share: options of the GL, faults as lines, exit codes. */
#ifndef PELT_SERVICE_CLI_H
#define PELT_SERVICE_CLI_H

#include <stdbool.h>

#include "api/scene.h"
#include "renderer/render.h"

/* Prints each fault as a line on the standard error: "pelt: NAME: /pointer: message". `name` may be
 * NULL. */
void cli_print_error(const char *name, const struct error *err);

/* Prints one line, "pelt COMMAND: message; see ...", and gives the exit code of wrong usage. */
int cli_usage(const char *command, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* The exit code of a run over many scenes: 1 (Pelt's own fault) hides every other, else the
 * highest. */
int cli_worse(int a, int b);

/* Rows for getopt_long(), and the reader of what they give. */
enum { CLI_OPT_BACKEND = 256, CLI_OPT_DEVICE, CLI_OPT_REQUIRE_HARDWARE, CLI_OPT_FIRST_FREE };
#define CLI_GL_OPTIONS                                                                             \
    {"backend", required_argument, NULL, CLI_OPT_BACKEND},                                         \
        {"device", required_argument, NULL, CLI_OPT_DEVICE}, {                                     \
        "require-hardware", no_argument, NULL, CLI_OPT_REQUIRE_HARDWARE                            \
    }
#define CLI_GL_HELP                                                                                \
    "  --backend auto|egl|osmesa  how to open OpenGL (auto)\n"                                     \
    "  --device N                 which EGL device (the first that works)\n"                       \
    "  --require-hardware         refuse a software rasteriser\n"

/* Takes one CLI_OPT_*; false where its value is none. */
bool cli_gl_option(int option, const char *value, struct renderer_options *options);

/* One scene, read from `path` ("-": standard input). */
struct cli_scene {
    unsigned char *text; /* the JSON as it came; owned */
    size_t bytes;
    struct arena arena;
    struct scene scene;
};

/* Reads and validates. On failure `err` tells why and nothing needs finishing. */
enum status cli_scene_read(const char *path, struct cli_scene *scene, struct error *err);
void cli_scene_finish(struct cli_scene *scene);

#endif
