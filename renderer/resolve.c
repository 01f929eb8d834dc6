/* See resolve.h. */
#include "renderer/resolve.h"

#include <string.h>

#include "renderer/choice.h"
#include "renderer/force.h"
#include "renderer/path/footprint.h"
#include "renderer/tint.h"

void resolve_objects(struct scene *scene, const struct prepared *prepared) {
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct path_object *object = &prepared->objects[i];
        if (!object->shell)
            continue;
        struct scene_object *spec = &scene->objects[i];
        path_find(spec->path)->resolve(object, &spec->quality);
        if (spec->quality.map == SCENE_MAP_AUTO && !object->volume->homogeneous)
            spec->quality.map = object->exact ? SCENE_MAP_EXACT : SCENE_MAP_AFFINE;
        if (!object->volume->homogeneous && spec->quality.filter == SCENE_FILTER_AUTO)
            spec->quality.filter = object->filter;
        if (!object->volume->homogeneous)
            memcpy(spec->shell.material.size, object->volume->size,
                   sizeof spec->shell.material.size);
    }
}

/* The path of the shells, which is that of any, chooses for all. */
static enum status choose_quality(const struct prepared *prepared, struct error *err) {
    for (size_t i = 0; i < prepared->object_count; i++)
        if (prepared->objects[i].shell)
            return path_find(prepared->objects[i].object->path)
                ->choose(prepared->objects, prepared->object_count, err);
    return STATUS_OK;
}

enum status resolve_plan(const struct scene *asked, struct prepared *prepared,
                         const struct view *world, bool may_walk, uint32_t force,
                         struct report *report, struct plan *plan, struct error *err) {
    struct scene *scene = &report->resolved;
    size_t warnings = report->warning_count;
    for (size_t i = 0; i < scene->object_count; i++)
        scene->objects[i].quality = asked->objects[i].quality;
    scene->shadow = asked->shadow;
    enum status status = choose_quality(prepared, err);
    if (status == STATUS_OK)
        status = plan_order(prepared->objects, prepared->object_count, may_walk, err);
    if (status == STATUS_OK)
        status = tint_check(scene, prepared->objects, prepared->object_count, err);
    if (status == STATUS_OK)
        status = footprint_choose_filters(prepared->objects, prepared->object_count, err);
    if (status != STATUS_OK)
        return status;
    struct shadow_need shadow;
    status = shadow_choose(scene, prepared->objects, prepared->object_count, force & FORCE_SHADOW,
                           &shadow, err);
    if (status != STATUS_OK)
        return status;
    if (force & FORCE_COST)
        choice_tell_cost(prepared, scene, world, report);
    resolve_objects(scene, prepared);
    plan_warn_uneven(prepared->objects, prepared->object_count, report);
    plan_make(scene, prepared->objects, prepared->object_count, &shadow, plan);
    plan->warnings = warnings;
    force_plan(force, plan);
    plan_report(plan, scene, prepared->objects, prepared->object_count, report);
    return STATUS_OK;
}
