/* The reference against closed forms, to 1e-9: boxes of homogeneous material with their side walls,
 * from outside, aslant, from inside; polyhedra by their own chords; overlapping boxes; a sphere. */
#include <math.h>

#include "tests/reference_fixture.h"

/* Length of the ray's part within a box, from the eye on. */
static double box_chord(const double o[3], const double d[3], const double low[3],
                        const double high[3]) {
    double t0 = 0, t1 = INFINITY;
    for (int i = 0; i < 3; i++) {
        if (d[i] == 0) {
            if (o[i] < low[i] || o[i] > high[i])
                return 0;
            continue;
        }
        double a = (low[i] - o[i]) / d[i], b = (high[i] - o[i]) / d[i];
        t0 = fmax(t0, fmin(a, b));
        t1 = fmin(t1, fmax(a, b));
    }
    return fmax(0, t1 - t0);
}

static void assert_pixel(const double found[4], const double expected[4], size_t pixel,
                         double tolerance) {
    for (int i = 0; i < 4; i++)
        if (!(fabs(found[i] - expected[i]) <= tolerance))
            fail_msg("pixel %zu, channel %d: %.15g, expected %.15g (off by %.2e)", pixel, i,
                     found[i], expected[i], found[i] - expected[i]);
}

/* A plane's shell is a box. Largest difference found: 6e-13. */
static void check_box(const char *camera, double thickness, double extinction, int n, int m) {
    struct truth_fixture truth;
    assert_int_equal(
        truth_open(
            &truth,
            "{'image': {'width': 21, 'height': 17, 'samples': 1}, 'camera': {%s}, 'objects': "
            "[{'shell': {'mesh': {'shape': 'plane', 'size': [2, 1], 'divisions': [%d, %d]}, "
            "'thickness': %.17g, 'material': {'builtin': 'homogeneous', 'extinction': "
            "%.17g, 'color': [0.25, 0.5, 2]}}}]}",
            camera, n, m, thickness, extinction),
        STATUS_OK);
    truth_draw(&truth, 0, 1);
    const double low[3] = {-1, -0.5, 0}, high[3] = {1, 0.5, thickness};
    size_t crossed = 0;
    for (size_t p = 0; p < truth.result.count; p++) {
        double o[3], d[3];
        truth_pixel_ray(&truth.scene, p, o, d);
        double alpha = -expm1(-extinction * box_chord(o, d, low, high));
        const double expected[4] = {0.25 * alpha, 0.5 * alpha, 2 * alpha, alpha};
        assert_pixel(truth.result.pixels[p], expected, p, 1e-9);
        crossed += alpha > 0;
    }
    assert_true(crossed > 20);
    assert_int_equal(truth.result.unresolved, 0);
    truth_close(&truth);
}

static void test_box(void **state) {
    (void)state;
    static const char *const cameras[] = {
        "'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 1.3",
        /* along the planes of the walls between prisms, and in a layer */
        "'eye': [0, -5, 0.1], 'target': [0, 0, 0.1], 'ortho_height': 0.5",
        "'eye': [0, -5, 0.25], 'target': [0, 0, 0.25], 'fov_y_deg': 6",
        "'eye': [3, -4, 1], 'target': [0, 0, 0.2], 'fov_y_deg': 20",
        "'eye': [-3, 2, -4], 'target': [0, 0, 0.2], 'fov_y_deg': 20",
        "'eye': [4, 0.1, 0.3], 'target': [0, 0, 0.2], 'ortho_height': 0.9",
        /* inside */
        "'eye': [0.3, -0.1, 0.2], 'target': [0.5, 0.4, 0.3], 'fov_y_deg': 120",
    };
    for (size_t c = 0; c < sizeof cameras / sizeof *cameras; c++) {
        check_box(cameras[c], 0.5, 2, 4, 4);
        check_box(cameras[c], 0.4, 1e-6, 1, 1);
        check_box(cameras[c], 1, 30, 5, 3); /* a row of cubes' height */
    }
}

static void test_depths(void **state) {
    (void)state;
    for (double depth = 1e-6; depth < 11; depth *= 10) {
        struct truth_fixture truth;
        assert_int_equal(
            truth_open(&truth,
                       "{'image': {'width': 3, 'height': 3, 'samples': 1}, 'camera': {'eye': [0, "
                       "0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 1}, "
                       "'objects': [{'shell': {'mesh': {'shape': 'plane'}, 'thickness': 0.25, "
                       "'material': {'builtin': 'homogeneous', 'extinction': %.17g}}}]}",
                       depth * 4),
            STATUS_OK);
        truth_draw(&truth, 0, 1);
        for (size_t p = 0; p < 9; p++) {
            double off = truth_depth(truth.result.pixels[p]) / depth - 1;
            /* alpha near 1 has ulp(1) / 2, alpha near 0 what 1 - T left of it */
            double resolution = 2.3e-16 * exp(depth) / depth;
            assert_true(fabs(off) <= 1e-12 + resolution);
        }
        truth_close(&truth);
    }
}

/* Two boxes in one another: extinctions add, colours mix by extinction; and a plain mesh within. */
static void test_overlap(void **state) {
    (void)state;
    struct truth_fixture truth;
    assert_int_equal(
        truth_open(
            &truth,
            "{'image': {'width': 9, 'height': 9, 'samples': 1}, 'camera': {'eye': [2, -3, 4], "
            "'target': [0, 0, 0.5], 'fov_y_deg': 9}, 'ambient': [0.5, 0.5, 0.5], 'lights': [], "
            "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [6, 6]}, 'thickness': 1, "
            "'material': {'builtin': 'homogeneous', 'extinction': 1, 'color': [1, 0, 0]}}}, "
            "{'shell': {'mesh': {'shape': 'plane', 'size': [6, 6]}, 'thickness': 0.25, 'material': "
            "{'builtin': 'homogeneous', 'extinction': 3, 'color': [0, 1, 0]}}, 'transform': "
            "{'translate': [0, 0, 0.5]}}, {'mesh': {'shape': 'plane', 'size': [6, 6]}, 'color': "
            "[0, 0, 0.5], 'transform': {'translate': [0, 0, 0.25]}}]}"),
        STATUS_OK);
    truth_draw(&truth, 0, 2);
    for (size_t p = 0; p < truth.result.count; p++) {
        double o[3], d[3];
        truth_pixel_ray(&truth.scene, p, o, d);
        double slant = -1 / d[2];
        double t1 = exp(-0.25 * slant), t2 = exp(-0.25 * 4 * slant); /* outer, both, outer */
        double red = (1 - t1) + t1 * (1 - t2) / 4 + t1 * t2 * (1 - t1);
        double green = t1 * (1 - t2) * 3 / 4, blue = t1 * t2 * t1 * 0.25;
        const double expected[4] = {red, green, blue, 1};
        assert_pixel(truth.result.pixels[p], expected, p, 1e-9);
    }
    truth_close(&truth);
}

/* ---- polyhedra ---- */

/* Adds the signed places where a ray crosses a closed surface: leaving counts +t, entering -t. */
static double cross_triangle(const double o[3], const double d[3], const double a[3],
                             const double b[3], const double c[3]) {
    double e1[3], e2[3], p[3], q[3], r[3], det = 0, u = 0, v = 0, t = 0;
    for (int i = 0; i < 3; i++) {
        e1[i] = b[i] - a[i];
        e2[i] = c[i] - a[i];
        r[i] = o[i] - a[i];
    }
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        p[i] = d[j] * e2[k] - d[k] * e2[j];
        q[i] = r[j] * e1[k] - r[k] * e1[j];
    }
    for (int i = 0; i < 3; i++) {
        det += e1[i] * p[i];
        u += r[i] * p[i];
        v += d[i] * q[i];
        t += e2[i] * q[i];
    }
    if (det == 0 || u / det < 0 || v / det < 0 || (u + v) / det > 1 || t / det < 0)
        return 0;
    return det > 0 ? -t / det : t / det; /* det > 0: seen from in front, the ray enters */
}

static void test_polyhedra(void **state) {
    (void)state;
    static const char *const shapes[] = {
        "'shape': 'sphere', 'divisions': [7, 5]",
        "'shape': 'torus', 'divisions': [9, 7]",
        "'shape': 'sphere', 'radius': 0.01, 'divisions': [5, 3]",
    };
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        double size = s == 2 ? 0.01 : 1, h = 0.3 * size, sigma = 1.5 / size;
        struct truth_fixture truth;
        assert_int_equal(
            truth_open(&truth,
                       "{'image': {'width': 40, 'height': 40, 'samples': 1}, 'camera': {'eye': "
                       "[%.17g, %.17g, %.17g], 'target': [0, 0, 0], 'fov_y_deg': 45}, 'objects': "
                       "[{'shell': {'mesh': {%s}, 'thickness': %.17g, 'material': {'builtin': "
                       "'homogeneous', 'extinction': %.17g}}}]}",
                       1.1 * size, -3.2 * size, 1.7 * size, shapes[s], h, sigma),
            STATUS_OK);
        truth_draw(&truth, 0, 2);
        const struct mesh *mesh;
        struct error err = {0};
        assert_int_equal(mesh_acquire(truth.sources.meshes, &truth.scene.objects[0].shell.mesh,
                                      false, "", &truth.assets, &mesh, &err),
                         STATUS_OK);
        double worst = 0;
        for (size_t p = 0; p < truth.result.count; p++) {
            double o[3], d[3], chord = 0;
            truth_pixel_ray(&truth.scene, p, o, d);
            for (uint32_t f = 0; f < mesh->triangle_count; f++) {
                double inner[3][3], outer[3][3];
                for (int k = 0; k < 3; k++)
                    for (int i = 0; i < 3; i++) {
                        uint32_t v = mesh->vertex[f][k];
                        inner[k][i] = mesh->position[v][i];
                        outer[k][i] = inner[k][i] + h * mesh->normal[v][i];
                    }
                chord += cross_triangle(o, d, outer[0], outer[1], outer[2]);
                chord -= cross_triangle(o, d, inner[0], inner[1], inner[2]);
            }
            double alpha = -expm1(-sigma * chord);
            worst = fmax(worst, fabs(truth.result.pixels[p][3] - alpha));
        }
        mesh_release(truth.sources.meshes, mesh);
        /* Measured 5e-15. */
        if (!(worst <= 1e-9))
            fail_msg("%s: off by %.2e", shapes[s], worst);
        truth_close(&truth);
    }
}

/* The shell over a round sphere: polyhedra with n divisions are off by O(1/n^2). */
static void test_sphere_second_order(void **state) {
    (void)state;
    double worst[3] = {0, 0, 0};
    for (int level = 0; level < 3; level++) {
        struct truth_fixture truth;
        int n = 16 << level;
        assert_int_equal(
            truth_open(&truth,
                       "{'image': {'width': 25, 'height': 25, 'samples': 1}, 'camera': {'eye': [0, "
                       "-4, 0], 'target': [0, 0, 0], 'ortho_height': 1.4}, 'objects': [{'shell': "
                       "{'mesh': {'shape': 'sphere', 'divisions': [%d, %d]}, 'thickness': 0.2, "
                       "'material': {'builtin': 'homogeneous', 'extinction': 1}}}]}",
                       2 * n, n),
            STATUS_OK);
        truth_draw(&truth, 0, 2);
        for (size_t p = 0; p < truth.result.count; p++) {
            double o[3], d[3];
            truth_pixel_ray(&truth.scene, p, o, d);
            double away2 = o[0] * o[0] + o[2] * o[2];
            double chord = 2 * (sqrt(1.44 - away2) - sqrt(1 - away2));
            worst[level] =
                fmax(worst[level], fabs(truth_depth(truth.result.pixels[p]) / chord - 1));
        }
        truth_close(&truth);
    }
    /* Measured orders 2.0 and 2.0. */
    for (int level = 0; level < 2; level++) {
        double order = log2(worst[level] / worst[level + 1]);
        if (!(order > 1.7 && order < 2.4))
            fail_msg("order %.2f from %.2e to %.2e", order, worst[level], worst[level + 1]);
    }
}

/* One unlit colour, seen along a layer of a shell so thin that a voxel is 1e6 thicknesses wide:
 * where extinction rises from 0 to a depth of a million, the colour is the medium's own, not black.
 */
static void test_stiff_ramps(void **state) {
    (void)state;
    struct truth_fixture truth;
    assert_int_equal(
        truth_open(&truth,
                   "{'image': {'width': 48, 'height': 3, 'samples': 1}, 'camera': {'eye': [0, -5, "
                   "5e-8], 'target': [0, 0, 5e-8], 'ortho_height': 5e-8}, 'objects': [{'shell': "
                   "{'mesh': {'shape': 'plane', 'divisions': [1, 1]}, 'thickness': 1e-7, 'tiles': "
                   "[1, 1], 'material': {'builtin': 'clouds', 'size': [8, 8, 4], 'color': [1, 0.5, "
                   "0.25], 'lit': false}}, 'transform': {'scale': [1e-7, 1, 1]}}]}"),
        STATUS_OK);
    truth_draw(&truth, 0, 1);
    size_t opaque = 0;
    for (size_t p = 0; p < truth.result.count; p++) {
        const double *pixel = truth.result.pixels[p];
        const double expected[4] = {pixel[3], pixel[3] * 0.5, pixel[3] * 0.25, pixel[3]};
        assert_pixel(pixel, expected, p, 1e-8);
        opaque += pixel[3] == 1;
    }
    assert_true(opaque > 20);
    truth_close(&truth);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_box),
        cmocka_unit_test(test_depths),
        cmocka_unit_test(test_overlap),
        cmocka_unit_test(test_polyhedra),
        cmocka_unit_test(test_sphere_second_order),
        cmocka_unit_test(test_stiff_ramps),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
