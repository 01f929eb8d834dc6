/* Table 1 of Lensch, Daubert & Seidel 2002 on this machine: tests/bench/scenes cut by 250, 500 and
 * 1,000 planes at 512 x 512 by each of the paper's methods and by slabs, with the reject (lists by
 * depth) and without (every plane looks at every prism), and drawn by tetra at its default. The
 * methods take turns, so that all have the same machine. Errors are against the truth
 * (renderer/truth.h) at 96 x 96, one sample a pixel: what a pixel is off by does not depend on how
 * many there are. Prints one JSON object a line; table1.py makes the table, with the paper's
 * figures beside.
 *
 *   bench_table1 REPEATS SCENE.json... */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "api/scene.h"
#include "renderer/force.h"
#include "renderer/truth.h"
#include "tests/unit/asset_files.h"

enum { SIDE = 512, ERROR_SIDE = 96, REPEATS_MAX = 101, SCENE_BYTES = 1 << 16 };

static const struct method {
    const char *name;
    enum scene_path path;
    enum scene_slicing_method method;
    uint32_t force;
    bool planes; /* else at the path's default */
} methods[] = {
    {"software", SCENE_PATH_SLICING, SCENE_SLICING_SOFTWARE, 0, true},
    {"hybrid", SCENE_PATH_SLICING, SCENE_SLICING_HYBRID, 0, true},
    {"hardware", SCENE_PATH_SLICING, SCENE_SLICING_HARDWARE, FORCE_HOST_LISTS, true},
    {"hardware, device lists", SCENE_PATH_SLICING, SCENE_SLICING_HARDWARE, FORCE_DEVICE_LISTS,
     true},
    {"slabs", SCENE_PATH_SLICING, SCENE_SLICING_SLABS, 0, true},
    {"software, no reject", SCENE_PATH_SLICING, SCENE_SLICING_SOFTWARE, FORCE_EVERY_PLANE, true},
    {"hybrid, no reject", SCENE_PATH_SLICING, SCENE_SLICING_HYBRID, FORCE_EVERY_PLANE, true},
    {"hardware, no reject", SCENE_PATH_SLICING, SCENE_SLICING_HARDWARE, FORCE_EVERY_PLANE, true},
    {"slabs, no reject", SCENE_PATH_SLICING, SCENE_SLICING_SLABS, FORCE_EVERY_PLANE, true},
    {"tetra", SCENE_PATH_TETRA, SCENE_SLICING_AUTO, 0, false},
};
enum { METHODS = sizeof methods / sizeof *methods };

static int open_files;
static const struct asset_source source = {files_open, files_close, &open_files};

static double processor_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static bool failed(const char *what, struct error *err) {
    fprintf(stderr, "bench_table1: %s: %s\n", what,
            err->fault_count ? err->faults[0].message : "failed");
    error_clear(err);
    return false;
}

/* The scene as a method draws it; 0 planes: at the path's default. */
static void set_method(struct scene *scene, const struct method *method, int planes) {
    for (size_t i = 0; i < scene->object_count; i++) {
        if (scene->objects[i].kind != SCENE_OBJECT_SHELL)
            continue;
        scene->objects[i].path = method->path;
        scene->objects[i].quality = (struct scene_quality){0};
        scene->objects[i].quality.slices = planes;
        scene->objects[i].quality.method = method->method;
    }
}

static bool draw(struct renderer *renderer, struct scene *scene, const struct method *method,
                 int planes, int side, struct render_result *result) {
    struct error err = {0};
    set_method(scene, method, planes);
    scene->image.width = scene->image.height = side;
    renderer_force(renderer, method->force);
    enum status status = renderer_render(renderer, scene, &source, result, &err);
    renderer_force(renderer, 0);
    return status == STATUS_OK || failed(method->name, &err);
}

struct taken {
    double wall[REPEATS_MAX], processor[REPEATS_MAX];
    struct error_metrics error;
    struct report_work work;
};

static bool measure_error(struct renderer *renderer, struct scene *scene,
                          const struct method *method, int planes, const struct truth *truth,
                          struct taken *taken) {
    struct render_result result;
    struct error err = {0};
    if (!draw(renderer, scene, method, planes, ERROR_SIDE, &result))
        return false;
    enum status status =
        error_compare(result.pixels, truth->pixels, ERROR_SIDE, ERROR_SIDE, truth->touched,
                      scene->image.background, NULL, &taken->error, &err);
    render_result_finish(&result);
    return status == STATUS_OK || failed("comparing", &err);
}

static void print_list(const char *name, const double *values, int count) {
    printf("\"%s\": [", name);
    for (int n = 0; n < count; n++)
        printf("%s%.2f", n ? ", " : "", values[n]);
    printf("], ");
}

static bool measure(struct renderer *renderer, const char *name, struct scene *scene, int planes,
                    const struct truth *truth, int repeats) {
    static struct taken taken[METHODS];
    bool good = true;
    for (int n = -1; n < repeats && good; n++) /* the first may compile */
        for (size_t m = 0; m < METHODS && good; m++) {
            struct render_result result;
            if ((planes > 0) != methods[m].planes)
                continue;
            if (n < 0) {
                good = measure_error(renderer, scene, &methods[m], planes, truth, &taken[m]);
                continue;
            }
            double began = processor_ms();
            good = draw(renderer, scene, &methods[m], planes, SIDE, &result);
            if (!good)
                break;
            taken[m].processor[n] = processor_ms() - began;
            taken[m].wall[n] = result.report.stage_ms[REPORT_STAGE_draw] +
                               result.report.stage_ms[REPORT_STAGE_sort];
            taken[m].work = result.report.work;
            render_result_finish(&result);
        }
    for (size_t m = 0; m < METHODS && good; m++) {
        if ((planes > 0) != methods[m].planes)
            continue;
        printf("{\"scene\": \"%s\", \"planes\": %d, \"method\": \"%s\", ", name, planes,
               methods[m].name);
        print_list("ms", taken[m].wall, repeats);
        print_list("processor_ms", taken[m].processor, repeats);
        printf("\"rmse\": %.6g, \"max_abs\": %.4g, \"outlines\": %llu, \"prisms\": %llu, "
               "\"fragments\": %llu}\n",
               taken[m].error.touched.rmse, taken[m].error.touched.max_abs,
               (unsigned long long)taken[m].work.segments, (unsigned long long)taken[m].work.prisms,
               (unsigned long long)taken[m].work.fragments);
    }
    fflush(stdout);
    return good;
}

static bool run_scene(struct renderer *renderer, const char *path, int repeats) {
    static char json[SCENE_BYTES];
    FILE *file = fopen(path, "rb");
    size_t length = file ? fread(json, 1, sizeof json, file) : 0;
    if (file)
        fclose(file);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct truth truth;
    if (scene_read(json, length, &arena, &scene, &err) != STATUS_OK)
        return failed(path, &err);
    scene.image.samples = 1;
    scene.image.width = scene.image.height = ERROR_SIDE;
    set_method(&scene, &(struct method){.path = SCENE_PATH_AUTO}, 0);
    struct reference_request request = {.threads = 2};
    bool good = truth_render(&scene, &source, &request, &truth, &err) == STATUS_OK;
    if (!good)
        failed(path, &err);
    static const int planes[] = {250, 500, 1000, 0};
    for (int i = 0; i < 4 && good; i++)
        good = measure(renderer, path, &scene, planes[i], &truth, repeats);
    if (good)
        truth_finish(&truth);
    arena_free(&arena);
    return good;
}

int main(int argc, char **argv) {
    int repeats = argc > 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (repeats < 1 || repeats > REPEATS_MAX) {
        fputs("usage: bench_table1 REPEATS SCENE.json...\n", stderr);
        return 2;
    }
    struct renderer_options options = {.device = -1};
    struct renderer *renderer = NULL;
    if (renderer_create(&options, &renderer, NULL) != STATUS_OK)
        return 1;
    bool good = true;
    for (int i = 2; i < argc && good;
         i++) /* run in the scenes' folder: assets are relative to it */
        good = run_scene(renderer, argv[i], repeats);
    renderer_destroy(renderer);
    return good ? 0 : 1;
}
