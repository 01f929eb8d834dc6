/* What leaving a part out saves: for each part of the plan, a scene that does not need it, drawn as
 * planned and with the part put in (renderer/force.h), in turns. Prints one JSON object a line;
 * bench.py makes the table.
 *
 * Both ways draw the same picture; where they differ by more than a row's bound, the program ends
 * with 1. Bytes are those of a first picture, in a renderer of its own. Fetches are counted
 * by the shaders themselves, in pictures that are not timed: each call of texture() or texelFetch()
 * that a sample inside a triangle reaches, over all samples of the picture
 * (shaders/common_count.glsl).
 *
 *   bench_plan REPEATS [PART]   all rows, or those of one part
 *   bench_plan --library N      opens module N, in a process that does nothing else */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "api/scene.h"
#include "renderer/asset/module.h"
#include "renderer/force.h"
#include "renderer/gl/clock.h"

#define SCENE(image, objects) "{'image': {'width': 192, 'height': 192" image "}, " objects "}"
#define SHELL(mesh, material, beside)                                                              \
    "'objects': [{'shell': {'mesh': {" mesh "}, 'material': {" material "}}" beside "}]"
#define TORUS  "'shape': 'torus'"
#define CHAIN  "'builtin': 'chain'"
#define FUR    "'builtin': 'fur'"
#define MIST   "'builtin': 'homogeneous', 'extinction': 4"
#define SORTED ", 'quality': {'order': 'sorted'}"
#define TETRA  ", 'path': 'tetra'" /* the cheaper one, sorted, may be another */
/* By the prisms' own map sorted cells and closed forms end at planes where walks end at ruled
 * sides: what is compared here is drawn by the affine one. */
#define AFFINE ", 'path': 'tetra', 'quality': {'map': 'affine'}"
#define DIM    "'lights': [], 'ambient': [1, 1, 1], "
/* A whole scene: a shell over its base, and a plain mesh that stands through it. */
#define WHOLE(material)                                                                            \
    "'objects': [{'shell': {'mesh': {" TORUS "}, 'base': {'color': [0.3, 0.2, 0.1]}, "             \
    "'material': {" material "}}}, {'mesh': {'shape': 'sphere', 'radius': 0.8}}]"

/* The largest difference between the two pictures of a row: fp32 rounding, 4e-7 where a closed form
 * becomes steps and 0 elsewhere. */
static const double largest_max = 1e-6;
/* The root mean square where cells are sorted instead of walked: sums run in another order, lengths
 * come from edges instead of planes, a span next to a whole number of steps may take one more, and
 * a walk ends at a transmittance of 0.1 / samples^2. All of them: 2e-5 on the fur torus. */
static const double rms_max = 5e-5;

static const struct row {
    const char *part;  /* of the plan */
    const char *scene; /* in words */
    uint32_t force;
    const char *json;
} rows[] = {
    {"media", "solid alone, walked", FORCE_MEDIUM, SCENE("", SHELL(TORUS, CHAIN, ""))},
    {"media+sort", "solid alone, cells", FORCE_MEDIUM, SCENE("", SHELL(TORUS, CHAIN, SORTED))},
    {"media+occluded", "opaque: solid, base and mesh", FORCE_MEDIUM, SCENE("", WHOLE(CHAIN))},
    {"solid", "medium alone, walked", FORCE_SOLID, SCENE("", SHELL(TORUS, FUR, ""))},
    {"sort", "one voxel medium", FORCE_SORT, SCENE("", SHELL(TORUS, FUR, AFFINE))},
    {"sort", "one homogeneous medium", FORCE_SORT, SCENE("", SHELL(TORUS, MIST, TETRA))},
    {"depth", "one solid shell", FORCE_DEPTH, SCENE("", SHELL(TORUS, CHAIN, ""))},
    {"occluded", "nothing opaque, walked", FORCE_OCCLUDED, SCENE("", SHELL(TORUS, FUR, ""))},
    {"occluded", "nothing opaque, cells", FORCE_OCCLUDED, SCENE("", SHELL(TORUS, MIST, SORTED))},
    {"eye-inside", "shell before the eye", FORCE_EYE_INSIDE, SCENE("", SHELL(TORUS, MIST, SORTED))},
    {"voxels", "homogeneous medium", FORCE_VOXELS, SCENE("", SHELL(TORUS, MIST, AFFINE))},
    {"light", "medium, ambient light", FORCE_LIGHT, SCENE("", DIM SHELL(TORUS, FUR, ""))},
    {"light", "solid, ambient light", FORCE_LIGHT, SCENE("", DIM SHELL(TORUS, CHAIN, ""))},
    {"light", "unlit medium", FORCE_LIGHT, SCENE("", DIM SHELL(TORUS, FUR ", 'lit': false", ""))},
    {"light", "mesh, ambient light", FORCE_LIGHT,
     SCENE("", DIM "'objects': [{'mesh': {'shape': 'teapot'}}]")},
    {"specular", "dull lit medium", FORCE_SPECULAR, SCENE("", SHELL(TORUS, FUR, ""))},
    {"specular", "dull lit solid", FORCE_SPECULAR, SCENE("", SHELL(TORUS, CHAIN, ""))},
    {"shadow", "medium, no shadow", FORCE_SHADOW, SCENE("", SHELL(TORUS, FUR, ""))},
    {"shadow", "solid, no shadow", FORCE_SHADOW, SCENE("", SHELL(TORUS, CHAIN, ""))},
    {"shadow", "mesh, no shadow", FORCE_SHADOW,
     SCENE("", "'objects': [{'mesh': {'shape': 'teapot'}}]")},
    {"shadow", "fur, base and mesh, no shadow", FORCE_SHADOW, SCENE("", WHOLE(FUR))},
    {"base-textures", "mesh of one colour", FORCE_TEXTURED,
     SCENE("", "'objects': [{'mesh': {'shape': 'teapot'}}]")},
    {"supersampling", "even picture, 1 sample", FORCE_SAMPLES,
     SCENE(", 'samples': 1",
           "'camera': {'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], "
           "'ortho_height': 2}, " SHELL("'shape': 'plane', 'size': [8, 8]", MIST, ""))},
};

static int fail(const char *what, const struct error *err) {
    fprintf(stderr, "bench_plan: %s: %s\n", what,
            err->fault_count ? err->faults[0].message : status_title(err->status));
    return 1;
}

static enum status no_asset(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s here", name);
}

static const struct asset_source no_assets = {.open = no_asset};
static const struct renderer_options options = {.device = -1};

/* One way of drawing a scene, from a first picture in a renderer of its own. */
struct way {
    uint64_t bytes, draws, samples;
    size_t passes;
    double fetches; /* a sample */
};

/* What is drawn stands before the parts that this takes, and ends with resolve. */
static size_t count_passes(const struct report *report) {
    size_t i = 0;
    while (i < report->pass_count && strcmp(report->passes[i].name, "resolve") != 0)
        i++;
    return i + 1;
}

static enum status look_at(const struct scene *scene, uint32_t force, struct way *way,
                           struct error *err) {
    struct renderer *renderer;
    struct render_result result;
    enum status status = renderer_create(&options, &renderer, err);
    if (status != STATUS_OK)
        return status;
    renderer_force(renderer, force);
    status = renderer_count_fetches(renderer, true, err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, scene, &no_assets, &result, err);
    if (status == STATUS_OK) {
        const struct report_work *work = &result.report.work;
        *way = (struct way){work->upload_bytes, work->draws, work->samples,
                            count_passes(&result.report),
                            (double)renderer_fetches(renderer) / (double)work->samples};
        render_result_finish(&result);
    }
    renderer_destroy(renderer);
    return status;
}

struct difference {
    double largest, rms;
};

static struct difference compare(const struct render_result *a, const struct render_result *b) {
    struct difference d = {0, 0};
    size_t count = 4 * (size_t)a->width * (size_t)a->height;
    for (size_t i = 0; i < count; i++) {
        double off = fabs((double)a->pixels[i] - (double)b->pixels[i]);
        d.largest = fmax(d.largest, off);
        d.rms += off * off;
    }
    d.rms = sqrt(d.rms / (double)count);
    return d;
}

/* Prints the times of pictures drawn in turns, the two orders in turn too: [draw, total] of each
 * way.
 */
static enum status time_both(struct renderer *renderer, const struct scene *scene, uint32_t force,
                             int repeats, struct difference *worst, struct error *err) {
    enum { WARM = 2 };
    printf("\"ms\": [");
    for (int i = -WARM; i < repeats; i++) {
        struct render_result results[2];
        for (int turn = 0; turn < 2; turn++) {
            int way = turn ^ (i & 1);
            renderer_force(renderer, way ? force : 0);
            enum status status = renderer_render(renderer, scene, &no_assets, &results[way], err);
            if (status != STATUS_OK)
                return status;
        }
        struct difference now = compare(&results[0], &results[1]);
        worst->largest = fmax(worst->largest, now.largest);
        worst->rms = fmax(worst->rms, now.rms);
        if (i >= 0)
            printf("%s[[%.4f, %.4f], [%.4f, %.4f]]", i ? ", " : "",
                   results[0].report.stage_ms[REPORT_STAGE_draw], results[0].report.total_ms,
                   results[1].report.stage_ms[REPORT_STAGE_draw], results[1].report.total_ms);
        render_result_finish(&results[0]);
        render_result_finish(&results[1]);
    }
    printf("], ");
    return STATUS_OK;
}

static void print_way(const char *name, const struct way *way) {
    printf("\"%s\": {\"passes\": %zu, \"draws\": %llu, \"bytes\": %llu, \"fetches\": %.4f}, ", name,
           way->passes, (unsigned long long)way->draws, (unsigned long long)way->bytes,
           way->fetches);
}

static int measure(const struct row *row, int repeats) {
    char json[1024];
    int length = snprintf(json, sizeof json, "%s", row->json);
    for (char *c = json; *c; c++)
        *c = *c == '\'' ? '"' : *c;
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct way planned = {0}, more = {0};
    struct renderer *renderer = NULL; /* after the two that look: contexts cannot share a thread */
    struct difference worst = {0, 0};
    int code = 1;
    if (scene_read(json, (size_t)length, &arena, &scene, &err) != STATUS_OK ||
        look_at(&scene, 0, &planned, &err) != STATUS_OK ||
        look_at(&scene, row->force, &more, &err) != STATUS_OK ||
        renderer_create(&options, &renderer, &err) != STATUS_OK)
        goto done;
    printf("{\"part\": \"%s\", \"scene\": \"%s\", ", row->part, row->scene);
    print_way("planned", &planned);
    print_way("forced", &more);
    if (time_both(renderer, &scene, row->force, repeats, &worst, &err) != STATUS_OK)
        goto done;
    printf("\"largest\": %.3g, \"rms\": %.3g}\n", worst.largest, worst.rms);
    fflush(stdout);
    code = 0;
    if (!(row->force & FORCE_SORT ? worst.rms <= rms_max : worst.largest <= largest_max)) {
        fprintf(stderr, "bench_plan: %s, %s: the pictures differ by %.3g (rms %.3g)\n", row->part,
                row->scene, worst.largest, worst.rms);
        code = 1;
    }
done:
    if (err.status != STATUS_OK)
        fail(row->part, &err);
    renderer_destroy(renderer);
    error_clear(&err);
    arena_free(&arena);
    return code;
}

static int count_mapped(void) {
    FILE *file = fopen("/proc/self/maps", "re");
    char line[4352], last[4352] = "";
    int count = 0;
    while (file && fgets(line, sizeof line, file)) {
        const char *name = strchr(line, '/');
        if (name && strstr(name, ".so") && strcmp(name, last) != 0) {
            count++;
            snprintf(last, sizeof last, "%s", name);
        }
    }
    if (file)
        fclose(file);
    return count;
}

static long resident_kib(void) {
    FILE *file = fopen("/proc/self/statm", "re");
    long pages = 0;
    if (file && fscanf(file, "%*s %ld", &pages) != 1)
        pages = 0;
    if (file)
        fclose(file);
    return pages * (sysconf(_SC_PAGESIZE) / 1024);
}

static int open_library(long number) {
    if (number < 0 || number >= MODULE_COUNT)
        return 2;
    struct error err = {0};
    int mapped = count_mapped();
    long kib = resident_kib();
    double began_ms = clock_now_ms();
    if (!module_open((enum module)number, &err))
        return fail("a module", &err);
    double ms = clock_now_ms() - began_ms;
    printf("{\"library\": \"%s\", \"ms\": %.3f, \"mapped\": %d, \"kib\": %ld}\n",
           module_describe((enum module)number)->name, ms, count_mapped() - mapped,
           resident_kib() - kib);
    return 0;
}

int main(int argc, char **argv) {
    if (argc == 3 && strcmp(argv[1], "--library") == 0)
        return open_library(strtol(argv[2], NULL, 10));
    int repeats = argc >= 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (argc > 3 || repeats < 1) {
        fputs("usage: bench_plan REPEATS [PART] | --library NUMBER\n", stderr);
        return 2;
    }
    int code = 0;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        if (argc < 3 || strcmp(argv[2], rows[i].part) == 0)
            code |= measure(&rows[i], repeats);
    return code;
}
