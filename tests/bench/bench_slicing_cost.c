/* What slicing costs, and what of: the growth with the planes and with the prisms, the published
 * methods side by side, what either map of the texture costs, and the memory of a prism's
 * attributes beside what Lensch, Daubert & Seidel 2002 tell (section 7: 243 kB for hybrid, 109 with
 * shared edges, 486 for hardware, for a torus of 576). Times are processor time of all threads,
 * which other programs disturb least, in turns, the median. One JSON object a line: {"figure",
 * "value", "note"}; bench.py makes the table.
 *
 *   bench_slicing_cost REPEATS */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "api/scene.h"
#include "renderer/render.h"

enum { REPEATS_MAX = 101, SETTINGS_MAX = 8, SIDE = 256 };

/* One picture: a mesh and a quality of its shell. */
struct setting {
    char mesh[96], quality[96];
    double x; /* what it is measured against */
    double cpu_ms[REPEATS_MAX], middle;
    struct report_work work;
};

static enum status no_asset(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    (void)user;
    (void)bytes;
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s", name);
}

static double cpu_ms(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static bool draw(struct renderer *renderer, struct setting *setting, const char *material,
                 double *ms) {
    char json[1024];
    snprintf(
        json, sizeof json,
        "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"objects\": [{\"shell\": "
        "{\"mesh\": {%s}, \"thickness\": 0.15, \"tiles\": [6, 3], \"material\": {%s}}, "
        "\"path\": \"slicing\", \"quality\": {%s}}]}",
        SIDE, SIDE, setting->mesh, material, setting->quality);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source assets = {.open = no_asset};
    struct render_result result;
    double began = cpu_ms();
    enum status status = scene_read(json, strlen(json), &arena, &scene, &err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, &scene, &assets, &result, &err);
    *ms = cpu_ms() - began;
    if (status == STATUS_OK) {
        setting->work = result.report.work;
        render_result_finish(&result);
    } else {
        fprintf(stderr, "bench_slicing_cost: %s: %s\n", setting->quality,
                err.fault_count ? err.faults[0].message : "failed");
    }
    error_clear(&err);
    arena_free(&arena);
    return status == STATUS_OK;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

#define CLOUDS "\"builtin\": \"clouds\", \"size\": [64, 64, 32]"

/* All settings in turns; the first round, which may compile and upload, is not counted. */
static bool measure(struct renderer *renderer, struct setting *settings, int count, int repeats) {
    double ms;
    for (int n = -1; n < repeats; n++)
        for (int s = 0; s < count; s++) {
            if (!draw(renderer, &settings[s], CLOUDS, &ms))
                return false;
            if (n >= 0)
                settings[s].cpu_ms[n] = ms;
        }
    for (int s = 0; s < count; s++) {
        qsort(settings[s].cpu_ms, (size_t)repeats, sizeof ms, by_value);
        settings[s].middle = settings[s].cpu_ms[repeats / 2];
    }
    return true;
}

static void tell_growth(const char *figure, const char *of, const struct setting *settings,
                        int count) {
    double sx = 0, sy = 0, sxx = 0, sxy = 0;
    printf("{\"figure\": \"%s\", \"note\": \"", figure);
    for (int s = 0; s < count; s++) {
        double x = log(settings[s].x), y = log(settings[s].middle);
        sx += x, sy += y, sxx += x * x, sxy += x * y;
        printf("%s%.0f %s %.0f ms", s ? ", " : "", settings[s].x, of, settings[s].middle);
    }
    printf("\", \"value\": \"n^%.2f\"}\n", (count * sxy - sx * sy) / (count * sxx - sx * sx));
    fflush(stdout);
}

#define TORUS_576 "\"shape\": \"torus\", \"divisions\": [24, 12]"
#define TERRAIN   "\"shape\": \"terrain\", \"divisions\": [40, 40]"

static const char *const methods[] = {"slabs", "software", "hybrid", "hardware"};
enum { METHODS = sizeof methods / sizeof *methods };

static bool growth(struct renderer *renderer, int repeats) {
    struct setting settings[SETTINGS_MAX];
    char figure[96];
    for (int m = 0; m < METHODS; m++) {
        for (int i = 0; i < 4; i++) {
            snprintf(settings[i].mesh, sizeof settings[i].mesh, TORUS_576);
            snprintf(settings[i].quality, sizeof settings[i].quality,
                     "\"method\": \"%s\", \"slices\": %d", methods[m], 250 << i);
            settings[i].x = 250 << i;
        }
        if (!measure(renderer, settings, 4, repeats))
            return false;
        snprintf(figure, sizeof figure, "%s, cost against planes (torus of 576)", methods[m]);
        tell_growth(figure, "planes", settings, 4);
        for (int i = 0; i < 4; i++) {
            snprintf(settings[i].mesh, sizeof settings[i].mesh,
                     "\"shape\": \"torus\", \"divisions\": [%d, %d]", 24 << i, 12 << i);
            snprintf(settings[i].quality, sizeof settings[i].quality,
                     "\"method\": \"%s\", \"slices\": 500", methods[m]);
            settings[i].x = 576 << 2 * i;
        }
        if (!measure(renderer, settings, 4, repeats))
            return false;
        snprintf(figure, sizeof figure, "%s, cost against prisms (500 planes)", methods[m]);
        tell_growth(figure, "prisms", settings, 4);
    }
    return true;
}

static bool side_by_side(struct renderer *renderer, int repeats) {
    static const char *const meshes[] = {TORUS_576, TERRAIN}, *const names[] = {"torus", "terrain"};
    struct setting settings[SETTINGS_MAX];
    for (int s = 0; s < 2; s++) {
        for (int i = 0; i < 2 * METHODS; i++) {
            bool other = i >= METHODS; /* the map that is not the method's own */
            snprintf(settings[i].mesh, sizeof settings[i].mesh, "%s", meshes[s]);
            snprintf(settings[i].quality, sizeof settings[i].quality,
                     "\"method\": \"%s\", \"slices\": 500, \"map\": \"%s\"", methods[i % METHODS],
                     other == (i % METHODS != 0) ? "exact" : "affine");
        }
        if (!measure(renderer, settings, 2 * METHODS, repeats))
            return false;
        for (int i = 0; i < METHODS; i++) {
            const struct setting *own = &settings[i], *other = &settings[i + METHODS];
            printf(
                "{\"figure\": \"%s, 500 planes, %s\", \"value\": \"%.0f ms\", \"note\": \"%.2f of "
                "hybrid; uploads %.2f MB; by the %s map %.0f ms\"}\n",
                names[s], methods[i], own->middle, own->middle / settings[2].middle,
                (double)own->work.upload_bytes / 1e6, i ? "exact" : "affine", other->middle);
        }
        fflush(stdout);
    }
    return true;
}

/* What stays on the device: what a first picture uploads and a second does not. A homogeneous
 * medium has no textures; what the exact map takes is told by one that has. */
static bool memory(const struct renderer_options *options) {
    static const char *const paper[] = {NULL, NULL, "243 kB, 109 with shared edges", "486 kB"};
    for (int m = 0; m < METHODS; m++) {
        struct renderer *renderer = NULL;
        if (renderer_create(options, &renderer, NULL) != STATUS_OK)
            return false;
        struct setting setting = {.mesh = TORUS_576};
        snprintf(setting.quality, sizeof setting.quality, "\"method\": \"%s\", \"slices\": 500",
                 methods[m]);
        static const char medium[] = "\"builtin\": \"homogeneous\", \"extinction\": 3";
        double ms;
        bool good = draw(renderer, &setting, medium, &ms);
        uint64_t first = setting.work.upload_bytes, prisms = setting.work.prisms;
        good = good && draw(renderer, &setting, medium, &ms);
        renderer_destroy(renderer);
        if (!good)
            return false;
        uint64_t stays = first - setting.work.upload_bytes;
        printf("{\"figure\": \"%s, attributes that stay on the device\", \"value\": \"%.0f B a "
               "prism\", \"note\": \"%.0f kB for %llu prisms%s%s; of the planes %.0f kB for each "
               "picture\"}\n",
               methods[m], (double)stays / (double)prisms, (double)stays / 1024,
               (unsigned long long)prisms, paper[m] ? "; paper " : "", paper[m] ? paper[m] : "",
               (double)setting.work.upload_bytes / 1024);
    }
    return true;
}

int main(int argc, char **argv) {
    int repeats = argc == 2 ? (int)strtol(argv[1], NULL, 10) : 0;
    if (repeats < 1 || repeats > REPEATS_MAX) {
        fputs("usage: bench_slicing_cost REPEATS\n", stderr);
        return 2;
    }
    struct renderer_options options = {.device = -1};
    struct renderer *renderer = NULL;
    if (renderer_create(&options, &renderer, NULL) != STATUS_OK)
        return 1;
    bool good = side_by_side(renderer, repeats) && growth(renderer, repeats);
    renderer_destroy(renderer);
    return good && memory(&options) ? 0 : 1;
}
