/* The truth does not depend on where, how large and how turned the scene is, nor on how many
 * threads draw it, nor, beyond 1e-8, on a finer tolerance. */
#include <math.h>

#include "tests/reference_fixture.h"

/* Media and a solid, lit, over a base. `place` goes into each object, `s` scales what is not
 * transformed; camera and light are the caller's. */
#define MATERIALS                                                                                  \
    "{'shell': {'mesh': {'shape': 'torus', 'divisions': [16, 10]}, 'thickness': 0.2, 'tiles': "    \
    "[6, 3], 'base': {'color': [0.3, 0.2, 0.1]}, 'material': {'builtin': 'clouds', 'size': [32, "  \
    "32, 8], 'specular': 0.3}}%s}, {'shell': {'mesh': {'shape': 'plane', 'size': [3, 3], "         \
    "'divisions': [3, 3]}, 'thickness': 0.3, 'tiles': [2, 2], 'material': {'builtin': 'chain', "   \
    "'size': [32, 32, 8]}}%s}"

static void open_scene(struct truth_fixture *truth, const double eye[3], const double target[3],
                       const double up[3], const double light[3], const char *place) {
    assert_int_equal(
        truth_open(truth,
                   "{'image': {'width': 14, 'height': 12, 'samples': 1}, 'camera': {'eye': [%.17g, "
                   "%.17g, %.17g], 'target': [%.17g, %.17g, %.17g], 'up': [%.17g, %.17g, %.17g], "
                   "'fov_y_deg': 40}, 'lights': [{'direction': [%.17g, %.17g, %.17g]}], 'objects': "
                   "[" MATERIALS "]}",
                   eye[0], eye[1], eye[2], target[0], target[1], target[2], up[0], up[1], up[2],
                   light[0], light[1], light[2], place, place),
        STATUS_OK);
}

static const double eye[3] = {0.7, -3.1, 2.3}, target[3] = {0.05, 0.02, 0.01}, up[3] = {0, 0, 1};
static const double light[3] = {-1, 0.7, -2};

/* Largest difference, left out the pixels (at most `left_out_max`) where a silhouette or a solid's
 * edge lies so near to the ray that rounding decides. */
static void compare(const struct truth_fixture *a, const struct truth_fixture *b, double tolerance,
                    size_t left_out_max) {
    size_t left_out = 0, touched = 0;
    double worst = 0;
    for (size_t p = 0; p < a->result.count; p++) {
        double off = 0;
        for (int i = 0; i < 4; i++)
            off = fmax(off, fabs(a->result.pixels[p][i] - b->result.pixels[p][i]));
        touched += a->result.touched[p];
        if (off > 1e-3)
            left_out++;
        else
            worst = fmax(worst, off);
    }
    assert_true(touched > a->result.count / 2);
    print_message("off by %.2e, %zu left out\n", worst, left_out);
    if (worst > tolerance || left_out > left_out_max)
        fail_msg("off by %.2e, %zu pixels by more than 1e-3", worst, left_out);
}

static void test_threads(void **state) {
    (void)state;
    struct truth_fixture one, many;
    open_scene(&one, eye, target, up, light, "");
    open_scene(&many, eye, target, up, light, "");
    truth_draw(&one, 0, 1);
    truth_draw(&many, 0, 5);
    assert_memory_equal(one.result.pixels, many.result.pixels,
                        one.result.count * sizeof *one.result.pixels);
    assert_int_equal(one.result.evaluations, many.result.evaluations);
    /* A list of pixels gives the same as the picture. */
    const uint32_t list[4] = {150, 3, 77, 77};
    struct reference_request request = {.pixels = list, .pixel_count = 4, .threads = 2};
    struct reference_result few;
    assert_int_equal(reference_render(many.reference, &request, &few, NULL), STATUS_OK);
    for (size_t k = 0; k < 4; k++)
        assert_memory_equal(few.pixels[k], one.result.pixels[list[k]], sizeof few.pixels[k]);
    reference_result_finish(&few);
    truth_close(&one);
    truth_close(&many);
}

static void test_cancel(void **state) {
    (void)state;
    struct truth_fixture truth;
    open_scene(&truth, eye, target, up, light, "");
    atomic_bool cancel = true;
    struct reference_request request = {.threads = 2, .cancel = &cancel};
    struct error err = {0};
    assert_int_equal(reference_render(truth.reference, &request, &truth.result, &err),
                     STATUS_CANCELLED);
    assert_null(truth.result.pixels);
    error_clear(&err);
    truth_close(&truth);
}

static void test_tolerance(void **state) {
    (void)state;
    struct truth_fixture coarse, fine;
    open_scene(&coarse, eye, target, up, light, "");
    open_scene(&fine, eye, target, up, light, "");
    truth_draw(&coarse, 1e-8, 2);
    truth_draw(&fine, 1e-12, 2);
    assert_true(fine.result.evaluations > coarse.result.evaluations);
    compare(&coarse, &fine, 1e-8, 0); /* measured 3e-10 */
    truth_close(&coarse);
    truth_close(&fine);
}

/* Turned by Rz(30) Ry(-50) Rx(70), object, camera and light alike. */
static void turn(const double v[3], double out[3]) {
    double a = 70 * M_PI / 180, b = -50 * M_PI / 180, c = 30 * M_PI / 180;
    double x[3] = {v[0], cos(a) * v[1] - sin(a) * v[2], sin(a) * v[1] + cos(a) * v[2]};
    double y[3] = {cos(b) * x[0] + sin(b) * x[2], x[1], -sin(b) * x[0] + cos(b) * x[2]};
    out[0] = cos(c) * y[0] - sin(c) * y[1];
    out[1] = sin(c) * y[0] + cos(c) * y[1];
    out[2] = y[2];
}

static void test_rotation(void **state) {
    (void)state;
    struct truth_fixture straight, turned;
    double e[3], t[3], u[3], l[3];
    turn(eye, e);
    turn(target, t);
    turn(up, u);
    turn(light, l);
    open_scene(&straight, eye, target, up, light, "");
    open_scene(&turned, e, t, u, l, ", 'transform': {'rotate_deg': [70, -50, 30]}");
    truth_draw(&straight, 0, 2);
    truth_draw(&turned, 0, 2);
    compare(&straight, &turned, 1e-8, 0); /* measured 1e-12 */
    truth_close(&straight);
    truth_close(&turned);
}

static void test_scale(void **state) {
    (void)state;
    static const double scales[] = {1e-6, 1e6};
    for (size_t k = 0; k < 2; k++) {
        struct truth_fixture plain, scaled;
        double e[3], t[3];
        for (int i = 0; i < 3; i++) {
            e[i] = eye[i] * scales[k];
            t[i] = target[i] * scales[k];
        }
        open_scene(&plain, eye, target, up, light, "");
        open_scene(&scaled, e, t, up, light,
                   k ? ", 'transform': {'scale': 1e6}" : ", 'transform': {'scale': 1e-6}");
        truth_draw(&plain, 0, 2);
        truth_draw(&scaled, 0, 2);
        compare(&plain, &scaled, 1e-8, 0); /* measured 1e-12 */
        truth_close(&plain);
        truth_close(&scaled);
    }
}

/* The object's own coordinates scaled, not its transform. */
static void test_size(void **state) {
    (void)state;
    struct truth_fixture truth[3];
    static const double size[3] = {1, 1e-6, 1e6};
    for (size_t k = 0; k < 3; k++) {
        double s = size[k];
        assert_int_equal(
            truth_open(
                &truth[k],
                "{'image': {'width': 12, 'height': 12, 'samples': 1}, 'camera': {'eye': [%.17g, "
                "%.17g, %.17g], 'target': [0, 0, 0]}, 'objects': [{'shell': {'mesh': {'shape': "
                "'torus', 'radius': %.17g, 'tube': %.17g, 'divisions': [12, 8]}, 'thickness': "
                "%.17g, 'tiles': [6, 3], 'material': {'builtin': 'fur', 'size': [32, 32, 8]}}}]}",
                0.7 * s, -3 * s, 2 * s, s, 0.4 * s, 0.2 * s),
            STATUS_OK);
        truth_draw(&truth[k], 0, 2);
    }
    compare(&truth[0], &truth[1], 1e-8, 0);
    compare(&truth[0], &truth[2], 1e-8, 0);
    for (size_t k = 0; k < 3; k++)
        truth_close(&truth[k]);
}

static void test_translation(void **state) {
    (void)state;
    struct truth_fixture here, there;
    static const double far_away[3] = {1e6, -1e6, 1e6};
    double e[3], t[3];
    for (int i = 0; i < 3; i++) {
        e[i] = eye[i] + far_away[i];
        t[i] = target[i] + far_away[i];
    }
    open_scene(&here, eye, target, up, light, "");
    open_scene(&there, e, t, up, light, ", 'transform': {'translate': [1e6, -1e6, 1e6]}");
    truth_draw(&here, 0, 2);
    truth_draw(&there, 0, 2);
    compare(&here, &there, 1e-6, 0); /* measured 2e-8: the coordinates' own rounding */
    truth_close(&here);
    truth_close(&there);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads),     cmocka_unit_test(test_cancel),
        cmocka_unit_test(test_tolerance),   cmocka_unit_test(test_rotation),
        cmocka_unit_test(test_scale),       cmocka_unit_test(test_size),
        cmocka_unit_test(test_translation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
