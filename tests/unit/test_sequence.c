/* Sequences: interpolation against its closed forms, frames as scenes, and every kind of fault with
 * its pointer. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "api/sequence.h"

/* ---- interpolation ---- */

static struct sequence_track make_track(enum sequence_interpolation how, struct sequence_key *keys,
                                        const double *frames, size_t count) {
    for (size_t i = 0; i < count; i++)
        keys[i] = (struct sequence_key){.frame = frames[i]};
    return (struct sequence_track){.interpolation = how, .key_count = count, .keys = keys};
}

static void two_keys_have_closed_forms(void **state) {
    (void)state;
    struct sequence_key keys[2];
    const double frames[] = {2, 10}, values[] = {-1, 3};
    struct sequence_track linear = make_track(SEQUENCE_LINEAR, keys, frames, 2);
    struct sequence_track smooth = linear, step = linear;
    smooth.interpolation = SEQUENCE_SMOOTH;
    step.interpolation = SEQUENCE_STEP;
    for (int i = 0; i <= 48; i++) {
        double frame = i * 0.25, s = fmin(fmax((frame - 2) / 8, 0), 1);
        assert_true(fabs(sequence_value(&linear, values, frame) - (-1 + 4 * s)) < 1e-14);
        assert_true(fabs(sequence_value(&smooth, values, frame) -
                         (-1 + 4 * (3 * s * s - 2 * s * s * s))) < 1e-14);
        assert_true(sequence_value(&step, values, frame) == (frame < 10 ? -1 : 3));
    }
}

/* Slopes 0, 4/3 (the harmonic mean of 1 and 2), 0, as Fritsch and Butland's for even steps. */
static void smooth_is_their_cubic(void **state) {
    (void)state;
    struct sequence_key keys[3];
    const double frames[] = {0, 1, 2}, values[] = {0, 1, 3};
    struct sequence_track track = make_track(SEQUENCE_SMOOTH, keys, frames, 3);
    for (int i = 0; i <= 100; i++) {
        double s = i * 0.01, s2 = s * s, s3 = s2 * s, m = 4.0 / 3;
        double first = 3 * s2 - 2 * s3 + (s3 - s2) * m;
        double second = 1 + (3 * s2 - 2 * s3) * 2 + (s - 2 * s2 + s3) * m;
        assert_true(fabs(sequence_value(&track, values, s) - first) < 1e-14);
        assert_true(fabs(sequence_value(&track, values, 1 + s) - second) < 1e-14);
    }
}

static void smooth_stays_between_and_has_no_corners(void **state) {
    (void)state;
    enum { COUNT = 8 };
    struct sequence_key keys[COUNT];
    const double frames[COUNT] = {0, 0.001, 3, 3.5, 100, 101, 1e5, 2e5};
    const double values[COUNT] = {1e9, 0, 0.1, -7, -7, -6.999, 1e-9, 0};
    struct sequence_track track = make_track(SEQUENCE_SMOOTH, keys, frames, COUNT);
    for (int k = 0; k + 1 < COUNT; k++) {
        double low = fmin(values[k], values[k + 1]), high = fmax(values[k], values[k + 1]);
        double before = values[k], up = values[k + 1] >= values[k] ? 1 : -1;
        for (int i = 0; i <= 1000; i++) {
            double s = i / 1000.0;
            double value =
                sequence_value(&track, values, frames[k] + s * (frames[k + 1] - frames[k]));
            assert_true(value >= low && value <= high);
            /* Of values of 1e9 the last digits are rounding. */
            assert_true((value - before) * up >= -1e-15 * fmax(fabs(low), fabs(high)));
            before = value;
        }
        assert_true(sequence_value(&track, values, frames[k]) == values[k]);
        if (k == 0)
            continue;
        double h = fmin(frames[k] - frames[k - 1], frames[k + 1] - frames[k]) * 1e-4;
        double left = (values[k] - sequence_value(&track, values, frames[k] - h)) / h;
        double right = (sequence_value(&track, values, frames[k] + h) - values[k]) / h;
        double steepest = fabs((values[k] - values[k - 1]) / (frames[k] - frames[k - 1]));
        assert_true(fabs(left - right) <= 0.01 * (1 + steepest));
    }
}

/* ---- frames ---- */

#define SHAPE                                                                                      \
    "\"objects\":[{\"shell\":{\"mesh\":{\"shape\":\"plane\"},\"material\":{\"builtin\":\"fur\"}}}" \
    "]"

struct held {
    struct arena arena;
    struct sequence sequence;
    struct scene scene;
};

static void read_well(struct held *held, const char *text) {
    struct error err = {0};
    *held = (struct held){0};
    if (sequence_read(text, strlen(text), &held->arena, &held->sequence, &err) != STATUS_OK)
        fail_msg("%s: %s", err.faults[0].pointer, err.faults[0].message);
}

static const struct scene *frame(struct held *held, int number) {
    struct error err = {0};
    if (sequence_frame(&held->sequence, number, &held->arena, &held->scene, &err) != STATUS_OK)
        fail_msg("%s: %s", err.faults[0].pointer, err.faults[0].message);
    return &held->scene;
}

static void finish(struct held *held) {
    sequence_finish(&held->sequence);
    arena_free(&held->arena);
}

static void frames_are_scenes(void **state) {
    (void)state;
    struct held held;
    read_well(&held,
              "{\"frames\":9,\"fps\":4,\"scene\":{\"lights\":[{},{}],\"ambient\":[0,0,0]," SHAPE
              "},\"tracks\":["
              "{\"pointer\":\"/camera/"
              "eye\",\"keys\":[{\"frame\":0,\"value\":[0,-3,1]},{\"time\":2,\"value\":"
              "[4,-3,1]}]},"
              "{\"pointer\":\"/objects/0/transform/"
              "rotate_deg\",\"keys\":[{\"frame\":0,\"value\":[0,0,0]},"
              "{\"frame\":8,\"value\":[0,0,360]}]},"
              "{\"pointer\":\"/objects/0/shell/"
              "thickness\",\"keys\":[{\"time\":0,\"value\":0.1},{\"time\":1,"
              "\"value\":0.3}]},"
              "{\"pointer\":\"/ambient/1\",\"keys\":[{\"frame\":3,\"value\":7}]},"
              "{\"pointer\":\"/lights/1/"
              "color\",\"interpolation\":\"smooth\",\"keys\":[{\"frame\":0,\"value\":"
              "[0,0,0]},{\"frame\":8,\"value\":[8,4,2]}]},"
              "{\"pointer\":\"/objects/0/shell/material/"
              "seed\",\"keys\":[{\"frame\":0,\"value\":0},{\"frame\":"
              "7,\"value\":3}]},"
              "{\"pointer\":\"/objects/0/shell/mesh/"
              "shape\",\"interpolation\":\"step\",\"keys\":[{\"frame\":0,"
              "\"value\":\"plane\"},{\"frame\":4.5,\"value\":\"teapot\"}]}]}");
    /* Out of order and again: a frame depends on no other. */
    static const int order[] = {8, 0, 4, 2, 4, 7};
    for (size_t i = 0; i < sizeof order / sizeof *order; i++) {
        int k = order[i];
        const struct scene *scene = frame(&held, k);
        const struct scene_object *object = &scene->objects[0];
        double s = k / 8.0;
        assert_true(scene->camera.given && scene->camera.eye[1] == -3);
        assert_true(fabs(scene->camera.eye[0] - 4 * s) < 1e-15);
        assert_true(fabs(object->transform[0] - cos(s * 8 * atan(1))) < 1e-14);
        assert_true(fabs(object->shell.thickness - fmin(0.1 + 0.05 * k, 0.3)) < 1e-15);
        assert_true(scene->ambient[0] == 0 && scene->ambient[1] == 7);
        assert_true(fabs(scene->lights[1].color[0] - 8 * s * s * (3 - 2 * s)) < 1e-14);
        assert_true(scene->lights[0].color[0] == 3);
        assert_int_equal(object->shell.material.seed, (int)floor(k * 3 / 7.0 + 0.5));
        assert_int_equal(object->shell.mesh.kind, k > 4 ? SCENE_MESH_TEAPOT : SCENE_MESH_PLANE);
    }
    struct error err = {0};
    assert_int_equal(sequence_check(&held.sequence, 0, 8, NULL, NULL, &err), STATUS_OK);
    finish(&held);
}

/* What a pointer leads into must be there, or be an object. */
static void elements_must_be_there(void **state) {
    (void)state;
    struct held held;
    struct error err = {0};
    read_well(&held,
              "{\"frames\":2,\"scene\":{" SHAPE "},\"tracks\":[{\"pointer\":\"/lights/0/color\","
              "\"keys\":[{\"frame\":0,\"value\":[1,1,1]}]}]}");
    assert_int_equal(sequence_frame(&held.sequence, 0, &held.arena, &held.scene, &err),
                     STATUS_INVALID_SCENE);
    assert_string_equal(err.faults[0].pointer, "/tracks/0/pointer");
    assert_string_equal(err.faults[0].message, "leads nowhere: the scene has no `lights` there");
    error_clear(&err);
    finish(&held);
}

static void frames_tell_their_faults(void **state) {
    static const struct {
        const char *text, *pointer, *message;
        int frame;
    } cases[] = {
        {"{\"frames\":9,\"scene\":{" SHAPE
         "},\"tracks\":[{\"pointer\":\"/objects/0/shell/thickness\","
         "\"keys\":[{\"frame\":0,\"value\":0.4},{\"frame\":8,\"value\":-0.4}]}]}",
         "/tracks/0", "frame 4: must be at least 1e-09, is 0, in /objects/0/shell/thickness", 4},
        {"{\"frames\":9,\"scene\":{" SHAPE "},\"tracks\":[{\"pointer\":\"/camera/eye\","
         "\"keys\":[{\"frame\":0,\"value\":[0,0,-2]},{\"frame\":6,\"value\":[0,0,1]}]}]}",
         "/scene/camera", "frame 0: up must not be parallel to the view", 0},
        {"{\"frames\":9,\"scene\":{" SHAPE "},\"tracks\":[{\"pointer\":\"/camera/eye\","
         "\"keys\":[{\"frame\":0,\"value\":[0,-2,0]},{\"frame\":4,\"value\":[0,2,0]}]}]}",
         "/scene/camera", "frame 2: the eye and the target are the same point", 2},
        {"{\"frames\":9,\"scene\":{" SHAPE ",\"light\":1},\"tracks\":[{\"pointer\":\"/camera/eye\","
         "\"keys\":[{\"frame\":0,\"value\":[0,-2,0]}]}]}",
         "/scene/light", "frame 0: unknown member; is `lights` meant?", 0},
        {"{\"frames\":9,\"scene\":{" SHAPE
         "},\"tracks\":[{\"pointer\":\"/objects/0/path\",\"interpolation\":\"step\","
         "\"keys\":[{\"frame\":0,\"value\":\"tetra\"},{\"frame\":7,\"value\":\"gdm\"}]}]}",
         "/tracks/0", "frame 7: ", 7},
        {"{\"frames\":3600,\"scene\":{\"image\":{\"width\":2048,\"height\":2048}," SHAPE
         "},\"tracks\":[{\"pointer\":\"/ambient\",\"keys\":[{\"frame\":0,\"value\":[0,0,0]}]}]}",
         "/frames", "up to frame 512 there are more than 8589934592 pixels times samples", 512},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct held held;
        struct error err = {0};
        read_well(&held, cases[i].text);
        enum status status =
            sequence_check(&held.sequence, 0, held.sequence.frames - 1, NULL, NULL, &err);
        assert_int_not_equal(status, STATUS_OK);
        if (strcmp(err.faults[0].pointer, cases[i].pointer) != 0 ||
            strncmp(err.faults[0].message, cases[i].message, strlen(cases[i].message)) != 0)
            fail_msg("%zu: %s: %s", i, err.faults[0].pointer, err.faults[0].message);
        error_clear(&err);
        if (cases[i].frame > 0) /* those before stand */
            assert_int_equal(
                sequence_check(&held.sequence, 0, cases[i].frame - 1, NULL, NULL, &err), STATUS_OK);
        finish(&held);
    }
}

/* ---- reading ---- */

#define ONE(track) "{\"frames\":2,\"scene\":{" SHAPE "},\"tracks\":[" track "]}"
#define KEYS       "\"keys\":[{\"frame\":0,\"value\":1}]"

static void faults_have_their_pointers(void **state) {
    static const struct {
        const char *text, *pointer, *part;
    } cases[] = {
        {"[]", "", "must be an object"},
        {"{\"frames\":2,\"scene\":{},\"tracks\":[]}", "/tracks", "at least 1"},
        {"{\"frames\":0,\"scene\":{},\"tracks\":[{}]}", "/frames", "at least 1"},
        {"{\"frames\":3601,\"scene\":{},\"tracks\":[{}]}", "/frames", "at most 3600"},
        {"{\"frames\":1.5,\"scene\":{},\"tracks\":[{}]}", "/frames", "an integer"},
        {"{\"frames\":2,\"scene\":[],\"tracks\":[{\"pointer\":\"/ambient\"," KEYS "}]}", "/scene",
         "must be an object, is an array"},
        {"{\"frames\":2,\"fps\":0,\"scene\":{},\"tracks\":[{}]}", "/fps", "at least 0.01"},
        {"{\"frames\":2,\"scene\":{},\"track\":1,\"tracks\":[{}]}", "/track", "is `tracks` meant?"},
        {ONE("{\"pointer\":7," KEYS "}"), "/tracks/0/pointer", "a JSON Pointer, is a number"},
        {ONE("{\"pointer\":\"\"," KEYS "}"), "/tracks/0/pointer", "not a JSON Pointer"},
        {ONE("{\"pointer\":\"camera/eye\"," KEYS "}"), "/tracks/0/pointer", "must begin with /"},
        {ONE("{\"pointer\":\"/a~2b\"," KEYS "}"), "/tracks/0/pointer", "not a JSON Pointer"},
        {ONE("{\"pointer\":\"/camera/eyes\"," KEYS "}"), "/tracks/0/pointer", "is `eye` meant?"},
        {ONE("{\"pointer\":\"/nothing\"," KEYS "}"), "/tracks/0/pointer", "`nothing` in `scene`"},
        {ONE("{\"pointer\":\"/camera/eye/3\"," KEYS "}"), "/scene/camera/eye", NULL},
        {ONE("{\"pointer\":\"/camera/eye/x\"," KEYS "}"), "/tracks/0/pointer",
         "nothing called `x`"},
        {ONE("{\"pointer\":\"/camera/eye/0/0\"," KEYS "}"), "/tracks/0/pointer", "leads nowhere"},
        {ONE("{\"pointer\":\"/objects/00/color\"," KEYS "}"), "/tracks/0/pointer", "leads nowhere"},
        {ONE("{\"pointer\":\"/objects/1/shell/thickness\"," KEYS "}"), "/tracks/0/pointer", NULL},
        {ONE("{\"pointer\":\"/image/width\"," KEYS "}"), "/tracks/0/pointer",
         "size of the picture"},
        {ONE("{\"pointer\":\"/image\"," KEYS "}"), "/tracks/0/pointer", "size of the picture"},
        {ONE("{\"pointer\":\"/ambient\"," KEYS "},{\"pointer\":\"/ambient/0\"," KEYS "}"),
         "/tracks/1/pointer", "drives what track 0 drives: `/ambient`"},
        {ONE("{\"pointer\":\"/ambient\",\"keys\":[]}"), "/tracks/0/keys", "at least 1"},
        {ONE("{\"pointer\":\"/ambient\",\"keys\":[{\"value\":1}]}"), "/tracks/0/keys/0",
         "needs one of `frame`, `time`"},
        {ONE("{\"pointer\":\"/ambient\",\"keys\":[{\"frame\":0,\"time\":0,\"value\":1}]}"),
         "/tracks/0/keys/0/time", "excludes `frame`"},
        {ONE("{\"pointer\":\"/ambient\",\"keys\":[{\"frame\":0}]}"), "/tracks/0/keys/0",
         "`value` is required"},
        {ONE("{\"pointer\":\"/"
             "ambient\",\"keys\":[{\"frame\":3,\"value\":1},{\"time\":0.12,\"value\":2}]}"),
         "/tracks/0/keys/1/time", "later than the key before"},
        {ONE("{\"pointer\":\"/ambient\",\"keys\":[{\"frame\":NaN,\"value\":1}]}"),
         "/tracks/0/keys/0/frame", "NaN"},
        {ONE("{\"pointer\":\"/ambient\",\"keys\":[{\"frame\":0,\"value\":1e999}]}"),
         "/tracks/0/keys/0/value", "too large"},
        {ONE("{\"pointer\":\"/ambient\",\"keys\":[{\"frame\":0,\"value\":[1,2,3]},{\"frame\":1,"
             "\"value\":[1,2]}]}"),
         "/tracks/0/keys/1/value", "as many numbers as the first"},
        {ONE("{\"pointer\":\"/ambient\",\"interpolation\":\"smooth\",\"keys\":[{\"frame\":0,"
             "\"value\":\"x\"}]}"),
         "/tracks/0/keys/0/value", "unless `interpolation` is `step`"},
        {ONE("{\"pointer\":\"/ambient\",\"interpolation\":\"cubic\"," KEYS "}"),
         "/tracks/0/interpolation", "one of `linear`, `step`, `smooth`"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct held held = {0};
        struct error err = {0};
        enum status status =
            sequence_read(cases[i].text, strlen(cases[i].text), &held.arena, &held.sequence, &err);
        if (status == STATUS_OK) /* what frames tell */
            status = sequence_check(&held.sequence, 0, 1, NULL, NULL, &err);
        assert_int_not_equal(status, STATUS_OK);
        bool found = false;
        for (size_t k = 0; k < err.fault_count; k++)
            found |= (strcmp(err.faults[k].pointer, cases[i].pointer) == 0 || !cases[i].part) &&
                     (!cases[i].part || strstr(err.faults[k].message, cases[i].part));
        if (!found)
            fail_msg("%s: %s: %s", cases[i].text, err.faults[0].pointer, err.faults[0].message);
        error_clear(&err);
        finish(&held);
    }
}

static void many_frames_of_a_long_text_are_refused(void **state) {
    (void)state;
    enum { BYTES = 200000 };
    static char text[BYTES + 256];
    int n = snprintf(text, sizeof text,
                     "{\"frames\":3600,\"scene\":{" SHAPE
                     "},\"tracks\":[{\"pointer\":\"/ambient\"," KEYS "}]}");
    memset(text + n, ' ', BYTES);
    struct held held = {0};
    struct error err = {0};
    assert_int_equal(sequence_read(text, (size_t)n + BYTES, &held.arena, &held.sequence, &err),
                     STATUS_TOO_COMPLEX);
    assert_string_equal(err.faults[0].pointer, "/frames");
    error_clear(&err);
    finish(&held);
}

struct visited {
    int count;
    char names[8][32], pointers[8][64];
};

static void visit(void *user, const char *name, const char *pointer) {
    struct visited *visited = user;
    assert_true(visited->count < 8);
    snprintf(visited->names[visited->count], 32, "%s", name);
    snprintf(visited->pointers[visited->count++], 64, "%s", pointer);
}

static void assets_of_all_frames_are_visited_once(void **state) {
    (void)state;
    struct held held;
    struct visited visited = {0};
    struct error err = {0};
    read_well(&held,
              "{\"frames\":9,\"scene\":{\"objects\":[{\"mesh\":{\"asset\":\"a.glb\"}},{\"mesh\":{"
              "\"asset\":\"b.glb\"}}]},\"tracks\":[{\"pointer\":\"/objects/1/mesh/asset\","
              "\"interpolation\":\"step\",\"keys\":[{\"frame\":0,\"value\":\"b.glb\"},{\"frame\":4,"
              "\"value\":\"c.glb\"},{\"frame\":6,\"value\":\"a.glb\"}]}]}");
    assert_int_equal(sequence_check(&held.sequence, 0, 8, visit, &visited, &err), STATUS_OK);
    assert_int_equal(visited.count, 3);
    assert_string_equal(visited.names[0], "a.glb");
    assert_string_equal(visited.pointers[0], "/scene/objects/0/mesh/asset");
    assert_string_equal(visited.names[2], "c.glb");
    assert_string_equal(visited.pointers[2], "/tracks/0");
    visited.count = 0;
    assert_int_equal(sequence_check(&held.sequence, 0, 3, visit, &visited, &err), STATUS_OK);
    assert_int_equal(visited.count, 2);
    finish(&held);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(two_keys_have_closed_forms),
        cmocka_unit_test(smooth_is_their_cubic),
        cmocka_unit_test(smooth_stays_between_and_has_no_corners),
        cmocka_unit_test(frames_are_scenes),
        cmocka_unit_test(elements_must_be_there),
        cmocka_unit_test(frames_tell_their_faults),
        cmocka_unit_test(faults_have_their_pointers),
        cmocka_unit_test(many_frames_of_a_long_text_are_refused),
        cmocka_unit_test(assets_of_all_frames_are_visited_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
