/* What the table of members cannot say: members that are good alone and bad together. Each refusal
 * is a row of refusals.def. */
#include <math.h>
#include <string.h>

#include "api/scene_reader.h"

/* Below this a direction or a distance counts as none: squares of what is left stay far from the
 * smallest doubles, so that whoever normalises need not look again. */
static const double length_min = 1e-12;

/* Two directions whose sine is below this are parallel: the camera's basis would be rounding. */
static const double sine_min = 1e-9;

/* |det| of a matrix whose columns have unit length; below this its inverse is rounding. */
static const double determinant_min = 1e-12;

static double length3(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static void cross3(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* At the member, or at the object where its default is to blame. */
static void refuse_member(struct reader *reader, json_t *json, enum refusal refusal,
                          const char *member) {
    size_t mark = reader->path.length;
    if (json_object_get(json, member))
        json_path_enter_name(&reader->path, member);
    reader_refuse(reader, refusal, "%s", "");
    json_path_leave(&reader->path, mark);
}

static void check_camera(struct reader *reader, json_t *json, const struct scene_camera *camera) {
    double view[3], side[3];
    for (int i = 0; i < 3; i++)
        view[i] = camera->target[i] - camera->eye[i];
    double distance = length3(view), up = length3(camera->up);
    if (distance < length_min) {
        refuse_member(reader, json, REFUSAL_EYE_AT_TARGET, "target");
        return;
    }
    if (up < length_min) {
        refuse_member(reader, json, REFUSAL_ZERO_DIRECTION, "up");
        return;
    }
    const double v[3] = {view[0] / distance, view[1] / distance, view[2] / distance};
    const double u[3] = {camera->up[0] / up, camera->up[1] / up, camera->up[2] / up};
    cross3(v, u, side);
    if (length3(side) < sine_min)
        refuse_member(reader, json, REFUSAL_UP_PARALLEL, "up");
}

static void check_light(struct reader *reader, json_t *json, const struct scene_light *light) {
    if (!light->point && length3(light->direction) < length_min)
        refuse_member(reader, json, REFUSAL_ZERO_DIRECTION, "direction");
}

static void check_transform(struct reader *reader, json_t *json,
                            struct scene_transform *transform) {
    scene_transform_compose(transform);
    const double *m = transform->matrix;
    if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1) {
        refuse_member(reader, json, REFUSAL_NOT_AFFINE, "matrix");
        return;
    }
    double column[3][3], normal[3], determinant = 0;
    for (int i = 0; i < 3; i++) {
        double length = length3(m + 4 * i);
        if (length < length_min) {
            refuse_member(reader, json, REFUSAL_SINGULAR,
                          transform->is_matrix ? "matrix" : "scale");
            return;
        }
        for (int k = 0; k < 3; k++)
            column[i][k] = m[4 * i + k] / length;
    }
    cross3(column[0], column[1], normal);
    for (int k = 0; k < 3; k++)
        determinant += normal[k] * column[2][k];
    if (fabs(determinant) < determinant_min)
        refuse_member(reader, json, REFUSAL_SINGULAR, transform->is_matrix ? "matrix" : "scale");
}

static void check_skeleton(struct reader *reader, struct scene_skeleton *skeleton) {
    if (!skeleton->has_relief)
        skeleton->relief.kind = SCENE_MATERIAL_NONE;
    size_t outer = json_path_enter_name(&reader->path, "segments");
    for (size_t i = 0; i < skeleton->segment_count; i++) {
        const uint32_t *pair = skeleton->segments[i];
        size_t mark = json_path_enter_index(&reader->path, i);
        for (size_t k = 0; k < 2; k++) {
            if (pair[k] < skeleton->joint_count)
                continue;
            size_t inner = json_path_enter_index(&reader->path, k);
            reader_refuse(reader, REFUSAL_SEGMENT_INDEX, "%u, there are %zu", pair[k],
                          skeleton->joint_count);
            json_path_leave(&reader->path, inner);
        }
        if (pair[0] == pair[1])
            reader_refuse(reader, REFUSAL_SEGMENT_LOOP, "%s", "");
        json_path_leave(&reader->path, mark);
    }
    json_path_leave(&reader->path, outer);
}

static void check_image(struct reader *reader, const struct scene_image *image) {
    int k = (int)lround(sqrt(image->samples));
    int64_t width = (int64_t)image->width * k, height = (int64_t)image->height * k;
    if (width > SCENE_DRAWN_SIDE_MAX || height > SCENE_DRAWN_SIDE_MAX ||
        width * height > SCENE_DRAWN_PIXELS_MAX)
        reader_refuse(reader, REFUSAL_PICTURE_COST,
                      "with %d samples it is drawn at %lld x %lld; at most %d a side and %d pixels",
                      image->samples, (long long)width, (long long)height, SCENE_DRAWN_SIDE_MAX,
                      SCENE_DRAWN_PIXELS_MAX);
}

/* Of a built-in shape; no more than this, as poles drop some. */
static int64_t triangles_of(const struct scene_mesh *mesh) {
    int64_t cells = (int64_t)mesh->divisions[0] * mesh->divisions[1];
    switch (mesh->kind) {
    case SCENE_MESH_ASSET:
        return 0;
    case SCENE_MESH_TEAPOT:
        return 32 * 2 * cells;
    default:
        return 2 * cells;
    }
}

static void count_triangles(struct reader *reader, const struct scene_mesh *mesh, const char *first,
                            const char *second, int64_t *total) {
    *total += triangles_of(mesh);
    if (*total <= SCENE_TRIANGLES_MAX || triangles_of(mesh) == 0)
        return;
    size_t mark = json_path_enter_name(&reader->path, first);
    if (second)
        json_path_enter_name(&reader->path, second);
    reader_refuse(reader, REFUSAL_TRIANGLES, "%lld up to here, at most %d", (long long)*total,
                  SCENE_TRIANGLES_MAX);
    json_path_leave(&reader->path, mark);
}

static void check_scene(struct reader *reader, const struct scene *scene) {
    int64_t total = 0;
    size_t outer = json_path_enter_name(&reader->path, "objects");
    for (size_t i = 0; i < scene->object_count; i++) {
        const struct scene_object *object = &scene->objects[i];
        size_t mark = json_path_enter_index(&reader->path, i);
        if (object->kind == SCENE_OBJECT_SHELL)
            count_triangles(reader, &object->shell.mesh, "shell", "mesh", &total);
        else if (object->kind == SCENE_OBJECT_MESH)
            count_triangles(reader, &object->mesh.mesh, "mesh", NULL, &total);
        json_path_leave(&reader->path, mark);
    }
    json_path_leave(&reader->path, outer);
}

/* In the schema too: quality is the path's own. */
static void check_object(struct reader *reader, json_t *json, const struct scene_object *object) {
    json_t *quality = json_object_get(json, "quality");
    if (object->path == SCENE_PATH_AUTO)
        return;
    size_t outer = json_path_enter_name(&reader->path, "quality");
    for (size_t i = 0; i < scene_member_count; i++) {
        const struct member *member = &scene_members[i];
        if (member->node != SCENE_NODE_quality || member->paths & UINT64_C(1) << object->path ||
            !json_object_get(quality, member->name))
            continue;
        size_t mark = json_path_enter_name(&reader->path, member->name);
        reader_fault(reader, "does not belong to path `%s`",
                     scene_choice_lists[SCENE_CHOICES_path].choice[object->path].name);
        json_path_leave(&reader->path, mark);
    }
    json_path_leave(&reader->path, outer);
}

void reader_check(struct reader *reader, enum scene_node node, json_t *json, void *out) {
    switch (node) {
    case SCENE_NODE_scene:
        check_scene(reader, out);
        break;
    case SCENE_NODE_image:
        check_image(reader, out);
        break;
    case SCENE_NODE_camera:
        check_camera(reader, json, out);
        break;
    case SCENE_NODE_light:
        check_light(reader, json, out);
        break;
    case SCENE_NODE_object:
        check_object(reader, json, out);
        break;
    case SCENE_NODE_transform:
        check_transform(reader, json, out);
        break;
    case SCENE_NODE_skeleton:
        check_skeleton(reader, out);
        break;
    default:
        break;
    }
}
