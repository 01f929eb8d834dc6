/* The lights of a scene as every path sees them: unit vectors toward them, in the world. */
#ifndef PELT_RENDERER_LIGHT_LIGHT_H
#define PELT_RENDERER_LIGHT_LIGHT_H

#include "api/scene.h"
#include "shaders/interface.h"

struct light_set {
    int count;
    float toward[LIGHTS_MAX][3]; /* unit */
    float color[LIGHTS_MAX][3];  /* linear radiance */
    float ambient[3];
    float even[3]; /* sum of the colours / 4: what a medium without gradient receives */
};

/* At most LIGHTS_MAX lights, as scene_read() guarantees. */
void light_set_from_scene(const struct scene *scene, struct light_set *lights);

#endif
