/* See cost.h. */
#include "renderer/cost.h"

#include <math.h>

#include "renderer/path/runs.h"

/* Prisms looked at in each shell. With 64 the figures of a sphere, a torus and a terrain are within
 * 8 % of what is drawn (tests/unit/test_choice.c holds them to it). */
enum { PRISMS_MAX = 64, PRISM_CELLS = 3 };

/* Milliseconds of the processor for each of the figures; the frame's once for each shell. */
struct rates {
    double frame, sample, outline, fragment, step;
};

enum way { WALKED, SORTED, SLABS, WAYS };
enum content { EVEN, MEDIUM, LIT, SOLID, CONTENTS };

/* Fitted to the 315 pictures of bench_choice.c (7 shapes, 4 contents, 3 ways, 4 views) on two cores
 * of an x86-64 virtual machine under llvmpipe 22.3, by least squares of relative errors, none below
 * 0; `tests/bench/bench.py BUILD --only choice` prints them for the machine it runs on. The rates
 * of slabs are of a later day than the others, since slabs are drawn in runs, and were held to two
 * other runs of the same bench, while other work took half of the machine and more: the model is
 * within a factor of 2 of 299 and 296 of the pictures; its ratio of slabs to walks is in 94 and 89
 * of 105, of slabs to sorted cells in 104 and 105 of 105. It takes the dearer of slabs and walks in
 * 6 and 5, by a factor of 1.43 at most; of slabs and sorted cells, which are near to each other now
 * (0.55 to 3.8), in 28 and 30, by 1.31. Farthest off are walks through solids that fold over
 * themselves, since those turn out to be cells. */
static const struct rates RATES[WAYS][CONTENTS] = {
    [WALKED] = {[EVEN] = {0.365, 2.17e-5, 0, 2.28e-5, 0},
                [MEDIUM] = {0, 0, 0, 8.93e-5, 1.80e-5},
                [LIT] = {3.22, 2.39e-5, 0, 7.53e-5, 2.78e-5},
                [SOLID] = {0.512, 9.67e-5, 0, 1.09e-4, 1.24e-5}},
    [SORTED] = {[EVEN] = {0, 0, 1.07e-3, 4.76e-5, 0},
                [MEDIUM] = {0, 0, 2.57e-3, 1.50e-4, 1.07e-5},
                [LIT] = {0, 0, 3.87e-3, 2.05e-4, 3.75e-5},
                [SOLID] = {0, 0, 2.51e-3, 2.92e-4, 1.45e-5}},
    [SLABS] = {[EVEN] = {0, 0, 1.29e-3, 3.82e-5, 0},
               [MEDIUM] = {0, 0, 1.65e-3, 1.42e-4, 0},
               [LIT] = {0, 0, 1.81e-3, 2.58e-4, 0},
               [SOLID] = {0, 0, 2.20e-3, 2.60e-4, 5.02e-6}},
};

/* What one shell holds, whatever it is drawn by. */
struct counted {
    double cells;
    double area;   /* of all cells' outlines, in samples */
    double length; /* area times the mean length of the rays in a cell, object units */
    double depth;  /* area times the depth H (view.h) of that length */
    double depths; /* sum of the cells' ranges of H */
};

/* Twice the area of a polygon. */
static double twice_area(double outline[][2], int corners) {
    double sum = 0;
    for (int i = 0; i < corners; i++) {
        const double *a = outline[i], *b = outline[(i + 1) % corners];
        sum += a[0] * b[1] - b[0] * a[1];
    }
    return fabs(sum);
}

static void subtract(const double a[3], const double b[3], double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = a[i] - b[i];
}

static double triple(const double a[3], const double b[3], const double c[3]) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
}

/* The mean length of the parallel rays along `ray` in a tetrahedron, in units of |ray|: its volume
 * over its projection, which is half the sum of those of its faces. */
static double mean_chord(const double v[4][3], const double ray[3]) {
    double e[3][3], shadow = 0;
    for (int i = 0; i < 3; i++)
        subtract(v[i + 1], v[0], e[i]);
    double volume = fabs(triple(e[0], e[1], e[2])) / 6;
    double f1[3], f2[3];
    subtract(v[2], v[1], f1);
    subtract(v[3], v[1], f2);
    shadow = fabs(triple(ray, e[0], e[1])) + fabs(triple(ray, e[1], e[2])) +
             fabs(triple(ray, e[2], e[0])) + fabs(triple(ray, f1, f2));
    shadow /= 4; /* half of each face's parallelogram, half of both sides */
    return shadow > 0 ? volume / shadow : 0;
}

static void count_cell(const struct path_object *object, uint32_t t, const struct slabs *slabs,
                       struct counted *counted) {
    const struct shell *shell = object->shell;
    const struct projection *projection = &object->projection;
    const struct view *view = &projection->view;
    double outline[OUTLINE_MAX][2], v[4][3], ray[3], low = INFINITY, high = -INFINITY;
    double area = twice_area(outline, project_outline(shell, projection, t, outline)) / 2;
    double middle[3] = {0, 0, 0};
    for (int k = 0; k < 4; k++) {
        uint32_t vertex = shell->tetra[t][k];
        for (int i = 0; i < 3; i++) {
            v[k][i] = shell->position[vertex][i];
            middle[i] += v[k][i] / 4;
        }
        low = fmin(low, projection->clip[vertex][2]);
        high = fmax(high, projection->clip[vertex][2]);
    }
    if (high > slabs->low)
        counted->depths += high - fmax(low, slabs->low);
    /* The ray through the cell's middle: from the eye, or parallel to d0. */
    double h = view->h_row[3];
    for (int i = 0; i < 3; i++) {
        h += view->h_row[i] * middle[i];
        ray[i] = view->orthographic ? view->d0[i] : middle[i] - (view->o0[i] - view->d0[i]);
    }
    double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + ray[2] * ray[2]);
    double chord = mean_chord(v, ray); /* in units of the ray's length, which is H of depth */
    counted->area += area;
    counted->length += area * chord * length;
    counted->depth += area * chord * (view->orthographic ? 1 : fabs(h));
}

static struct counted count_shell(const struct path_object *object, const struct slabs *slabs) {
    struct counted counted = {.cells = object->shell->tetra_count};
    uint32_t prisms = object->shell->tetra_count / PRISM_CELLS;
    uint32_t looked_at = prisms < PRISMS_MAX ? prisms : PRISMS_MAX;
    for (uint32_t n = 0; n < looked_at; n++) {
        /* All, or spread by multiples of the golden ratio, which keep step with no grid. */
        double at = n * 0.6180339887498949;
        uint32_t prism = prisms == looked_at ? n : (uint32_t)((at - floor(at)) * prisms);
        for (uint32_t k = 0; k < PRISM_CELLS; k++)
            count_cell(object, PRISM_CELLS * prism + k, slabs, &counted);
    }
    double scale = looked_at ? (double)prisms / looked_at : 0;
    counted.area *= scale;
    counted.length *= scale;
    counted.depth *= scale;
    counted.depths *= scale;
    return counted;
}

/* How many planes cut a unit of depth. */
struct planes {
    double slabs; /* with a step from each to the next */
    double runs;  /* with a part of a cell from each to the next */
};

static struct planes find_planes(const struct path_object *objects, size_t count,
                                 const struct slabs *slabs, bool solid) {
    double range = slabs->high - slabs->low;
    uint32_t wanted = 1;
    for (size_t i = 0; i < count; i++)
        if (path_object_drawn(&objects[i]) && objects[i].object->path == SCENE_PATH_SLICING)
            wanted = (uint32_t)objects[i].quality;
    if (!(range > 0))
        return (struct planes){0, 0};
    uint32_t run = runs_slabs(objects, count, range / wanted, solid);
    /* Those before and behind all of it cut nothing. */
    return (struct planes){(wanted - 1) / range, (runs_count(wanted, run) - 1) / range};
}

static void add_shell(const struct path_object *object, const struct slabs *slabs,
                      const struct planes *planes, bool lights, bool solid, struct cost *cost) {
    const struct volume *volume = object->volume;
    struct counted counted = count_shell(object, slabs);
    enum way way = object->object->path == SCENE_PATH_SLICING ? SLABS
                   : object->walk                             ? WALKED
                                                              : SORTED;
    enum content content = solid                   ? SOLID
                           : volume->homogeneous   ? EVEN
                           : lights && volume->lit ? LIT
                                                   : MEDIUM;
    double outlines = counted.cells, fragments = counted.area, steps;
    if (way == SLABS) {
        outlines += counted.depths * planes->runs;
        fragments += counted.depth * planes->runs;
        const struct view *view = &object->projection.view;
        steps = fmax(fragments,
                     counted.depth * planes->slabs * runs_along_ray(view) / runs_step(view, 1));
    } else {
        outlines = way == WALKED ? 0 : outlines;
        steps = fmax(fragments, counted.length * object->quality / object->shell->thickness);
    }
    if (content == EVEN)
        steps = 0;
    const struct rates *rates = &RATES[way][content];
    cost->outlines += outlines;
    cost->fragments += fragments;
    cost->steps += steps;
    cost->ms += rates->frame + rates->sample * cost->samples + rates->outline * outlines +
                rates->fragment * fragments + rates->step * steps;
}

void cost_find(const struct path_object *objects, size_t count, const struct view *world,
               bool lights, struct cost *cost) {
    *cost = (struct cost){.samples = (double)world->width * world->height};
    struct slabs slabs;
    runs_find_range(objects, count, &slabs);
    for (int solid = 0; solid < 2; solid++) {
        struct planes planes = find_planes(objects, count, &slabs, solid);
        for (size_t i = 0; i < count; i++)
            if (path_object_drawn(&objects[i]) && (solid ? volume_has_solid(objects[i].volume)
                                                         : volume_has_medium(objects[i].volume)))
                add_shell(&objects[i], &slabs, &planes, lights, solid, cost);
    }
}
