/* What the commands that read scenes share. */
#include "service/cli.h"

#include <errno.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "service/files.h"

void cli_print_error(const char *name, const struct error *err) {
    const char *colon = name ? ": " : "";
    name = name ? name : "";
    for (size_t i = 0; i < err->fault_count; i++) {
        const char *pointer = err->faults[i].pointer;
        const char *message = err->faults[i].message;
        fprintf(stderr, "pelt: %s%s%s%s%s\n", name, colon, pointer ? pointer : "",
                pointer && *pointer ? ": " : "", message ? message : status_title(err->status));
    }
    if (err->faults_left_out)
        fprintf(stderr, "pelt: %s%s%zu more faults\n", name, colon, err->faults_left_out);
    if (err->fault_count == 0 && err->faults_left_out == 0)
        fprintf(stderr, "pelt: %s%s%s\n", name, colon, status_title(err->status));
}

int cli_usage(const char *command, const char *format, ...) {
    fprintf(stderr, "pelt %s: ", command);
    va_list args;
    va_start(args, format);
    vfprintf(stderr, format, args);
    va_end(args);
    fprintf(stderr, "; see `pelt %s --help`\n", command);
    return status_exit_code(STATUS_USAGE);
}

int cli_worse(int a, int b) {
    int internal = status_exit_code(STATUS_INTERNAL);
    if (a == internal || b == internal)
        return internal;
    return a > b ? a : b;
}

bool cli_gl_option(int option, const char *value, struct renderer_options *options) {
    if (option == CLI_OPT_REQUIRE_HARDWARE) {
        options->require_hardware = true;
        return true;
    }
    if (option == CLI_OPT_DEVICE) {
        char *end;
        errno = 0;
        long device = strtol(value, &end, 10);
        if (errno || end == value || *end || device < 0 || device > INT_MAX)
            return false;
        options->device = (int)device;
        return true;
    }
    if (strcmp(value, "auto") == 0)
        options->backend = RENDER_BACKEND_AUTO;
    else if (strcmp(value, "egl") == 0)
        options->backend = RENDER_BACKEND_EGL;
    else if (strcmp(value, "osmesa") == 0)
        options->backend = RENDER_BACKEND_OSMESA;
    else
        return false;
    return true;
}

enum status cli_scene_read(const char *path, struct cli_scene *scene, struct error *err) {
    *scene = (struct cli_scene){0};
    enum status status = files_read(path, SCENE_BYTES_MAX, &scene->text, &scene->bytes, err);
    if (status == STATUS_OK)
        status =
            scene_read((const char *)scene->text, scene->bytes, &scene->arena, &scene->scene, err);
    if (status != STATUS_OK)
        cli_scene_finish(scene);
    return status;
}

void cli_scene_finish(struct cli_scene *scene) {
    free(scene->text);
    arena_free(&scene->arena);
    *scene = (struct cli_scene){0};
}
