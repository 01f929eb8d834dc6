/* The plan and its words: see plan.h. A scene is asked only about what it holds. */
#include "renderer/plan.h"

#include <math.h>
#include <stdio.h>

#include "renderer/path/surface.h"
#include "renderer/path/variant.h"
#include "renderer/path/walk.h"

#define NO_SHELL "no object is a shell"

/* Which path's quality a shell gives; NULL in *member: none's. */
static enum scene_path path_of_quality(const struct scene_quality *quality, const char **member) {
    *member = quality->samples                        ? "samples"
              : quality->order != SCENE_ORDER_AUTO    ? "order"
              : quality->slices                       ? "slices"
              : quality->method != SCENE_SLICING_AUTO ? "method"
                                                      : NULL;
    return quality->samples || quality->order != SCENE_ORDER_AUTO ? SCENE_PATH_TETRA
                                                                  : SCENE_PATH_SLICING;
}

static const char *name_of(enum scene_path id) {
    return path_find(id)->name;
}

enum status plan_paths(struct scene *scene, bool *open, struct error *err) {
    enum scene_path chosen = SCENE_PATH_AUTO;
    size_t by = 0, shells = 0;
    const char *member;
    for (int round = 0; round < 2; round++)
        for (size_t i = 0; i < scene->object_count && chosen == SCENE_PATH_AUTO; i++) {
            const struct scene_object *object = &scene->objects[i];
            if (object->kind != SCENE_OBJECT_SHELL)
                continue;
            enum scene_path path = path_of_quality(&object->quality, &member);
            shells++;
            chosen = round == 0 ? object->path : member ? path : SCENE_PATH_AUTO;
            by = i;
        }
    *open = chosen == SCENE_PATH_AUTO && shells > 0;
    if (chosen == SCENE_PATH_AUTO)
        return STATUS_OK;
    char pointer[64];
    if (!path_find(chosen)) {
        snprintf(pointer, sizeof pointer, "/objects/%zu/path", by);
        return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                           "this version does not draw by this path");
    }
    for (size_t i = 0; i < scene->object_count; i++) {
        struct scene_object *object = &scene->objects[i];
        if (object->kind != SCENE_OBJECT_SHELL)
            continue;
        if (object->path != SCENE_PATH_AUTO && object->path != chosen) {
            snprintf(pointer, sizeof pointer, "/objects/%zu/path", i);
            return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                               "all shells of one picture are drawn by one path, and /objects/%zu "
                               "takes %s",
                               by, name_of(chosen));
        }
        enum scene_path path = path_of_quality(&object->quality, &member);
        if (member && path != chosen) {
            snprintf(pointer, sizeof pointer, "/objects/%zu/quality/%s", i, member);
            return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                               "belongs to path %s; /objects/%zu takes %s, and one path draws all "
                               "shells of a picture",
                               name_of(path), by, name_of(chosen));
        }
        object->path = chosen;
    }
    return STATUS_OK;
}

/* Media are drawn one way, all walked or all sorted, since each may hide the others. NULL, or what
 * keeps several of them from being walked together. Solids hide one another by depth. */
static const char *several_media(const struct path_object *objects, size_t count, bool may_walk) {
    size_t media = 0;
    const char *sorted = NULL;
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        if (!object->shell || !volume_has_medium(object->volume))
            continue;
        const char *why;
        enum scene_order asked = object->object->quality.order;
        bool walks = walk_possible(object, &why) && walk_possible_with_others(object, &why) &&
                     (asked == SCENE_ORDER_WALK || (asked == SCENE_ORDER_AUTO && may_walk));
        media++;
        sorted = walks ? sorted : "another semi-transparent shell is drawn cell by cell";
    }
    return media > 1 ? sorted : NULL;
}

enum status plan_order(struct path_object *objects, size_t count, bool may_walk,
                       struct error *err) {
    const char *several = several_media(objects, count, may_walk);
    for (size_t i = 0; i < count; i++) {
        struct path_object *object = &objects[i];
        if (!object->shell)
            continue;
        object->walk = object->walk_asked = object->solid_cells = object->solid_folds = false;
        bool medium = volume_has_medium(object->volume), solid = volume_has_solid(object->volume);
        enum scene_map map = object->object->quality.map;
        bool slicing = object->object->path == SCENE_PATH_SLICING;
        bool points = slicing && object->method != SCENE_SLICING_SLABS;
        /* Slices as published interpolate texture coordinates, unless they are asked not to. */
        object->exact = map != SCENE_MAP_AFFINE && (map == SCENE_MAP_EXACT || !points) &&
                        path_object_drawn(object) && !object->volume->homogeneous &&
                        !object->shell->affine;
        if (slicing)
            continue;
        enum scene_order asked = object->object->quality.order;
        const char *why;
        bool possible = walk_possible(object, &why);
        if (medium && several && possible && walk_possible_with_others(object, &why))
            why = several;
        possible = possible && !(medium && several);
        if (asked == SCENE_ORDER_WALK && !possible) {
            char pointer[64];
            snprintf(pointer, sizeof pointer, "%s/quality/order", object->pointer);
            return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer, "cannot walk: %s", why);
        }
        object->walk_asked = asked == SCENE_ORDER_WALK;
        object->walk = (medium || solid) && possible &&
                       (asked == SCENE_ORDER_WALK || (asked == SCENE_ORDER_AUTO && may_walk));
    }
    return STATUS_OK;
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

static uint32_t find_flags(const struct plan *plan, const struct path_object *objects, size_t count,
                           int lights) {
    uint32_t flags = 0;
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        if (surface_wanted(object->object))
            flags |= variant_of_surface(object, lights, surface_textured(object));
        if (object->shell && volume_has_medium(object->volume))
            flags |= variant_of_shell(object, lights, plan->occluded, false);
        if (object->shell && volume_has_solid(object->volume))
            flags |= variant_of_shell(object, lights, plan->occluded, true);
    }
    return flags;
}

void plan_warn_uneven(const struct path_object *objects, size_t count, struct report *report) {
    for (size_t i = 0; i < count; i++) {
        if (!objects[i].exact || objects[i].shell->diagnosis.uneven == 0)
            continue;
        char pointer[64];
        snprintf(pointer, sizeof pointer, "%s/quality/map", objects[i].pointer);
        report_warn(
            report, "uneven-prisms", pointer, objects[i].shell->diagnosis.uneven,
            objects[i].shell->diagnosis.uneven_first,
            "prisms nearly fold, and their own map cannot be inverted in a few steps; their "
            "cells are read by the affine one");
    }
}

void plan_make(const struct scene *scene, const struct path_object *objects, size_t count,
               const struct shadow_need *shadow, struct plan *plan) {
    *plan = (struct plan){.shadow = *shadow,
                          .k = (int)lround(sqrt(scene->image.samples)),
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
        plan->slices = objects[i].object->path == SCENE_PATH_SLICING ? objects[i].quality : 0;
    }
    plan->occluded = plan->media && (plan->surface || plan->solid);
    plan->depth = needs_depth(plan, objects, count);
    plan->flags = find_flags(plan, objects, count, (int)scene->light_count);
}

/* What no other field of the plan tells. */
struct needs {
    bool filter, far, exact, curved, images, gltf, shells, behind, sorted, cells, voxels,
        homogeneous, gradients;
};

static struct needs find_needs(const struct scene *scene, const struct path_object *objects,
                               size_t count) {
    struct needs needs = {0};
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        const struct scene_object *spec = object->object;
        const struct scene_mesh *mesh =
            spec->kind == SCENE_OBJECT_SHELL ? &spec->shell.mesh : &spec->mesh.mesh;
        needs.gltf |= mesh->kind == SCENE_MESH_ASSET;
        if (!object->shell)
            continue;
        bool medium = volume_has_medium(object->volume), solid = volume_has_solid(object->volume);
        needs.shells = true;
        const struct scene_material *material = &spec->shell.material;
        needs.images |=
            material->kind == SCENE_MATERIAL_HEIGHT || material->kind == SCENE_MATERIAL_VOLUME;
        needs.gltf |= material->kind == SCENE_MATERIAL_GEOMETRY &&
                      material->geometry.kind == SCENE_MESH_ASSET;
        needs.behind |= object->projection.behind && (medium || solid);
        needs.sorted |= medium && !object->walk && spec->path == SCENE_PATH_TETRA;
        needs.cells |= (medium || solid) && !object->walk;
        needs.voxels |= !object->volume->homogeneous;
        bool asked =
            spec->quality.filter == SCENE_FILTER_MIP || spec->quality.filter == SCENE_FILTER_VIEW;
        needs.filter |= asked && !object->volume->homogeneous;
        needs.far |= object->far_solid;
        needs.exact |= object->exact;
        needs.curved |= !object->volume->homogeneous && !object->shell->affine;
        needs.homogeneous |= object->volume->homogeneous && medium;
        int lights = (int)scene->light_count;
        needs.gradients |=
            variant_needs_normals(object, lights) && (solid || !variant_by_strands(object, lights));
    }
    return needs;
}

/* One row: in for `why_in`, or left out for `why_out`; NULL where that cannot be. */
static void tell(struct report *report, const char *name, bool in, const char *why_in,
                 const char *why_out) {
    if (in)
        report_pass(report, name, why_in);
    else
        report_left_out(report, name, why_out);
}

/* Views of the lights' own. `none`: why no light throws a shadow, where things are lit. */
static void tell_shadow(const struct plan *plan, bool lit, const char *none,
                        struct report *report) {
    const struct shadow_need *need = &plan->shadow;
    const char *not_drawn = need->count ? NULL : lit ? none : "nothing is lit";
    char why[160];
    snprintf(why, sizeof why, "%d view%s of %d light%s, %d x %d texels, asked at every sample",
             need->views, need->views == 1 ? "" : "s", need->count, need->count == 1 ? "" : "s",
             need->size, need->size);
    tell(report, "shadow", need->count, why, not_drawn);
    tell(report, "shadow-map", need->count && need->opaque,
         "opaque things throw shadows: their planes, as the lights see them",
         not_drawn ? not_drawn : "nothing opaque throws a shadow");
    snprintf(why, sizeof why, "media throw shadows: their optical depths in %d slices",
             3 * need->layers);
    tell(report, "shadow-slices", need->count && need->media, why,
         not_drawn ? not_drawn : "no medium throws a shadow");
    bool tinted = plan->flags & FLAG_SHADOW_TINT, channels = plan->flags & FLAG_SHADOW_CHANNELS;
    tell(report, "shadow-colors", tinted || channels,
         channels ? "extinctions of several colours throw shadows: three optical depths are kept"
                  : "extinction of one colour throws shadows: channels take shares of one depth",
         not_drawn ? not_drawn : "no medium that throws shadows has extinction_color");
}

/* Light, and what it takes. */
static void tell_light(const struct plan *plan, const struct needs *needs, bool lights,
                       struct report *report) {
    bool lit = plan->flags & FLAG_LIT;
    const char *unlit = "every material is unlit and there is no base or mesh";
    const char *no_light = "there are no lights";
    tell(report, "light", lit, "lights with a direction fall on bases, meshes or voxels",
         lights ? unlit : no_light);
    tell(report, "ambient", plan->flags & FLAG_AMBIENT,
         "ambient light alone: colours are multiplied by it, without normals",
         lit ? "it is a term of the lights with a direction" : unlit);
    tell_shadow(plan, lit, lights ? "no light casts a shadow" : no_light, report);
    tell(report, "point-lights", plan->flags & FLAG_POINT,
         "lights stand at points: direction and distance are found at every sample",
         lights ? "no light stands at a point, or nothing is lit" : no_light);
    tell(report, "specular", plan->flags & FLAG_SPECULAR, "a material is glossy",
         !lights ? no_light
         : lit   ? "no lit material is glossy"
                 : "nothing is lit");
    tell(report, "gradients", needs->gradients, "normals of lit voxels are baked and fetched",
         !needs->shells ? NO_SHELL
         : !lights      ? "no light has a direction: no normals are baked, uploaded or fetched"
         : plan->flags & FLAG_STRANDS
             ? "media are lit by their strands: no normals are baked, uploaded or fetched"
             : "no lit voxels: no normals are baked, uploaded or fetched");
    tell(report, "strands", plan->flags & FLAG_STRANDS,
         "a medium is lit by the directions of its strands, which are fetched",
         !lights ? no_light
         : lit   ? "no lit medium's shading is kajiya-kay"
                 : "nothing is lit");
    tell(report, "mesh-normals", plan->surface && lit, "lit triangles have normals at corners",
         plan->surface ? "no light has a direction: no normals of triangles are uploaded"
                       : "there is no base or mesh");
}

/* How shells are gone through. */
static void tell_shells(const struct plan *plan, const struct needs *needs, struct report *report) {
    const char *no_shell = needs->shells ? NULL : NO_SHELL;
    bool drawn = plan->media || plan->solid;
    const char *nothing = no_shell ? no_shell : "no material holds anything";
    tell(report, "voxels", needs->voxels, "materials are fetched in steps from 3D textures",
         no_shell ? no_shell : "every material is homogeneous: no texture is made or fetched");
    tell(report, "filter", plan->flags & FLAG_FILTER,
         plan->flags & FLAG_FILTER_VIEW
             ? plan->flags & FLAG_LIT
                   ? "where a sample covers several voxels it reads what is seen of them from its "
                     "side, and light falls on its normals' moments, 48 bytes more a texel"
                   : "where a sample covers several voxels it reads what is seen of them from its "
                     "side"
             : "where a sample covers several voxels it reads coarser ones",
         no_shell        ? no_shell
         : needs->filter ? "no sample covers more than a voxel of a medium: none is made coarser"
                         : "quality.filter is none, or nothing has voxels");
    tell(report, "leap", plan->flags & FLAG_LEAP,
         "rays leap over empty voxels: how far it is to the next full one is baked and fetched",
         no_shell        ? no_shell
         : needs->voxels ? "every ray takes steps of equal length, or from plane to plane"
                         : "every material is homogeneous");
    tell(report, "far-solids", needs->far, "solids smaller than a sample are drawn as media",
         needs->filter ? "no solid's voxels are all smaller than a sample"
         : no_shell    ? no_shell
                       : "quality.filter is none");
    tell(report, "fill", plan->flags & FLAG_FILL,
         "voxels glow, or their shell absorbs or emits besides: a step adds all",
         needs->voxels ? "nothing has absorption, emission or glow"
         : no_shell    ? no_shell
                       : "nothing has voxels");
    tell(report, "tint", plan->flags & FLAG_TINT,
         "extinction has colours: three optical depths are summed",
         no_shell ? no_shell : "no medium has extinction_color");
    tell(report, "closed-form", needs->homogeneous,
         "homogeneous media are integrated without textures or steps",
         no_shell ? no_shell : "no medium is homogeneous");
    tell(report, "cells", needs->cells, "cells are drawn one by one, from a table",
         drawn ? "rays walk from cell to cell: the table for single cells is not uploaded"
               : nothing);
    tell(report, "fp64", plan->flags & FLAG_FP64,
         "a shell is so thin, or seen from so near, that rays must meet its cells in doubles",
         drawn ? "fp32 tells the cells of every shell apart" : nothing);
    tell(report, "eye-inside", plan->flags & FLAG_EYE_INSIDE,
         "the eye may stand in a cell: each segment begins at it",
         !drawn          ? nothing
         : needs->behind ? "a walk begins at the eye by itself, and so does the first slab"
                         : "every shell lies in front of the eye");
}

void plan_report(const struct plan *plan, const struct scene *scene,
                 const struct path_object *objects, size_t count, struct report *report) {
    struct needs needs = find_needs(scene, objects, count);
    bool opaque = plan->surface || plan->solid, textured = plan->flags & FLAG_TEXTURED;
    char why[160];

    /* What is drawn, in order. */
    tell(report, "surface", plan->surface, "bases and plain meshes are opaque triangles",
         "no shell has a base and no object is a plain mesh");
    tell(report, "entries", plan->walk, "where each sample's ray enters the shell",
         needs.shells ? "no ray walks: cells are drawn one by one, or there are none" : NO_SHELL);
    tell(report, "solid", plan->solid, "a material has a solid part",
         needs.shells ? "no material has a solid part" : NO_SHELL);
    tell(report, "sort", needs.sorted, "semi-transparent tetrahedra are drawn back to front",
         plan->slices && plan->media
             ? "slabs are drawn by their depth; neighbours in a run of them tell their order"
         : plan->media  ? "rays walk from cell to cell, front to back"
         : needs.shells ? "nothing is semi-transparent: the first surface decides"
                        : NO_SHELL);
    tell(report, "cycles", false, NULL, /* until cells are sorted: renderer/path/cycles.c */
         needs.sorted ? "on no ray are cells in the wrong order" : "no cells are sorted");
    /* The slicing path puts it in where it does so: how many runs of slabs there are is its own. */
    tell(report, "nearest-first", false, "",
         plan->slices && plan->media ? "media let too much through, or slabs are few"
                                     : "no slabs of a medium are drawn");
    tell(report, "exact-map", needs.exact, "textures are read by the prisms' own map",
         needs.curved
             ? "quality.map asks for the tetrahedra's affine map, or slices are as published"
         : needs.voxels ? "every prism is affine: both maps are one"
         : needs.shells ? "no shell has voxels"
                        : NO_SHELL);
    snprintf(why, sizeof why, "%d slab%s between planes that face the viewer", plan->slices,
             plan->slices == 1 ? "" : "s");
    tell(report, "slices", plan->slices && (plan->media || plan->solid), why,
         needs.shells ? "no shell is drawn by slicing" : NO_SHELL);
    tell(report, "overlap", false, NULL, /* until samples are looked at: renderer/path/walk.c */
         !plan->media   ? needs.shells ? "no material has a medium" : NO_SHELL
         : plan->slices ? "slabs turn their order around from each to the next"
         : needs.sorted ? "cells are sorted, not walked through"
                        : "no sample's ray was found to meet two stretches at once");
    tell(report, "folds", false, NULL, /* the same */
         plan->walk && plan->solid ? "no sample's ray was found to meet two stretches at once"
                                   : "no solid is walked through");
    tell(report, "media", plan->media, "a material has a medium",
         needs.shells ? "no material has a medium: nothing is blended" : NO_SHELL);
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

    /* What that takes: branches, buffers, libraries. */
    tell(report, "supersampling", plan->k > 1, "image.samples is more than 1",
         "image.samples is 1");
    tell(report, "depth", plan->depth, "opaque things hide one another, or media",
         opaque ? "one solid shell is walked through alone: each ray finds its first surface"
                : "nothing opaque: no depth buffer is made");
    tell(report, "occluded", plan->occluded, "media end at the depth of what is opaque",
         !plan->media ? "there is no medium to clip" : "nothing opaque clips the media");
    tell_shells(plan, &needs, report);
    tell_light(plan, &needs, scene->light_count > 0, report);
    tell(report, "base-textures", textured, "a base or mesh takes its colour from an image",
         "no base or mesh takes its colour from an image: no texture coordinates are uploaded");
    tell(report, "OpenImageIO", needs.images || textured, "the scene reads an image",
         "the scene reads no image");
    tell(report, "tinygltf", needs.gltf, "the scene reads a glTF asset",
         "the scene reads no glTF asset");
}
