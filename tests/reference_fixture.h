/* For tests of the reference: a scene as JSON goes in, doubles come out. */
#ifndef PELT_TESTS_REFERENCE_FIXTURE_H
#define PELT_TESTS_REFERENCE_FIXTURE_H

#include <stdlib.h>

#include "renderer/reference/reference.h"
#include "tests/support.h"

struct truth_fixture {
    struct arena arena;
    struct scene scene;
    struct asset_source assets;
    struct reference_sources sources;
    struct reference *reference;
    struct reference_result result;
};

/* Reads a scene, given as JSON with ' for ", and prepares its reference. */
static inline enum status truth_open_json(struct truth_fixture *truth, struct asset_source assets,
                                          char *json) {
    support_quote(json);
    memset(truth, 0, sizeof *truth);
    struct error err = {0};
    truth->assets = assets;
    truth->sources = (struct reference_sources){mesh_cache_create(64 << 20),
                                                volume_cache_create(64 << 20), &truth->assets};
    assert_non_null(truth->sources.meshes);
    assert_non_null(truth->sources.volumes);
    enum status status = scene_read(json, strlen(json), &truth->arena, &truth->scene, &err);
    if (status == STATUS_OK)
        status = reference_create(&truth->scene, &truth->sources, &truth->reference, &err);
    for (size_t i = 0; i < err.fault_count; i++)
        print_message("%s: %s\n", err.faults[i].pointer ? err.faults[i].pointer : "-",
                      err.faults[i].message);
    error_clear(&err);
    return status;
}

/* The same for a printf format, without assets. */
__attribute__((format(printf, 2, 3))) static inline enum status
truth_open(struct truth_fixture *truth, const char *format, ...) {
    char json[8192];
    va_list args;
    va_start(args, format);
    int length = vsnprintf(json, sizeof json, format, args);
    va_end(args);
    assert_true(length > 0 && (size_t)length < sizeof json);
    return truth_open_json(truth, (struct asset_source){.open = support_no_asset}, json);
}

/* Draws the whole picture. */
static inline void truth_draw(struct truth_fixture *truth, double tolerance, int threads) {
    struct reference_request request = {.threads = threads, .tolerance = tolerance};
    struct error err = {0};
    reference_result_finish(&truth->result);
    assert_int_equal(reference_render(truth->reference, &request, &truth->result, &err), STATUS_OK);
}

static inline void truth_close(struct truth_fixture *truth) {
    reference_result_finish(&truth->result);
    reference_destroy(truth->reference);
    volume_cache_destroy(truth->sources.volumes);
    mesh_cache_destroy(truth->sources.meshes);
    arena_free(&truth->arena);
    memset(truth, 0, sizeof *truth);
}

/* The optical depth that a pixel shows over an empty background. */
static inline double truth_depth(const double pixel[4]) {
    return -log1p(-pixel[3]);
}

/* The ray of a pixel's centre, written down from the scene's definition once more: o is the eye, or
 * its plane, d of unit length. */
static inline void truth_pixel_ray(const struct scene *scene, size_t pixel, double o[3],
                                   double d[3]) {
    const struct scene_camera *camera = &scene->camera;
    int width = scene->image.width, height = scene->image.height;
    double x = 2 * ((double)(pixel % (size_t)width) + 0.5) / width - 1;
    double y = 1 - 2 * ((double)(pixel / (size_t)width) + 0.5) / height;
    double f[3], r[3], u[3], length = 0;
    for (int i = 0; i < 3; i++)
        f[i] = camera->target[i] - camera->eye[i];
    length = sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
    for (int i = 0; i < 3; i++)
        f[i] /= length;
    const double *up = camera->up;
    r[0] = f[1] * up[2] - f[2] * up[1];
    r[1] = f[2] * up[0] - f[0] * up[2];
    r[2] = f[0] * up[1] - f[1] * up[0];
    length = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2]);
    for (int i = 0; i < 3; i++)
        r[i] /= length;
    u[0] = r[1] * f[2] - r[2] * f[1];
    u[1] = r[2] * f[0] - r[0] * f[2];
    u[2] = r[0] * f[1] - r[1] * f[0];
    double half =
        camera->orthographic ? camera->ortho_height / 2 : tan(camera->fov_y_deg * M_PI / 360);
    double aspect = (double)width / height;
    length = 0;
    for (int i = 0; i < 3; i++) {
        double aside = half * (x * aspect * r[i] + y * u[i]);
        o[i] = camera->eye[i] + (camera->orthographic ? aside : 0);
        d[i] = f[i] + (camera->orthographic ? 0 : aside);
        length += d[i] * d[i];
    }
    for (int i = 0; i < 3; i++)
        d[i] /= sqrt(length);
}

#endif
