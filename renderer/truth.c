/* Caches for one picture, the camera where the scene gives none, and doubles to floats. */
#include "renderer/truth.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/camera.h"

enum { CACHE_BYTES = 256 << 20 };

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
    return STATUS_OK;
}

enum status truth_render(const struct scene *scene, const struct asset_source *assets,
                         const struct reference_request *request, struct truth *truth,
                         struct error *err) {
    memset(truth, 0, sizeof *truth);
    struct reference_sources sources = {mesh_cache_create(CACHE_BYTES),
                                        volume_cache_create(CACHE_BYTES), assets};
    struct reference *reference = NULL;
    struct reference_result drawn = {0};
    enum status status;
    if (!sources.meshes || !sources.volumes) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the caches");
        goto done;
    }
    status = reference_create(scene, &sources, &reference, err);
    if (status != STATUS_OK)
        goto done;
    truth->width = scene->image.width;
    truth->height = scene->image.height;
    truth->camera = scene->camera;
    if (!scene->camera.given) {
        double low[3], high[3];
        struct points points = {.reference = reference};
        reference_bounds(reference, low, high);
        camera_frame(&scene->image, low, high, next_point, restart, &points, &truth->camera);
        reference_set_camera(reference, &truth->camera);
    }
    struct reference_request whole = *request;
    whole.pixels = NULL;
    status = reference_render(reference, &whole, &drawn, err);
    if (status == STATUS_OK)
        status = to_floats(&drawn, truth, err);
    truth->folded = reference_folded(reference);
    truth->unresolved = drawn.unresolved;
done:
    reference_result_finish(&drawn);
    reference_destroy(reference);
    volume_cache_destroy(sources.volumes);
    mesh_cache_destroy(sources.meshes);
    if (status != STATUS_OK)
        truth_finish(truth);
    return status;
}

void truth_finish(struct truth *truth) {
    free(truth->pixels);
    free(truth->touched);
    memset(truth, 0, sizeof *truth);
}
