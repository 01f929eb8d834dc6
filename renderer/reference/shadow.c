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
    double fill = volume->absorption * prism->ray->speed * h;
    if (volume->homogeneous)
        return volume->extinction * prism->ray->speed * h + fill;
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
    return sum * h * prism->ray->speed / prism->object->spec->shell.thickness + fill;
}

/* The share of light k, by channels, that comes to `from`, which is relative to the world's centre.
 */
static void share(struct tracer *light, const double from[3], const double toward[3],
                  double distance, const struct origin *origin, double arrives[3]) {
    const struct world *world = light->world;
    for (int i = 0; i < 3; i++)
        arrives[i] = 0;
    if (origin->object && !origin->solid && dot3(origin->flat, toward) <= EDGE_ON)
        return; /* the triangle itself is in the way */
    double t_from = dot3(from, toward), t_to = t_from + distance, o[3];
    for (int i = 0; i < 3; i++)
        o[i] = from[i] - t_from * toward[i];
    for (size_t i = 0; i < world->object_count; i++)
        object_ray_init(&world->objects[i], o, toward, &light->rays[i]);
    if (tracer_meets_surface(light, t_from, t_to, origin) || !tracer_gather(light, t_from, t_to) ||
        tracer_meets_solid(light, t_from, origin))
        return;
    double depth[3] = {0, 0, 0};
    for (size_t k = 0; k < light->cell_count; k++) {
        if (fmin(depth[0], fmin(depth[1], depth[2])) >= DEPTH_DARK)
            break;
        const struct segment *segment = &light->segments[light->cells[k].segment];
        const double *tint = light->prisms[segment->prism].object->volume->tint;
        double own = depth_of_cell(light, &light->cells[k]);
        for (int i = 0; i < 3; i++)
            depth[i] += tint[i] * own;
    }
    for (int i = 0; i < 3; i++)
        arrives[i] = depth[i] < DEPTH_DARK ? exp(-depth[i]) : 0;
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
        double arrives[3];
        share(tracer->light, from, incident->toward[k], incident->distance[k], origin, arrives);
        for (int i = 0; i < 3; i++)
            incident->color[k][i] *= arrives[i];
        if (tracer->light->status != STATUS_OK) {
            tracer->status = tracer->light->status;
            return false;
        }
    }
    return true;
}
