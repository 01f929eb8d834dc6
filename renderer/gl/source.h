/* The text of a shader stage, put together from the files that the program carries. Private to
 * renderer/gl; no GL needed. */
#ifndef PELT_RENDERER_GL_SOURCE_H
#define PELT_RENDERER_GL_SOURCE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/status.h"

enum {
    GL_SOURCE_FILES_MAX = 32,
    GL_SOURCE_DEPTH_MAX = 8,
    GL_SOURCE_LINES = 10000 /* what a file's lines are counted up from: see source.c */
};

/* A stage's text. Line l of files[n] is announced as `#line (n + 1) * GL_SOURCE_LINES + l  n`. */
struct gl_source {
    char *text; /* owned; terminated */
    size_t length, capacity;
    size_t file_count;
    const char *files[GL_SOURCE_FILES_MAX]; /* names of embedded files: static storage */
};

/* Assembles shaders/`name`: the version, `#define VARIANT 0x..`, interface.h, then the file with
 * each
 * `#include "x"` replaced by shaders/x. `*source` need not be initialised; gl_source_finish() frees
 * it, after failure too. STATUS_INTERNAL (a file is missing, or includes itself), naming both files
 * and the line; STATUS_OUT_OF_MEMORY. */
enum status gl_source_assemble(struct gl_source *source, const char *name, uint32_t variant,
                               struct error *err);
void gl_source_finish(struct gl_source *source);

/* A compiler's log with the places turned into names and lines: "0:30017(5): error" becomes
 * "common_ray.glsl:17(5): error". malloc'ed, NULL where memory ran out. */
char *gl_source_translate_log(const struct gl_source *source, const char *log);

#endif
