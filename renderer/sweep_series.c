/* See sweep_series.h. A new path is one more row. */
#include "renderer/sweep_series.h"

#include <assert.h>
#include <string.h>

#include "api/scene_members.h"

const struct sweep_row sweep_rows[] = {
    {.name = "tetra-walk",
     .text = "tetrahedra, rays walk from cell to cell",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "samples",
     .choice = {{"order", "walk"}, {"traversal", "fixed"}},
     .ladder = {4, 8, 16, 32, 64, 128}},
    {.name = "tetra-sorted",
     .text = "tetrahedra, drawn back to front",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "samples",
     .choice = {{"order", "sorted"}, {"traversal", "fixed"}},
     .ladder = {4, 8, 16, 32, 64, 128}},
    {.name = "tetra-affine",
     .text = "tetrahedra, walked, textures by their affine map, as published",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "samples",
     .choice = {{"order", "walk"}, {"traversal", "fixed"}, {"map", "affine"}},
     .ladder = {4, 8, 16, 32, 64, 128}},
    {.name = "tetra-adaptive",
     .text = "tetrahedra, walked in steps of equally many voxels, over what is empty in one",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "samples",
     .choice = {{"order", "walk"}, {"traversal", "adaptive"}},
     .ladder = {4, 8, 16, 32, 64, 128}},
    {.name = "tetra-dda",
     .text = "tetrahedra, walked from voxel to voxel; surfaces are found at any quality",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "samples",
     .choice = {{"order", "walk"}, {"traversal", "dda"}},
     .ladder = {4, 8, 16, 32, 64, 128}},
    {.name = "slicing-slabs",
     .text = "slabs between planes that face the viewer",
     .path = SCENE_PATH_SLICING,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "slices",
     .choice = {{"method", "slabs"}},
     .ladder = {16, 32, 64, 128, 256, 512}},
    {.name = "slicing-slabs-affine",
     .text = "slabs, textures by the tetrahedra's affine map",
     .path = SCENE_PATH_SLICING,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "slices",
     .choice = {{"method", "slabs"}, {"map", "affine"}},
     .ladder = {16, 32, 64, 128, 256, 512}},
    {.name = "slicing-hardware",
     .text = "slices as published, intersected in the vertex shader",
     .path = SCENE_PATH_SLICING,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "slices",
     .choice = {{"method", "hardware"}},
     .ladder = {16, 32, 64, 128, 256, 512}},
    {.name = "slicing-hardware-exact",
     .text = "the same, textures by the prisms' own map",
     .path = SCENE_PATH_SLICING,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "slices",
     .choice = {{"method", "hardware"}, {"map", "exact"}},
     .ladder = {16, 32, 64, 128, 256, 512}},
    {.name = "tetra-mip",
     .text = "tetrahedra, walked, coarser voxels where a sample covers several, as published",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "samples",
     .filter = true,
     .choice = {{"order", "walk"}, {"filter", "mip"}},
     .ladder = {4, 8, 16, 32, 64, 128}},
    {.name = "tetra-view",
     .text = "the same, what is seen of such voxels from where the ray comes",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "samples",
     .filter = true,
     .choice = {{"order", "walk"}, {"filter", "view"}},
     .ladder = {4, 8, 16, 32, 64, 128}},
    {.name = "slicing-slabs-mip",
     .text = "slabs, coarser voxels as published",
     .path = SCENE_PATH_SLICING,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "slices",
     .filter = true,
     .choice = {{"method", "slabs"}, {"filter", "mip"}},
     .ladder = {16, 32, 64, 128, 256, 512}},
    {.name = "slicing-slabs-view",
     .text = "slabs, voxels as they are seen",
     .path = SCENE_PATH_SLICING,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "slices",
     .filter = true,
     .choice = {{"method", "slabs"}, {"filter", "view"}},
     .ladder = {16, 32, 64, 128, 256, 512}},
    {.name = "shadow-size",
     .text = "tetrahedra, walked, with larger and larger maps of shadows",
     .path = SCENE_PATH_TETRA,
     .kind = SCENE_OBJECT_SHELL,
     .quality = "size",
     .shadow = true,
     .ladder = {32, 64, 128, 256, 512, 1024}},
    {0},
};

const struct sweep_row *sweep_row_find(const char *name) {
    for (const struct sweep_row *row = sweep_rows; row->name; row++)
        if (strcmp(row->name, name) == 0)
            return row;
    return NULL;
}

static const struct member *find_member(enum scene_node node, const char *name) {
    for (size_t i = 0; i < scene_member_count; i++)
        if (scene_members[i].node == node && strcmp(scene_members[i].name, name) == 0)
            return &scene_members[i];
    assert(!"a row of sweep_rows names a member that scenes do not have");
    return NULL;
}

static const struct member *moved_member(const struct sweep_row *row) {
    return find_member(row->shadow ? SCENE_NODE_shadow : SCENE_NODE_quality, row->quality);
}

int sweep_row_max(const struct sweep_row *row) {
    return (int)member_max(moved_member(row), 0);
}

int sweep_row_min(const struct sweep_row *row) {
    return (int)member_min(moved_member(row), 0);
}

const char *sweep_row_unit(const struct sweep_row *row) {
    return moved_member(row)->unit;
}

const char *sweep_row_path_name(const struct sweep_row *row) {
    const struct member *path = find_member(SCENE_NODE_object, "path");
    const struct scene_choice_list *list = &scene_choice_lists[path->choices];
    for (size_t i = 0; i < list->count; i++)
        if (list->choice[i].value == (int)row->path)
            return list->choice[i].name;
    assert(!"a path without a name");
    return "";
}

bool sweep_casts(const struct scene *scene) {
    for (size_t k = 0; k < scene->light_count; k++)
        if (scene->lights[k].shadow)
            return true;
    return false;
}

bool sweep_filters(const struct scene *scene) {
    for (size_t i = 0; i < scene->object_count; i++) {
        enum scene_filter filter = scene->objects[i].quality.filter;
        if (scene->objects[i].kind == SCENE_OBJECT_SHELL &&
            (filter == SCENE_FILTER_MIP || filter == SCENE_FILTER_VIEW))
            return true;
    }
    return false;
}

bool sweep_row_concerns(const struct sweep_row *row, const struct scene *scene) {
    if (row->shadow && !sweep_casts(scene))
        return false;
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].kind == row->kind)
            return true;
    return false;
}

static void set_choice(const char *name, const char *value, struct scene_quality *quality) {
    const struct member *member = find_member(SCENE_NODE_quality, name);
    const struct scene_choice_list *list = &scene_choice_lists[member->choices];
    for (size_t i = 0; i < list->count; i++)
        if (strcmp(list->choice[i].name, value) == 0) {
            memcpy((char *)quality + member->offset, &list->choice[i].value, sizeof(int));
            return;
        }
    assert(!"a row of sweep_rows names a choice that scenes do not have");
}

void sweep_row_apply(const struct sweep_row *row, int quality, struct scene_object *objects,
                     size_t count) {
    const struct member *moved = moved_member(row);
    for (size_t i = 0; i < count; i++) {
        if (objects[i].kind != row->kind)
            continue;
        objects[i].path = row->path;
        objects[i].quality = (struct scene_quality){0};
        if (!row->shadow)
            memcpy((char *)&objects[i].quality + moved->offset, &quality, sizeof quality);
        for (int c = 0; c < SWEEP_CHOICES_MAX && row->choice[c].member; c++)
            set_choice(row->choice[c].member, row->choice[c].value, &objects[i].quality);
    }
}
