/* Objects made ready: see prepare.h. */
#include "renderer/prepare.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/camera.h"
#include "renderer/path/surface.h"
#include "renderer/shell/precision.h"

/* Steps across one thickness that do a material justice: one for each layer of voxels. */
static int layers_of(const struct volume *volume) {
    int layers = volume->size[2];
    return layers < 8 ? 8 : layers > 64 ? 64 : layers;
}

static enum status prepare_shell(struct caches *caches, const struct scene_shell *spec,
                                 const struct asset_source *assets, struct path_object *object,
                                 bool *made, struct report *report, struct error *err) {
    char pointer[64];
    snprintf(pointer, sizeof pointer, "%s/shell/mesh", object->pointer);
    enum status status = shell_acquire(caches->shells, object->mesh, spec->thickness, spec->tiles,
                                       pointer, &object->shell, err);
    if (status != STATUS_OK)
        return status;
    report_reuse(report, REPORT_PART_shells, object->shell->serial <= caches->newest_shell);
    if (object->shell->serial > caches->newest_shell)
        caches->newest_shell = object->shell->serial;
    shell_warn(object->shell, pointer, report);
    snprintf(pointer, sizeof pointer, "%s/shell/material", object->pointer);
    bool new_voxels = false;
    status = volume_acquire(caches->volumes, &spec->material, spec->thickness, pointer, assets,
                            &object->volume, &new_voxels, err);
    if (status != STATUS_OK)
        return status;
    *made |= new_voxels;
    report_reuse(report, REPORT_PART_voxels, !new_voxels);
    volume_warn(object->volume, pointer, report);
    object->layers = layers_of(object->volume);
    report->work.prisms += object->mesh->triangle_count;
    report->work.tetrahedra += object->shell->tetra_count;
    return STATUS_OK;
}

enum status prepare_objects(struct caches *caches, const struct scene *scene,
                            const struct asset_source *assets, struct prepared *prepared,
                            bool *made, struct report *report, struct error *err) {
    memset(prepared, 0, sizeof *prepared);
    for (int i = 0; i < 3; i++) {
        prepared->bounds_min[i] = INFINITY;
        prepared->bounds_max[i] = -INFINITY;
    }
    prepared->objects = calloc(scene->object_count + 1, sizeof *prepared->objects);
    if (!prepared->objects)
        return error_fault(err, STATUS_OUT_OF_MEMORY, "/objects", "no memory for the objects");
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct scene_object *spec = &scene->objects[i];
        struct path_object *object = &prepared->objects[prepared->object_count++];
        object->object = spec;
        snprintf(object->pointer, sizeof object->pointer, "/objects/%zu", i);
        bool is_shell = spec->kind == SCENE_OBJECT_SHELL;
        char pointer[64];
        snprintf(pointer, sizeof pointer, "%s/%s", object->pointer,
                 is_shell ? "shell/mesh" : "mesh");
        bool own_color = is_shell ? spec->shell.base.has_color : spec->mesh.has_color;
        enum status status =
            mesh_acquire(caches->meshes, is_shell ? &spec->shell.mesh : &spec->mesh.mesh,
                         surface_wanted(spec) && !own_color, pointer, assets, &object->mesh, err);
        if (status == STATUS_OK) {
            report_reuse(report, REPORT_PART_meshes, object->mesh->serial <= caches->newest_mesh);
            if (object->mesh->serial > caches->newest_mesh)
                caches->newest_mesh = object->mesh->serial;
            mesh_warn(object->mesh, pointer, report);
            if (is_shell)
                status = prepare_shell(caches, &spec->shell, assets, object, made, report, err);
        }
        if (status != STATUS_OK) {
            prepared_finish(caches, prepared);
            return status;
        }
        camera_add_bounds(spec->transform,
                          is_shell ? object->shell->bounds_min : object->mesh->bounds_min,
                          is_shell ? object->shell->bounds_max : object->mesh->bounds_max,
                          prepared->bounds_min, prepared->bounds_max);
    }
    return STATUS_OK;
}

/* Whether the linear part of a column-major transform turns space inside out. */
static bool mirrors(const double m[16]) {
    double largest = 0;
    for (int i = 0; i < 12; i++)
        largest = fmax(largest, fabs(m[i]));
    double a[12];
    for (int i = 0; i < 12; i++)
        a[i] = m[i] / largest;
    return a[0] * (a[5] * a[10] - a[6] * a[9]) - a[4] * (a[1] * a[10] - a[2] * a[9]) +
               a[8] * (a[1] * a[6] - a[2] * a[5]) <
           0;
}

/* Every vertex of every object, in the world, for framing. */
struct point_walk {
    const struct prepared *prepared;
    size_t object;
    uint32_t vertex;
};

static void restart_points(void *user) {
    struct point_walk *walk = user;
    walk->object = 0;
    walk->vertex = 0;
}

static bool next_point(void *user, double point[3]) {
    struct point_walk *walk = user;
    for (; walk->object < walk->prepared->object_count; walk->object++, walk->vertex = 0) {
        const struct path_object *object = &walk->prepared->objects[walk->object];
        const struct shell *shell = object->shell;
        if (walk->vertex == (shell ? shell->vertex_count : object->mesh->vertex_count))
            continue;
        const double *local =
            shell ? shell->position[walk->vertex] : object->mesh->position[walk->vertex];
        const double *m = object->object->transform;
        for (int r = 0; r < 3; r++) {
            point[r] = m[12 + r];
            for (int c = 0; c < 3; c++)
                point[r] += m[4 * c + r] * (local[c] + (shell ? shell->center[c] : 0));
        }
        walk->vertex++;
        return true;
    }
    return false;
}

enum status prepare_views(struct prepared *prepared, struct scene *scene, struct view *world,
                          struct error *err) {
    if (!scene->camera.given)
        camera_frame(&scene->image, prepared->bounds_min, prepared->bounds_max, next_point,
                     restart_points, &(struct point_walk){.prepared = prepared}, &scene->camera);
    int k = (int)lround(sqrt(scene->image.samples));
    view_from_camera(&scene->camera, &scene->image, prepared->bounds_min, prepared->bounds_max, k,
                     world);
    for (size_t i = 0; i < prepared->object_count; i++) {
        struct path_object *object = &prepared->objects[i];
        const double *transform = object->object->transform;
        double center[3];
        for (int c = 0; c < 3; c++)
            center[c] = object->mesh->bounds_min[c] +
                        (object->mesh->bounds_max[c] - object->mesh->bounds_min[c]) / 2;
        view_in_object(world, transform, center, &object->mesh_view);
        view_normal_matrix(transform, object->normal_rows);
        object->mirrored = mirrors(transform);
        if (!object->shell)
            continue;
        struct view view;
        view_in_object(world, transform, object->shell->center, &view);
        enum status status = project_shell(object->shell, &view, &object->projection, err);
        if (status != STATUS_OK)
            return status;
        object->fp64 = precision_needs_fp64(object->shell, &object->projection, world);
    }
    return STATUS_OK;
}

void prepared_finish(struct caches *caches, struct prepared *prepared) {
    for (size_t i = 0; i < prepared->object_count; i++) {
        struct path_object *object = &prepared->objects[i];
        if (prepared->far && prepared->far[i].original)
            object->volume = prepared->far[i].original;
        if (prepared->far)
            free(prepared->far[i].medium);
        if (prepared->forced) {
            object->volume = prepared->forced[i].original;
            free(prepared->forced[i].medium);
            free(prepared->forced[i].solid);
        }
        projection_finish(&object->projection);
        volume_release(caches->volumes, object->volume);
        shell_release(caches->shells, object->shell);
        mesh_release(caches->meshes, object->mesh);
    }
    free(prepared->far);
    free(prepared->forced);
    free(prepared->objects);
    *prepared = (struct prepared){0};
}
