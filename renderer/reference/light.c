/* Light; DESIGN, 'One truth'. Blinn 1977 for the half vector, which has no direction where a light
 * shines straight from behind what is seen: there is no highlight then. */
#include "renderer/reference/light.h"

#include <string.h>

#include "renderer/reference/vector.h"

void reference_lights_init(const struct scene *scene, struct reference_lights *lights) {
    memset(lights, 0, sizeof *lights);
    memcpy(lights->ambient, scene->ambient, sizeof lights->ambient);
    for (size_t k = 0; k < scene->light_count && k < SCENE_LIGHTS_MAX; k++) {
        for (int i = 0; i < 3; i++) {
            lights->toward[k][i] = -scene->lights[k].direction[i];
            lights->color[k][i] = scene->lights[k].color[i];
            lights->shadow[k] |= scene->lights[k].shadow && scene->lights[k].color[i] > 0;
        }
        unit3(lights->toward[k]);
        lights->point[k] = scene->lights[k].point;
        memcpy(lights->position[k], scene->lights[k].position, sizeof lights->position[k]);
        lights->radius[k] = scene->lights[k].radius;
        lights->any_shadow |= lights->shadow[k];
        lights->count++;
    }
}

void reference_unshadowed(const struct reference_lights *lights, const double at[3],
                          const double center[3], struct reference_incident *incident) {
    memcpy(incident->color, lights->color, sizeof incident->color);
    memcpy(incident->toward, lights->toward, sizeof incident->toward);
    for (int k = 0; k < lights->count; k++) {
        incident->distance[k] = INFINITY;
        if (!lights->point[k])
            continue;
        double *to = incident->toward[k];
        for (int i = 0; i < 3; i++)
            to[i] = lights->position[k][i] - center[i] - at[i];
        double distance = sqrt(dot3(to, to)), least = fmax(distance, lights->radius[k]);
        incident->distance[k] = distance;
        unit3(to);
        for (int i = 0; i < 3; i++)
            incident->color[k][i] /= least * least;
    }
}

void reference_light(const struct reference_lights *lights,
                     const struct reference_incident *incident, const double color[3],
                     const double n[3], const double v[3], double weight, double specular,
                     double shininess, double out[3]) {
    double diffuse[3] = {0, 0, 0}, gloss[3] = {0, 0, 0}, even[3] = {0, 0, 0};
    for (int k = 0; k < lights->count; k++) {
        const double *l = incident->toward[k], *radiance = incident->color[k];
        double cosine = fmax(0, dot3(n, l));
        double h[3] = {l[0] + v[0], l[1] + v[1], l[2] + v[2]};
        double highlight = 0;
        if (specular > 0) {
            unit3(h);
            double c = dot3(n, h);
            highlight = c > 0 ? pow(c, shininess) : 0;
        }
        for (int i = 0; i < 3; i++) {
            diffuse[i] += radiance[i] * cosine;
            gloss[i] += radiance[i] * highlight;
            even[i] += radiance[i] / 4;
        }
    }
    for (int i = 0; i < 3; i++)
        out[i] = color[i] * (lights->ambient[i] + weight * diffuse[i] + (1 - weight) * even[i]) +
                 weight * specular * gloss[i];
}

/* Kajiya & Kay 1989 by angles: alpha between the strand and a direction. A cylinder reflects what
 * comes from the angle alpha_l onto the cone at pi - alpha_l; the highlight is the cosine of what
 * the viewer is off it. */
void reference_strand_light(const struct reference_lights *lights,
                            const struct reference_incident *incident, const double color[3],
                            const double t[3], const double v[3], double weight, double specular,
                            double shininess, double out[3]) {
    const double pi = 3.14159265358979323846;
    double across[3];
    cross3(t, v, across);
    double alpha_v = atan2(sqrt(dot3(across, across)), dot3(t, v));
    for (int i = 0; i < 3; i++)
        out[i] = color[i] * lights->ambient[i];
    for (int k = 0; k < lights->count; k++) {
        const double *l = incident->toward[k], *radiance = incident->color[k];
        cross3(t, l, across);
        double alpha_l = atan2(sqrt(dot3(across, across)), dot3(t, l));
        double c = cos(alpha_v - (pi - alpha_l));
        double highlight = specular > 0 && c > 0 ? specular * pow(c, shininess) : 0;
        double diffuse = weight * sin(alpha_l) + (1 - weight) * pi / 4;
        for (int i = 0; i < 3; i++)
            out[i] += radiance[i] * (color[i] * diffuse + weight * highlight);
    }
}
