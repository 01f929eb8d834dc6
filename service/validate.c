/* `pelt validate`, which reads scenes and draws nothing, and `pelt plan`, which says what drawing
 * would do. */
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "service/cli.h"
#include "service/files.h"
#include "service/render.h"
#include "service/table.h"

static const char validate_usage[] =
    "usage: pelt validate SCENE.json...\n"
    "\n"
    "Reads scenes and names each fault with its JSON Pointer. Opens neither OpenGL nor assets.\n"
    "\n"
    "  --drawable                 also refuse what this version cannot draw\n"
    "  --quiet                    print nothing but faults\n";

static int validate_one(const char *path, bool drawable, bool quiet) {
    struct error err = {0};
    struct cli_scene scene;
    enum status status = cli_scene_read(path, &scene, &err);
    if (status == STATUS_OK) {
        status = scene_check_implemented(&scene.scene, &err);
        if (!quiet)
            printf("%s: valid%s\n", path,
                   status == STATUS_OK ? "" : ", but not drawable by this version");
        if (!drawable)
            status = STATUS_OK;
        cli_scene_finish(&scene);
    }
    if (status != STATUS_OK)
        cli_print_error(path, &err);
    error_clear(&err);
    return status_exit_code(status);
}

int validate_main(int argc, char **argv) {
    static const struct option rows[] = {{"drawable", no_argument, NULL, 'd'},
                                         {"quiet", no_argument, NULL, 'q'},
                                         {"help", no_argument, NULL, 'h'},
                                         {0}};
    bool drawable = false, quiet = false;
    int option;
    opterr = 0; /* it would name the program after the command */
    while ((option = getopt_long(argc, argv, "hq", rows, NULL)) != -1) {
        if (option == 'h') {
            fputs(validate_usage, stdout);
            return 0;
        }
        if (option == '?')
            return cli_usage("validate", "%s is not an option", argv[optind - 1]);
        drawable |= option == 'd';
        quiet |= option == 'q';
    }
    if (optind == argc)
        return cli_usage("validate", "which scene?");
    int worst = 0;
    for (int i = optind; i < argc; i++)
        worst = cli_worse(worst, validate_one(argv[i], drawable, quiet));
    return worst;
}

static const char plan_usage[] =
    "usage: pelt plan SCENE.json [OPTIONS]\n"
    "\n"
    "Says which passes a scene needs and which are left out and why, without drawing it.\n"
    "\n"
    "  --assets DIR               where assets lie (beside the scene)\n"
    "  --json                     print the report as JSON\n" CLI_GL_HELP;

static enum status plan_scene(const char *path, const char *folder,
                              const struct renderer_options *gl, bool json, struct error *err) {
    struct cli_scene scene;
    struct file_assets files = {0};
    struct renderer *renderer = NULL;
    struct render_result result = {0};
    enum status status = cli_scene_read(path, &scene, err);
    if (status != STATUS_OK)
        return status;
    status = scene_check_implemented(&scene.scene, err);
    if (status == STATUS_OK)
        status = file_assets_init(&files, folder, path, err);
    if (status == STATUS_OK)
        status = renderer_create(gl, &renderer, err);
    if (status == STATUS_OK) {
        struct asset_source assets = file_assets_source(&files);
        status = renderer_plan(renderer, &scene.scene, &assets, &result, err);
    }
    if (status == STATUS_OK) {
        char *text = json ? report_write(&result.report) : NULL;
        if (text)
            puts(text);
        else if (json)
            status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
        else
            table_print_plan(stdout, &result.report);
        free(text);
        render_result_finish(&result);
    }
    renderer_destroy(renderer);
    file_assets_finish(&files);
    cli_scene_finish(&scene);
    return status;
}

int plan_main(int argc, char **argv) {
    static const struct option rows[] = {{"assets", required_argument, NULL, 'a'},
                                         {"json", no_argument, NULL, 'j'},
                                         {"help", no_argument, NULL, 'h'},
                                         CLI_GL_OPTIONS,
                                         {0}};
    struct renderer_options gl = {.device = -1};
    const char *folder = NULL;
    bool json = false;
    int option;
    opterr = 0; /* it would name the program after the command */
    while ((option = getopt_long(argc, argv, "h", rows, NULL)) != -1) {
        if (option == 'h') {
            fputs(plan_usage, stdout);
            return 0;
        }
        if (option == '?')
            return cli_usage("plan", "%s is not an option, or lacks its value", argv[optind - 1]);
        if (option == 'a')
            folder = optarg;
        else if (option == 'j')
            json = true;
        else if (!cli_gl_option(option, optarg, &gl))
            return cli_usage("plan", "%s is not a value of %s", optarg, argv[optind - 2]);
    }
    if (optind + 1 != argc)
        return cli_usage("plan", "which scene?");
    struct error err = {0};
    enum status status = plan_scene(argv[optind], folder, &gl, json, &err);
    if (status != STATUS_OK)
        cli_print_error(argv[optind], &err);
    error_clear(&err);
    return status_exit_code(status);
}
