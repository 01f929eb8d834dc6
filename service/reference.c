/* `pelt reference`: the true picture of one scene, in doubles, on the CPU, and the errors of
 * another picture of it. Opens no GL.
 *
 * Progress goes to the standard error where that is a terminal, or where --verbose asks for it;
 * what was found goes to the standard output. */
#include "service/reference.h"

#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"
#include "renderer/gl/clock.h"
#include "renderer/truth.h"
#include "service/cli.h"
#include "service/encode.h"
#include "service/files.h"

enum { PICTURE_BYTES_MAX = 1 << 30 };

static const char usage[] =
    "usage: pelt reference SCENE.json -o OUT.png [OPTIONS]\n"
    "\n"
    "Draws the true picture of a scene, in double precision, without OpenGL. Takes minutes where "
    "a\n"
    "path takes milliseconds. - is the standard input, or output. Assets lie beside the scene.\n"
    "\n"
    "  -o, --output FILE          where the picture goes, .png or .exr\n"
    "  --compare PICTURE.exr      tell the errors of another picture of the same scene\n"
    "  --flip-map FILE            where its FLIP errors go, .png or .exr, black to white\n"
    "  --assets DIR               where assets lie\n"
    "  --threads N                how many threads draw (one for each core)\n"
    "  --quiet                    print nothing but errors\n"
    "  --verbose                  tell the progress, also where there is no terminal\n";

struct options {
    const char *output, *compare, *flip_map, *assets;
    int threads;
    bool quiet, verbose;
};

enum {
    OPT_COMPARE = CLI_OPT_FIRST_FREE,
    OPT_FLIP_MAP,
    OPT_ASSETS,
    OPT_THREADS,
    OPT_QUIET,
    OPT_VERBOSE
};

static bool parse_threads(const char *text, int *threads) {
    char *end;
    errno = 0;
    long value = strtol(text, &end, 10);
    if (errno || end == text || *end || value < 1 || value > 256)
        return false;
    *threads = (int)value;
    return true;
}

/* 0, or the exit code after a message; -1: the help was printed. */
static int parse_options(int argc, char **argv, struct options *options) {
    static const struct option rows[] = {{"output", required_argument, NULL, 'o'},
                                         {"compare", required_argument, NULL, OPT_COMPARE},
                                         {"flip-map", required_argument, NULL, OPT_FLIP_MAP},
                                         {"assets", required_argument, NULL, OPT_ASSETS},
                                         {"threads", required_argument, NULL, OPT_THREADS},
                                         {"quiet", no_argument, NULL, OPT_QUIET},
                                         {"verbose", no_argument, NULL, OPT_VERBOSE},
                                         {"help", no_argument, NULL, 'h'},
                                         {0}};
    *options = (struct options){0};
    int option;
    while ((option = getopt_long(argc, argv, "o:hqv", rows, NULL)) != -1) {
        switch (option) {
        case 'o':
            options->output = optarg;
            break;
        case OPT_COMPARE:
            options->compare = optarg;
            break;
        case OPT_FLIP_MAP:
            options->flip_map = optarg;
            break;
        case OPT_ASSETS:
            options->assets = optarg;
            break;
        case OPT_THREADS:
            if (!parse_threads(optarg, &options->threads))
                return cli_usage("reference", "%s is not a number of threads from 1 to 256",
                                 optarg);
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
        default:
            return status_exit_code(STATUS_USAGE); /* getopt has said what is wrong */
        }
    }
    return 0;
}

static bool format_of(const char *path, enum encode_format *format) {
    const char *dot = strrchr(path, '.');
    *format = ENCODE_PNG;
    if (strcmp(path, "-") == 0 || (dot && strcasecmp(dot, ".png") == 0))
        return true;
    *format = ENCODE_EXR;
    return dot && strcasecmp(dot, ".exr") == 0;
}

static int check_options(int scene_count, const struct options *options) {
    enum encode_format format;
    if (scene_count != 1)
        return cli_usage("reference", scene_count ? "one scene at a time" : "which scene?");
    if (!options->output && !options->compare)
        return cli_usage("reference", "what for? -o, --compare, or both");
    if (options->flip_map && !options->compare)
        return cli_usage("reference", "--flip-map needs --compare");
    if (options->output && !format_of(options->output, &format))
        return cli_usage("reference", "%s ends in neither .png nor .exr", options->output);
    if (options->flip_map && !format_of(options->flip_map, &format))
        return cli_usage("reference", "%s ends in neither .png nor .exr", options->flip_map);
    return 0;
}

/* ---- progress ---- */

struct progress {
    double began_ms, told_ms;
    bool terminal;
};

static void show_progress(void *user, size_t done, size_t total) {
    struct progress *progress = user;
    double now = clock_now_ms();
    if (done < total && now - progress->told_ms < (progress->terminal ? 200 : 5000))
        return;
    progress->told_ms = now;
    double spent_s = (now - progress->began_ms) / 1000, share = (double)done / (double)total;
    double left_s = done ? spent_s * (1 - share) / share : 0;
    fprintf(stderr, "%sreference: %5.1f %%, %.1f s, %.0f s left%s", progress->terminal ? "\r" : "",
            100 * share, spent_s, left_s, progress->terminal && done < total ? "  " : "\n");
}

/* ---- the other picture ---- */

/* Premultiplied RGBA of the same size as the truth; malloc'ed. */
static enum status read_picture(const char *path, const struct truth *truth, float **pixels,
                                struct error *err) {
    unsigned char *data = NULL;
    size_t bytes = 0;
    *pixels = NULL;
    const struct image_module *oiio = module_open(MODULE_IMAGE_OIIO, err);
    if (!oiio)
        return STATUS_IO_ERROR;
    enum status status = files_read(path, PICTURE_BYTES_MAX, &data, &bytes, err);
    if (status != STATUS_OK)
        return status;
    struct image_pixels image = {0};
    char message[256] = "";
    if (oiio->decode(data, bytes, &image, message, sizeof message) != 0)
        status = error_fault(err, STATUS_BAD_ASSET, NULL, "%s: %s", path, message);
    else if (!image.is_float)
        status = error_fault(err, STATUS_BAD_ASSET, NULL,
                             "%s: only pictures of floats (EXR) can be compared", path);
    else if (image.width != truth->width || image.height != truth->height || image.channels != 4)
        status = error_fault(err, STATUS_BAD_ASSET, NULL,
                             "%s: %d x %d pixels of %d channels, the scene's picture has %d x %d "
                             "of 4",
                             path, image.width, image.height, image.channels, truth->width,
                             truth->height);
    if (status == STATUS_OK)
        *pixels = image.data;
    else
        free(image.data);
    free(data);
    return status;
}

static enum status write_picture(const char *path, const float *pixels, const struct truth *truth,
                                 struct error *err) {
    enum encode_format format;
    unsigned char *data = NULL;
    size_t bytes = 0;
    format_of(path, &format);
    enum status status =
        encode_image(format, pixels, truth->width, truth->height, &data, &bytes, err);
    if (status == STATUS_OK)
        status = files_write(path, data, bytes, err);
    free(data);
    return status;
}

static enum status write_map(const char *path, const float *map, const struct truth *truth,
                             struct error *err) {
    enum encode_format format;
    unsigned char *data = NULL;
    size_t bytes = 0;
    format_of(path, &format);
    enum status status = encode_map(format, map, truth->width, truth->height, &data, &bytes, err);
    if (status == STATUS_OK)
        status = files_write(path, data, bytes, err);
    free(data);
    return status;
}

static void print_figures(FILE *out, const char *name, const struct error_figures *figures) {
    fprintf(out, "  %-8s %9zu pixels  rmse %.3e  largest %.3e  p99 %.3e\n", name, figures->pixels,
            figures->rmse, figures->max_abs, figures->p99);
}

static enum status compare(const struct options *options, const struct scene *scene,
                           const struct truth *truth, struct error *err) {
    float *test = NULL;
    struct error_metrics metrics;
    size_t count = (size_t)truth->width * (size_t)truth->height;
    enum status status = read_picture(options->compare, truth, &test, err);
    if (status != STATUS_OK)
        return status;
    float *map = malloc((count + 1) * sizeof *map);
    if (map)
        status = error_compare(test, truth->pixels, truth->width, truth->height, truth->touched,
                               scene->image.background, map, &metrics, err);
    else
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a map");
    if (status == STATUS_OK && options->flip_map)
        status = write_map(options->flip_map, map, truth, err);
    if (status == STATUS_OK && !options->quiet) {
        FILE *out = options->output && strcmp(options->output, "-") == 0 ? stderr : stdout;
        fprintf(out, "%s against the reference\n", options->compare);
        print_figures(out, "touched", &metrics.touched);
        print_figures(out, "whole", &metrics.whole);
        fprintf(out, "  coverage %9zu pixels  psnr %.2f dB  flip %.5f\n", metrics.coverage,
                metrics.psnr_db, metrics.flip);
        if (metrics.not_finite)
            fprintf(out, "  %zu pixels are no numbers\n", metrics.not_finite);
    }
    free(map);
    free(test);
    return status;
}

static enum status draw(const char *path, const struct options *options, struct error *err) {
    struct cli_scene scene;
    struct file_assets files = {0};
    struct truth truth = {0};
    enum status status = cli_scene_read(path, &scene, err);
    if (status != STATUS_OK)
        return status;
    status = file_assets_init(&files, options->assets, path, err);
    struct asset_source assets = file_assets_source(&files);
    struct progress progress = {.began_ms = clock_now_ms(), .terminal = isatty(STDERR_FILENO) != 0};
    bool tell = !options->quiet && (options->verbose || progress.terminal);
    struct reference_request request = {
        .threads = options->threads, .progress = tell ? show_progress : NULL, .user = &progress};
    if (status == STATUS_OK)
        status = truth_render(&scene.scene, &assets, &request, &truth, err);
    if (status == STATUS_OK && options->output)
        status = write_picture(options->output, truth.pixels, &truth, err);
    if (status == STATUS_OK && !options->quiet && options->output &&
        strcmp(options->output, "-") != 0)
        printf("%s  %.1f s\n", options->output, (clock_now_ms() - progress.began_ms) / 1000);
    if (status == STATUS_OK && truth.unresolved)
        fprintf(stderr, "pelt: %s: %llu intervals missed the tolerance of 1e-8\n", path,
                (unsigned long long)truth.unresolved);
    if (status == STATUS_OK && truth.folded)
        fprintf(stderr, "pelt: %s: %llu prisms fold over; each of their sheets is drawn\n", path,
                (unsigned long long)truth.folded);
    if (status == STATUS_OK && options->compare)
        status = compare(options, &scene.scene, &truth, err);
    truth_finish(&truth);
    file_assets_finish(&files);
    cli_scene_finish(&scene);
    return status;
}

int reference_main(int argc, char **argv) {
    struct options options;
    int code = parse_options(argc, argv, &options);
    if (code != 0)
        return code < 0 ? 0 : code;
    code = check_options(argc - optind, &options);
    if (code != 0)
        return code;
    struct error err = {0};
    enum status status = draw(argv[optind], &options, &err);
    if (status != STATUS_OK) {
        cli_print_error(argv[optind], &err);
        code = status_exit_code(status);
    }
    error_clear(&err);
    return code;
}
