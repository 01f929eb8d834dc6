/* The nearest opaque triangle: bases of shells and plain meshes, two-sided, with interpolated
 * shading normals and the asset's colours where the scene gives none.
 *
 * Seen along the ray the corners are points of a plane, and the ray meets the triangle where the
 * three cross products have one sign; 0 counts as either, so that no ray slips through an edge.
 * Textures are read bilinearly at their full size, repeated, decoded from sRGB before they are
 * mixed. */
#include <string.h>

#include "renderer/reference/trace.h"
#include "renderer/reference/vector.h"

struct nearest {
    const struct world_object *object;
    const struct object_ray *ray;
    double t_eye, t;
    double b[3];
    uint32_t triangle;
    bool found;
    const struct origin *origin; /* NULL, or where a ray toward a light begins */
};

static bool meet(void *user, uint32_t index) {
    struct nearest *nearest = user;
    const struct object_ray *ray = nearest->ray;
    /* Its own triangle a ray toward a light leaves at once, whatever rounding says. */
    if (nearest->origin && nearest->origin->object == nearest->object && !nearest->origin->solid &&
        nearest->origin->triangle == index)
        return true;
    double q[3][2], along[3], b[3], sum = 0, t = 0;
    for (int k = 0; k < 3; k++) {
        const double *p = nearest->object->bottom[nearest->object->mesh->vertex[index][k]];
        double r[3] = {p[0] - ray->o[0], p[1] - ray->o[1], p[2] - ray->o[2]};
        q[k][0] = dot3(r, ray->a);
        q[k][1] = dot3(r, ray->b);
        along[k] = dot3(r, ray->d) / (ray->speed * ray->speed);
    }
    bool positive = false, negative = false;
    for (int k = 0; k < 3; k++) {
        b[k] = cross2(q[(k + 1) % 3], q[(k + 2) % 3]);
        positive |= b[k] > 0;
        negative |= b[k] < 0;
        sum += b[k];
    }
    if ((positive && negative) || sum == 0)
        return true;
    for (int k = 0; k < 3; k++) {
        b[k] /= sum;
        t += b[k] * along[k];
    }
    /* What the eye lies on it does not see: nearer than this is rounding. */
    double rounding = 1e-13 * (fabs(nearest->t_eye) + nearest->object->radius / ray->speed);
    /* Nor is what a light stands on in its way; seen nearly from the edge it is met less exactly.
     */
    double before = nearest->t;
    if (nearest->origin && isfinite(before))
        before -= 1e4 * rounding;
    if (!(t > nearest->t_eye + rounding && t < before))
        return true;
    nearest->t = t;
    nearest->triangle = index;
    nearest->found = true;
    memcpy(nearest->b, b, sizeof b);
    return !nearest->origin; /* any will do that hides a light */
}

bool tracer_meets_surface(struct tracer *tracer, double t_from, double t_to,
                          const struct origin *origin) {
    const struct world *world = tracer->world;
    for (size_t i = 0; i < world->object_count; i++) {
        const struct world_object *object = &world->objects[i];
        if (!object->triangles)
            continue;
        struct nearest nearest = {.object = object,
                                  .ray = &tracer->rays[i],
                                  .t_eye = t_from,
                                  .t = t_to,
                                  .origin = origin};
        if (!bvh_candidates(object->triangles, nearest.ray->o, nearest.ray->d, t_from, &nearest.t,
                            meet, &nearest))
            return true;
    }
    return false;
}

static double linear_from_srgb(uint8_t code) {
    double v = code / 255.0;
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static size_t wrap(double k, int n) {
    double r = fmod(k, n);
    size_t index = (size_t)(r < 0 ? r + n : r);
    return index < (size_t)n ? index : 0;
}

static void texture_at(const struct mesh_image *image, const double uv[2], double color[3]) {
    double x = (uv[0] - floor(uv[0])) * image->width - 0.5;
    double y = (uv[1] - floor(uv[1])) * image->height - 0.5;
    double fx = x - floor(x), fy = y - floor(y);
    memset(color, 0, 3 * sizeof *color);
    for (int c = 0; c < 4; c++) {
        size_t column = wrap(floor(x) + (c & 1), image->width);
        size_t row = wrap(floor(y) + (c >> 1), image->height);
        const uint8_t *texel = image->rgba + 4 * (row * (size_t)image->width + column);
        double weight = (c & 1 ? fx : 1 - fx) * (c >> 1 ? fy : 1 - fy);
        for (int i = 0; i < 3; i++)
            color[i] += weight * linear_from_srgb(texel[i]);
    }
}

static void color_of(const struct nearest *hit, double color[3]) {
    const struct scene_object *spec = hit->object->spec;
    bool shell = spec->kind == SCENE_OBJECT_SHELL;
    if (shell ? spec->shell.base.has_color : spec->mesh.has_color) {
        memcpy(color, shell ? spec->shell.base.color : spec->mesh.color, 3 * sizeof *color);
        return;
    }
    const struct mesh *mesh = hit->object->mesh;
    const struct mesh_surface *surface = &mesh->surfaces[mesh->surface[hit->triangle]];
    for (int i = 0; i < 3; i++)
        color[i] = (double)surface->base_color[i];
    if (surface->image < 0 || !mesh->images[surface->image].rgba)
        return;
    double uv[2] = {0, 0}, texel[3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 2; i++)
            uv[i] += hit->b[k] * mesh->corner_uv[hit->triangle][k][i];
    texture_at(&mesh->images[surface->image], uv, texel);
    for (int i = 0; i < 3; i++)
        color[i] *= texel[i];
}

/* The shading normal in the world, turned to the side from which the triangle is seen, and the
 * triangle's own, likewise. */
static void normals_of(const struct nearest *hit, double normal[3], double flat[3]) {
    const struct mesh *mesh = hit->object->mesh;
    const uint32_t *v = mesh->vertex[hit->triangle];
    double e1[3], e2[3], face[3], shading[3] = {0, 0, 0};
    for (int i = 0; i < 3; i++) {
        e1[i] = hit->object->bottom[v[1]][i] - hit->object->bottom[v[0]][i];
        e2[i] = hit->object->bottom[v[2]][i] - hit->object->bottom[v[0]][i];
        for (int k = 0; k < 3; k++)
            shading[i] += hit->b[k] * (double)mesh->corner_normal[hit->triangle][k][i];
    }
    cross3(e1, e2, face);
    double side = dot3(face, hit->ray->d) > 0 ? -1 : 1;
    unit3(shading);
    apply3(hit->object->world_from_gradient, shading, normal);
    unit3(normal);
    unit3(face);
    apply3(hit->object->world_from_gradient, face, flat);
    unit3(flat);
    for (int i = 0; i < 3; i++) {
        normal[i] *= side;
        flat[i] *= side;
    }
}

bool tracer_find_surface(struct tracer *tracer, double t_eye, const double view[3],
                         struct stop *stop) {
    const struct world *world = tracer->world;
    struct nearest best = {.found = false};
    stop->t = INFINITY;
    for (size_t i = 0; i < world->object_count; i++) {
        const struct world_object *object = &world->objects[i];
        if (!object->triangles)
            continue;
        struct nearest nearest = {
            .object = object, .ray = &tracer->rays[i], .t_eye = t_eye, .t = stop->t};
        bvh_candidates(object->triangles, nearest.ray->o, nearest.ray->d, t_eye, &nearest.t, meet,
                       &nearest);
        if (nearest.found) {
            best = nearest;
            stop->t = nearest.t;
        }
    }
    if (!best.found)
        return true;
    double color[3], normal[3];
    struct origin origin = {.object = best.object, .triangle = best.triangle};
    struct reference_incident incident;
    color_of(&best, color);
    normals_of(&best, normal, origin.flat);
    if (!tracer_incident(tracer, best.t, &origin, &incident))
        return false;
    reference_light(&world->lights, &incident, color, normal, view, 1, 0, 0, stop->color);
    return true;
}
