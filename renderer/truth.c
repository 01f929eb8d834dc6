/* Caches for one scene, the camera where the scene gives none, and doubles to floats. */
#include "renderer/truth.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/camera.h"

enum { CACHE_BYTES = 256 << 20 };

struct truth_source {
    struct reference_sources sources;
    struct reference *reference;
    int width, height;
    struct scene_camera camera;
};

struct points {
    const struct reference *reference;
    uint64_t next;
};

static bool next_point(void *user, double point[3]) {
    struct points *points = user;
    return reference_point(points->reference, points->next++, point);
}

static void restart(void *user) {
    ((struct points *)user)->next = 0;
}

static enum status to_floats(const struct reference_result *drawn, struct truth *truth,
                             struct error *err) {
    truth->pixels = malloc((drawn->count + 1) * 4 * sizeof *truth->pixels);
    truth->touched = malloc(drawn->count + 1);
    if (!truth->pixels || !truth->touched)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for a picture");
    for (size_t p = 0; p < drawn->count; p++)
        for (int i = 0; i < 4; i++)
            truth->pixels[4 * p + (size_t)i] = (float)drawn->pixels[p][i];
    memcpy(truth->touched, drawn->touched, drawn->count);
    truth->count = drawn->count;
    truth->unresolved = drawn->unresolved;
    return STATUS_OK;
}

enum status truth_create(const struct scene *scene, const struct asset_source *assets,
                         struct truth_source **out, struct error *err) {
    *out = NULL;
    struct truth_source *source = calloc(1, sizeof *source);
    if (!source)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the reference");
    source->sources = (struct reference_sources){mesh_cache_create(CACHE_BYTES),
                                                 volume_cache_create(CACHE_BYTES), assets};
    enum status status;
    if (!source->sources.meshes || !source->sources.volumes)
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the caches");
    else
        status = reference_create(scene, &source->sources, &source->reference, err);
    if (status != STATUS_OK) {
        truth_destroy(source);
        return status;
    }
    source->width = scene->image.width;
    source->height = scene->image.height;
    source->camera = scene->camera;
    if (!scene->camera.given) {
        double low[3], high[3];
        struct points points = {.reference = source->reference};
        reference_bounds(source->reference, low, high);
        camera_frame(&scene->image, low, high, next_point, restart, &points, &source->camera);
        reference_set_camera(source->reference, &source->camera);
    }
    *out = source;
    return STATUS_OK;
}

void truth_destroy(struct truth_source *source) {
    if (!source)
        return;
    reference_destroy(source->reference);
    volume_cache_destroy(source->sources.volumes);
    mesh_cache_destroy(source->sources.meshes);
    free(source);
}

const struct scene_camera *truth_camera(const struct truth_source *source) {
    return &source->camera;
}

enum status truth_draw_pixels(const struct truth_source *source,
                              const struct reference_request *request, struct truth *truth,
                              struct error *err) {
    struct reference_result drawn;
    *truth = (struct truth){.width = source->width,
                            .height = source->height,
                            .camera = source->camera,
                            .folded = reference_folded(source->reference)};
    enum status status = reference_render(source->reference, request, &drawn, err);
    if (status == STATUS_OK)
        status = to_floats(&drawn, truth, err);
    reference_result_finish(&drawn);
    if (status != STATUS_OK)
        truth_finish(truth);
    return status;
}

enum status truth_check(const struct scene *scene, struct error *err) {
    return reference_check(scene, err);
}

enum status truth_render(const struct scene *scene, const struct asset_source *assets,
                         const struct reference_request *request, struct truth *truth,
                         struct error *err) {
    *truth = (struct truth){0};
    struct truth_source *source;
    enum status status = truth_create(scene, assets, &source, err);
    if (status != STATUS_OK)
        return status;
    struct reference_request whole = *request;
    whole.pixels = NULL;
    status = truth_draw_pixels(source, &whole, truth, err);
    truth_destroy(source);
    return status;
}

void truth_finish(struct truth *truth) {
    free(truth->pixels);
    free(truth->touched);
    memset(truth, 0, sizeof *truth);
}
