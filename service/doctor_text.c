/* The doctor's findings for people: one paragraph a subject, and at the end the command to type. */
#include <stdbool.h>
#include <string.h>
#include <strings.h>

#include "service/doctor.h"

static const char *string(const json_t *object, const char *name) {
    const char *value = json_string_value(json_object_get(object, name));
    return value ? value : "";
}

static bool is_true(const json_t *object, const char *name) {
    return json_is_true(json_object_get(object, name));
}

static double gibibytes(const json_t *object, const char *name) {
    return (double)json_integer_value(json_object_get(object, name)) / (1 << 30);
}

/* What a library printed while it was tried: its first lines, empty and repeated ones left out. */
static void print_messages(FILE *out, const json_t *found) {
    const char *messages = string(found, "messages"), *last = "";
    size_t last_length = 0;
    for (size_t printed = 0; *messages && printed < 8;) {
        size_t length = strcspn(messages, "\n");
        if (length && (length != last_length || memcmp(messages, last, length) != 0)) {
            fprintf(out, "          it said: %.*s\n", (int)length, messages);
            last = messages;
            last_length = length;
            printed++;
        }
        messages += length + (messages[length] == '\n');
    }
}

/* A message may open with the backend's name, which stands before it here anyway. */
static const char *without_title(const char *why, const char *title) {
    size_t length = strlen(title);
    return strncasecmp(why, title, length) == 0 && strncmp(why + length, ": ", 2) == 0
               ? why + length + 2
               : why;
}

static void print_backend(FILE *out, const char *title, const json_t *found) {
    if (is_true(found, "usable"))
        fprintf(out,
                "%-9s works: %s, OpenGL %s, %s\n"
                "          opened in %.0f ms: %s; times are taken by %s\n",
                title, string(found, "gl_renderer"), string(found, "gl_version"),
                is_true(found, "software") ? "software" : "hardware",
                json_real_value(json_object_get(found, "open_ms")), string(found, "device"),
                string(found, "clock"));
    else
        fprintf(out, "%-9s does not work: %s\n", title, without_title(string(found, "why"), title));
    const json_t *devices = json_object_get(found, "devices"), *device;
    size_t i;
    json_array_foreach(devices, i, device) fprintf(out, "          %s\n", string(device, "name"));
    print_messages(out, found);
}

static void print_modules(FILE *out, const json_t *modules) {
    const json_t *module;
    size_t i;
    json_array_foreach(modules, i, module) {
        fprintf(out, "%-9s %-12s ", i ? "" : "modules", string(module, "name"));
        if (is_true(module, "usable"))
            fprintf(out, "works (for %s)\n", string(module, "needed_for"));
        else
            fprintf(out, "does not work: %s; needed for %s\n", string(module, "why"),
                    string(module, "needed_for"));
        print_messages(out, module);
    }
}

static void print_machine(FILE *out, const json_t *machine) {
    int cores = (int)json_integer_value(json_object_get(machine, "cores"));
    fprintf(out, "%-9s %d core%s%s%s; %.1f GiB of memory, %.1f available", "machine", cores,
            cores == 1 ? "" : "s", *string(machine, "cpu") ? " of " : "", string(machine, "cpu"),
            gibibytes(machine, "memory_bytes"), gibibytes(machine, "memory_available_bytes"));
    if (json_object_get(machine, "memory_limit_bytes"))
        fprintf(out, ", limited to %.2f", gibibytes(machine, "memory_limit_bytes"));
    if (json_object_get(machine, "address_space_bytes"))
        fprintf(out, "; address space limited to %.2f", gibibytes(machine, "address_space_bytes"));
    fputc('\n', out);
}

static void print_missing(FILE *out, const json_t *missing) {
    const json_t *one;
    size_t i;
    if (json_array_size(missing) == 0) {
        fprintf(out, "%-9s nothing\n", "missing");
        return;
    }
    json_array_foreach(missing, i, one)
        fprintf(out, "%-9s %s (%s): apt-get install %s\n", i ? "" : "missing", string(one, "what"),
                is_true(one, "needed") ? "needed" : "may be left out", string(one, "packages"));
}

void doctor_print(FILE *out, const json_t *findings) {
    const char *backend = string(findings, "backend");
    const json_t *cache = json_object_get(findings, "shader_cache");
    if (is_true(findings, "usable"))
        fprintf(out, "pelt %s can draw here, by %s.\n\n", string(findings, "version"),
                strcmp(backend, "egl") == 0 ? "EGL" : "OSMesa");
    else
        fprintf(out, "pelt %s cannot draw here: no usable OpenGL 4.5.\n\n",
                string(findings, "version"));
    print_backend(out, "EGL", json_object_get(findings, "egl"));
    print_backend(out, "OSMesa", json_object_get(findings, "osmesa"));
    print_modules(out, json_object_get(findings, "modules"));
    if (is_true(cache, "writable"))
        fprintf(out, "%-9s compiled shaders are kept in %s\n", "cache", string(cache, "folder"));
    else
        fprintf(out, "%-9s compiled shaders are not kept, each start compiles again: %s\n", "cache",
                string(cache, "why"));
    print_machine(out, json_object_get(findings, "machine"));
    print_missing(out, json_object_get(findings, "missing"));
}
