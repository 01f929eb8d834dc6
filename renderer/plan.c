/* The plan and its words: see plan.h. A scene is asked only about what it holds. */
#include "renderer/plan.h"

#include <math.h>
#include <stdio.h>

#include "renderer/camera.h"
#include "renderer/path/surface.h"
#include "renderer/path/walk.h"

/* Media are mixed cell by cell where several shells may overlap, so only one of them can be walked;
 * solids hide one another by depth. */
static const char *several_media(const struct path_object *objects, size_t count) {
    size_t media = 0;
    for (size_t i = 0; i < count; i++)
        media += objects[i].shell && volume_has_medium(objects[i].volume);
    return media > 1 ? "several semi-transparent shells hide one another" : NULL;
}

enum status plan_order(struct path_object *objects, size_t count, bool may_walk,
                       struct error *err) {
    const char *several = several_media(objects, count);
    for (size_t i = 0; i < count; i++) {
        struct path_object *object = &objects[i];
        if (!object->shell)
            continue;
        bool medium = volume_has_medium(object->volume), solid = volume_has_solid(object->volume);
        enum scene_order asked = object->object->quality.order;
        const char *why;
        bool possible = walk_possible(object, &why);
        if (medium && several) {
            possible = false;
            why = several;
        }
        if (asked == SCENE_ORDER_WALK && !possible) {
            char pointer[64];
            snprintf(pointer, sizeof pointer, "%s/quality/order", object->pointer);
            return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer, "cannot walk: %s", why);
        }
        object->walk = (medium || solid) && possible &&
                       (asked == SCENE_ORDER_WALK || (asked == SCENE_ORDER_AUTO && may_walk));
    }
    return STATUS_OK;
}

static void world_bounds(const struct path_object *object, double low[3], double high[3]) {
    for (int i = 0; i < 3; i++) {
        low[i] = INFINITY;
        high[i] = -INFINITY;
    }
    camera_add_bounds(object->object->transform, object->shell->bounds_min,
                      object->shell->bounds_max, low, high);
}

void plan_warn_overlaps(const struct path_object *objects, size_t count, struct report *report) {
    uint64_t pairs = 0, first = 0;
    for (size_t b = 0; b < count; b++) {
        if (!objects[b].shell || !volume_has_medium(objects[b].volume))
            continue;
        double low_b[3], high_b[3];
        world_bounds(&objects[b], low_b, high_b);
        for (size_t a = 0; a < b; a++) {
            if (!objects[a].shell || !volume_has_medium(objects[a].volume))
                continue;
            double low_a[3], high_a[3];
            bool apart = false;
            world_bounds(&objects[a], low_a, high_a);
            for (int i = 0; i < 3; i++)
                apart |= high_a[i] < low_b[i] || high_b[i] < low_a[i];
            if (!apart && pairs++ == 0)
                first = b;
        }
    }
    if (pairs)
        report_warn(
            report, "shells-may-overlap", "/objects", pairs, first,
            "the bounds of semi-transparent shells overlap; where the shells themselves do, "
            "their colours are mixed cell by cell, not by extinction");
}

/* Whether more than one thing is written to a sample and depth decides between them. Triangles,
 * and cells drawn one by one, hide one another; a walk through one shell finds each sample's first
 * surface by itself. */
static bool needs_depth(const struct plan *plan, const struct path_object *objects, size_t count) {
    size_t walked = 0, cells = 0;
    for (size_t i = 0; i < count; i++)
        if (objects[i].shell && volume_has_solid(objects[i].volume))
            *(objects[i].walk ? &walked : &cells) += 1;
    return plan->occluded || plan->surface || cells > 0 || walked > 1;
}

void plan_make(const struct scene *scene, const struct path_object *objects, size_t count,
               struct plan *plan) {
    *plan = (struct plan){.k = (int)lround(sqrt(scene->image.samples)),
                          .measured = scene->error_mode == SCENE_ERROR_ESTIMATE ||
                                      scene->target.has_max_error || scene->target.has_deadline_ms};
    for (size_t i = 0; i < count; i++) {
        plan->surface |= surface_wanted(objects[i].object);
        if (!objects[i].shell)
            continue;
        plan->path = path_find(objects[i].object->path);
        plan->solid |= volume_has_solid(objects[i].volume);
        plan->media |= volume_has_medium(objects[i].volume);
        plan->walk |= objects[i].walk;
    }
    plan->occluded = plan->media && (plan->surface || plan->solid);
    plan->depth = needs_depth(plan, objects, count);
}

struct needs {
    bool lit, specular, gradients, eye_inside, images, gltf, textures, shells, sorted;
};

static struct needs find_needs(const struct scene *scene, const struct path_object *objects,
                               size_t count) {
    struct needs needs = {0};
    for (size_t i = 0; i < count; i++) {
        const struct scene_object *spec = objects[i].object;
        const struct scene_mesh *mesh =
            spec->kind == SCENE_OBJECT_SHELL ? &spec->shell.mesh : &spec->mesh.mesh;
        needs.gltf |= mesh->kind == SCENE_MESH_ASSET;
        needs.textures |= surface_wanted(spec) && objects[i].mesh->image_count > 0;
        needs.lit |= surface_wanted(spec);
        if (!objects[i].shell)
            continue;
        needs.shells = true;
        const struct volume *volume = objects[i].volume;
        needs.lit |= volume->lit && !volume->homogeneous;
        needs.gradients |= volume->lit && !volume->homogeneous;
        needs.specular |= volume->lit && volume->specular > 0 && scene->light_count > 0;
        needs.eye_inside |= objects[i].projection.behind;
        needs.images |= spec->shell.material.kind == SCENE_MATERIAL_HEIGHT;
        needs.sorted |= volume_has_medium(volume) && !objects[i].walk;
    }
    return needs;
}

/* One row: drawn for `why_in`, or left out for `why_out`. NULL: such a row is not worth a word. */
static void tell(struct report *report, const char *name, bool in, const char *why_in,
                 const char *why_out) {
    if (in && why_in)
        report_pass(report, name, why_in);
    if (!in && why_out)
        report_left_out(report, name, why_out);
}

void plan_report(const struct plan *plan, const struct scene *scene,
                 const struct path_object *objects, size_t count, struct report *report) {
    struct needs needs = find_needs(scene, objects, count);
    const char *no_shell = "no object is a shell";
    char why[160];

    tell(report, "surface", plan->surface, "bases and plain meshes are opaque triangles",
         "no shell has a base and no object is a plain mesh");
    tell(report, "depth", plan->surface || plan->solid, NULL,
         "nothing opaque: no depth buffer is made and no segment is clipped at one");
    tell(report, "solid", plan->solid, "a material has a solid part",
         needs.shells ? "no material has a solid part" : no_shell);
    tell(report, "entries", plan->walk, "where each sample's ray enters the shell", NULL);
    tell(report, "sort", needs.sorted, "semi-transparent tetrahedra are drawn back to front",
         plan->media    ? "rays walk from cell to cell, front to back"
         : needs.shells ? "nothing is semi-transparent: the depth test decides"
                        : no_shell);
    tell(report, "media", plan->media, "a material has a medium",
         needs.shells ? "no material has a medium" : no_shell);
    snprintf(why, sizeof why, "the mean of %d x %d samples a pixel, alpha from optical depth",
             plan->k, plan->k);
    tell(report, "resolve", true, why, NULL);

    bool target = scene->target.has_max_error || scene->target.has_deadline_ms;
    tell(report, "trials", target, "a few pixels at several qualities, for the target",
         "there is no target");
    bool reference = scene->error_mode == SCENE_ERROR_REFERENCE;
    tell(report, "error", scene->error_mode != SCENE_ERROR_NONE || scene->target.has_max_error,
         reference ? "4096 pixels against the reference"
                   : "some pixels four times as finely, a few against the rational ray",
         "report.error is none");
    tell(report, "supersampling", plan->k > 1, NULL, "image.samples is 1");
    tell(report, "shadow", false, NULL,
         scene->light_count ? "no light casts a shadow" : "there are no lights");
    tell(report, "light", needs.lit, NULL, "every material is unlit and there is no base or mesh");
    tell(report, "gradients", needs.gradients, NULL,
         needs.shells ? "no lit voxels: no normals are baked, uploaded or fetched" : no_shell);
    tell(report, "specular", needs.specular, NULL,
         needs.lit ? "no material is glossy" : "nothing is lit");
    tell(report, "eye-inside", needs.eye_inside, NULL,
         needs.shells ? "every shell lies in front of the eye" : no_shell);
    tell(report, "base-textures", needs.textures, NULL,
         "no base or mesh takes its colour from an image");
    tell(report, "OpenImageIO", needs.images || needs.textures, NULL, "the scene reads no image");
    tell(report, "tinygltf", needs.gltf, NULL, "the scene reads no glTF asset");
}
