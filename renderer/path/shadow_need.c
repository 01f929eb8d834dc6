/* What a picture needs of shadows: views, sizes and slices of maps. See shadow.h. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "renderer/path/light_view.h"
#include "renderer/path/shadow.h"
#include "renderer/path/variant.h"

/* A map's size where the scene leaves it open; its slices: of rays that end on a base, or pass one
 * stretch, and of those that go on to another side of the shell. */
enum { SIDE_MIN = 256, SIDE_MAX = 1024, SLICES = 12, SLICES_THROUGH = 48 };

/* Of a texture, which every GL 4.5 has. */
enum { ARRAY_LAYERS = 2048 };

static bool throws(const struct scene_light *light) {
    return light->shadow && (light->color[0] > 0 || light->color[1] > 0 || light->color[2] > 0);
}

/* The colour of all extinction that throws shadows, or that there are several. */
static void choose_tint(const struct path_object *objects, size_t count, struct shadow_need *need) {
    for (int i = 0; i < 3; i++)
        need->tint[i] = 1;
    need->channels = false;
    bool any = false;
    for (size_t n = 0; n < count; n++) {
        if (!objects[n].shell || !volume_has_medium(objects[n].volume))
            continue;
        const double *tint = objects[n].volume->tint;
        for (int i = 0; i < 3; i++) {
            need->channels |= any && tint[i] != need->tint[i];
            need->tint[i] = tint[i];
        }
        any = true;
    }
}

static uint64_t bytes_of(const struct shadow_need *need, int size) {
    uint64_t layers =
        (need->opaque ? 1 : 0) + (need->media ? 1 + (uint64_t)shadow_map_layers(need) : 0);
    return (uint64_t)size * (uint64_t)size * 16 * (layers * (uint64_t)need->views + 1);
}

/* fp32 holds places in the scene to some of its radius: a light and a corner that are this near may
 * be one. */
static const double AT_VERTEX = 3e-7;

static enum status count_views(const struct scene *scene, size_t k,
                               const struct path_object *objects, size_t count,
                               struct shadow_need *need, struct error *err) {
    const struct scene_light *light = &scene->lights[k];
    need->count++;
    if (!light->point) {
        need->view[k][0] = need->views++;
        return STATUS_OK;
    }
    double low[3], high[3], radius = 0;
    light_view_bounds(objects, count, light->position, low, high);
    for (int i = 0; i < 3; i++)
        radius += (high[i] - low[i]) * (high[i] - low[i]) / 4;
    if (light_view_at_vertex(objects, count, light->position, AT_VERTEX * sqrt(radius))) {
        char pointer[48];
        snprintf(pointer, sizeof pointer, "/lights/%zu/position", k);
        return error_fault(err, STATUS_NOT_IMPLEMENTED, pointer,
                           "a light that throws shadows stands at a corner of a shell: a millionth "
                           "of the scene beside it, it can be drawn");
    }
    for (int face = 0; face < SHADOW_FACES; face++)
        if (light_view_meets(low, high, face))
            need->view[k][face] = need->views++;
    return STATUS_OK;
}

/* Where media have no base and surfaces that face one another, a map's slices are spread over all
 * of the object: most of them lie where nothing is. */
static int slices_for(const struct path_object *objects, size_t count) {
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        if (object->shell && volume_has_medium(object->volume) && !object->object->shell.has_base &&
            object->shell->flatness < 0.5)
            return SLICES_THROUGH;
    }
    return SLICES;
}

enum status shadow_choose(struct scene *scene, struct path_object *objects, size_t count,
                          bool forced, struct shadow_need *need, struct error *err) {
    memset(need, 0, sizeof *need);
    bool lit = false;
    for (size_t i = 0; i < count; i++) {
        const struct path_object *object = &objects[i];
        bool wanted = surface_wanted(object->object);
        need->opaque |= wanted || (object->shell && volume_has_solid(object->volume));
        need->media |= object->shell && volume_has_medium(object->volume);
        lit |= wanted || (object->shell && path_object_drawn(object) &&
                          variant_needs_normals(object, (int)scene->light_count));
    }
    for (size_t k = 0; k < scene->light_count; k++) {
        need->points |= lit && scene->lights[k].point;
        for (int face = 0; face < SHADOW_FACES; face++)
            need->view[k][face] = -1;
        if (!lit || !throws(&scene->lights[k]))
            continue;
        enum status status = count_views(scene, k, objects, count, need, err);
        if (status != STATUS_OK)
            return status;
    }
    if (need->count == 0 && forced && scene->light_count > 0)
        need->count = need->views = 1;
    for (size_t i = 0; i < count; i++)
        objects[i].shadow = need->points ? (uint32_t)FLAG_POINT : 0;
    if (need->count == 0)
        return STATUS_OK;
    int slices = scene->shadow.slices ? scene->shadow.slices : slices_for(objects, count);
    need->layers = SHADOW_LAYERS * (int)ceil(slices / 12.0);
    choose_tint(objects, count, need);
    /* What the scene leaves out never is what cannot be had. */
    int least = scene->shadow.size ? scene->shadow.size : SIDE_MIN;
    if (!scene->shadow.slices && (bytes_of(need, least) > SHADOW_BYTES_MAX ||
                                  shadow_map_layers(need) * need->views > ARRAY_LAYERS))
        need->layers = SHADOW_LAYERS;
    need->size = scene->shadow.size;
    if (!need->size) {
        int longer =
            scene->image.width > scene->image.height ? scene->image.width : scene->image.height;
        need->size = longer < SIDE_MIN ? SIDE_MIN : longer > SIDE_MAX ? SIDE_MAX : longer;
        while (bytes_of(need, need->size) > SHADOW_BYTES_MAX)
            need->size = need->size * 7 / 8;
    }
    if (bytes_of(need, need->size) > SHADOW_BYTES_MAX)
        return error_fault(err, STATUS_TOO_COMPLEX, "/shadow/size",
                           "maps of %d x %d with %d slices for %d views of lights: %llu MiB, at "
                           "most %d",
                           need->size, need->size, 3 * need->layers, need->views,
                           (unsigned long long)(bytes_of(need, need->size) >> 20),
                           SHADOW_BYTES_MAX >> 20);
    if (shadow_map_layers(need) * need->views > ARRAY_LAYERS)
        return error_fault(err, STATUS_TOO_COMPLEX, "/shadow/slices",
                           "%d slices of three optical depths for %d views of lights: %d layers, "
                           "and a GL need not have more than %d",
                           3 * need->layers, need->views, shadow_map_layers(need) * need->views,
                           ARRAY_LAYERS);
    scene->shadow.size = need->size;
    scene->shadow.slices = need->media ? 3 * need->layers : 0;
    for (size_t i = 0; i < count; i++)
        objects[i].shadow |= (need->opaque ? (uint32_t)FLAG_SHADOW_OPAQUE : 0) |
                             (need->media ? (uint32_t)FLAG_SHADOW_MEDIA : 0) |
                             (need->channels           ? (uint32_t)FLAG_SHADOW_CHANNELS
                              : shadow_is_tinted(need) ? (uint32_t)FLAG_SHADOW_TINT
                                                       : 0);
    return STATUS_OK;
}
