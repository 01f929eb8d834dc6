/* Lights of a scene to those of the shaders: see light.h. */
#include "renderer/light/light.h"

#include <math.h>
#include <string.h>

void light_set_from_scene(const struct scene *scene, struct light_set *lights) {
    memset(lights, 0, sizeof *lights);
    for (int i = 0; i < 3; i++)
        lights->ambient[i] = (float)scene->ambient[i];
    for (size_t k = 0; k < scene->light_count && k < LIGHTS_MAX; k++) {
        const double *d = scene->lights[k].direction;
        /* Scaled first, so that directions of any representable length work. */
        double largest = fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2])));
        largest = scene->lights[k].point ? 1 : largest; /* it has none, and nobody asks for it */
        double v[3] = {d[0] / largest, d[1] / largest, d[2] / largest};
        double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
        for (int i = 0; i < 3; i++) {
            lights->toward[k][i] = length > 0 ? (float)(-v[i] / length) : 0;
            lights->color[k][i] = (float)scene->lights[k].color[i];
            lights->even[i] += (float)(scene->lights[k].color[i] / 4);
        }
        lights->count++;
    }
}
