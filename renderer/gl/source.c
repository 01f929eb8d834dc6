/* Includes for GLSL, which has none: text in, text out.
 *
 * Every file that comes in gets a number and is announced by `#line LINE NUMBER` before and after
 * each include, so that a compiler's log points at the file that a person edits. The numbers are
 * turned back into names here, in the two forms that drivers write: Mesa, Intel and AMD "2:17",
 * NVIDIA "2(17)", at the start of a line or after "ERROR: ".
 *
 * A file that is included twice is put in twice; its own include guard (#ifndef) drops the second
 * copy, as in C. A file that reaches itself is refused. Left out on purpose: macros in #include,
 * <>, and conditionals: a file is put in even where an #if around it says no, which costs nothing
 * but text. */
#include "renderer/gl/source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "api/embedded.h"

static bool reserve(struct gl_source *source, size_t more) {
    size_t needed = source->length + more + 1;
    if (needed <= source->capacity)
        return true;
    size_t capacity = source->capacity ? source->capacity : 4096;
    while (capacity < needed)
        capacity *= 2;
    char *grown = realloc(source->text, capacity);
    if (!grown)
        return false;
    source->text = grown;
    source->capacity = capacity;
    return true;
}

static bool append(struct gl_source *source, const char *text, size_t length) {
    if (!reserve(source, length))
        return false;
    memcpy(source->text + source->length, text, length);
    source->length += length;
    source->text[source->length] = 0;
    return true;
}

static enum status out_of_memory(struct error *err) {
    return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "a shader's text: memory ran out");
}

/* The files that are open at this point, innermost last. */
struct stack {
    const char *names[GL_SOURCE_DEPTH_MAX];
    size_t depth;
};

/* `#include "name"` in a line of `length` characters: name and its length; else NULL. */
static const char *include_name(const char *line, size_t length, size_t *name_length) {
    const char *end = line + length;
    while (line < end && (*line == ' ' || *line == '\t'))
        line++;
    if (line == end || *line++ != '#')
        return NULL;
    while (line < end && (*line == ' ' || *line == '\t'))
        line++;
    if ((size_t)(end - line) < 8 || memcmp(line, "include", 7) != 0)
        return NULL;
    const char *open = memchr(line, '"', (size_t)(end - line));
    const char *close = open ? memchr(open + 1, '"', (size_t)(end - open - 1)) : NULL;
    if (!close)
        return NULL;
    *name_length = (size_t)(close - open - 1);
    return open + 1;
}

static enum status add_file(struct gl_source *source, const char *name, size_t name_length,
                            const char *from, unsigned from_line, struct stack *stack,
                            struct error *err) {
    char path[128];
    int length = snprintf(path, sizeof path, "shaders/%.*s", (int)name_length, name);
    const struct embedded *file =
        length > 0 && (size_t)length < sizeof path ? embedded_find(path) : NULL;
    if (!file)
        return error_fault(err, STATUS_INTERNAL, NULL, "%s:%u: there is no shader file %.*s", from,
                           from_line, (int)name_length, name);
    const char *short_name = file->name + strlen("shaders/");
    for (size_t i = 0; i < stack->depth; i++)
        if (stack->names[i] == short_name)
            return error_fault(err, STATUS_INTERNAL, NULL, "%s:%u: %s includes itself", from,
                               from_line, short_name);
    if (stack->depth == GL_SOURCE_DEPTH_MAX || source->file_count == GL_SOURCE_FILES_MAX)
        return error_fault(err, STATUS_INTERNAL, NULL, "%s:%u: too many includes", from, from_line);
    stack->names[stack->depth++] = short_name;
    size_t number = source->file_count++;
    source->files[number] = short_name;

    char directive[64];
    int used = snprintf(directive, sizeof directive, "#line 1 %zu\n", number);
    if (!append(source, directive, (size_t)used))
        return out_of_memory(err);
    unsigned line_number = 0;
    for (const char *line = file->begin; line < file->end;) {
        const char *end = memchr(line, '\n', (size_t)(file->end - line));
        size_t line_length = (size_t)((end ? end : file->end) - line), include_length;
        line_number++;
        const char *include = include_name(line, line_length, &include_length);
        if (include) {
            enum status status =
                add_file(source, include, include_length, short_name, line_number, stack, err);
            if (status != STATUS_OK)
                return status;
            used = snprintf(directive, sizeof directive, "#line %u %zu\n", line_number + 1, number);
            if (!append(source, directive, (size_t)used))
                return out_of_memory(err);
        } else if (!append(source, line, line_length) || !append(source, "\n", 1)) {
            return out_of_memory(err);
        }
        line += line_length + 1;
    }
    stack->depth--;
    return STATUS_OK;
}

enum status gl_source_assemble(struct gl_source *source, const char *name, uint32_t variant,
                               struct error *err) {
    *source = (struct gl_source){0};
    char head[96];
    int used = snprintf(head, sizeof head, "#version 450 core\n#define VARIANT 0x%04x\n",
                        (unsigned)variant);
    if (!append(source, head, (size_t)used))
        return out_of_memory(err);
    struct stack stack = {0};
    static const char interface[] = "interface.h";
    enum status status = add_file(source, interface, sizeof interface - 1, name, 0, &stack, err);
    if (status == STATUS_OK)
        status = add_file(source, name, strlen(name), name, 0, &stack, err);
    return status;
}

void gl_source_finish(struct gl_source *source) {
    free(source->text);
    *source = (struct gl_source){0};
}

/* A file number at `at`, followed by ':' or '(' and a digit: its length, else 0. */
static size_t file_number(const char *at, size_t file_count, size_t *number) {
    size_t length = 0, value = 0;
    while (at[length] >= '0' && at[length] <= '9' && length < 4)
        value = value * 10 + (size_t)(at[length++] - '0');
    bool follows = length && (at[length] == ':' || at[length] == '(') && at[length + 1] >= '0' &&
                   at[length + 1] <= '9';
    if (!follows || value >= file_count)
        return 0;
    *number = value;
    return length;
}

char *gl_source_translate_log(const struct gl_source *source, const char *log) {
    struct gl_source out = {0};
    bool good = append(&out, "", 0);
    while (*log && good) {
        static const char *const prefixes[] = {"ERROR: ", "WARNING: "};
        for (size_t i = 0; i < sizeof prefixes / sizeof *prefixes; i++)
            if (strncmp(log, prefixes[i], strlen(prefixes[i])) == 0) {
                good = good && append(&out, prefixes[i], strlen(prefixes[i]));
                log += strlen(prefixes[i]);
            }
        size_t number, digits = file_number(log, source->file_count, &number);
        if (digits) {
            const char *name = source->files[number];
            good = good && append(&out, name, strlen(name));
            log += digits;
        }
        size_t rest = strcspn(log, "\n");
        if (log[rest])
            rest++;
        good = good && append(&out, log, rest);
        log += rest;
    }
    if (!good) {
        free(out.text);
        return NULL;
    }
    return out.text;
}
