/* Making a scene ready: object frames, prisms, boxes, the camera's rays.
 *
 * Everything is kept relative to a point near it: the objects' places to their own centres, the
 * camera to the world's, so that scenes far from the origin lose only what their own coordinates
 * have lost. */
#include "renderer/reference/world.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/mesh_thickness.h"
#include "renderer/reference/vector.h"

static void invert(const double m[16], double inverse[3][3]) {
    double largest = 0, a[3][3], determinant = 0;
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            largest = fmax(largest, fabs(m[4 * c + r]));
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            a[c][r] = m[4 * c + r] / largest; /* columns */
    for (int c = 0; c < 3; c++)
        cross3(a[(c + 1) % 3], a[(c + 2) % 3], inverse[c]);
    determinant = dot3(a[0], inverse[0]);
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            inverse[c][r] /= determinant * largest;
}

/* ---- shells ---- */

/* dP's determinant is N(w) . sum b_i offset_i, N = (e1 + w g1) x (e2 + w g2): linear in b, so it
 * has one sign over the prism exactly if it has along each of the three offsets. */
static bool prism_folds(const struct world_object *object, const uint32_t v[3]) {
    double e1[3], e2[3], g1[3], g2[3], n[3][3], part[3];
    for (int i = 0; i < 3; i++) {
        e1[i] = object->bottom[v[1]][i] - object->bottom[v[0]][i];
        e2[i] = object->bottom[v[2]][i] - object->bottom[v[0]][i];
        g1[i] = object->offset[v[1]][i] - object->offset[v[0]][i];
        g2[i] = object->offset[v[2]][i] - object->offset[v[0]][i];
    }
    cross3(e1, e2, n[0]);
    cross3(e1, g2, n[1]);
    cross3(g1, e2, part);
    for (int i = 0; i < 3; i++)
        n[1][i] += part[i];
    cross3(g1, g2, n[2]);
    double least = INFINITY, most = -INFINITY;
    for (int k = 0; k < 3; k++) {
        double q[3];
        for (int p = 0; p < 3; p++)
            q[p] = dot3(n[p], object->offset[v[k]]);
        double at[3] = {0, 1, q[2] != 0 ? fmin(1, fmax(0, -q[1] / (2 * q[2]))) : 0};
        for (int p = 0; p < 3; p++) {
            least = fmin(least, quadratic_at(q, at[p]));
            most = fmax(most, quadratic_at(q, at[p]));
        }
    }
    return !(least > 0 || most < 0);
}

static struct bvh *make_bvh(const struct world_object *object, bool prisms) {
    const struct mesh *mesh = object->mesh;
    struct bvh_box *boxes = malloc((mesh->triangle_count + (size_t)1) * sizeof *boxes);
    if (!boxes)
        return NULL;
    for (uint32_t f = 0; f < mesh->triangle_count; f++)
        for (int i = 0; i < 3; i++) {
            boxes[f].low[i] = INFINITY;
            boxes[f].high[i] = -INFINITY;
            for (int k = 0; k < 3; k++) {
                uint32_t v = mesh->vertex[f][k];
                double bottom = object->bottom[v][i];
                double top = prisms ? bottom + object->offset[v][i] : bottom;
                boxes[f].low[i] = fmin(boxes[f].low[i], fmin(bottom, top));
                boxes[f].high[i] = fmax(boxes[f].high[i], fmax(bottom, top));
            }
        }
    struct bvh *bvh = bvh_create(boxes, mesh->triangle_count, 1e-9 * object->radius);
    free(boxes);
    return bvh;
}

static enum status no_memory(const struct world_object *object, struct error *err) {
    return error_fault(err, STATUS_OUT_OF_MEMORY, object->pointer,
                       "no memory for the reference's copy of a mesh of %u triangles",
                       object->mesh->triangle_count);
}

static enum status make_geometry(struct world_object *object, struct error *err) {
    const struct mesh *mesh = object->mesh;
    size_t count = mesh->vertex_count + (size_t)1;
    struct mesh_thickness limit = {0};
    object->bottom = malloc(count * sizeof *object->bottom);
    if (!object->bottom)
        return no_memory(object, err);
    if (object->volume) {
        object->offset = malloc(count * sizeof *object->offset);
        object->folds = calloc(mesh->triangle_count + (size_t)1, sizeof *object->folds);
        if (!object->offset || !object->folds)
            return no_memory(object, err);
        enum status status = mesh_thickness_limit(mesh, object->spec->shell.thickness, &limit, err);
        if (status != STATUS_OK)
            return status;
    }
    double low[3], high[3];
    for (int i = 0; i < 3; i++) {
        low[i] = INFINITY;
        high[i] = -INFINITY;
        for (uint32_t v = 0; v < mesh->vertex_count; v++) {
            double bottom = mesh->position[v][i], offset = 0;
            if (limit.height)
                offset = object->offset[v][i] = limit.height[v] * mesh->normal[v][i];
            low[i] = fmin(low[i], fmin(bottom, bottom + offset));
            high[i] = fmax(high[i], fmax(bottom, bottom + offset));
        }
        object->center[i] = mesh->vertex_count ? low[i] + (high[i] - low[i]) / 2 : 0;
        for (uint32_t v = 0; v < mesh->vertex_count; v++)
            object->bottom[v][i] = mesh->position[v][i] - object->center[i];
        double half = mesh->vertex_count ? (high[i] - low[i]) / 2 : 0;
        object->radius = hypot(object->radius, half);
    }
    mesh_thickness_finish(&limit);
    for (uint32_t f = 0; f < mesh->triangle_count && object->volume; f++) {
        object->folds[f] = prism_folds(object, mesh->vertex[f]);
        object->folded += object->folds[f];
    }
    if (object->volume && !(object->prisms = make_bvh(object, true)))
        return no_memory(object, err);
    if (object->opaque && !(object->triangles = make_bvh(object, false)))
        return no_memory(object, err);
    return STATUS_OK;
}

/* ---- objects ---- */

static enum status acquire(const struct scene_object *spec, struct world_object *object,
                           const struct reference_sources *sources, struct error *err) {
    char pointer[64];
    assert(spec->kind != SCENE_OBJECT_SKELETON); /* reference_check() has refused it */
    bool shell = spec->kind == SCENE_OBJECT_SHELL;
    bool own_color = shell ? spec->shell.base.has_color : spec->mesh.has_color;
    object->opaque = !shell || spec->shell.has_base;
    snprintf(pointer, sizeof pointer, "%s/%s/mesh", object->pointer, shell ? "shell" : "mesh");
    enum status status =
        mesh_acquire(sources->meshes, shell ? &spec->shell.mesh : &spec->mesh.mesh,
                     object->opaque && !own_color, pointer, sources->assets, &object->mesh, err);
    if (status != STATUS_OK || !shell)
        return status;
    snprintf(pointer, sizeof pointer, "%s/shell/material", object->pointer);
    bool made;
    return volume_acquire(sources->volumes, &spec->shell.material, spec->shell.thickness, pointer,
                          sources->assets, &object->volume, &made, err);
}

static void place(struct world_object *object) {
    invert(object->spec->transform, object->object_from_world);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            object->world_from_gradient[r][c] = object->object_from_world[c][r];
}

/* M p, p relative to the object's centre. */
static void to_world(const double m[16], const struct world_object *object, const double p[3],
                     double out[3]) {
    for (int r = 0; r < 3; r++) {
        out[r] = m[12 + r];
        for (int c = 0; c < 3; c++)
            out[r] += m[4 * c + r] * (p[c] + object->center[c]);
    }
}

/* The bounds of the object's box, mapped: what the picture's framing starts from. */
static void add_bounds(struct world *world, const struct world_object *object) {
    const struct mesh *mesh = object->mesh;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        for (int i = 0; i < 3; i++) {
            double bottom = object->bottom[v][i];
            double top = bottom + (object->offset ? object->offset[v][i] : 0);
            low[i] = fmin(low[i], fmin(bottom, top));
            high[i] = fmax(high[i], fmax(bottom, top));
        }
    for (int corner = 0; corner < 8; corner++) {
        double p[3], mapped[3];
        for (int i = 0; i < 3; i++)
            p[i] = corner >> i & 1 ? high[i] : low[i];
        to_world(object->spec->transform, object, p, mapped);
        for (int i = 0; i < 3; i++) {
            world->bounds_min[i] = fmin(world->bounds_min[i], mapped[i]);
            world->bounds_max[i] = fmax(world->bounds_max[i], mapped[i]);
        }
    }
}

enum status world_init(const struct scene *scene, const struct reference_sources *sources,
                       struct world *world, struct error *err) {
    memset(world, 0, sizeof *world);
    world->meshes = sources->meshes;
    world->volumes = sources->volumes;
    for (int i = 0; i < 3; i++) {
        world->bounds_min[i] = INFINITY;
        world->bounds_max[i] = -INFINITY;
    }
    enum status drawable = reference_check(scene, err);
    if (drawable != STATUS_OK)
        return drawable;
    world->objects = calloc(scene->object_count + 1, sizeof *world->objects);
    if (!world->objects)
        return error_fault(err, STATUS_OUT_OF_MEMORY, "/objects", "no memory for the objects");
    for (size_t i = 0; i < scene->object_count; i++) {
        struct world_object *object = &world->objects[world->object_count++];
        object->spec = &scene->objects[i];
        snprintf(object->pointer, sizeof object->pointer, "/objects/%zu", i);
        enum status status = acquire(object->spec, object, sources, err);
        if (status == STATUS_OK)
            status = make_geometry(object, err);
        if (status != STATUS_OK) {
            world_finish(world);
            return status;
        }
        place(object);
        add_bounds(world, object);
    }
    for (int i = 0; i < 3; i++)
        world->center[i] = world->bounds_min[i] + (world->bounds_max[i] - world->bounds_min[i]) / 2;
    for (size_t i = 0; i < world->object_count; i++) {
        double mapped[3];
        to_world(scene->objects[i].transform, &world->objects[i], (const double[3]){0, 0, 0},
                 mapped);
        for (int r = 0; r < 3; r++)
            world->objects[i].shift[r] = mapped[r] - world->center[r];
    }
    reference_lights_init(scene, &world->lights);
    for (int i = 0; i < 4; i++)
        world->background[i] =
            scene->image.background[i] * (i < 3 ? scene->image.background[3] : 1);
    world->camera.width = scene->image.width;
    world->camera.height = scene->image.height;
    world->camera.k = (int)lround(sqrt(scene->image.samples));
    if (scene->camera.given)
        world_set_camera(world, &scene->camera);
    return STATUS_OK;
}

void world_finish(struct world *world) {
    for (size_t i = 0; i < world->object_count; i++) {
        struct world_object *object = &world->objects[i];
        bvh_destroy(object->prisms);
        bvh_destroy(object->triangles);
        free(object->bottom);
        free(object->offset);
        free(object->folds);
        volume_release(world->volumes, object->volume);
        mesh_release(world->meshes, object->mesh);
    }
    free(world->objects);
    memset(world, 0, sizeof *world);
}

/* ---- the camera ---- */

void world_set_camera(struct world *world, const struct scene_camera *camera) {
    struct world_camera *to = &world->camera;
    to->orthographic = camera->orthographic;
    double up[3];
    for (int i = 0; i < 3; i++) {
        to->eye[i] = camera->eye[i] - world->center[i];
        to->forward[i] = camera->target[i] - camera->eye[i];
        up[i] = camera->up[i];
    }
    unit3(to->forward);
    unit3(up);
    cross3(to->forward, up, to->right);
    unit3(to->right);
    cross3(to->right, to->forward, to->up);
    const double pi = 3.14159265358979323846;
    double half =
        camera->orthographic ? camera->ortho_height / 2 : tan(camera->fov_y_deg * (pi / 360));
    for (int i = 0; i < 3; i++) {
        to->up[i] *= half;
        to->right[i] *= half * to->width / to->height;
    }
}

void world_ray(const struct world *world, double x, double y, double o[3], double d[3],
               double *t_eye) {
    const struct world_camera *camera = &world->camera;
    double across = 2 * x / camera->width - 1, above = 1 - 2 * y / camera->height;
    for (int i = 0; i < 3; i++) {
        double aside = across * camera->right[i] + above * camera->up[i];
        o[i] = camera->eye[i] + (camera->orthographic ? aside : 0);
        d[i] = camera->forward[i] + (camera->orthographic ? 0 : aside);
    }
    unit3(d);
    double along = dot3(o, d);
    for (int i = 0; i < 3; i++)
        o[i] -= along * d[i];
    *t_eye = along;
}
