/* Includes for GLSL, which has none: text in, text out.
 *
 * Every file that comes in gets a number n, and `#line` before and after each include tells the
 * compiler where the text is from, so that its log points at the file that a person edits. The line
 * that it is told is (n + 1) * 10000 + the line in the file, and the log is turned back here. Files
 * by GLSL's own source numbers alone would not do: Mesa loses them for whatever is longer than one
 * token (its YYLLOC_DEFAULT sets the source to 0), and names the wrong file in most of its errors.
 * Drivers write "S:L(C)" (Mesa), "S(L)" (NVIDIA) or "ERROR: S:L:" (glslang, and who builds on it).
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
#include "shaders/interface.h"

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

static bool append_line_directive(struct gl_source *source, size_t number, unsigned line) {
    char text[64];
    int used = snprintf(text, sizeof text, "#line %zu %zu\n", (number + 1) * GL_SOURCE_LINES + line,
                        number);
    return append(source, text, (size_t)used);
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

    if (!append_line_directive(source, number, 1))
        return out_of_memory(err);
    unsigned line_number = 0;
    for (const char *line = file->begin; line < file->end;) {
        const char *end = memchr(line, '\n', (size_t)(file->end - line));
        size_t line_length = (size_t)((end ? end : file->end) - line), include_length;
        if (++line_number >= GL_SOURCE_LINES)
            return error_fault(err, STATUS_INTERNAL, NULL, "%s has more lines than a log can name",
                               short_name);
        const char *include = include_name(line, line_length, &include_length);
        if (include) {
            enum status status =
                add_file(source, include, include_length, short_name, line_number, stack, err);
            if (status != STATUS_OK)
                return status;
            if (!append_line_directive(source, number, line_number + 1))
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
    bool counts = (variant & FLAG_COUNT) && strstr(name, ".frag");
    static const char counting[] = "common_count.glsl";
    if (status == STATUS_OK && counts)
        status = add_file(source, counting, sizeof counting - 1, name, 0, &stack, err);
    if (status == STATUS_OK)
        status = add_file(source, name, strlen(name), name, 0, &stack, err);
    if (status == STATUS_OK && counts)
        status = add_file(source, counting, sizeof counting - 1, name, 0, &stack, err);
    return status;
}

void gl_source_finish(struct gl_source *source) {
    free(source->text);
    *source = (struct gl_source){0};
}

/* A decimal number of at most 7 digits at `*at`, which moves past it. */
static bool read_number(const char **at, size_t *number) {
    size_t length = strspn(*at, "0123456789");
    *number = 0;
    for (size_t i = 0; i < length && length <= 7; i++)
        *number = *number * 10 + (size_t)((*at)[i] - '0');
    *at += length;
    return length >= 1 && length <= 7;
}

/* The place "S:L" or "S(L" at `at` in one of the files: its length, else 0. */
static size_t read_place(const char *at, size_t file_count, size_t *file, size_t *line) {
    const char *end = at;
    size_t number;
    if (!read_number(&end, &number) || (*end != ':' && *end != '('))
        return 0;
    end++;
    if (!read_number(&end, &number))
        return 0;
    *file = number / GL_SOURCE_LINES - 1; /* wraps where there is none: then not below the count */
    *line = number % GL_SOURCE_LINES;
    return *file < file_count ? (size_t)(end - at) : 0;
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
        size_t file, line, length = read_place(log, source->file_count, &file, &line);
        if (length) {
            char place[160];
            int used = snprintf(place, sizeof place, "%.120s%c%zu", source->files[file],
                                log[strcspn(log, ":(")], line);
            good = good && append(&out, place, (size_t)used);
            log += length;
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
