/* Closed forms that hold for every path: slabs of homogeneous material seen straight, aslant, in
 * perspective, from inside, moved, scaled, and cut by what is opaque. A test program includes this,
 * sets `quality` and runs CLOSED_FORM_TESTS. */
#ifndef PELT_TESTS_UNIT_CLOSED_FORMS_H
#define PELT_TESTS_UNIT_CLOSED_FORMS_H

#include <math.h>

#include "tests/unit/renderer_fixture.h"

/* The optical depth that a pixel shows, from its alpha. */
static double depth_of(const float *pixel) {
    return -log1p(-(double)pixel[3]);
}

/* Every closed form must hold in every way that a path has. */
static const char *quality = "";

/* fp32 alpha near 1 resolves the depth d no finer than ulp(1)/2 * exp(d) / d. */
static void assert_depth(const float *pixel, double expected, double relative) {
    double found = depth_of(pixel);
    double resolution = 3.1e-8 * exp(expected) / expected;
    if (!(fabs(found / expected - 1) <= relative + resolution))
        fail_msg("optical depth %.9g, expected %.9g (off by %.2e)", found, expected,
                 found / expected - 1);
}

#define SLAB                                                                                       \
    "{'shell': {'mesh': {'shape': 'plane', 'size': [8, 8], 'divisions': [%d, %d]}, "               \
    "'thickness': %.17g, 'material': {'builtin': 'homogeneous', 'extinction': %.17g, "             \
    "'color': [0.25, 0.5, 1]}}, 'quality': {%s}%s}"

static void test_slab_straight(void **state) {
    (void)state;
    static const double depths[] = {1e-6, 1e-4, 1e-2, 1, 3, 10};
    for (size_t i = 0; i < sizeof depths / sizeof *depths; i++) {
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': {'eye': "
                         "[0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 2}, "
                         "'objects': [" SLAB "]}",
                         5, 7, 0.5, depths[i] / 0.5, quality, ""),
            STATUS_OK);
        for (int p = 0; p < 256; p++) {
            const float *pixel = result.pixels + 4 * p;
            assert_depth(pixel, depths[i], 2e-6);
            double alpha = -expm1(-depths[i]);
            for (int c = 0; c < 3; c++)
                assert_float_equal(pixel[c] / alpha, c == 0 ? 0.25 : c == 1 ? 0.5 : 1, 2e-6);
        }
        render_result_finish(&result);
    }
}

static void test_slab_aslant(void **state) {
    (void)state;
    for (int angle = 0; angle <= 85; angle += 17) {
        double a = angle * M_PI / 180;
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'camera': {'eye': "
                         "[%.17g, 0, %.17g], 'target': [0, 0, 0.1], 'up': [0, 1, 0], "
                         "'ortho_height': 0.1}, 'objects': [" SLAB "]}",
                         20 * sin(a), 20 * cos(a) + 0.1, 9, 4, 0.2, 2.0, quality, ""),
            STATUS_OK);
        for (int p = 0; p < 64; p++)
            assert_depth(result.pixels + 4 * p, 0.4 / cos(a), 5e-6);
        render_result_finish(&result);
    }
}

static void test_slab_in_perspective(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(
        support_draw(
            renderer, &result,
            "{'image': {'width': 64, 'height': 64, 'samples': 1}, 'camera': {'eye': [0, 0, "
            "3], 'target': [0, 0, 0], 'up': [0, 1, 0], 'fov_y_deg': 60}, 'objects': [" SLAB "]}",
            11, 13, 0.3, 4.0, quality, ""),
        STATUS_OK);
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++) {
            double px = ((x + 0.5) / 32 - 1) * tan(M_PI / 6),
                   py = ((y + 0.5) / 32 - 1) * tan(M_PI / 6);
            assert_depth(support_pixel(&result, x, y), 1.2 * sqrt(1 + px * px + py * py), 5e-6);
        }
    render_result_finish(&result);
}

/* From within the slab, looking up and looking level: only what lies before the eye counts. */
static void test_eye_inside(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(
        support_draw(renderer, &result,
                     "{'image': {'width': 32, 'height': 32, 'samples': 1}, 'camera': {'eye': [0.1, "
                     "0.2, 0.1], 'target': [0.1, 0.2, 1], 'up': [0, 1, 0], 'fov_y_deg': 90}, "
                     "'objects': [" SLAB "]}",
                     6, 6, 0.5, 3.0, quality, ""),
        STATUS_OK);
    for (int y = 0; y < 32; y++)
        for (int x = 0; x < 32; x++) {
            double px = (x + 0.5) / 16 - 1, py = (y + 0.5) / 16 - 1;
            assert_depth(support_pixel(&result, x, y), 3 * 0.4 * sqrt(1 + px * px + py * py), 1e-5);
        }
    render_result_finish(&result);

    assert_int_equal(
        support_draw(
            renderer, &result,
            "{'image': {'width': 33, 'height': 33, 'samples': 1}, 'camera': {'eye': [0, 0, "
            "0.25], 'target': [0, 1, 0.25], 'fov_y_deg': 20}, 'objects': [" SLAB "]}",
            6, 6, 0.5, 0.5, quality, ""),
        STATUS_OK);
    /* The middle ray leaves through the wall at y = 4. */
    assert_depth(support_pixel(&result, 16, 16), 2, 1e-5);
    render_result_finish(&result);
}

/* `transform` maps the finished shell and never changes an optical depth; far from the origin
 * included. */
static void test_transforms(void **state) {
    (void)state;
    static const char *const transforms[] = {
        "{'scale': [1000, 1000, 1000]}",   "{'scale': [1e-6, 1e-6, 1e-6]}",
        "{'scale': [1, 1, -3]}",           "{'scale': [-1, 1, 1], 'rotate_deg': [10, 20, 30]}",
        "{'translate': [1e6, -1e6, 1e6]}",
    };
    static const double places[][7] = {
        {0, 0, 5000, 0, 0, 0, 2000},
        {0, 0, 5e-6, 0, 0, 0, 2e-6},
        {0, 0, 5, 0, 0, 0, 2},
        {0, 0, 0, 0, 0, 0, 1},
        {1e6, -1e6, 1e6 + 5, 1e6, -1e6, 1e6, 2},
    };
    for (size_t i = 0; i < sizeof transforms / sizeof *transforms; i++) {
        const double *p = places[i];
        double eye[3] = {p[0], p[1], p[2]};
        if (i == 3) {
            /* Along the mapped normal: R n, R = Rz Ry Rx. */
            double x = 10 * M_PI / 180, y = 20 * M_PI / 180, z = 30 * M_PI / 180;
            double n[3] = {cos(x) * sin(y), -sin(x), cos(x) * cos(y)};
            eye[0] = 5 * (cos(z) * n[0] - sin(z) * n[1]);
            eye[1] = 5 * (sin(z) * n[0] + cos(z) * n[1]);
            eye[2] = 5 * n[2];
        }
        char transform[128];
        snprintf(transform, sizeof transform, ", 'transform': %s", transforms[i]);
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': {'eye': "
                         "[%.17g, %.17g, %.17g], 'target': [%.17g, %.17g, %.17g], 'up': [0, 1, 0], "
                         "'ortho_height': %.17g}, 'objects': [" SLAB "]}",
                         eye[0], eye[1], eye[2], p[3], p[4], p[5], p[6], 5, 7, 0.5, 2.0, quality,
                         transform),
            STATUS_OK);
        for (int k = 0; k < 256; k++)
            assert_depth(result.pixels + 4 * k, 1, i == 4 ? 2e-5 : 5e-6);
        render_result_finish(&result);
    }
}

/* The number of samples a pixel and the tessellation do not matter. */
static void test_independence(void **state) {
    (void)state;
    static const int divisions[][2] = {{1, 1}, {2, 50}, {64, 64}};
    for (int d = 0; d < 3; d++)
        for (int samples = 1; samples <= 16; samples *= 4) {
            struct render_result result;
            assert_int_equal(
                support_draw(renderer, &result,
                             "{'image': {'width': 16, 'height': 16, 'samples': %d}, 'camera': "
                             "{'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], "
                             "'ortho_height': 2}, 'objects': [" SLAB "]}",
                             samples, divisions[d][0], divisions[d][1], 0.5, 3.0, quality, ""),
                STATUS_OK);
            for (int p = 0; p < 256; p++)
                assert_depth(result.pixels + 4 * p, 1.5, 5e-6);
            render_result_finish(&result);
        }
}

/* A plane through the middle of a slab leaves half of it before it; nothing shows from behind. */
static void test_cut_by_a_mesh(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(
        support_draw(renderer, &result,
                     "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'ambient': [1, 1, 1], "
                     "'lights': [], 'camera': {'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, "
                     "0], 'fov_y_deg': 20}, 'objects': [" SLAB ", {'mesh': {'shape': 'plane', "
                     "'size': [8, 8]}, 'color': [1, 0, 0], 'transform': {'translate': [0, 0, "
                     "0.25]}}]}",
                     6, 6, 0.5, 2.0, quality, ""),
        STATUS_OK);
    const float *pixel = support_pixel(&result, 8, 8);
    double through = exp(-0.5);
    assert_float_equal(pixel[3], 1, 1e-6);
    assert_float_equal(pixel[0], through + 0.25 * (1 - through), 2e-4);
    assert_float_equal(pixel[1], 0.5 * (1 - through), 2e-4);
    assert_float_equal(pixel[2], 1 - through, 2e-4);
    render_result_finish(&result);
}

/* Two slabs one behind the other, in either order in the scene: the nearer one's light is whole. */
static void test_two_shells(void **state) {
    (void)state;
    for (int swap = 0; swap < 2; swap++) {
        char front[512], back[512];
        snprintf(front, sizeof front,
                 "{'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': "
                 "0.5, 'material': {'builtin': 'homogeneous', 'extinction': 2, 'color': "
                 "[1, 0, 0]}}, 'transform': {'translate': [0, 0, 1]}, 'quality': {%s}}",
                 quality);
        snprintf(back, sizeof back,
                 "{'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': "
                 "0.5, 'material': {'builtin': 'homogeneous', 'extinction': 4, 'color': "
                 "[0, 1, 0]}}, 'quality': {%s}}",
                 quality);
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': {'eye': "
                         "[0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 2}, "
                         "'objects': [%s, %s]}",
                         swap ? back : front, swap ? front : back),
            STATUS_OK);
        for (int p = 0; p < 256; p++) {
            const float *pixel = result.pixels + 4 * p;
            assert_float_equal(pixel[0], 1 - exp(-1), 2e-6);
            assert_float_equal(pixel[1], exp(-1) * (1 - exp(-2)), 2e-6);
            assert_float_equal(pixel[3], 1 - exp(-3), 2e-6);
        }
        render_result_finish(&result);
    }
}

/* Every ray through a closed shell meets cells that fill it without gaps: along each, the depth
 * must not fall short anywhere, tiny cells and edges included. */
static void test_no_holes(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(
        support_draw(renderer, &result,
                     "{'image': {'width': 256, 'height': 256, 'samples': 1}, 'camera': {'eye': "
                     "[2.1, -3.3, 1.7], 'target': [0, 0, 0], 'fov_y_deg': 22}, 'objects': "
                     "[{'shell': {'mesh': {'shape': 'sphere', 'radius': 1, 'divisions': [60, 30]}, "
                     "'thickness': 0.2, 'material': {'builtin': 'homogeneous', 'extinction': 1, "
                     "'color': [1, 1, 1]}}, 'quality': {%s}}]}",
                     quality),
        STATUS_OK);
    double eye = sqrt(2.1 * 2.1 + 3.3 * 3.3 + 1.7 * 1.7);
    int inside = 0;
    double worst = 0;
    for (int y = 0; y < 256; y++)
        for (int x = 0; x < 256; x++) {
            double s = tan(11 * M_PI / 180);
            double px = ((x + 0.5) / 128 - 1) * s, py = ((y + 0.5) / 128 - 1) * s;
            double sine2 = (px * px + py * py) / (1 + px * px + py * py);
            double nearest2 = eye * eye * sine2;
            /* Away from both silhouettes, where the polygons are not the sphere. */
            if (nearest2 > 1.15 * 1.15 || (nearest2 > 0.9 && nearest2 < 1.02))
                continue;
            double chord = 2 * sqrt(1.44 - nearest2) - (nearest2 < 1 ? 2 * sqrt(1 - nearest2) : 0);
            double found = depth_of(support_pixel(&result, x, y));
            worst = fmax(worst, fabs(found / chord - 1));
            inside++;
        }
    render_result_finish(&result);
    assert_true(inside > 10000);
    /* Measured 0.021 with 60 x 30 divisions; a lost cell would show as 0.1 and more. */
    if (worst > 0.035)
        fail_msg("the chord through the shell is off by %.3f", worst);
}

/* Every sample's ray runs exactly through a vertex of the mesh and along edges and faces of cells,
 * at which ties must be broken alike by all cells around: each ray is in one of them, never in two.
 */
static void test_rays_through_vertices(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(
        support_draw(
            renderer, &result,
            "{'image': {'width': 17, 'height': 17, 'samples': 1}, 'camera': {'eye': [0, 0, "
            "8], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 17}, 'objects': [" SLAB "]}",
            8, 8, 0.5, 2.0, quality, ""),
        STATUS_OK);
    for (int y = 5; y < 12; y++)
        for (int x = 5; x < 12; x++)
            assert_depth(support_pixel(&result, x, y), 1, 5e-6);
    render_result_finish(&result);
    /* Aslant, so that rays pass through vertices without running along the edges above them. */
    assert_int_equal(
        support_draw(
            renderer, &result,
            "{'image': {'width': 17, 'height': 17, 'samples': 1}, 'camera': {'eye': [8, 0, "
            "8], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 17}, 'objects': [" SLAB "]}",
            8, 8, 0.5, 2.0, quality, ""),
        STATUS_OK);
    for (int y = 5; y < 12; y++)
        for (int x = 7; x < 10; x++)
            assert_depth(support_pixel(&result, x, y), sqrt(2), 5e-6);
    render_result_finish(&result);
}

/* Nothing anywhere, and a medium that is opaque to the last bit. */
static void test_extremes(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(support_draw(renderer, &result,
                                  "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'camera': "
                                  "{'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], "
                                  "'ortho_height': 2}, 'objects': [" SLAB "]}",
                                  2, 2, 0.5, 0.0, quality, ""),
                     STATUS_OK);
    for (int i = 0; i < 256; i++)
        assert_true(result.pixels[i] == 0);
    render_result_finish(&result);
    assert_int_equal(support_draw(renderer, &result,
                                  "{'image': {'width': 8, 'height': 8, 'samples': 1}, 'camera': "
                                  "{'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], "
                                  "'ortho_height': 2}, 'objects': [" SLAB "]}",
                                  2, 2, 0.5, 1e12, quality, ""),
                     STATUS_OK);
    for (int p = 0; p < 64; p++) {
        assert_true(result.pixels[4 * p + 3] == 1);
        assert_float_equal(result.pixels[4 * p], 0.25, 1e-6);
    }
    render_result_finish(&result);
}

#define CLOSED_FORM_TESTS                                                                          \
    cmocka_unit_test(test_slab_straight), cmocka_unit_test(test_slab_aslant),                      \
        cmocka_unit_test(test_slab_in_perspective), cmocka_unit_test(test_eye_inside),             \
        cmocka_unit_test(test_transforms), cmocka_unit_test(test_independence),                    \
        cmocka_unit_test(test_cut_by_a_mesh), cmocka_unit_test(test_two_shells),                   \
        cmocka_unit_test(test_no_holes), cmocka_unit_test(test_extremes),                          \
        cmocka_unit_test(test_rays_through_vertices)

#endif
