/* The truth: the picture that the design's 'One truth' defines, in doubles, on the CPU.
 *
 * Every other path is judged by this one, so it shares no geometry, sampling or shading code with
 * them: meshes, thicknesses and voxels (renderer/asset) are the last thing in common. What it does
 * about each part of the definition, and how exactly, is in README.md.
 *
 * A reference is made from a scene once and then draws any list of pixels, or all. */
#ifndef PELT_RENDERER_REFERENCE_REFERENCE_H
#define PELT_RENDERER_REFERENCE_REFERENCE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/scene.h"
#include "api/status.h"
#include "renderer/asset/mesh.h"
#include "renderer/asset/source.h"
#include "renderer/asset/volume.h"

/* Where meshes and voxels come from. The caches must outlive the reference. */
struct reference_sources {
    struct mesh_cache *meshes;
    struct volume_cache *volumes;
    const struct asset_source *assets;
};

struct reference;

/* What of a scene the reference does not draw, each with its pointer: STATUS_NOT_IMPLEMENTED. Looks
 * at the scene alone; reference_create() asks this first. */
enum status reference_check(const struct scene *scene, struct error *err);

/* Acquires and prepares everything that `scene` names; the scene must outlive the reference. The
 * objects' `path` and `quality` are without effect. STATUS_NOT_IMPLEMENTED for skeletons,
 * with pointers; whatever mesh_acquire() and volume_acquire() return;
 * STATUS_OUT_OF_MEMORY. Thread: the caches' own. Blocks while assets are decoded. `*reference` is
 * NULL on failure. */
enum status reference_create(const struct scene *scene, const struct reference_sources *sources,
                             struct reference **reference, struct error *err);
void reference_destroy(struct reference *reference); /* takes NULL */

/* For framing a scene that gives no camera: the bounds of all objects in the world, and all their
 * points one after another (index from 0; false past the last). */
void reference_bounds(const struct reference *reference, double low[3], double high[3]);
bool reference_point(const struct reference *reference, uint64_t index, double point[3]);

/* Sets the camera; needed before drawing where scene->camera is not `given`. */
void reference_set_camera(struct reference *reference, const struct scene_camera *camera);

/* Prisms that fold over or stand on their heads: every sheet of theirs is drawn, and adds. */
uint64_t reference_folded(const struct reference *reference);

struct reference_request {
    /* Pixels to draw, as y * width + x, any order, or NULL: all of the picture. */
    const uint32_t *pixels;
    size_t pixel_count;
    int threads;      /* 0: one for each core */
    double tolerance; /* in radiance (relative above 1) and in transmittance; 0: 1e-8 */
    /* Called now and then by the calling thread, `done` rising to `total`; may be NULL. */
    void (*progress)(void *user, size_t done, size_t total);
    void *user;
    const atomic_bool *cancel; /* set by anyone: the work ends soon; may be NULL */
};

struct reference_result {
    size_t count;
    double (*pixels)[4]; /* linear premultiplied RGBA over the background; in the request's order
                            (all: row by row, the top row first) */
    uint8_t *touched;    /* for each pixel: 1 where an object lies on one of its rays */
    uint64_t rays, segments, cells, evaluations; /* work done */
    uint64_t unresolved; /* intervals whose error was above the tolerance at the last subdivision */
};

/* Draws. The same request gives the same bits whatever the number of threads.
 * STATUS_CANCELLED, STATUS_TOO_COMPLEX (one ray crosses more voxels than fit in memory),
 * STATUS_OUT_OF_MEMORY; on failure `*result` is zeroed. Blocks. The caller calls
 * reference_result_finish(). */
enum status reference_render(const struct reference *reference,
                             const struct reference_request *request,
                             struct reference_result *result, struct error *err);
void reference_result_finish(struct reference_result *result);

#endif
