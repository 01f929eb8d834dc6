/* A scene made ready for the reference: the finished shells, the opaque triangles, the voxels, the
 * camera and the light, in doubles. Internal to the room. */
#ifndef PELT_RENDERER_REFERENCE_WORLD_H
#define PELT_RENDERER_REFERENCE_WORLD_H

#include <stdbool.h>
#include <stdint.h>

#include "api/scene.h"
#include "renderer/asset/mesh.h"
#include "renderer/asset/volume.h"
#include "renderer/reference/bvh.h"
#include "renderer/reference/light.h"
#include "renderer/reference/reference.h"

struct world_object {
    const struct scene_object *spec;
    char pointer[32];
    const struct mesh *mesh;
    const struct volume *volume; /* NULL: a plain mesh */
    bool opaque;                 /* its triangles are drawn: a base, or a plain mesh */

    /* Object space, relative to `center`. The shell map is P(b, w) = sum b_i (bottom_i + w
     * offset_i), offset_i = h_i n_i. */
    double center[3], radius; /* of the bounding box, and of the ball around it */
    double (*bottom)[3], (*offset)[3];
    bool *folds; /* for each prism: dP changes its sign within */
    uint32_t folded;
    struct bvh *prisms, *triangles; /* NULL where there are none to draw */

    double object_from_world[3][3];   /* linear part, for rays */
    double world_from_gradient[3][3]; /* its transpose: what takes gradients to the world */
    double shift[3];                  /* of `center`, mapped, from the world's centre */
};

struct world_camera {
    bool orthographic;
    int width, height, k;   /* pixels; samples along a pixel's side */
    double eye[3];          /* relative to the world's centre */
    double right[3], up[3]; /* unit vectors times half of the picture's extent: at distance 1 in
                               perspective, as it is where orthographic */
    double forward[3];
};

struct world {
    double center[3], bounds_min[3], bounds_max[3];
    size_t object_count;
    struct world_object *objects;
    struct reference_lights lights;
    struct world_camera camera;
    double background[4]; /* premultiplied */
    struct mesh_cache *meshes;
    struct volume_cache *volumes;
};

enum status world_init(const struct scene *scene, const struct reference_sources *sources,
                       struct world *world, struct error *err);
void world_finish(struct world *world);

/* The ray through a point of the picture, in pixels from its top left corner: `o` relative to the
 * world's centre and at the point of the ray nearest to it, so that nothing is lost far from the
 * origin; `d` of unit length; the eye, or its plane, at t = *t_eye. */
void world_ray(const struct world *world, double x, double y, double o[3], double d[3],
               double *t_eye);

void world_set_camera(struct world *world, const struct scene_camera *camera);

#endif
