/* `pelt sweep`: one scene by every path at a ladder of qualities, as JSON, CSV, a page and pictures
 * in a folder.
 *
 * Progress goes to the standard error where that is a terminal, or where --verbose asks for it; the
 * table, or the JSON, to the standard output. */
#include "service/sweep.h"

#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "renderer/gl/clock.h"
#include "service/cli.h"
#include "service/encode.h"
#include "service/files.h"
#include "service/sweep_ask.h"
#include "service/sweep_picture.h"
#include "service/sweep_write.h"

static const char usage[] =
    "usage: pelt sweep SCENE.json -o DIR [OPTIONS]\n"
    "\n"
    "Draws a scene by every path at a ladder of qualities, times each point and compares it with\n"
    "the reference. Takes minutes. - is the standard input. Assets lie beside the scene.\n"
    "\n"
    "  -o, --output DIR           where sweep.json, sweep.csv, sweep.html and the pictures go\n"
    "  --series NAME,...          which series (all)\n"
    "  --quality N,...            the ladder, ascending (4,8,16,32,64,128)\n"
    "  --repeats N                timed drawings of each point, besides the first (5)\n"
    "  --pixels all|N             what the reference draws (all, where that is expected to take\n"
    "                             at most 120 s, else 4096, stratified)\n"
    "  --threads N                how many threads draw the reference (one for each core)\n"
    "  --assets DIR               where assets lie\n"
    "  --json                     print sweep.json instead of a table; -o may be left out\n"
    "  --quiet                    print nothing but errors\n"
    "  --verbose                  tell the progress, also where there is no terminal\n" CLI_GL_HELP;

struct options {
    const char *output, *assets;
    bool json, quiet, verbose;
    struct sweep_ask ask;
    struct renderer_options gl;
};

enum {
    OPT_SERIES = CLI_OPT_FIRST_FREE,
    OPT_QUALITY,
    OPT_REPEATS,
    OPT_PIXELS,
    OPT_THREADS,
    OPT_ASSETS,
    OPT_JSON,
    OPT_QUIET,
    OPT_VERBOSE
};

/* 0, or the exit code after a message; -1: the help was printed. */
static int parse_options(int argc, char **argv, struct options *options) {
    static const struct option rows[] = {{"output", required_argument, NULL, 'o'},
                                         {"series", required_argument, NULL, OPT_SERIES},
                                         {"quality", required_argument, NULL, OPT_QUALITY},
                                         {"repeats", required_argument, NULL, OPT_REPEATS},
                                         {"pixels", required_argument, NULL, OPT_PIXELS},
                                         {"threads", required_argument, NULL, OPT_THREADS},
                                         {"assets", required_argument, NULL, OPT_ASSETS},
                                         {"json", no_argument, NULL, OPT_JSON},
                                         {"quiet", no_argument, NULL, OPT_QUIET},
                                         {"verbose", no_argument, NULL, OPT_VERBOSE},
                                         {"help", no_argument, NULL, 'h'},
                                         CLI_GL_OPTIONS,
                                         {0}};
    opterr = 0; /* it would name the program "sweep" */
    int option;
    while ((option = getopt_long(argc, argv, "o:hqv", rows, NULL)) != -1) {
        bool good = true;
        switch (option) {
        case 'o':
            options->output = optarg;
            break;
        case OPT_SERIES:
            good = sweep_ask_set(&options->ask, "series", optarg);
            break;
        case OPT_QUALITY:
            good = sweep_ask_set(&options->ask, "quality", optarg);
            break;
        case OPT_REPEATS:
            good = sweep_ask_set(&options->ask, "repeats", optarg);
            break;
        case OPT_PIXELS:
            good = sweep_ask_set(&options->ask, "pixels", optarg);
            break;
        case OPT_THREADS:
            good = sweep_ask_set(&options->ask, "threads", optarg);
            break;
        case OPT_ASSETS:
            options->assets = optarg;
            break;
        case OPT_JSON:
            options->json = true;
            break;
        case 'q':
        case OPT_QUIET:
            options->quiet = true;
            break;
        case 'v':
        case OPT_VERBOSE:
            options->verbose = true;
            break;
        case 'h':
            fputs(usage, stdout);
            return -1;
        case CLI_OPT_BACKEND:
        case CLI_OPT_DEVICE:
        case CLI_OPT_REQUIRE_HARDWARE:
            good = cli_gl_option(option, optarg, &options->gl);
            break;
        default:
            return cli_usage("sweep", "%s is not an option, or lacks its value", argv[optind - 1]);
        }
        if (!good)
            return cli_usage("sweep", "%.64s is not a value of %s", optarg,
                             option == 'o' ? "-o" : argv[optind - 2]);
    }
    return 0;
}

/* Whether files may be made in a folder, or, where it is not there, the folder itself. */
static bool can_write(const char *folder, bool there) {
    if (there)
        return access(folder, W_OK | X_OK) == 0;
    char *parent = strdup(folder);
    if (!parent)
        return false;
    size_t length = strlen(parent);
    while (length > 1 && parent[length - 1] == '/')
        parent[--length] = 0;
    char *slash = strrchr(parent, '/');
    if (slash == parent)
        slash[1] = 0;
    else if (slash)
        *slash = 0;
    bool good = access(slash ? parent : ".", W_OK | X_OK) == 0;
    free(parent);
    return good;
}

/* Before minutes are spent on it. */
static int check_options(int scene_count, const struct options *options) {
    struct stat found;
    if (scene_count != 1)
        return cli_usage("sweep", scene_count ? "one scene at a time" : "which scene?");
    if (!options->output && !options->json)
        return cli_usage("sweep", "where to? -o, or --json");
    if (options->quiet && options->json)
        return cli_usage("sweep", "one of --quiet and --json");
    bool there = options->output && stat(options->output, &found) == 0;
    if (there && !S_ISDIR(found.st_mode))
        return cli_usage("sweep", "%s is a file, not a folder", options->output);
    if (options->output && !can_write(options->output, there)) {
        fprintf(stderr, "pelt sweep: %s: cannot be %s: %s\n", options->output,
                there ? "written to" : "made", strerror(errno));
        return status_exit_code(STATUS_IO_ERROR);
    }
    struct error err = {0};
    enum status status = sweep_check(&options->ask.options, &err);
    if (status != STATUS_OK)
        cli_print_error("sweep", &err);
    error_clear(&err);
    return status_exit_code(status);
}

/* ---- progress ---- */

struct progress {
    double began_ms, told_ms;
    bool terminal;
    char what[128]; /* the stage last told */
};

static void show_progress(void *user, size_t done, size_t total, const char *what) {
    struct progress *progress = user;
    double now = clock_now_ms();
    bool same = strcmp(progress->what, what) == 0;
    if (same && done < total && now - progress->told_ms < (progress->terminal ? 200 : 5000))
        return;
    if (!same && *progress->what && progress->terminal)
        fputc('\n', stderr);
    progress->told_ms = now;
    snprintf(progress->what, sizeof progress->what, "%s", what);
    fprintf(stderr, "%ssweep: %6.1f s  %s: %zu of %zu%s", progress->terminal ? "\r" : "",
            (now - progress->began_ms) / 1000, what, done, total, progress->terminal ? "  " : "\n");
}

static void end_progress(const struct progress *progress) {
    if (progress->terminal && *progress->what)
        fputc('\n', stderr);
}

/* ---- files ---- */

static enum status write_file(const char *folder, const char *name, const void *data, size_t bytes,
                              struct error *err) {
    char *path = NULL;
    if (asprintf(&path, "%s/%s", folder, name) < 0)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a path");
    enum status status = files_write(path, data, bytes, err);
    free(path);
    return status;
}

/* Takes `text`, which may be NULL. */
static enum status write_text(const char *folder, const char *name, char *text, struct error *err) {
    enum status status =
        text ? write_file(folder, name, text, strlen(text), err)
             : error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %s", name);
    free(text);
    return status;
}

static enum status write_picture(const char *folder, const char *name, const struct sweep *sweep,
                                 const struct sweep_point *point, enum sweep_view view,
                                 enum encode_format format, struct error *err) {
    int width, height;
    unsigned char *data = NULL;
    size_t bytes = 0;
    float *pixels = sweep_picture(sweep, point, view, 0, &width, &height);
    if (!pixels)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %s", name);
    enum status status = encode_image(format, pixels, width, height, &data, &bytes, err);
    if (status == STATUS_OK)
        status = write_file(folder, name, data, bytes, err);
    free(data);
    free(pixels);
    return status;
}

static enum status write_point(const char *folder, const struct sweep *sweep,
                               const struct sweep_series *series, const struct sweep_point *point,
                               struct error *err) {
    static const struct {
        enum sweep_view view;
        const char *suffix;
    } views[] = {{SWEEP_VIEW_PICTURE, ""},
                 {SWEEP_VIEW_DIFFERENCE, "-difference"},
                 {SWEEP_VIEW_FLIP, "-flip"}};
    enum status status = STATUS_OK;
    for (size_t i = 0; i < (sweep->pixels ? 1 : 3) && status == STATUS_OK; i++) {
        char name[128];
        snprintf(name, sizeof name, "%s-%d%s.png", series->row->name, point->quality,
                 views[i].suffix);
        status = write_picture(folder, name, sweep, point, views[i].view, ENCODE_PNG, err);
    }
    return status;
}

static enum status write_all(const char *folder, const char *scene_name, const struct sweep *sweep,
                             struct error *err) {
    if (mkdir(folder, 0777) != 0 && errno != EEXIST)
        return error_fault(err, STATUS_IO_ERROR, NULL, "%s: cannot be made: %s", folder,
                           strerror(errno));
    enum status status = write_text(folder, "sweep.json", sweep_json(sweep), err);
    if (status == STATUS_OK)
        status = write_text(folder, "sweep.csv", sweep_csv(sweep), err);
    if (status == STATUS_OK)
        status = write_text(folder, "sweep.html", sweep_html(sweep, scene_name), err);
    if (status == STATUS_OK && !sweep->pixels) {
        status = write_picture(folder, "reference.png", sweep, NULL, SWEEP_VIEW_PICTURE, ENCODE_PNG,
                               err);
        if (status == STATUS_OK)
            status = write_picture(folder, "reference.exr", sweep, NULL, SWEEP_VIEW_PICTURE,
                                   ENCODE_EXR, err);
    }
    for (size_t s = 0; s < sweep->series_count; s++)
        for (size_t i = 0; i < sweep->series[s].point_count && status == STATUS_OK; i++)
            if (sweep->series[s].points[i].pixels)
                status =
                    write_point(folder, sweep, &sweep->series[s], &sweep->series[s].points[i], err);
    return status;
}

/* ---- all ---- */

static enum status tell(const char *scene_name, const struct options *options,
                        const struct sweep *sweep, struct error *err) {
    enum status status = STATUS_OK;
    if (options->output)
        status = write_all(options->output, scene_name, sweep, err);
    if (status != STATUS_OK || options->quiet)
        return status;
    if (!options->json) {
        printf("%s/sweep.html\n", options->output);
        sweep_print(stdout, sweep);
        return STATUS_OK;
    }
    char *json = sweep_json(sweep);
    if (!json)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the JSON");
    puts(json);
    free(json);
    return STATUS_OK;
}

static enum status run(const char *path, const struct options *options, struct error *err) {
    struct cli_scene scene;
    struct file_assets files = {0};
    struct renderer *renderer = NULL;
    struct sweep *sweep = NULL;
    struct sweep_options asked = options->ask.options;
    struct progress progress = {.began_ms = clock_now_ms(), .terminal = isatty(STDERR_FILENO) != 0};
    if (!options->quiet && (options->verbose || progress.terminal)) {
        asked.progress = show_progress;
        asked.user = &progress;
    }
    enum status status = cli_scene_read(path, &scene, err);
    if (status != STATUS_OK)
        return status;
    status = file_assets_init(&files, options->assets, path, err);
    struct asset_source assets = file_assets_source(&files);
    if (status == STATUS_OK)
        status = renderer_create(&options->gl, &renderer, err);
    if (status == STATUS_OK)
        status = sweep_run(renderer, &scene.scene, &assets, &asked, &sweep, err);
    end_progress(&progress);
    const char *slash = strrchr(path, '/');
    if (status == STATUS_OK)
        status = tell(slash ? slash + 1 : path, options, sweep, err);
    sweep_destroy(sweep);
    renderer_destroy(renderer);
    file_assets_finish(&files);
    cli_scene_finish(&scene);
    return status;
}

int sweep_main(int argc, char **argv) {
    struct options options = {.gl.device = -1};
    int code = parse_options(argc, argv, &options);
    if (code == 0)
        code = check_options(argc - optind, &options);
    if (code == 0) {
        struct error err = {0};
        enum status status = run(argv[optind], &options, &err);
        if (status != STATUS_OK) {
            cli_print_error(argv[optind], &err);
            code = status_exit_code(status);
        }
        error_clear(&err);
    }
    sweep_ask_finish(&options.ask);
    return code < 0 ? 0 : code;
}
