/* Light as the design defines it, in doubles. */
#ifndef PELT_RENDERER_REFERENCE_LIGHT_H
#define PELT_RENDERER_REFERENCE_LIGHT_H

#include <stdbool.h>

#include "api/scene.h"

struct reference_lights {
    int count;
    double toward[SCENE_LIGHTS_MAX][3]; /* unit, against the light's travel */
    bool point[SCENE_LIGHTS_MAX];       /* then `toward` is not told, but: */
    double position[SCENE_LIGHTS_MAX][3], radius[SCENE_LIGHTS_MAX];
    double color[SCENE_LIGHTS_MAX][3];
    double ambient[3];
    bool shadow[SCENE_LIGHTS_MAX]; /* it throws one, and is not black */
    bool any_shadow;
};

void reference_lights_init(const struct scene *scene, struct reference_lights *lights);

/* What of each light arrives at a point, and from where: its colour, as far as distance and shadow
 * leave it. */
struct reference_incident {
    double color[SCENE_LIGHTS_MAX][3], toward[SCENE_LIGHTS_MAX][3];
    double distance[SCENE_LIGHTS_MAX]; /* INFINITY where there is none */
};

/* As if nothing were in the way. `at` and `center` add up to the point; the first is small. */
void reference_unshadowed(const struct reference_lights *lights, const double at[3],
                          const double center[3], struct reference_incident *incident);

/* Source colour: color x (ambient + weight x sum L max(0, n.l) + (1 - weight) x sum L / 4) +
 * weight x specular x sum L max(0, n.h)^shininess, L being what is incident. `n` and `v` (toward
 * the viewer) are of unit length, in the world; `weight` is 1 on surfaces and g / (g + 0.01) in a
 * medium. */
void reference_light(const struct reference_lights *lights,
                     const struct reference_incident *incident, const double color[3],
                     const double n[3], const double v[3], double weight, double specular,
                     double shininess, double out[3]);

/* The same for strands of the unit tangent t (api/README.md, "Strands"). */
void reference_strand_light(const struct reference_lights *lights,
                            const struct reference_incident *incident, const double color[3],
                            const double t[3], const double v[3], double weight, double specular,
                            double shininess, double out[3]);

#endif
