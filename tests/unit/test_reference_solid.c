/* Solid surfaces in the reference: where s = 1/2 lies by hand, thin walls, cuts, normals. */
#include <math.h>

#include "tests/unit/height_row.h"

static enum status open_heights(struct truth_fixture *truth, struct row *row, const char *camera,
                                const char *material) {
    char json[2048];
    snprintf(json, sizeof json,
             "{'image': {'width': 64, 'height': 1, 'samples': 1}, 'camera': {%s}, 'ambient': [1, "
             "1, 1], 'lights': [], 'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [2, "
             "2], 'divisions': [1, 1]}, 'thickness': 1, 'tiles': [1, 1], 'material': {'height': "
             "'h.hdr', 'size': [8, 1, 16]%s}}}]}",
             camera, material);
    return height_row_open(truth, row, json);
}

/* Rays across a wall one voxel wide, at every height and slant: whoever would hit the wall by a
 * search in steps of a hundredth of a voxel hits it, and nobody else. */
static void test_thin_wall(void **state) {
    (void)state;
    unsigned char file[256];
    const unsigned char heights[8] = {0, 0, 0, 220, 0, 0, 0, 0};
    struct row row = {file, make_file(heights, file)};
    static const char *const cameras[] = {
        "'eye': [-0.2, 0, 5], 'target': [-0.2, 0, 0], 'up': [0, 1, 0], 'ortho_height': 0.02",
        "'eye': [-6, 0.3, 3], 'target': [-0.2, 0.01, 0.45], 'up': [0, 1, 0], 'ortho_height': 0.02",
        "'eye': [6, -0.3, 0.7], 'target': [-0.2, 0.01, 0.6], 'up': [0, 0.2, 1], 'fov_y_deg': 0.2",
    };
    size_t hits = 0, misses = 0;
    for (size_t c = 0; c < sizeof cameras / sizeof *cameras; c++) {
        struct truth_fixture truth;
        assert_int_equal(open_heights(&truth, &row, cameras[c], ""), STATUS_OK);
        truth_draw(&truth, 0, 1);
        const struct volume *volume;
        bool made;
        assert_int_equal(volume_acquire(truth.sources.volumes,
                                        &truth.scene.objects[0].shell.material, 1.0, "",
                                        &truth.assets, &volume, &made, NULL),
                         STATUS_OK);
        assert_false(made);
        for (size_t p = 0; p < truth.result.count; p++) {
            double o[3], d[3], nearest = 0;
            truth_pixel_ray(&truth.scene, p, o, d);
            /* The plane's shell is the box [-1, 1]^2 x [0, 1]; u = (x + 1) / 2. */
            double t0 = 0, t1 = INFINITY;
            for (int i = 0; i < 3; i++) {
                double a = ((i < 2 ? -1 : 0) - o[i]) / d[i], b = (1 - o[i]) / d[i];
                t0 = fmax(t0, fmin(a, b));
                t1 = fmin(t1, fmax(a, b));
            }
            for (double t = t0; t < t1; t += 2.5e-4)
                nearest =
                    fmax(nearest, field_at(volume, (o[0] + t * d[0] + 1) / 2, o[2] + t * d[2]));
            double alpha = truth.result.pixels[p][3];
            assert_true(alpha == 0 || alpha == 1);
            if (fabs(nearest - 0.5) < 1e-3)
                continue; /* grazes: the search in steps cannot tell */
            if ((alpha == 1) != (nearest > 0.5))
                fail_msg("camera %zu, pixel %zu: alpha %g, s up to %.4f", c, p, alpha, nearest);
            hits += alpha == 1;
            misses += alpha == 0;
        }
        volume_release(truth.sources.volumes, volume);
        truth_close(&truth);
    }
    assert_true(hits > 20 && misses > 20);
}

/* The ground's own colour: of the lowest voxel, which is solid throughout. */
static double color_of(const struct truth_fixture *truth) {
    const struct volume *volume;
    bool made;
    assert_int_equal(volume_acquire(truth->sources.volumes, &truth->scene.objects[0].shell.material,
                                    1.0, "", &truth->assets, &volume, &made, NULL),
                     STATUS_OK);
    double color = (double)volume->solid[0] / (double)volume->solid[3];
    volume_release(truth->sources.volumes, volume);
    return color;
}

/* Flat ground at half the depth, lit from a known direction: colour, n.l and highlight by hand; and
 * the ground hides what lies below. */
static void test_flat_ground(void **state) {
    (void)state;
    unsigned char file[256];
    const unsigned char heights[8] = {128, 128, 128, 128, 128, 128, 128, 128};
    struct row row = {file, make_file(heights, file)};
    struct truth_fixture truth;
    assert_int_equal(open_heights(&truth, &row,
                                  "'eye': [0, -3, 3], 'target': [0, 0, 0.5], 'ortho_height': 0.01",
                                  ", 'specular': 0.5, 'shininess': 3"),
                     STATUS_OK);
    struct scene_light light = {.direction = {0, 3, -4}, .color = {1, 2, 3}};
    truth.scene.lights = &light;
    truth.scene.light_count = 1;
    reference_destroy(truth.reference);
    assert_int_equal(reference_create(&truth.scene, &truth.sources, &truth.reference, NULL),
                     STATUS_OK);
    truth_draw(&truth, 0, 1);
    /* n = z, l = (0, -3, 4) / 5; v = (0, -3, 2.5) / |.|. */
    double color = color_of(&truth);
    double v[2] = {-3 / sqrt(15.25), 2.5 / sqrt(15.25)}, h[2] = {-0.6 + v[0], 0.8 + v[1]};
    double shine = pow(h[1] / hypot(h[0], h[1]), 3);
    for (size_t p = 0; p < truth.result.count; p++) {
        const double *pixel = truth.result.pixels[p];
        for (int i = 0; i < 3; i++)
            assert_float_equal(pixel[i], color * (1 + (i + 1) * 0.8) + (i + 1) * 0.5 * shine, 1e-9);
        assert_true(pixel[3] == 1);
    }
    truth_close(&truth);
}

/* Solid to the top: the lid has no gradient, so the boundary's own normal serves, toward the eye.
 */
static void test_cut_open(void **state) {
    (void)state;
    unsigned char file[256];
    const unsigned char heights[8] = {255, 255, 255, 255, 255, 255, 255, 255};
    struct row row = {file, make_file(heights, file)};
    struct truth_fixture truth;
    assert_int_equal(open_heights(&truth, &row,
                                  "'eye': [0, -5, 0.25], 'target': [0, 0, 0.25], 'ortho_height': "
                                  "0.01",
                                  ""),
                     STATUS_OK);
    struct scene_light light = {.direction = {0, 1, 0}, .color = {1, 1, 1}};
    truth.scene.lights = &light;
    truth.scene.light_count = 1;
    reference_destroy(truth.reference);
    assert_int_equal(reference_create(&truth.scene, &truth.sources, &truth.reference, NULL),
                     STATUS_OK);
    truth_draw(&truth, 0, 1);
    double color = color_of(&truth);
    for (size_t p = 0; p < truth.result.count; p++)
        assert_float_equal(truth.result.pixels[p][0], 2 * color, 1e-9); /* ambient + n.l */
    truth_close(&truth);
}

static void test_refusals(void **state) {
    (void)state;
    struct truth_fixture truth;
    assert_int_equal(truth_open(&truth, "{'objects': [{'skeleton': {'builtin': 'elm'}}]}"),
                     STATUS_NOT_IMPLEMENTED);
    truth_close(&truth);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_thin_wall),
        cmocka_unit_test(test_flat_ground),
        cmocka_unit_test(test_cut_open),
        cmocka_unit_test(test_refusals),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
