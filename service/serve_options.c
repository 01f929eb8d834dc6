/* One table of settings: name, kind, default, range, text. Reading and the help are made from it.
 */
#include "service/serve_options.h"

#include <errno.h>
#include <limits.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum kind { KIND_TEXT, KIND_INTEGER, KIND_CHOICE, KIND_FLAG };

static const char *const log_names[] = {
    [LOG_FORMAT_TEXT] = "text", [LOG_FORMAT_JSON] = "json", NULL};
static const char *const backend_names[] = {[RENDER_BACKEND_AUTO] = "auto",
                                            [RENDER_BACKEND_EGL] = "egl",
                                            [RENDER_BACKEND_OSMESA] = "osmesa",
                                            NULL};

#define AT(member) offsetof(struct serve_options, member)

static const struct setting {
    const char *name, *value; /* `value`: how the help calls it */
    enum kind kind;
    size_t offset;
    const char *text_default;
    int number_default, least, most;
    const char *const *choices; /* the default is the first one */
    const char *help;
} settings[] = {
    {"--listen", "ADDR:PORT", KIND_TEXT, AT(listen), "127.0.0.1:8748", 0, 0, 0, NULL,
     "where to listen; port 0: any free one"},
    {"--assets", "DIR", KIND_TEXT, AT(assets), NULL, 0, 0, 0, NULL,
     "folder whose files scenes may name as assets"},
    {"--workers", "N", KIND_INTEGER, AT(workers), NULL, 2, 1, 64, NULL,
     "worker processes, each with a GL context"},
    {"--queue", "N", KIND_INTEGER, AT(queue), NULL, 32, 1, 4096, NULL,
     "requests that may wait for a worker"},
    {"--timeout-ms", "N", KIND_INTEGER, AT(timeout_ms), NULL, 30000, 10, 3600000, NULL,
     "how long one request may be drawn, and how long it may wait"},
    {"--receive-timeout-ms", "N", KIND_INTEGER, AT(receive_timeout_ms), NULL, 30000, 100, 3600000,
     NULL, "how long a request may take to arrive"},
    {"--connections", "N", KIND_INTEGER, AT(connections), NULL, 512, 2, 16384, NULL,
     "client connections at once"},
    {"--body-mib", "N", KIND_INTEGER, AT(body_mib), NULL, 64, 1, 1024, NULL,
     "largest request body in MiB, scene and assets together"},
    {"--jobs-queue", "N", KIND_INTEGER, AT(jobs_queue), NULL, 16, 1, 1024, NULL,
     "long jobs that may wait for their turn"},
    {"--jobs-keep-mib", "N", KIND_INTEGER, AT(jobs_keep_mib), NULL, 256, 1, 65536, NULL,
     "MiB of results of finished jobs that are kept, the newest"},
    {"--jobs-keep-s", "N", KIND_INTEGER, AT(jobs_keep_s), NULL, 3600, 1, 604800, NULL,
     "how long a finished job is kept"},
    {"--job-timeout-s", "N", KIND_INTEGER, AT(job_timeout_s), NULL, 3600, 1, 604800, NULL,
     "how long one job may run"},
    {"--log", "text|json", KIND_CHOICE, AT(log), NULL, 0, 0, 0, log_names,
     "form of the log on stderr"},
    {"--backend", "auto|egl|osmesa", KIND_CHOICE, AT(renderer.backend), NULL, 0, 0, 0,
     backend_names, "which OpenGL to open"},
    {"--device", "N", KIND_INTEGER, AT(renderer.device), NULL, -1, -1, 255, NULL,
     "index among the EGL devices; -1 chooses"},
    {"--require-hardware", NULL, KIND_FLAG, AT(renderer.require_hardware), NULL, 0, 0, 0, NULL,
     "refuse a software rasteriser"},
    {"--help", NULL, KIND_FLAG, AT(help), NULL, 0, 0, 0, NULL, "this text"},
};

enum { SETTINGS = sizeof settings / sizeof *settings };

static void *member(struct serve_options *options, const struct setting *setting) {
    return (char *)options + setting->offset;
}

static void set_default(struct serve_options *options, const struct setting *setting) {
    switch (setting->kind) {
    case KIND_TEXT:
        memcpy(member(options, setting), &setting->text_default, sizeof setting->text_default);
        break;
    case KIND_INTEGER:
    case KIND_CHOICE:
        memcpy(member(options, setting), &setting->number_default, sizeof(int));
        break;
    case KIND_FLAG:
        *(bool *)member(options, setting) = false;
        break;
    }
}

static enum status set(struct serve_options *options, const struct setting *setting,
                       const char *value, struct error *err) {
    char *end;
    int chosen = 0;
    switch (setting->kind) {
    case KIND_TEXT:
        memcpy(member(options, setting), &value, sizeof value);
        break;
    case KIND_INTEGER: {
        errno = 0;
        long number = strtol(value, &end, 10);
        if (errno || end == value || *end || number < setting->least || number > setting->most)
            return error_fault(err, STATUS_USAGE, NULL, "%s %s: expected an integer from %d to %d",
                               setting->name, value, setting->least, setting->most);
        int narrow = (int)number;
        memcpy(member(options, setting), &narrow, sizeof narrow);
        break;
    }
    case KIND_CHOICE:
        while (setting->choices[chosen] && strcmp(setting->choices[chosen], value) != 0)
            chosen++;
        if (!setting->choices[chosen])
            return error_fault(err, STATUS_USAGE, NULL, "%s %s: expected one of %s", setting->name,
                               value, setting->value);
        memcpy(member(options, setting), &chosen, sizeof chosen);
        break;
    case KIND_FLAG:
        *(bool *)member(options, setting) = true;
        break;
    }
    return STATUS_OK;
}

enum status serve_options_read(int argc, char **argv, struct serve_options *options,
                               struct error *err) {
    _Static_assert(sizeof(enum log_format) == sizeof(int) &&
                       sizeof(enum render_backend) == sizeof(int),
                   "choices are stored as int");
    memset(options, 0, sizeof *options);
    for (int i = 0; i < SETTINGS; i++)
        set_default(options, &settings[i]);
    for (int i = 1; i < argc; i++) {
        const struct setting *setting = NULL;
        size_t length = strcspn(argv[i], "=");
        const char *word = strcmp(argv[i], "-h") == 0 ? "--help" : argv[i];
        if (word != argv[i])
            length = strlen(word);
        for (int k = 0; k < SETTINGS && !setting; k++)
            if (strlen(settings[k].name) == length && strncmp(settings[k].name, word, length) == 0)
                setting = &settings[k];
        if (!setting)
            return error_fault(err, STATUS_USAGE, NULL, "no option %s; see pelt serve --help",
                               argv[i]);
        const char *value = word[length] == '=' ? word + length + 1 : NULL;
        if (setting->kind == KIND_FLAG && value)
            return error_fault(err, STATUS_USAGE, NULL, "%s takes no value", setting->name);
        if (setting->kind != KIND_FLAG && !value && ++i < argc)
            value = argv[i];
        if (setting->kind != KIND_FLAG && !value)
            return error_fault(err, STATUS_USAGE, NULL, "%s needs a value: %s", setting->name,
                               setting->value);
        enum status status = set(options, setting, value, err);
        if (status != STATUS_OK)
            return status;
    }
    return STATUS_OK;
}

void serve_options_help(void) {
    puts(
        "usage: pelt serve [OPTIONS]\n\n"
        "Answers scenes with pictures over HTTP until SIGTERM or SIGINT, then finishes what is in\n"
        "flight and exits 0; a second signal ends it at once. Prints its address when it is "
        "ready.\n");
    for (int i = 0; i < SETTINGS; i++) {
        const struct setting *setting = &settings[i];
        char left[64], right[64] = "";
        snprintf(left, sizeof left, "%s %s", setting->name, setting->value ? setting->value : "");
        if (setting->kind == KIND_INTEGER)
            snprintf(right, sizeof right, " (%d; %d to %d)", setting->number_default,
                     setting->least, setting->most);
        else if (setting->kind == KIND_CHOICE || setting->text_default)
            snprintf(right, sizeof right, " (%s)",
                     setting->text_default ? setting->text_default : setting->choices[0]);
        printf("  %-28s %s%s\n", left, setting->help, right);
    }
    puts("\nExit codes: 0 ended by a signal, 1 a fault of Pelt or the machine, 2 wrong usage,\n"
         "6 no usable OpenGL, 7 ended by a second signal before work was finished.");
}
