/* One cell of the matrix: a case, drawn by one path, against the truth. See matrix.h.
 *
 * Voxels that no material of a scene makes are written over those that it did make, as the volume
 * leaves its cache for the first time: the linker sends every volume_acquire() here
 * (--wrap=volume_acquire, Makefile). So path and reference read the same voxels, and each goes the
 * whole way from the scene. Each case has a seed of its own, and thereby a key of its own. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

#include "api/scene.h"
#include "renderer/error/metrics.h"
#include "renderer/gl/clock.h"
#include "renderer/reference/reference.h"
#include "tests/stability/matrix.h"

const struct matrix_path matrix_paths[] = {
    {"walk", SCENE_PATH_TETRA, SCENE_ORDER_WALK}, {"sorted", SCENE_PATH_TETRA, SCENE_ORDER_SORTED},
    {"auto", SCENE_PATH_AUTO, SCENE_ORDER_AUTO},  {"slabs", SCENE_PATH_SLICING, SCENE_ORDER_AUTO},
    {NULL, SCENE_PATH_AUTO, SCENE_ORDER_AUTO},
};

const char *const matrix_verdicts[] = {"right", "refused", "warned", "WRONG"};

enum { CACHE_BYTES = 512 << 20, SLICES_A_STEP = 20, SLICES_MOST = 4096 };
enum { PRISM_SLICES_MOST = 1 << 26 };

struct matrix_truth {
    const struct matrix_case *of;
    struct arena arena;
    struct scene scene;
    struct blob glb;
    struct asset_source assets;
    struct reference_result drawn;
    float *pixels; /* drawn, in fp32 */
    double ms;
};

/* The case whose voxels volume_acquire() shall give: the linker gives no other way in. */
static const struct matrix_case *current;
static const char *pictures;

void matrix_set_pictures(const char *folder) {
    pictures = folder;
}

enum status __real_volume_acquire(struct volume_cache *cache, const struct scene_material *spec,
                                  double thickness, const char *pointer,
                                  const struct asset_source *source, const struct volume **volume,
                                  bool *made, struct error *err);
enum status __wrap_volume_acquire(struct volume_cache *cache, const struct scene_material *spec,
                                  double thickness, const char *pointer,
                                  const struct asset_source *source, const struct volume **volume,
                                  bool *made, struct error *err);

enum status __wrap_volume_acquire(struct volume_cache *cache, const struct scene_material *spec,
                                  double thickness, const char *pointer,
                                  const struct asset_source *source, const struct volume **volume,
                                  bool *made, struct error *err) {
    bool fresh = false;
    enum status status =
        __real_volume_acquire(cache, spec, thickness, pointer, source, volume, &fresh, err);
    if (status == STATUS_OK && fresh && current && current->voxels) {
        struct volume *writable = (struct volume *)(uintptr_t)*volume;
        current->voxels(writable, current);
    }
    *made |= fresh;
    return status;
}

static enum status open_glb(void *user, const char *name, const char *pointer,
                            struct asset_bytes *bytes, struct error *err) {
    const struct matrix_truth *truth = user;
    if (strcmp(name, "mesh.glb") != 0 || !truth->glb.data)
        return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no asset %s", name);
    *bytes = (struct asset_bytes){.data = truth->glb.data, .size = truth->glb.size};
    gnutls_hash_fast(GNUTLS_DIG_SHA256, bytes->data, bytes->size, bytes->sha256);
    return STATUS_OK;
}

static void close_glb(void *user, struct asset_bytes *bytes) {
    (void)user;
    (void)bytes;
}

static void tell(const struct error *err, char reason[256]) {
    const char *pointer = err->fault_count && err->faults[0].pointer ? err->faults[0].pointer : "";
    snprintf(reason, 256, "%s %s", pointer, err->fault_count ? err->faults[0].message : "?");
}

void matrix_truth_free(struct matrix_truth *truth) {
    if (!truth)
        return;
    reference_result_finish(&truth->drawn);
    arena_free(&truth->arena);
    free(truth->glb.data);
    free(truth->pixels);
    free(truth);
}

double matrix_truth_ms(const struct matrix_truth *truth) {
    return truth->ms;
}

uint64_t matrix_truth_unresolved(const struct matrix_truth *truth) {
    return truth->drawn.unresolved;
}

/* A number of its own for each case, from its name: FNV-1a. */
static uint32_t seed_of(const struct matrix_case *of) {
    uint32_t seed = 2166136261u;
    for (const char *c = of->name; *c; c++)
        seed = (seed ^ (unsigned char)*c) * 16777619u;
    return seed;
}

struct matrix_truth *matrix_truth_make(const struct matrix_case *of, char reason[256]) {
    struct matrix_truth *truth = calloc(1, sizeof *truth);
    struct error err = {0};
    snprintf(reason, 256, "no memory");
    if (!truth)
        return NULL;
    double started = clock_now_ms();
    truth->of = current = of;
    if (of->mesh)
        of->mesh(&truth->glb, of);
    truth->assets = (struct asset_source){open_glb, close_glb, truth};
    struct reference_sources sources = {mesh_cache_create(CACHE_BYTES),
                                        volume_cache_create(CACHE_BYTES), &truth->assets};
    struct reference *reference = NULL;
    enum status status =
        scene_read(of->scene, strlen(of->scene), &truth->arena, &truth->scene, &err);
    if (status == STATUS_OK && !truth->scene.camera.given)
        status = error_fault(&err, STATUS_INVALID_SCENE, "/camera", "a case gives its camera");
    for (size_t i = 0; status == STATUS_OK && of->voxels && i < truth->scene.object_count; i++)
        truth->scene.objects[i].shell.material.seed = seed_of(of);
    struct scene drawn = truth->scene;
    if (of->truth_samples)
        drawn.image.samples = of->truth_samples;
    if (status == STATUS_OK)
        status = reference_create(&drawn, &sources, &reference, &err);
    struct reference_request request = {0};
    if (status == STATUS_OK)
        status = reference_render(reference, &request, &truth->drawn, &err);
    reference_destroy(reference);
    volume_cache_destroy(sources.volumes);
    mesh_cache_destroy(sources.meshes);
    current = NULL;
    size_t count = truth->drawn.count;
    if (status == STATUS_OK)
        truth->pixels = malloc((count + 1) * 4 * sizeof *truth->pixels);
    if (status != STATUS_OK || !truth->pixels) {
        tell(&err, reason);
        error_clear(&err);
        matrix_truth_free(truth);
        return NULL;
    }
    for (size_t p = 0; p < 4 * count; p++)
        truth->pixels[p] = (float)truth->drawn.pixels[p / 4][p % 4];
    truth->ms = clock_now_ms() - started;
    return truth;
}

/* ---- judging ---- */

/* The largest error of what a pixel shows of the medium: its optical depth, and its colour, which
 * adds up as many roundings of one transmittance near 1 as there are layers, both relative; but
 * never to less than a thousandth of the picture's largest: a ray that cuts off a corner has as
 * many roundings, and only a corner's length. Beyond
 * an optical depth of 10 alpha is too near 1 to tell: there an error in transmittance of
 * BOUND_THROUGH counts as BOUND_DEPTH_RELATIVE does below. */
static double depth_error(const float pixel[4], const double truth[4], const double least[4]) {
    double depth = -log1p(-truth[3]), worst;
    if (depth <= 10) {
        double found = -log1p(-(double)pixel[3]);
        double over = fmax(depth, least[3]);
        worst = over > 0 ? fabs(found - depth) / over : found;
    } else {
        worst = fabs((double)pixel[3] - truth[3]) / BOUND_THROUGH * BOUND_DEPTH_RELATIVE;
    }
    for (int c = 0; c < 3; c++) {
        double over = fmax(truth[c], least[c]), off = fabs(pixel[c] - truth[c]);
        worst = fmax(worst, over > 0 ? off / over : off);
    }
    return worst;
}

/* Of all pixels, see depth_error(). */
static double worst_depth(const struct matrix_truth *truth, const float *pixels) {
    double least[4] = {0}, worst = 0;
    for (size_t p = 0; p < truth->drawn.count; p++)
        for (int c = 0; c < 4; c++) {
            double value = truth->drawn.pixels[p][c];
            least[c] = fmax(least[c], c < 3 ? value : fmin(10, -log1p(-value)));
        }
    for (int c = 0; c < 4; c++)
        least[c] *= 1e-3;
    for (size_t p = 0; p < truth->drawn.count; p++)
        worst = fmax(worst, depth_error(pixels + 4 * p, truth->drawn.pixels[p], least));
    return worst;
}

static bool compare(const struct matrix_truth *truth, const float *pixels, const float *against,
                    struct error_metrics *metrics) {
    struct error err = {0};
    enum status status =
        error_compare(pixels, against, truth->scene.image.width, truth->scene.image.height,
                      truth->drawn.touched, truth->scene.image.background, NULL, metrics, &err);
    error_clear(&err);
    return status == STATUS_OK;
}

/* From above each plane meets every prism: a million of them 4,096 times take more than
 * CELL_SECONDS_MAX (0.2 s a run of slabs), and fewer slabs are no easier to draw right. */
static int slices_most(const struct scene_mesh *mesh, const struct matrix_case *of) {
    double prisms = 2.0 * mesh->divisions[0] * mesh->divisions[1];
    return (int)fmin(of->slices ? of->slices : SLICES_MOST,
                     fmax(1, ceil(PRISM_SLICES_MOST / fmax(prisms, 1))));
}

static enum status draw_once(struct renderer *renderer, const struct matrix_truth *truth,
                             const struct matrix_path *path, int samples,
                             struct render_result *result, struct error *err) {
    struct scene scene = truth->scene;
    struct scene_object *objects = calloc(scene.object_count + 1, sizeof *objects);
    if (!objects)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory");
    memcpy(objects, scene.objects, scene.object_count * sizeof *objects);
    scene.objects = objects;
    for (size_t i = 0; i < scene.object_count; i++)
        if (objects[i].kind == SCENE_OBJECT_SHELL) {
            objects[i].path = path->path;
            objects[i].quality.order = path->order;
            if (samples)
                objects[i].quality.samples = samples;
            if (path->path != SCENE_PATH_SLICING)
                continue;
            int steps = objects[i].quality.samples;
            int slices = steps ? steps * SLICES_A_STEP : SLICES_MOST;
            int most = slices_most(&objects[i].shell.mesh, truth->of);
            objects[i].quality.slices = slices < most ? slices : most;
            objects[i].quality.samples = 0;
        }
    current = truth->of;
    enum status status = renderer_render(renderer, &scene, &truth->assets, result, err);
    current = NULL;
    free(objects);
    return status;
}

static bool listed(const char *list, const char *name) {
    return list && (strcmp(list, "*") == 0 || strcmp(list, name) == 0);
}

/* Three pictures in a row, one file: truth, path, and ten times their difference, over grey. */
static void write_picture(const struct matrix_truth *truth, const struct matrix_path *path,
                          const float *pixels) {
    int width = truth->scene.image.width, height = truth->scene.image.height;
    char name[512];
    int used = snprintf(name, sizeof name, "%s/", pictures);
    snprintf(name + used, sizeof name - (size_t)used, "%s-%s.ppm", truth->of->name, path->name);
    for (char *c = name + used; *c; c++)
        if (*c == ' ' || *c == '/' || *c == ',')
            *c = '_';
    FILE *file = fopen(name, "wb");
    if (!file)
        return;
    fprintf(file, "P6 %d %d 255\n", 3 * width, height);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < 3 * width; x++)
            for (int c = 0; c < 3; c++) {
                size_t p = 4 * ((size_t)y * (size_t)width + (size_t)(x % width));
                const float *a = truth->pixels + p, *b = pixels + p;
                double value = x < width ? a[c] + 0.2 * (1 - a[3]) : b[c] + 0.2 * (1 - b[3]);
                if (x >= 2 * width) {
                    double apart = fmax(fabs((double)b[c] - a[c]), fabs((double)b[3] - a[3]));
                    value = 10 * apart;
                }
                fputc((int)(255 * pow(fmin(1, fmax(0, value)), 1 / 2.2)), file);
            }
    fclose(file);
}

static const struct report_warning *warning_of(const struct render_result *result,
                                               const char *code) {
    for (size_t w = 0; code && w < result->report.warning_count; w++)
        if (strcmp(result->report.warnings[w].code, code) == 0)
            return &result->report.warnings[w];
    return NULL;
}

/* How far a pixel is off, summed over channels and at most. */
struct off {
    double square, most;
};

static int farther_off(const void *a, const void *b) {
    const struct off *x = a, *y = b;
    return (x->most < y->most) - (x->most > y->most);
}

/* RMSE over the touched pixels and largest difference without the `outliers` worst. */
static bool without_outliers(const struct matrix_truth *truth, const float *pixels, int outliers,
                             double *rmse, double *most) {
    struct off *list = malloc((truth->drawn.count + 1) * sizeof *list);
    size_t count = 0;
    if (!list)
        return false;
    for (size_t p = 0; p < truth->drawn.count; p++) {
        struct off off = {0};
        for (size_t c = 0; c < 4; c++) {
            double d = fabs((double)pixels[4 * p + c] - truth->pixels[4 * p + c]);
            off.square += d * d / 4;
            off.most = fmax(off.most, d);
        }
        if (truth->drawn.touched[p] || off.most > 0)
            list[count++] = off;
    }
    qsort(list, count, sizeof *list, farther_off);
    double sum = 0;
    size_t first = (size_t)outliers < count ? (size_t)outliers : count;
    for (size_t i = first; i < count; i++)
        sum += list[i].square;
    *rmse = count > first ? sqrt(sum / (double)(count - first)) : 0;
    *most = count > first ? list[first].most : 0;
    free(list);
    return true;
}

static void judge(const struct matrix_truth *truth, const struct render_result *drawn,
                  struct matrix_cell *cell) {
    const struct matrix_case *of = truth->of;
    struct error_metrics metrics;
    if (!compare(truth, drawn->pixels, truth->pixels, &metrics)) {
        snprintf(cell->reason, sizeof cell->reason, "no memory to compare");
        return;
    }
    cell->rmse = metrics.touched.rmse;
    cell->max = metrics.touched.max_abs;
    cell->pixels = metrics.touched.pixels;
    cell->coverage = metrics.coverage;
    cell->figure = cell->rmse;
    double most = cell->max;
    if (of->outliers && !without_outliers(truth, drawn->pixels, of->outliers, &cell->figure, &most))
        return;
    if (of->bound == BOUND_DEPTH)
        cell->figure = worst_depth(truth, drawn->pixels);
    bool finite = metrics.not_finite == 0 && !warning_of(drawn, "not-finite");
    bool right = finite && cell->figure <= of->most && (of->most_max == 0 || most <= of->most_max);
    const struct report_warning *warning = warning_of(drawn, of->may_warn);
    if (right) {
        cell->verdict = VERDICT_RIGHT;
    } else if (warning && (finite ? cell->figure <= of->most_warned
                                  : strcmp(of->may_warn, "not-finite") == 0)) {
        cell->verdict = VERDICT_WARNED;
        snprintf(cell->reason, sizeof cell->reason, "%s", warning->code);
    } else {
        int used = snprintf(cell->reason, sizeof cell->reason, "%s",
                            finite ? "past the bound;" : "pixels that are no numbers;");
        for (size_t w = 0; w < drawn->report.warning_count && used < 200; w++)
            used += snprintf(cell->reason + used, sizeof cell->reason - (size_t)used, " %s",
                             drawn->report.warnings[w].code);
    }
}

void matrix_draw(struct renderer *renderer, const struct matrix_truth *truth,
                 const struct matrix_path *path, bool limits, struct matrix_cell *cell) {
    const struct matrix_case *of = truth->of;
    *cell = (struct matrix_cell){.verdict = VERDICT_WRONG,
                                 .figure = NAN,
                                 .rmse = NAN,
                                 .max = NAN,
                                 .model = NAN,
                                 .discretisation = NAN};
    struct render_result drawn, limit;
    struct error err = {0};
    double started = clock_now_ms();
    enum status status = draw_once(renderer, truth, path, 0, &drawn, &err);
    cell->ms = clock_now_ms() - started;
    if (status != STATUS_OK) {
        tell(&err, cell->reason);
        error_clear(&err);
        bool told = status == STATUS_NOT_IMPLEMENTED || status == STATUS_TOO_COMPLEX ||
                    status == STATUS_INVALID_SCENE;
        if (told && listed(of->may_refuse, path->name))
            cell->verdict = VERDICT_REFUSED;
        return;
    }
    judge(truth, &drawn, cell);
    if (pictures)
        write_picture(truth, path, drawn.pixels);
    if (limits && of->limit &&
        draw_once(renderer, truth, path, of->limit, &limit, &err) == STATUS_OK) {
        struct error_metrics metrics;
        bool lost = warning_of(&limit, "not-finite") != NULL;
        if (!lost && compare(truth, limit.pixels, truth->pixels, &metrics))
            cell->model = metrics.touched.rmse;
        if (!lost && compare(truth, drawn.pixels, limit.pixels, &metrics))
            cell->discretisation = metrics.touched.rmse;
        render_result_finish(&limit);
    }
    error_clear(&err);
    render_result_finish(&drawn);
}
