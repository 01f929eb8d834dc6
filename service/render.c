/* `pelt render`: scenes from files to pictures in files, all of them in one GL context.
 *
 * A scene that fails does not stop the others; the exit code is that of the worst. This process is
 * as mortal as the scenes it draws: who does not trust them sends them to a daemon, whose workers
 * may die. */
#include "service/render.h"

#include <assert.h>
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
#include "service/remote.h"
#include "service/render_frames.h"
#include "service/table.h"

static const char usage[] =
    "usage: pelt render SCENE.json -o OUT.png [OPTIONS]\n"
    "       pelt render SCENE.json... --out-dir DIR [OPTIONS]\n"
    "       pelt render SEQUENCE.json --frames [A-B] -o frame-%04d.png [OPTIONS]\n"
    "\n"
    "Draws scenes; - is the standard input, or output. Assets lie beside their scene.\n"
    "\n"
    "  --frames [A-B]             draw a sequence: all its frames, or these, into numbered\n"
    "                             pictures (-o frame-%04d.png) or an animated GIF (-o a.gif)\n"
    "  -o, --output FILE          where the picture goes\n"
    "  --out-dir DIR              one picture for each scene, named after it\n"
    "  --format png|exr|gif       else by the output's extension; png with --out-dir\n"
    "  --assets DIR               where assets lie\n"
    "  --report FILE              write the report of a single scene as JSON\n"
    "  --json                     print the reports as JSON instead of a table\n"
    "  --quiet                    print nothing but errors\n"
    "  --verbose                  tell of each scene, also where there is no terminal\n"
    "  --server URL               let a daemon draw (its report comes with PNG "
    "alone)\n" CLI_GL_HELP;

struct options {
    const char *output, *out_dir, *report, *assets, *server;
    enum encode_format format;
    const char *frames_range, *format_name;
    bool has_format, json, quiet, verbose, frames;
    struct renderer_options gl;
};

enum {
    OPT_OUT_DIR = CLI_OPT_FIRST_FREE,
    OPT_FORMAT,
    OPT_ASSETS,
    OPT_REPORT,
    OPT_JSON,
    OPT_QUIET,
    OPT_VERBOSE,
    OPT_SERVER,
    OPT_FRAMES
};

static bool parse_format(const char *name, enum encode_format *format) {
    if (!name)
        return false;
    if (strcasecmp(name, "png") == 0)
        *format = ENCODE_PNG;
    else if (strcasecmp(name, "exr") == 0)
        *format = ENCODE_EXR;
    else
        return false;
    return true;
}

/* Digits, or two runs of them around a hyphen: no name of a scene. */
static bool is_range(const char *text) {
    return text && *text >= '0' && *text <= '9' && text[strspn(text, "0123456789-")] == 0;
}

/* 0, or the exit code after a message; -1: the help was printed. */
static int parse_options(int argc, char **argv, struct options *options) {
    static const struct option rows[] = {{"output", required_argument, NULL, 'o'},
                                         {"out-dir", required_argument, NULL, OPT_OUT_DIR},
                                         {"format", required_argument, NULL, OPT_FORMAT},
                                         {"assets", required_argument, NULL, OPT_ASSETS},
                                         {"report", required_argument, NULL, OPT_REPORT},
                                         {"json", no_argument, NULL, OPT_JSON},
                                         {"quiet", no_argument, NULL, OPT_QUIET},
                                         {"verbose", no_argument, NULL, OPT_VERBOSE},
                                         {"server", required_argument, NULL, OPT_SERVER},
                                         {"frames", optional_argument, NULL, OPT_FRAMES},
                                         {"help", no_argument, NULL, 'h'},
                                         CLI_GL_OPTIONS,
                                         {0}};
    *options = (struct options){.gl.device = -1};
    opterr = 0; /* it would name the program "render" */
    int option;
    while ((option = getopt_long(argc, argv, "o:hqv", rows, NULL)) != -1) {
        bool good = true;
        switch (option) {
        case 'o':
            options->output = optarg;
            break;
        case OPT_OUT_DIR:
            options->out_dir = optarg;
            break;
        case OPT_FORMAT:
            options->format_name = optarg;
            options->has_format = parse_format(optarg, &options->format);
            good = options->has_format || (optarg && strcasecmp(optarg, "gif") == 0);
            break;
        case OPT_ASSETS:
            options->assets = optarg;
            break;
        case OPT_REPORT:
            options->report = optarg;
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
        case OPT_FRAMES:
            options->frames = true;
            options->frames_range = optarg;
            if (!optarg && is_range(argv[optind])) /* also where it stands apart */
                options->frames_range = argv[optind++];
            break;
        case OPT_SERVER:
            options->server = optarg;
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
            return cli_usage("render", "%s is not an option, or lacks its value", argv[optind - 1]);
        }
        if (!good)
            return cli_usage("render", "%s is not a value of %s", optarg, argv[optind - 2]);
    }
    return 0;
}

static int check_options(int scene_count, struct options *options) {
    if (scene_count == 0)
        return cli_usage("render", "which scene?");
    if (options->report && strcmp(options->report, "-") == 0) {
        options->report = NULL;
        options->json = true;
    }
    if ((options->output != NULL) == (options->out_dir != NULL))
        return cli_usage("render", "where to? one of -o and --out-dir");
    if (scene_count > 1 && (options->output || options->report))
        return cli_usage("render", "-o and --report are for a single scene");
    if (options->quiet && options->json)
        return cli_usage("render", "one of --quiet and --json");
    if (options->json && options->output && strcmp(options->output, "-") == 0)
        return cli_usage("render", "picture and report cannot both go to the standard output");
    if (options->format_name && !options->has_format)
        return cli_usage("render", "a GIF is made of --frames");
    if (options->output && !options->has_format && strcmp(options->output, "-") != 0) {
        const char *dot = strrchr(options->output, '.');
        if (!dot || !parse_format(dot + 1, &options->format))
            return cli_usage("render", "%s ends in neither .png nor .exr; give --format",
                             options->output);
    }
    return 0;
}

/* ---- where pictures go ---- */

/* "DIR/name.png" for "some/name.json"; malloc'ed, NULL where memory ran out. */
static char *output_in(const char *folder, const char *scene_path, enum encode_format format) {
    const char *slash = strrchr(scene_path, '/');
    const char *name = slash ? slash + 1 : scene_path;
    size_t length = strlen(name);
    if (strcmp(name, "-") == 0)
        name = "stdin", length = 5;
    else if (length > 5 && strcmp(name + length - 5, ".json") == 0)
        length -= 5;
    char *path = NULL;
    if (asprintf(&path, "%s/%.*s.%s", folder, (int)length, name,
                 format == ENCODE_EXR ? "exr" : "png") < 0)
        return NULL;
    return path;
}

static int compare_text(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* The output of each scene; two scenes for one output are refused before anything is drawn. */
static int plan_outputs(char **scenes, int count, const struct options *options, char **outputs) {
    for (int i = 0; i < count; i++) {
        outputs[i] = options->output ? strdup(options->output)
                                     : output_in(options->out_dir, scenes[i], options->format);
        if (!outputs[i])
            return status_exit_code(STATUS_OUT_OF_MEMORY);
    }
    char **sorted = malloc((size_t)count * sizeof *sorted);
    if (!sorted)
        return status_exit_code(STATUS_OUT_OF_MEMORY);
    memcpy(sorted, outputs, (size_t)count * sizeof *sorted);
    qsort(sorted, (size_t)count, sizeof *sorted, compare_text);
    int code = 0;
    for (int i = 1; i < count && code == 0; i++)
        if (strcmp(sorted[i - 1], sorted[i]) == 0)
            code = cli_usage("render", "two scenes would be written to %s", sorted[i]);
    free(sorted);
    if (code == 0 && options->out_dir && mkdir(options->out_dir, 0777) != 0 && errno != EEXIST) {
        fprintf(stderr, "pelt: %s: cannot be made: %s\n", options->out_dir, strerror(errno));
        code = status_exit_code(STATUS_IO_ERROR);
    }
    return code;
}

/* ---- drawing ---- */

struct run {
    const struct options *options;
    struct renderer *renderer; /* opened for the first scene that can be read */
    double start_ms;           /* what opening took; told with the first picture, then 0 */
    bool no_gl;                /* opening failed: no other scene will fare better */
};

struct picture {
    unsigned char *data;
    size_t bytes;
    char *report_json;     /* NULL where nobody asked */
    struct report *report; /* NULL where a daemon drew */
    char timing[1024];     /* by a daemon: its Server-Timing */
};

static void picture_finish(struct picture *picture) {
    free(picture->data);
    free(picture->report_json);
    free(picture->report);
}

static bool wants_json(const struct options *options) {
    return options->json || options->report;
}

static enum status draw_here(struct run *run, const struct cli_scene *scene,
                             const struct asset_source *assets, double began_ms,
                             struct picture *picture, struct error *err) {
    enum status status = scene_check_implemented(&scene->scene, err);
    if (status != STATUS_OK)
        return status;
    double parsed_ms = clock_now_ms();
    double opening_ms = 0;
    if (!run->renderer) {
        status = renderer_create(&run->options->gl, &run->renderer, err);
        opening_ms = clock_now_ms() - parsed_ms;
        run->start_ms = opening_ms;
        run->no_gl = status == STATUS_NO_GL;
        if (status != STATUS_OK)
            return status;
    }
    struct render_result result = {0};
    /* Opening OpenGL is not the scene's: the clock stands still meanwhile. */
    struct render_limits limits = {
        began_ms + opening_ms, encode_expected_ms(run->options->format, scene->scene.image.width,
                                                  scene->scene.image.height)};
    status = renderer_render_within(run->renderer, &scene->scene, assets, &limits, &result, err);
    if (status != STATUS_OK) {
        if (status == STATUS_GL_ERROR) { /* whatever state that left the context in */
            renderer_destroy(run->renderer);
            run->renderer = NULL;
        }
        return status;
    }
    double drawn_ms = clock_now_ms();
    status = encode_image(run->options->format, result.pixels, result.width, result.height,
                          &picture->data, &picture->bytes, err);
    double done_ms = clock_now_ms();
    result.report.stage_ms[REPORT_STAGE_parse] = parsed_ms - began_ms;
    result.report.stage_ms[REPORT_STAGE_encode] = done_ms - drawn_ms;
    result.report.total_ms = done_ms - began_ms - opening_ms;
    report_settle(&result.report);
    if (status == STATUS_OK) {
        picture->report = malloc(sizeof *picture->report);
        picture->report_json = wants_json(run->options) ? report_write(&result.report) : NULL;
        if (!picture->report || (wants_json(run->options) && !picture->report_json))
            status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "memory ran out");
        else /* for the table, which needs nothing of what the arena owns */
            *picture->report = result.report, picture->report->resolved = (struct scene){0};
    }
    render_result_finish(&result);
    return status;
}

static enum status draw_there(const struct run *run, const struct cli_scene *scene,
                              const struct asset_source *assets, struct picture *picture,
                              struct error *err) {
    struct remote_reply reply = {0};
    enum status status = remote_render(run->options->server, scene, assets, run->options->format,
                                       wants_json(run->options), &reply, err);
    if (status == STATUS_OK) {
        picture->data = reply.image;
        picture->bytes = reply.image_bytes;
        picture->report_json = reply.report;
        memcpy(picture->timing, reply.timing, sizeof picture->timing);
        reply.image = NULL;
        reply.report = NULL;
    }
    remote_reply_finish(&reply);
    return status;
}

static enum status tell(struct run *run, const struct picture *picture, const char *output,
                        struct error *err) {
    const struct options *options = run->options;
    enum status status = STATUS_OK;
    if (options->report)
        status =
            files_write(options->report, picture->report_json, strlen(picture->report_json), err);
    FILE *out = strcmp(output, "-") == 0 ? stderr : stdout;
    if (options->json) {
        fprintf(out, "%s\n", picture->report_json);
    } else if (!options->quiet && options->output) {
        fprintf(out, "%s\n", output);
        if (picture->report)
            table_print(out, picture->report, run->start_ms);
        else
            table_print_timing(out, picture->timing);
    }
    run->start_ms = 0;
    return status;
}

static enum status render_one(struct run *run, const char *path, const char *output,
                              struct error *err) {
    const struct options *options = run->options;
    assert(output);
    struct cli_scene scene;
    struct file_assets files = {0};
    struct picture picture = {0};
    double began_ms = clock_now_ms();
    enum status status = cli_scene_read(path, &scene, err);
    if (status != STATUS_OK)
        return status;
    status = file_assets_init(&files, options->assets, path, err);
    struct asset_source assets = file_assets_source(&files);
    if (status == STATUS_OK)
        status = options->server ? draw_there(run, &scene, &assets, &picture, err)
                                 : draw_here(run, &scene, &assets, began_ms, &picture, err);
    if (status == STATUS_OK)
        status = files_write(output, picture.data, picture.bytes, err);
    if (status == STATUS_OK)
        status = tell(run, &picture, output, err);
    picture_finish(&picture);
    file_assets_finish(&files);
    cli_scene_finish(&scene);
    return status;
}

static int render_all(struct run *run, char **scenes, char **outputs, int count) {
    bool progress = !run->options->quiet && run->options->out_dir &&
                    (run->options->verbose || isatty(STDERR_FILENO));
    int worst = 0, failed = 0;
    for (int i = 0; i < count; i++) {
        struct error err = {0};
        double began_ms = clock_now_ms();
        enum status status = render_one(run, scenes[i], outputs[i], &err);
        if (status != STATUS_OK) {
            cli_print_error(scenes[i], &err);
            worst = cli_worse(worst, status_exit_code(status));
            failed++;
        } else if (progress) {
            fprintf(stderr, "[%d/%d] %s  %.0f ms\n", i + 1, count, outputs[i],
                    clock_now_ms() - began_ms);
        }
        error_clear(&err);
        if (run->no_gl) {
            failed = count - (i - failed + 1);
            break;
        }
    }
    if (failed && count > 1)
        fprintf(stderr, "pelt: %d of %d scenes failed\n", failed, count);
    return worst;
}

static int render_sequence(char **scenes, int count, const struct options *options) {
    if (count != 1 || !options->output)
        return cli_usage("render", "--frames: one sequence, and -o");
    if (options->out_dir || options->json || options->server)
        return cli_usage("render", "--frames goes with none of --out-dir, --json and --server");
    struct render_frames frames = {
        scenes[0],       options->frames_range,
        options->output, options->assets,
        options->report, options->format_name,
        options->quiet,  !options->quiet && (options->verbose || isatty(STDERR_FILENO)),
        options->gl};
    return render_frames(&frames);
}

int render_main(int argc, char **argv) {
    struct options options;
    int code = parse_options(argc, argv, &options);
    if (code != 0)
        return code < 0 ? 0 : code;
    char **scenes = argv + optind;
    int count = argc - optind;
    if (options.frames)
        return render_sequence(scenes, count, &options);
    code = check_options(count, &options);
    if (code != 0)
        return code;
    char **outputs = calloc((size_t)count, sizeof *outputs);
    if (!outputs)
        return status_exit_code(STATUS_OUT_OF_MEMORY);
    struct run run = {.options = &options};
    code = plan_outputs(scenes, count, &options, outputs);
    if (code == 0)
        code = render_all(&run, scenes, outputs, count);
    renderer_destroy(run.renderer);
    for (int i = 0; i < count; i++)
        free(outputs[i]);
    free(outputs);
    return code;
}
