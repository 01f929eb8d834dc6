/* pelt: one program, whose first argument says what it does. This file is the table of commands,
 * `pelt help`, and nothing else. */
#include <stdio.h>
#include <string.h>

#include "api/status.h"
#include "service/doctor.h"
#include "service/job_process.h"
#include "service/reference.h"
#include "service/render.h"
#include "service/serve.h"
#include "service/sweep.h"
#include "service/worker.h"

static int help_main(int argc, char **argv);
static int version_main(int argc, char **argv);

static const struct command {
    const char *name;
    int (*run)(int argc, char **argv);
    const char *summary; /* NULL: not for people, left out of the help */
} commands[] = {
    {"render", render_main, "draw scenes into picture files, here or by a daemon"},
    {"reference", reference_main, "draw the truth about a scene, and tell a picture's errors"},
    {"sweep", sweep_main, "measure error against run time by every path, as a page"},
    {"validate", validate_main, "read scenes and name every fault, without drawing"},
    {"plan", plan_main, "say which passes a scene needs, and which are left out and why"},
    {"serve", serve_main, "answer scenes with pictures over HTTP"},
    {"worker", worker_main, NULL},
    {"job", job_process_main, NULL},
    {"doctor", doctor_main, "say what this machine can draw with, and what to install"},
    {"help", help_main, "this text; `pelt help exit-codes` lists the exit codes"},
    {"version", version_main, "print the version"},
};

static int print_exit_codes(void) {
    static const struct {
        const char *name;
        int code;
    } rows[] = {
#define STATUS(name, slug, title, http, retryable, exit_code) {slug ": " title, exit_code},
#include "api/status.def"
#undef STATUS
    };
    puts(
        "Exit codes of pelt. 2 to 5 are the caller's fault, 1 and 6 Pelt's or the machine's; 8 is\n"
        "worth another try. A run over many scenes exits with 1 if any met that, else the "
        "highest.\n");
    for (int code = 0; code <= 8; code++)
        for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
            if (rows[i].code == code)
                printf("  %d  %s\n", code, rows[i].name);
    return 0;
}

static int help_main(int argc, char **argv) {
    if (argc > 1 && strcmp(argv[1], "exit-codes") == 0)
        return print_exit_codes();
    if (argc > 1) {
        fprintf(stderr, "pelt: no help on %s; try `pelt %s --help`\n", argv[1], argv[1]);
        return status_exit_code(STATUS_USAGE);
    }
    puts("pelt renders surfaces that have a depth of their own, on machines without a screen.\n\n"
         "usage: pelt COMMAND [ARGUMENTS]; pelt COMMAND --help tells more\n");
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        if (commands[i].summary)
            printf("  %-10s %s\n", commands[i].name, commands[i].summary);
    return 0;
}

static int version_main(int argc, char **argv) {
    (void)argc;
    (void)argv;
    puts("pelt " PELT_VERSION);
    return 0;
}

/* What was printed counts only if it arrived: a full disk behind the standard output is a failure.
 */
static int finish(int code) {
    if (fflush(stdout) == 0 && !ferror(stdout))
        return code;
    fputs("pelt: the standard output cannot be written\n", stderr);
    return code ? code : status_exit_code(STATUS_IO_ERROR);
}

int main(int argc, char **argv) {
    if (argc < 2) {
        fputs("pelt: which command? `pelt help` lists them\n", stderr);
        return status_exit_code(STATUS_USAGE);
    }
    const char *name = argv[1];
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0)
        name = "help";
    if (strcmp(name, "--version") == 0 || strcmp(name, "-V") == 0)
        name = "version";
    for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
        if (strcmp(name, commands[i].name) == 0)
            return finish(commands[i].run(argc - 1, argv + 1));
    fprintf(stderr, "pelt: no command named %s; `pelt help` lists them\n", name);
    return status_exit_code(STATUS_USAGE);
}
