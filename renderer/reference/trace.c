/* One ray, from its candidates to its colour. */
#include "renderer/reference/trace.h"

#include <stdlib.h>
#include <string.h>

#include "renderer/reference/vector.h"

bool tracer_init(struct tracer *tracer, const struct world *world, double tolerance) {
    memset(tracer, 0, sizeof *tracer);
    tracer->world = world;
    tracer->tolerance = tolerance;
    tracer->rays = calloc(world->object_count + 1, sizeof *tracer->rays);
    if (!tracer->rays || !world->lights.any_shadow)
        return tracer->rays != NULL;
    tracer->light = calloc(1, sizeof *tracer->light);
    if (tracer->light) {
        tracer->light->world = world;
        tracer->light->rays = calloc(world->object_count + 1, sizeof *tracer->rays);
    }
    return tracer->light && tracer->light->rays;
}

void tracer_finish(struct tracer *tracer) {
    if (tracer->light)
        tracer_finish(tracer->light);
    free(tracer->light);
    free(tracer->rays);
    free(tracer->prisms);
    free(tracer->segments);
    free(tracer->cells);
    free(tracer->breaks);
    free(tracer->active);
    memset(tracer, 0, sizeof *tracer);
}

bool tracer_grow(struct tracer *tracer, void **list, size_t count, size_t *capacity, size_t size) {
    if (count < *capacity)
        return true;
    size_t wanted = *capacity ? 2 * *capacity : 64;
    void *grown = wanted < SIZE_MAX / 2 / size ? realloc(*list, wanted * size) : NULL;
    if (!grown) {
        tracer->status = STATUS_OUT_OF_MEMORY;
        return false;
    }
    *list = grown;
    *capacity = wanted;
    return true;
}

/* What a visit of the hierarchy of one object's prisms needs. */
struct gather {
    struct tracer *tracer;
    size_t object;
    double t_eye, t_end;
};

static bool add_segment(struct tracer *tracer, const struct prism_interval *span) {
    void *list = tracer->segments;
    if (!tracer_grow(tracer, &list, tracer->segment_count, &tracer->segment_capacity,
                     sizeof *tracer->segments))
        return false;
    tracer->segments = list;
    tracer->segments[tracer->segment_count++] =
        (struct segment){(uint32_t)tracer->prism_count, *span};
    return true;
}

static bool meet_prism(void *user, uint32_t index) {
    struct gather *gather = user;
    struct tracer *tracer = gather->tracer;
    const struct world_object *object = &tracer->world->objects[gather->object];
    void *list = tracer->prisms;
    if (!tracer_grow(tracer, &list, tracer->prism_count, &tracer->prism_capacity,
                     sizeof *tracer->prisms))
        return false;
    tracer->prisms = list;
    struct prism_ray *prism = &tracer->prisms[tracer->prism_count];
    struct prism_interval intervals[PRISM_INTERVALS_MAX];
    int count = prism_meet(object, index, &tracer->rays[gather->object], prism, intervals);
    bool any = false;
    for (int i = 0; i < count; i++) {
        struct prism_interval span = intervals[i];
        if (!(span.t[1] > gather->t_eye && span.t[0] < gather->t_end))
            continue;
        if (span.t[0] < gather->t_eye) {
            span.w[0] = prism_w(prism, &intervals[i], gather->t_eye);
            span.t[0] = gather->t_eye;
        }
        if (span.t[1] > gather->t_end) {
            span.w[1] = prism_w(prism, &intervals[i], gather->t_end);
            span.t[1] = gather->t_end;
        }
        if (!(span.t[1] > span.t[0]))
            continue;
        if (!add_segment(tracer, &span))
            return false;
        any = true;
    }
    tracer->prism_count += any;
    return true;
}

static int compare_cells(const void *a, const void *b) {
    const struct cell *x = a, *y = b;
    if (x->span.t[0] != y->span.t[0])
        return x->span.t[0] < y->span.t[0] ? -1 : 1;
    return (x->segment > y->segment) - (x->segment < y->segment);
}

bool tracer_gather(struct tracer *tracer, double t_eye, double t_end) {
    const struct world *world = tracer->world;
    tracer->prism_count = tracer->segment_count = tracer->cell_count = 0;
    for (size_t i = 0; i < world->object_count; i++) {
        const struct world_object *object = &world->objects[i];
        struct gather gather = {tracer, i, t_eye, t_end};
        if (object->prisms && !bvh_candidates(object->prisms, tracer->rays[i].o, tracer->rays[i].d,
                                              t_eye, &gather.t_end, meet_prism, &gather))
            return false;
    }
    for (uint32_t s = 0; s < tracer->segment_count; s++)
        if (!tracer_split(tracer, s))
            return false;
    if (tracer->cell_count > 0)
        qsort(tracer->cells, tracer->cell_count, sizeof *tracer->cells, compare_cells);
    tracer->segments_met += tracer->segment_count;
    tracer->cells_met += tracer->cell_count;
    return true;
}

bool tracer_trace(struct tracer *tracer, double x, double y, double rgba[4]) {
    const struct world *world = tracer->world;
    double t_eye;
    world_ray(world, x, y, tracer->o, tracer->d, &t_eye);
    const double view[3] = {-tracer->d[0], -tracer->d[1], -tracer->d[2]};
    for (size_t i = 0; i < world->object_count; i++)
        object_ray_init(&world->objects[i], tracer->o, tracer->d, &tracer->rays[i]);

    memcpy(rgba, world->background, 4 * sizeof *rgba);
    struct stop stop;
    if (!tracer_find_surface(tracer, t_eye, view, &stop))
        return false;
    if (!tracer_gather(tracer, t_eye, stop.t))
        return false;
    if (!tracer_find_solid(tracer, view, &stop))
        return false;
    double radiance[3], through[3];
    if (!tracer_integrate(tracer, t_eye, stop.t, view, radiance, through))
        return false;
    double behind = isfinite(stop.t) ? 1 : rgba[3];
    for (int i = 0; i < 3; i++)
        rgba[i] = radiance[i] + through[i] * (isfinite(stop.t) ? stop.color[i] : rgba[i]);
    /* Alpha is the mean over the channels, which here mostly are one: that keeps its digits. */
    bool grey = through[0] == through[1] && through[0] == through[2];
    double transmittance = grey ? through[0] : (through[0] + through[1] + through[2]) / 3;
    /* 1 - T (1 - A), so that thin media keep their digits. */
    rgba[3] = behind >= 1 ? 1 : 1 - transmittance * (1 - behind);
    return tracer->segment_count > 0 || isfinite(stop.t);
}
