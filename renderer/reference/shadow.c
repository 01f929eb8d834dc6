/* Shadow, as api/README.md defines it: what arrives of a light at a point is what all media on the
 * way let through, exp(-int sigma), or nothing where something opaque lies on the way. A light ray
 * is a ray like any other: from the point on, through every prism, by the code that finds what the
 * eye sees; but what it gathers needs no order, since optical depths add.
 *
 * Within a voxel cell extinction is trilinear, along a straight map a cubic, which two points of
 * Gauss integrate exactly. Prisms' maps are rational: on a torus of 12 x 6 three points leave 2e-9
 * of the picture, four 3e-13 (tests/unit/test_reference_shadow.c). */
#include "renderer/reference/trace.h"
#include "renderer/reference/vector.h"
#include "renderer/reference/voxels.h"

enum { POINTS = 4 };
static const double point[POINTS] = {0.06943184420297371239, 0.33000947820757186760,
                                     0.66999052179242813240, 0.93056815579702628761};
static const double weight[POINTS] = {0.17392742256872692869, 0.32607257743127307131,
                                      0.32607257743127307131, 0.17392742256872692869};

/* exp(-DEPTH_DARK) is below the last digit of any light. */
static const double DEPTH_DARK = 80;

/* The cosine that rounding leaves to a light that stands on the triangle. */
static const double EDGE_ON = 1e-12;

static double depth_of_cell(struct tracer *light, const struct cell *cell) {
    const struct prism_ray *prism = &light->prisms[light->segments[cell->segment].prism];
    const struct volume *volume = prism->object->volume;
    double h = cell->span.t[1] - cell->span.t[0], sum = 0;
    if (volume->homogeneous)
        return volume->extinction * prism->ray->speed * h;
    if (!volume->medium)
        return 0;
    struct voxels voxels;
    voxels_load(volume, false, false, cell->x, cell->y, cell->z, &voxels);
    double most = 0;
    for (int c = 0; c < 8; c++)
        most = fmax(most, voxels.value[c][3]);
    for (int n = 0; n < POINTS && most > 0; n++) {
        double t = cell->span.t[0] + h * point[n], at[3], b[3], value[4];
        if (!voxels_place(prism, t, prism_w(prism, &cell->span, t), at, b))
            continue;
        voxels_value(&voxels, at, value);
        sum += weight[n] * fmax(0, value[3]);
        light->evaluations++;
    }
    return sum * h * prism->ray->speed / prism->object->spec->shell.thickness;
}

/* The share of light k that comes to `from`, which is relative to the world's centre. */
static double share(struct tracer *light, const double from[3], const double toward[3],
                    double distance, const struct origin *origin) {
    const struct world *world = light->world;
    if (origin->object && !origin->solid && dot3(origin->flat, toward) <= EDGE_ON)
        return 0; /* the triangle itself is in the way */
    double t_from = dot3(from, toward), t_to = t_from + distance, o[3];
    for (int i = 0; i < 3; i++)
        o[i] = from[i] - t_from * toward[i];
    for (size_t i = 0; i < world->object_count; i++)
        object_ray_init(&world->objects[i], o, toward, &light->rays[i]);
    if (tracer_meets_surface(light, t_from, t_to, origin) || !tracer_gather(light, t_from, t_to) ||
        tracer_meets_solid(light, t_from, origin))
        return 0;
    double depth = 0;
    for (size_t k = 0; k < light->cell_count && depth < DEPTH_DARK; k++)
        depth += depth_of_cell(light, &light->cells[k]);
    return depth < DEPTH_DARK ? exp(-depth) : 0;
}

bool tracer_incident(struct tracer *tracer, double t, const struct origin *origin,
                     struct reference_incident *incident) {
    const struct reference_lights *lights = &tracer->world->lights;
    double from[3];
    for (int i = 0; i < 3; i++)
        from[i] = tracer->o[i] + t * tracer->d[i];
    reference_unshadowed(lights, from, tracer->world->center, incident);
    for (int k = 0; k < lights->count; k++) {
        if (!lights->shadow[k])
            continue;
        double arrives =
            share(tracer->light, from, incident->toward[k], incident->distance[k], origin);
        for (int i = 0; i < 3; i++)
            incident->color[k][i] *= arrives;
        if (tracer->light->status != STATUS_OK) {
            tracer->status = tracer->light->status;
            return false;
        }
    }
    return true;
}
