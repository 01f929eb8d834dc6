/* The table of the built-in materials that are made of voxels: one row each. */
#include <stddef.h>

#include "renderer/asset/volume_generators.h"

typedef enum status maker(const struct scene_material *spec, struct volume *volume);

static maker *const makers[] = {
    [SCENE_BUILTIN_FUR] = volume_make_fur,       [SCENE_BUILTIN_CLOUDS] = volume_make_clouds,
    [SCENE_BUILTIN_FOG] = volume_make_fog,       [SCENE_BUILTIN_WEAVE] = volume_make_weave,
    [SCENE_BUILTIN_CHAIN] = volume_make_chain,   [SCENE_BUILTIN_ROCKS] = volume_make_rocks,
    [SCENE_BUILTIN_TREES] = volume_make_trees,   [SCENE_BUILTIN_GRATE] = volume_make_grate,
    [SCENE_BUILTIN_SCALES] = volume_make_scales, [SCENE_BUILTIN_BARK] = volume_make_bark,
};

bool volume_builtin_exists(enum scene_builtin builtin) {
    return (size_t)builtin < sizeof makers / sizeof *makers && makers[builtin];
}

enum status volume_make_builtin(const struct scene_material *spec, struct volume *volume) {
    return makers[spec->builtin](spec, volume);
}
