/* scene_read(): defaults, what is kept of a scene, and a fault with a pointer for each thing wrong.
 */
#include "tests/unit/scene_fixture.h"

#include <math.h>

#define FULL                                                                                       \
    "{\"image\": {\"width\": 640.0, \"height\": 48e1, \"samples\": 9, "                            \
    "\"background\": [0.1, 0.2, 0.3, 1]},"                                                         \
    "\"camera\": {\"eye\": [0, -3, 2.2], \"target\": [0, 0, 1], \"up\": [0, 1, 0], "               \
    "\"fov_y_deg\": 30},"                                                                          \
    "\"lights\": [{\"direction\": [0, 0, -1], \"color\": [1, 2, 3], \"shadow\": true}],"           \
    "\"ambient\": [0.5, 0.5, 0.5],"                                                                \
    "\"objects\": [{\"shell\": {\"mesh\": {\"asset\": \"a/b.glb\"}, \"thickness\": 0.25,"          \
    "\"tiles\": [3, 2], \"base\": {}, \"material\": {\"height\": \"h.png\", \"color\": \"c.png\"," \
    "\"specular\": 0.5, \"shininess\": 8, \"lit\": false}}, \"path\": \"tetra\","                  \
    "\"quality\": {\"samples\": 5, \"order\": \"walk\"}}],"                                        \
    "\"target\": {\"max_error\": 0.01}, \"report\": {\"error\": \"estimate\"}}"

static void assert_numbers(const double *found, const double *wanted, size_t count) {
    for (size_t i = 0; i < count; i++)
        assert_true(found[i] == wanted[i]);
}

static void least_scene_has_every_default(void **state) {
    (void)state;
    struct read read;
    read_text(&read, LEAST(""));
    assert_int_equal(read.status, STATUS_OK);
    const struct scene *scene = &read.scene;
    assert_int_equal(scene->image.width, 512);
    assert_int_equal(scene->image.height, 512);
    assert_int_equal(scene->image.samples, 4);
    assert_numbers(scene->image.background, (double[]){0, 0, 0, 0}, 4);
    assert_false(scene->camera.given);
    assert_numbers(scene->camera.up, (double[]){0, 0, 1}, 3);
    assert_true(scene->camera.fov_y_deg == 40);
    assert_int_equal(scene->light_count, 1);
    assert_numbers(scene->lights[0].direction, (double[]){1, 1, -2}, 3);
    assert_numbers(scene->lights[0].color, (double[]){3, 3, 3}, 3);
    assert_false(scene->lights[0].shadow);
    assert_numbers(scene->ambient, (double[]){0.1, 0.1, 0.1}, 3);
    assert_int_equal(scene->object_count, 1);
    const struct scene_object *object = &scene->objects[0];
    assert_int_equal(object->kind, SCENE_OBJECT_SHELL);
    assert_int_equal(object->path, SCENE_PATH_AUTO);
    assert_int_equal(object->quality.samples, 0);
    for (int i = 0; i < 16; i++)
        assert_true(object->transform[i] == (i % 5 == 0));
    const struct scene_shell *shell = &object->shell;
    assert_int_equal(shell->mesh.kind, SCENE_MESH_SPHERE);
    assert_true(shell->mesh.radius == 1);
    assert_int_equal(shell->mesh.divisions[0], 48);
    assert_int_equal(shell->mesh.divisions[1], 24);
    assert_true(shell->thickness == 0.08);
    assert_false(shell->has_base);
    assert_int_equal(shell->material.kind, SCENE_MATERIAL_BUILTIN);
    assert_int_equal(shell->material.builtin, SCENE_BUILTIN_FUR);
    assert_int_equal(shell->material.size[2], 32);
    assert_false(shell->material.has_color);
    assert_true(shell->material.lit);
    assert_true(shell->material.shininess == 32);
    assert_int_equal(scene->error_mode, SCENE_ERROR_NONE);
    read_finish(&read);
}

static void every_member_is_kept(void **state) {
    (void)state;
    struct read read;
    read_text(&read, FULL);
    assert_int_equal(read.status, STATUS_OK);
    const struct scene *scene = &read.scene;
    assert_int_equal(scene->image.width, 640);
    assert_int_equal(scene->image.height, 480);
    assert_int_equal(scene->image.samples, 9);
    assert_numbers(scene->image.background, (double[]){0.1, 0.2, 0.3, 1}, 4);
    assert_true(scene->camera.given);
    assert_false(scene->camera.orthographic);
    assert_numbers(scene->camera.eye, (double[]){0, -3, 2.2}, 3);
    assert_numbers(scene->camera.target, (double[]){0, 0, 1}, 3);
    assert_numbers(scene->camera.up, (double[]){0, 1, 0}, 3);
    assert_true(scene->camera.fov_y_deg == 30);
    assert_true(scene->lights[0].shadow);
    assert_numbers(scene->lights[0].color, (double[]){1, 2, 3}, 3);
    const struct scene_shell *shell = &scene->objects[0].shell;
    assert_int_equal(shell->mesh.kind, SCENE_MESH_ASSET);
    assert_string_equal(shell->mesh.asset, "a/b.glb");
    assert_true(shell->has_base);
    assert_false(shell->base.has_color);
    assert_int_equal(shell->material.kind, SCENE_MATERIAL_HEIGHT);
    assert_string_equal(shell->material.height, "h.png");
    assert_string_equal(shell->material.color_image, "c.png");
    assert_null(shell->material.volume);
    assert_int_equal(shell->material.size[0], 0);
    assert_false(shell->material.lit);
    assert_int_equal(scene->objects[0].path, SCENE_PATH_TETRA);
    assert_int_equal(scene->objects[0].quality.samples, 5);
    assert_int_equal(scene->objects[0].quality.order, SCENE_ORDER_WALK);
    assert_true(scene->target.has_max_error);
    assert_true(scene->target.max_error == 0.01);
    assert_false(scene->target.has_deadline_ms);
    assert_int_equal(scene->error_mode, SCENE_ERROR_ESTIMATE);
    read_finish(&read);
}

static void orthographic_cameras_and_skeletons(void **state) {
    (void)state;
    struct read read;
    read_text(&read, "{\"camera\": {\"eye\": [1, 0, 0], \"ortho_height\": 2}, \"objects\": ["
                     "{\"skeleton\": {\"joints\": [{\"position\": [0, 0, 0], \"radius\": 1},"
                     "{\"position\": [0, 0, 1], \"radius\": 0}], \"segments\": [[0, 1]]}},"
                     "{\"skeleton\": {\"builtin\": \"elm\", \"seed\": 4294967295}}]}");
    assert_int_equal(read.status, STATUS_OK);
    assert_true(read.scene.camera.orthographic);
    assert_true(read.scene.camera.ortho_height == 2);
    const struct scene_skeleton *skeleton = &read.scene.objects[0].skeleton;
    assert_int_equal(skeleton->joint_count, 2);
    assert_int_equal(skeleton->segment_count, 1);
    assert_int_equal(skeleton->segments[0][1], 1);
    assert_false(skeleton->has_relief);
    assert_int_equal(skeleton->relief.kind, SCENE_MATERIAL_NONE);
    assert_string_equal(read.scene.objects[1].skeleton.builtin, "elm");
    assert_int_equal(read.scene.objects[1].skeleton.seed, UINT32_MAX);
    read_finish(&read);
}

static void every_fault_is_told(void **state) {
    (void)state;
    struct read read;
    read_text(&read,
              "{\"image\": {\"width\": 0, \"heigth\": 4, \"samples\": 5, "
              "\"background\": [NaN, 0, 2]}, \"camera\": {\"eye\": [0, 0], \"fov_y_deg\": 1, "
              "\"ortho_height\": 2}, \"lights\": [{\"direction\": [0, 0, 0]}, 3], "
              "\"ambient\": \"dark\", \"objects\": [{\"shell\": {\"mesh\": {\"shape\": \"cube\"}, "
              "\"thickness\": -1, \"material\": {\"builtin\": \"fur\", \"extinction\": 1}}}, {}, "
              "{\"mesh\": {\"shape\": \"torus\", \"height\": 1}, \"shell\": null}, "
              "{\"mesh\": {}, \"path\": \"slicing\", \"quality\": {\"samples\": 4.5}}], "
              "\"a/b~c\": 1e999}");
    const struct {
        const char *pointer, *text;
    } wanted[] = {
        {"/image/width", "at least 1, is 0"},
        {"/image/heigth", "unknown member; is `height` meant?"},
        {"/image/samples", "square"},
        {"/image/background", "4 elements, has 3"},
        {"/image/background/0", "NaN"},
        {"/image/background/2", "at most 1, is 2"},
        {"/camera/eye", "3 elements, has 2"},
        {"/camera/ortho_height", "excludes `fov_y_deg`"},
        {"/lights/0/direction", "zero"},
        {"/lights/1", "an object, is a number"},
        {"/ambient", "array of 3 numbers, is a string"},
        {"/objects/0/shell/mesh/shape", "one of `plane`"},
        {"/objects/0/shell/thickness", "at least 1e-09, is -1"},
        {"/objects/0/shell/material/extinction", "does not belong to builtin `fur`"},
        {"/objects/1", "needs one of `shell`, `skeleton`, `mesh`"},
        {"/objects/2/mesh", "excludes `shell`"},
        {"/objects/2/shell", "an object, is null"},
        {"/objects/3/mesh", "needs one of `asset`, `shape`"},
        {"/objects/3/quality/samples", "an integer, is 4.5"},
        {"/a~1b~0c", "too large"},
    };
    for (size_t i = 0; i < sizeof wanted / sizeof *wanted; i++)
        assert_fault(&read.err, wanted[i].pointer, wanted[i].text);
    assert_int_equal(read.err.fault_count, sizeof wanted / sizeof *wanted);
    assert_null(read.scene.objects);
    read_finish(&read);
}

static void quality_is_the_paths_own(void **state) {
    (void)state;
    struct read read;
    read_text(&read, "{\"objects\": [{\"mesh\": {\"shape\": \"torus\"}, \"path\": "
                     "\"tetra\", \"quality\": {\"samples\": 4, \"slices\": 9, \"method\": "
                     "\"auto\"}}]}");
    assert_int_equal(read.status, STATUS_INVALID_SCENE);
    assert_int_equal(read.err.fault_count, 2);
    assert_fault(&read.err, "/objects/0/quality/slices", "path `tetra`");
    assert_fault(&read.err, "/objects/0/quality/method", "path `tetra`");
    read_finish(&read);
}

static void types_are_not_converted(void **state) {
    (void)state;
    static const char *const images[] = {
        "{\"width\": true}", "{\"width\": \"8\"}", "{\"width\": [8]}",   "{\"width\": null}",
        "{\"width\": 8.5}",  "{\"width\": -8}",    "{\"width\": 1e300}", "{\"width\": {}}"};
    for (size_t i = 0; i < sizeof images / sizeof *images; i++) {
        char text[256];
        snprintf(text, sizeof text, LEAST(", \"image\": %s"), images[i]);
        struct read read;
        read_text(&read, text);
        assert_int_equal(read.status, STATUS_INVALID_SCENE);
        assert_int_equal(read.err.fault_count, 1);
        assert_fault(&read.err, "/image/width", "");
        read_finish(&read);
    }
}

static void names_of_assets(void **state) {
    (void)state;
    static const struct {
        const char *name;
        enum status status;
    } rows[] = {
        {"a.glb", STATUS_OK},
        {"a/b c/d.e", STATUS_OK},
        {"..a/b../...", STATUS_OK},
        {"./a", STATUS_OK},
        {"sha256:0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef", STATUS_OK},
        {"", STATUS_INVALID_SCENE},
        {"/etc/passwd", STATUS_INVALID_SCENE},
        {"..", STATUS_INVALID_SCENE},
        {"../a", STATUS_INVALID_SCENE},
        {"a/../b", STATUS_INVALID_SCENE},
        {"a/..", STATUS_INVALID_SCENE},
        {"a\\\\b", STATUS_INVALID_SCENE},
        {"a\\nb", STATUS_INVALID_SCENE},
        {"a\\u007f", STATUS_INVALID_SCENE},
        {"sha256:", STATUS_INVALID_SCENE},
        {"sha256:0123456789ABCDEF0123456789abcdef0123456789abcdef0123456789abcdef",
         STATUS_INVALID_SCENE},
        {"sha256:0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef0",
         STATUS_INVALID_SCENE},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char text[512];
        snprintf(text, sizeof text, "{\"objects\": [{\"mesh\": {\"asset\": \"%s\"}}]}",
                 rows[i].name);
        struct read read;
        read_text(&read, text);
        if (read.status != rows[i].status)
            fail_msg("%s is answered with %s", rows[i].name, status_slug(read.status));
        if (read.status != STATUS_OK)
            assert_fault(&read.err, "/objects/0/mesh/asset", "name of an asset");
        read_finish(&read);
    }
}

/* 256 faults are kept, the others are counted; a name of 100 kB does not become a pointer. */
static void faults_are_bounded(void **state) {
    (void)state;
    size_t capacity = 600000, length = 0;
    char *text = malloc(capacity);
    assert_non_null(text);
    length += (size_t)snprintf(text, capacity, "{\"");
    memset(text + length, 'n', 100000);
    length += 100000;
    length += (size_t)snprintf(text + length, capacity - length, "\": 1");
    for (int i = 0; i < 20000; i++)
        length += (size_t)snprintf(text + length, capacity - length, ", \"unknown-%d\": 1", i);
    length += (size_t)snprintf(text + length, capacity - length, "}");
    struct read read;
    read_bytes(&read, text, length);
    assert_int_equal(read.status, STATUS_INVALID_SCENE);
    assert_int_equal(read.err.fault_count, ERROR_FAULTS_MAX);
    assert_int_equal(read.err.fault_count + read.err.faults_left_out, 20002);
    for (size_t i = 0; i < read.err.fault_count; i++)
        assert_true(strlen(read.err.faults[i].pointer) < 512);
    read_finish(&read);
    free(text);
}

/* Bombs end at once: by size before a byte is read, by depth at the 33rd bracket, and 180,000
 * members with the same name cost no more than their sorting. */
static void bombs(void **state) {
    (void)state;
    size_t ten_mb = 10000000;
    char *text = malloc(ten_mb);
    assert_non_null(text);
    memset(text, '[', ten_mb);
    struct read read;
    read_bytes(&read, text, ten_mb);
    assert_int_equal(read.status, STATUS_SCENE_TOO_LARGE);
    read_finish(&read);
    read_bytes(&read, text, 1000000);
    assert_int_equal(read.status, STATUS_INVALID_SCENE);
    assert_int_equal(read.err.fault_count, 1);
    read_finish(&read);
    size_t length = 1;
    text[0] = '{';
    while (length < 1000000) {
        memcpy(text + length, "\"a\":1,", 6);
        length += 6;
    }
    text[length - 1] = '}';
    read_bytes(&read, text, length);
    assert_int_equal(read.status, STATUS_INVALID_SCENE);
    assert_fault(&read.err, "/a", "given twice");
    read_finish(&read);
    free(text);
}

/* Cut anywhere, a scene is refused; never read past its end. */
static void cut_short(void **state) {
    (void)state;
    for (size_t bytes = 0; bytes < strlen(FULL); bytes++) {
        struct read read;
        read_bytes(&read, FULL, bytes);
        assert_int_equal(read.status, STATUS_BAD_JSON);
        read_finish(&read);
    }
}

static void transforms_are_composed(void **state) {
    (void)state;
    struct read read;
    read_text(&read, "{\"objects\": [{\"mesh\": {\"shape\": \"plane\"}, \"transform\": "
                     "{\"translate\": [1, 2, 3], \"rotate_deg\": [90, 0, 90], "
                     "\"scale\": [2, 3, 4]}}]}");
    assert_int_equal(read.status, STATUS_OK);
    /* R = Rz(90) Rx(90): x -> y, y -> z, z -> x; exact at quarter turns. */
    static const double wanted[16] = {0, 2, 0, 0, 0, 0, 3, 0, 4, 0, 0, 0, 1, 2, 3, 1};
    assert_numbers(read.scene.objects[0].transform, wanted, 16);
    read_finish(&read);
    read_text(&read, "{\"objects\": [{\"mesh\": {\"shape\": \"plane\"}, \"transform\": "
                     "{\"rotate_deg\": [10, 20, 30], \"scale\": 2}}]}");
    assert_int_equal(read.status, STATUS_OK);
    const double d = 3.14159265358979323846 / 180;
    double sx = sin(10 * d), cx = cos(10 * d), sy = sin(20 * d), cy = cos(20 * d), sz = sin(30 * d),
           cz = cos(30 * d);
    /* Rz (Ry (Rx v)), one rotation at a time. */
    for (int column = 0; column < 3; column++) {
        double v[3] = {column == 0 ? 2 : 0, column == 1 ? 2 : 0, column == 2 ? 2 : 0};
        double x[3] = {v[0], cx * v[1] - sx * v[2], sx * v[1] + cx * v[2]};
        double y[3] = {cy * x[0] + sy * x[2], x[1], -sy * x[0] + cy * x[2]};
        double z[3] = {cz * y[0] - sz * y[1], sz * y[0] + cz * y[1], y[2]};
        for (int row = 0; row < 3; row++) /* a few roundings of numbers up to 2 */
            assert_true(fabs(read.scene.objects[0].transform[4 * column + row] - z[row]) < 2e-15);
    }
    read_finish(&read);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(least_scene_has_every_default),
        cmocka_unit_test(every_member_is_kept),
        cmocka_unit_test(orthographic_cameras_and_skeletons),
        cmocka_unit_test(every_fault_is_told),
        cmocka_unit_test(quality_is_the_paths_own),
        cmocka_unit_test(types_are_not_converted),
        cmocka_unit_test(names_of_assets),
        cmocka_unit_test(faults_are_bounded),
        cmocka_unit_test(bombs),
        cmocka_unit_test(cut_short),
        cmocka_unit_test(transforms_are_composed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
