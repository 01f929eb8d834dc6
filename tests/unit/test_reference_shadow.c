/* Shadow in the reference, as api/README.md defines it: against closed forms where there are some,
 * else against the same field searched by hand, or the same media seen from the light. */
#include "tests/unit/height_row.h"

#define DOWN "'eye': [0, 0, 9], 'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 2"

static const char *const yes_no[2] = {"false", "true"};

/* A square of side 1 at height 1 over a wide plane: its shadow is the square, moved along the
 * light. Every pixel is dark or lit by its own centre; plain meshes and bases alike hide the light.
 */
static void test_opaque(void **state) {
    (void)state;
    for (int base = 0; base < 2; base++) {
        struct truth_fixture truth;
        assert_int_equal(
            truth_open(&truth,
                       "{'image': {'width': 40, 'height': 40, 'samples': 1}, 'camera': {" DOWN
                       "}, 'ambient': [0.25, 0, 0], 'lights': [{'direction': [2, 0.25, -1], "
                       "'color': [1, 2, 0], 'shadow': true}], 'objects': [{'mesh': {'shape': "
                       "'plane', 'size': [4, 4]}, 'color': [1, 1, 1]}, {%s, 'transform': "
                       "{'translate': [-2, 0, 1]}}]}",
                       base ? "'shell': {'mesh': {'shape': 'plane', 'size': [1, 1]}, 'base': "
                              "{'color': [0, 0, 0]}, 'material': {'builtin': 'homogeneous', "
                              "'extinction': 0}}"
                            : "'mesh': {'shape': 'plane', 'size': [1, 1]}, 'color': [0, 0, 0]"),
            STATUS_OK);
        truth_draw(&truth, 0, 1);
        double cosine = 1 / sqrt(1 + 4 + 0.0625);
        size_t dark = 0;
        for (size_t p = 0; p < truth.result.count; p++) {
            double o[3], d[3];
            truth_pixel_ray(&truth.scene, p, o, d);
            bool hidden = fabs(o[0]) < 0.5 && fabs(o[1] - 0.25) < 0.5;
            dark += hidden;
            assert_float_equal(truth.result.pixels[p][0], 0.25 + (hidden ? 0 : cosine), 1e-12);
            assert_float_equal(truth.result.pixels[p][1], hidden ? 0 : 2 * cosine, 1e-12);
        }
        assert_true(dark > 0 && dark < truth.result.count);
        truth_close(&truth);
    }
}

/* Parallel planes under a slanting light: the upper one takes the light of all below it, itself has
 * all; from below nothing is lit, and the light under the horizon reaches the lower side alone. */
static void test_sides(void **state) {
    (void)state;
    static const struct {
        double eye_z, light_z, lit;
    } rows[] = {{9, -1, 1}, {9, 1, 0}, {-9, -1, 0}, {-9, 1, 1}, {0.5, -1, 0}, {0.4, 0, 0}};
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        struct truth_fixture truth;
        assert_int_equal(
            truth_open(&truth,
                       "{'image': {'width': 5, 'height': 5, 'samples': 1}, 'camera': {'eye': [0, "
                       "0, %g], 'target': [0, 0, %g], 'up': [0, 1, 0], 'ortho_height': 1}, "
                       "'ambient': [0, 0, 0], 'lights': [{'direction': [0.1, 0, %g], 'color': [1, "
                       "1, 1], 'shadow': true}], 'objects': [{'mesh': {'shape': 'plane', 'size': "
                       "[90, 90]}, 'color': [1, 1, 1]}, {'mesh': {'shape': 'plane', 'size': [90, "
                       "90]}, 'color': [1, 1, 1], 'transform': {'translate': [0, 0, 1]}}]}",
                       rows[r].eye_z, rows[r].eye_z > 0 ? -1.0 : 2.0, rows[r].light_z),
            STATUS_OK);
        truth_draw(&truth, 0, 1);
        for (size_t p = 0; p < truth.result.count; p++)
            assert_float_equal(truth.result.pixels[p][0], rows[r].lit / sqrt(1.01), 1e-12);
        truth_close(&truth);
    }
}

/* A homogeneous slab over a plane lets exp(-sigma d / cos) through; several lights add. The camera
 * is between the two. */
static void test_slab(void **state) {
    (void)state;
    for (double sigma = 1e-6; sigma < 1e4; sigma *= 100) {
        struct truth_fixture truth;
        assert_int_equal(
            truth_open(
                &truth,
                "{'image': {'width': 5, 'height': 5, 'samples': 1}, 'camera': {'eye': [0, "
                "0, 0.5], 'target': [0, 0, 0], 'up': [0, 1, 0], 'fov_y_deg': 60}, 'ambient': "
                "[0, 0, 0.5], 'lights': [{'direction': [1, 0, -1], 'color': [1, 0, 0], "
                "'shadow': true}, {'direction': [0, 0, -3], 'color': [0, 1, 0], 'shadow': "
                "true}, {'direction': [0, 1, -1], 'color': [0, 0, 1], 'shadow': false}], "
                "'objects': [{'mesh': {'shape': 'plane', 'size': [8, 8]}, 'color': [1, 1, "
                "1]}, {'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'thickness': "
                "0.5, 'material': {'builtin': 'homogeneous', 'extinction': %.17g}}, "
                "'transform': {'translate': [0, 0, 1]}}]}",
                sigma),
            STATUS_OK);
        truth_draw(&truth, 0, 1);
        for (size_t p = 0; p < truth.result.count; p++) {
            const double *found = truth.result.pixels[p];
            assert_float_equal(found[0], sqrt(0.5) * exp(-sigma * 0.5 * sqrt(2)), 1e-12);
            assert_float_equal(found[1], exp(-sigma * 0.5), 1e-12);
            assert_float_equal(found[2], 0.5 + sqrt(0.5), 1e-12);
        }
        truth_close(&truth);
    }
}

/* A lit medium of one voxel has no gradient: its source is color (ambient + S L / 4). Under a light
 * from above S(z) = exp(-sigma (h - z)), so with tau = sigma h an eye above sees
 * color L / 8 (1 - exp(-2 tau)), one below color L / 4 tau exp(-tau). */
static void test_own_shell(void **state) {
    (void)state;
    for (int below = 0; below < 2; below++)
        for (int shadow = 0; shadow < 2; shadow++) {
            double pixel[2][4];
            for (int light = 0; light < 2; light++) {
                struct truth_fixture truth;
                assert_int_equal(
                    truth_open(&truth,
                               "{'image': {'width': 1, 'height': 1, 'samples': 1}, 'camera': "
                               "{'eye': [0.1, 0.2, %d], 'target': [0.1, 0.2, 0], 'up': [0, 1, 0], "
                               "'ortho_height': 1}, 'ambient': [%d, 0, 0], 'lights': "
                               "[{'direction': [0, 0, -1], 'color': [%d, 0, 0], 'shadow': %s}], "
                               "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [8, 8]}, "
                               "'thickness': 0.5, 'material': {'builtin': 'fur', 'size': [1, 1, "
                               "1]}}}]}",
                               below ? -9 : 9, !light, light, yes_no[shadow]),
                    STATUS_OK);
                truth_draw(&truth, 1e-12, 1);
                memcpy(pixel[light], truth.result.pixels[0], sizeof pixel[light]);
                truth_close(&truth);
            }
            double alpha = pixel[0][3], tau = -log1p(-alpha), color = pixel[0][0] / alpha;
            assert_true(tau > 0.3 && color > 0.1);
            double expected = !shadow ? alpha / 4
                              : below ? tau * exp(-tau) / 4
                                      : -expm1(-2 * tau) / 8;
            assert_float_equal(pixel[1][0], color * expected, 1e-10);
        }
}

/* What voxels let through toward the light is what they let through toward an eye: the shadow of
 * fur on a base of a torus, or of mist around a sphere on a plane, against the media's alpha seen
 * along the light. `flat`: where the ray of such an eye meets the ground, at height 0 in its space.
 */
static double worst_against_light(const char *object, const char *opaque, const char *light) {
    double toward[3];
    assert_int_equal(sscanf(light, "%lf, %lf, %lf", &toward[0], &toward[1], &toward[2]), 3);
    struct truth_fixture top, seen;
    assert_int_equal(truth_open(&top,
                                "{'image': {'width': 12, 'height': 12, 'samples': 1}, 'camera': "
                                "{'eye': [0, 0, -1.5], 'target': [0, 0, -2], 'up': [0, 1, 0], "
                                "'fov_y_deg': 120}, 'ambient': [0, 0, 0], 'lights': "
                                "[{'direction': [%s], 'color': [1, 1, 1], 'shadow': true}], "
                                "'objects': [%s, %s]}",
                                light, object, opaque),
                     STATUS_OK);
    truth_draw(&top, 0, 2);
    double worst = 0, length = 0, least = 1;
    for (int i = 0; i < 3; i++)
        length += toward[i] * toward[i];
    length = sqrt(length);
    for (size_t p = 0; p < top.result.count; p++) {
        double o[3], d[3], eye[3];
        truth_pixel_ray(&top.scene, p, o, d);
        double t = (-2 - o[2]) / d[2];
        for (int i = 0; i < 3; i++)
            eye[i] = o[i] + t * d[i] - 20 * toward[i];
        /* A picture of one pixel: its ray is the light's. */
        assert_int_equal(
            truth_open(&seen,
                       "{'image': {'width': 1, 'height': 1, 'samples': 1}, 'camera': {'eye': "
                       "[%.17g, %.17g, %.17g], 'target': [%.17g, %.17g, -2], 'up': [0, 1, 0], "
                       "'ortho_height': 1e-3}, 'objects': [%s]}",
                       eye[0], eye[1], eye[2], o[0] + t * d[0], o[1] + t * d[1], object),
            STATUS_OK);
        truth_draw(&seen, 1e-11, 1);
        double through = 1 - seen.result.pixels[0][3], cosine = -toward[2] / length;
        worst = fmax(worst, fabs(top.result.pixels[p][0] - cosine * through));
        least = fmin(least, through);
        truth_close(&seen);
    }
    assert_true(least < 0.7);
    truth_close(&top);
    return worst;
}

static void test_media_seen_from_the_light(void **state) {
    (void)state;
    static const char ground[] = "{'mesh': {'shape': 'plane', 'size': [40, 40]}, 'color': [1, 1, "
                                 "1], 'transform': {'translate': [0, 0, -2]}}";
    static const char *const objects[] = {
        "{'shell': {'mesh': {'shape': 'sphere', 'divisions': [12, 6]}, 'thickness': 0.3, "
        "'material': {'builtin': 'homogeneous', 'extinction': 2}}}",
        "{'shell': {'mesh': {'shape': 'torus', 'divisions': [12, 6]}, 'thickness': 0.2, 'tiles': "
        "[3, 2], 'material': {'builtin': 'clouds', 'size': [16, 16, 8]}}, 'transform': "
        "{'rotate_deg': [20, 30, 0], 'scale': [1, 1.5, 1]}}",
    };
    for (size_t i = 0; i < sizeof objects / sizeof *objects; i++) {
        double worst = worst_against_light(objects[i], ground, "0.3, 0.2, -1");
        print_message("object %zu: off by %.2e at most\n", i, worst);
        assert_true(worst < 1e-11); /* the eye's tolerance; measured 3e-13 */
    }
}

static const char columns_json[] =
    "{'image': {'width': 200, 'height': 1, 'samples': 1}, 'camera': {'eye': [0, 0, 9], 'target': "
    "[0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 0.0098}, 'ambient': [0, 0, 0], 'lights': "
    "[{'direction': [%g, 0, %g], 'color': [1, 1, 1], 'shadow': %s}], 'objects': [{'shell': "
    "{'mesh': {'shape': 'plane', 'size': [2, 2], 'divisions': [1, 1]}, 'thickness': 1, 'tiles': "
    "[1, 1], 'material': {'height': 'h.hdr', 'size': [8, 1, 16]}}}]}";

/* Without and with shadow, and the voxels that both are drawn from: the caches give one volume to
 * all who ask, so what is written into it is drawn. */
struct columns {
    struct truth_fixture truth[2];
    const struct volume *volume[2];
};

static void open_columns(struct columns *columns, struct row *row, const double direction[3]) {
    for (int shadow = 0; shadow < 2; shadow++) {
        char json[2048];
        const struct volume *volume;
        bool made;
        struct truth_fixture *truth = &columns->truth[shadow];
        snprintf(json, sizeof json, columns_json, direction[0], direction[2], yes_no[shadow]);
        assert_int_equal(height_row_open(truth, row, json), STATUS_OK);
        assert_int_equal(volume_acquire(truth->sources.volumes,
                                        &truth->scene.objects[0].shell.material, 1.0, "",
                                        &truth->assets, &volume, &made, NULL),
                         STATUS_OK);
        assert_false(made);
        columns->volume[shadow] = volume;
    }
}

static void close_columns(struct columns *columns) {
    for (int shadow = 0; shadow < 2; shadow++) {
        volume_release(columns->truth[shadow].sources.volumes, columns->volume[shadow]);
        truth_close(&columns->truth[shadow]);
    }
}

/* Holds every pixel to a search by hand, in steps of a two-hundredth of a voxel, from the first s =
 * 1/2 below the top; adds to what is dark, lit, and dark for nothing but a rise and fall at once.
 */
static void check_columns(struct columns *columns, const double direction[3], size_t *dark,
                          size_t *lit, size_t *ridges) {
    const struct volume *volume = columns->volume[1];
    double length = hypot(direction[0], direction[2]), step = 1.0 / 3200;
    double l[2] = {-direction[0] / length, -direction[2] / length};
    for (int shadow = 0; shadow < 2; shadow++)
        truth_draw(&columns->truth[shadow], 0, 1);
    for (size_t p = 0; p < columns->truth[0].result.count; p++) {
        double o[3], d[3], high = 1;
        truth_pixel_ray(&columns->truth[0].scene, p, o, d);
        double x = o[0];
        while (high > 0 && field_at(volume, (x + 1) / 2, high - step) < 0.5)
            high -= step;
        double low = high - step;
        for (int i = 0; i < 60; i++) {
            double z = (low + high) / 2;
            *(field_at(volume, (x + 1) / 2, z) >= 0.5 ? &low : &high) = z;
        }
        /* It begins at 1/2: what counts is whether s rises above it, first or after a fall. */
        double nearest = 0, first = 0, later = 0;
        bool away = false;
        for (double t = step; t < 3; t += step) {
            double at_x = x + t * l[0], at_z = low + t * l[1];
            bool within = fabs(at_x) < 1 && at_z < 1 && at_z > 0;
            double s = within ? field_at(volume, (at_x + 1) / 2, at_z) : 0;
            away |= s < 0.48;
            first = away ? first : fmax(first, s);
            later = away ? fmax(later, s) : later;
            nearest = away || s > 0.505 ? fmax(nearest, s) : nearest;
        }
        double plain = columns->truth[0].result.pixels[p][0];
        double found = columns->truth[1].result.pixels[p][0];
        assert_true(found == 0 || found == plain);
        /* Grazes, there or where it begins: the search in steps cannot tell. */
        if (low <= 0 || !(plain > 0) || fabs(nearest - 0.5) < 5e-3 ||
            (first > 0.4999 && first <= 0.505))
            continue;
        if ((found > 0) != (nearest < 0.5))
            fail_msg("light %g, %g, pixel %zu: %g of %g, s up to %.4f", direction[0], direction[2],
                     p, found, plain, nearest);
        *dark += found == 0;
        *lit += found > 0;
        *ridges += found == 0 && later < 0.495;
    }
}

/* Columns under slanting lights: what the search comes upon lies in the dark, and nothing else; a
 * point does not hide itself. */
static void test_solid(void **state) {
    (void)state;
    unsigned char file[256];
    const unsigned char heights[8] = {40, 40, 200, 200, 40, 90, 140, 190};
    struct row row = {file, make_file(heights, file)};
    static const double directions[][3] = {{0.3, 0, -1}, {-1, 0, -0.7}, {1, 0, -0.2}, {0, 0, -1}};
    size_t dark = 0, lit = 0, ridges = 0;
    for (size_t k = 0; k < sizeof directions / sizeof *directions; k++) {
        struct columns columns;
        open_columns(&columns, &row, directions[k]);
        check_columns(&columns, directions[k], &dark, &lit, &ridges);
        close_columns(&columns);
    }
    print_message("%zu pixels dark, %zu lit\n", dark, lit);
    assert_true(dark > 60 && lit > 200);
}

/* Voxels at random, between which a ray goes up into the solid and out of it again on its way to
 * the next plane of voxels: both ends of that cell lie outside, and only the root that the ray
 * begins at tells of it (solid.c, meets_again). Normals, which are differences over two voxels,
 * face many such lights. */
static void test_ridges(void **state) {
    (void)state;
    unsigned char file[256];
    const unsigned char heights[8] = {40, 40, 200, 200, 40, 90, 140, 190};
    struct row row = {file, make_file(heights, file)};
    static const double directions[][3] = {{1, 0, -1}, {-1, 0, -0.4}, {1, 0, -0.2}, {-1, 0, -0.1}};
    uint32_t random = 1;
    size_t dark = 0, lit = 0, ridges = 0;
    for (size_t k = 0; k < 6 * (sizeof directions / sizeof *directions); k++) {
        struct columns columns;
        open_columns(&columns, &row, directions[k % 4]);
        for (size_t i = 0; i < (size_t)8 * 16; i++) {
            random = random * 1664525u + 1013904223u;
            double s = i >= (size_t)8 * 14 ? 0 : 0.3 + 0.4 * (random >> 8) / 16777216.0;
            for (int shadow = 0; shadow < 2; shadow++) {
                float *voxel = columns.volume[shadow]->solid + 4 * i;
                for (int c = 0; c < 4; c++)
                    voxel[c] = (float)s;
            }
        }
        check_columns(&columns, directions[k % 4], &dark, &lit, &ridges);
        close_columns(&columns);
    }
    print_message("%zu pixels dark, %zu of them by a ridge at hand, %zu lit\n", dark, ridges, lit);
    assert_true(ridges > 20 && lit > 200);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_opaque),
        cmocka_unit_test(test_sides),
        cmocka_unit_test(test_slab),
        cmocka_unit_test(test_own_shell),
        cmocka_unit_test(test_media_seen_from_the_light),
        cmocka_unit_test(test_solid),
        cmocka_unit_test(test_ridges),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
