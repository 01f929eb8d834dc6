/* What a valid scene may ask for and this version does not draw: one row each, so that whoever
 * draws it deletes the row. */
#include <stdio.h>

#include "api/json_path.h"
#include "api/scene.h"

/* What a row looks at; objects are visited one by one. */
struct look {
    const struct scene *scene;
    const struct scene_object *object;
};

static bool skeleton(const struct look *look) {
    return look->object->kind == SCENE_OBJECT_SKELETON;
}

static bool other_path(const struct look *look) {
    return look->object->path != SCENE_PATH_AUTO && look->object->path != SCENE_PATH_TETRA &&
           look->object->path != SCENE_PATH_SLICING;
}

/* The quality of other paths, where `auto` may choose. */
static bool rank(const struct look *look) {
    return look->object->quality.rank != 0;
}

static bool iterations(const struct look *look) {
    return look->object->quality.iterations != 0;
}

static bool relief_steps(const struct look *look) {
    return look->object->quality.relief_steps != 0;
}

static bool bisections(const struct look *look) {
    return look->object->quality.bisections != 0;
}

static const struct {
    bool (*wanted)(const struct look *look);
    const char *members[4]; /* from the object */
    const char *what;
} rows[] = {
    {skeleton, {"skeleton"}, "skeletons"},
    {other_path, {"path"}, "by this path"},
    {rank, {"quality", "rank"}, "by gdm"},
    {iterations, {"quality", "iterations"}, "by distance"},
    {relief_steps, {"quality", "relief_steps"}, "by frusta"},
    {bisections, {"quality", "bisections"}, "by frusta"},
};

static void judge(const struct look *look, struct json_path *path, struct error *err) {
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        if (!rows[i].wanted(look))
            continue;
        size_t mark = path->length;
        for (size_t k = 0; k < 4 && rows[i].members[k]; k++)
            json_path_enter_name(path, rows[i].members[k]);
        error_fault(err, STATUS_NOT_IMPLEMENTED, path->text, "this version does not draw %s",
                    rows[i].what);
        json_path_leave(path, mark);
    }
}

enum status scene_check_implemented(const struct scene *scene, struct error *err) {
    struct error found = {0};
    struct json_path path = {0};
    struct look look = {.scene = scene};
    json_path_enter_name(&path, "objects");
    for (size_t i = 0; i < scene->object_count; i++) {
        size_t mark = json_path_enter_index(&path, i);
        look.object = &scene->objects[i];
        judge(&look, &path, &found);
        json_path_leave(&path, mark);
    }
    enum status status = found.status;
    error_move(err, &found);
    return status;
}
