/* Filtering in pictures: one filtered sample a pixel against the mean of 64 unfiltered ones, by
 * every way of drawing; what is left out where no footprint needs it; what is refused; extremes. */
#include <math.h>
#include <stdlib.h>

#include "renderer/force.h"
#include "shaders/interface.h"
#include "tests/unit/renderer_fixture.h"

enum { WIDTH = 32, PIXELS = WIDTH * WIDTH, TRUTH = 64 };

/* A torus, sixteen times as far as in the examples, and as large in the picture. */
#define TORUS                                                                                      \
    "{'image': {'width': 32, 'height': 32, 'samples': %d}, 'camera': {'eye': [0, -48, 35.2], "     \
    "'fov_y_deg': 2.6}, 'objects': [{'shell': {'mesh': {'shape': 'torus', 'divisions': [32, "      \
    "16]}, "                                                                                       \
    "'thickness': 0.12, 'tiles': [12, 6], 'base': {'color': [0.3, 0.2, 0.1]}, 'material': "        \
    "{'builtin': '%s', 'size': [64, 64, 16]}}, 'quality': {'filter': '%s'%s}}]}"

static double rmse(const struct render_result *a, const struct render_result *b) {
    double sum = 0;
    size_t count = 0;
    for (size_t p = 0; p < PIXELS; p++) {
        if (!(b->pixels[4 * p + 3] > 0))
            continue;
        count++;
        for (size_t i = 0; i < 4; i++) {
            double d = (double)a->pixels[4 * p + i] - (double)b->pixels[4 * p + i];
            assert_true(isfinite(d));
            sum += d * d / 4;
        }
    }
    assert_true(count > 0);
    return sqrt(sum / (double)count);
}

static bool told(const struct render_result *result, const char *name) {
    for (size_t i = 0; i < result->report.pass_count; i++)
        if (strcmp(result->report.passes[i].name, name) == 0)
            return true;
    return false;
}

static bool warned(const struct render_result *result, const char *code) {
    for (size_t i = 0; i < result->report.warning_count; i++)
        if (strcmp(result->report.warnings[i].code, code) == 0)
            return true;
    return false;
}

static double error_of(const struct render_result *truth, const char *material, const char *filter,
                       const char *more) {
    struct render_result result;
    assert_int_equal(support_draw(renderer, &result, TORUS, 1, material, filter, more), STATUS_OK);
    assert_int_equal(told(&result, "filter"), strcmp(filter, "none") != 0);
    assert_int_equal(told(&result, "far-solids"),
                     strcmp(filter, "none") != 0 && strcmp(material, "chain") == 0);
    double error = rmse(&result, truth);
    render_result_finish(&result);
    return error;
}

/* By each way of drawing. Measured at one sample: none 0.078, 0.313, 0.200; mip 0.073, 0.160,
 * 0.149; view 0.045, 0.123, 0.094, each the same to 0.002 by walk, sorted and slabs. What is left
 * is the silhouette's. */
static void it_is_nearer_to_many_samples(void **state) {
    (void)state;
    static const struct {
        const char *material;
        double mip, view;
    } rows[] = {{"fur", 0.97, 0.65}, {"clouds", 0.55, 0.42}, {"chain", 0.8, 0.52}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const char *material = rows[i].material;
        struct render_result truth;
        assert_int_equal(support_draw(renderer, &truth, TORUS, TRUTH, material, "none", ""),
                         STATUS_OK);
        double none = error_of(&truth, material, "none", "");
        static const char *const ways[] = {"", ", 'order': 'sorted'", ", 'method': 'slabs'"};
        for (size_t way = 0; way < sizeof ways / sizeof *ways; way++) {
            double mip = error_of(&truth, material, "mip", ways[way]);
            double view = error_of(&truth, material, "view", ways[way]);
            if (mip > rows[i].mip * none || view > rows[i].view * none)
                fail_msg("%s%s: none %g, mip %g, view %g", material, ways[way], none, mip, view);
        }
        render_result_finish(&truth);
    }
}

#define PLANE                                                                                      \
    "{'image': {'width': 32, 'height': 32, 'samples': %d}, 'lights': [], 'ambient': [1, 1, 1], "   \
    "'camera': {'eye': [0, %.9g, %.9g], 'fov_y_deg': %g}, 'objects': [{'shell': {'mesh': "         \
    "{'shape': 'plane', 'size': [%g, %g], 'divisions': [1, 1]}, 'thickness': 0.12, 'tiles': "      \
    "[%g, %g], 'material': {'builtin': '%s', 'size': [%d, %d, %d]}}, 'path': 'tetra', 'quality': " \
    "{'filter': "                                                                                  \
    "'%s'}}]}"

/* Means of the whole picture over one of many samples: what is seen of a plane at a slant is right
 * on the average, where the published pyramid is not. Each pixel covers several tiles. */
static void planes_keep_their_mean_at_any_slant(void **state) {
    (void)state;
    static const struct {
        const char *material;
        double slant_deg, view; /* bound on the mean's error */
    } rows[] = {{"fur", 0.1, 2e-3},    {"fur", 30, 2e-3},    {"fur", 60, 2e-3},
                {"clouds", 0.1, 1e-2}, {"clouds", 30, 2e-2}, {"clouds", 60, 3e-2}};
    double sum_mip = 0, sum_view = 0;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        double mean[3] = {0}, a = rows[i].slant_deg * M_PI / 180;
        static const char *const filters[3] = {"none", "mip", "view"};
        for (int f = 0; f < 3; f++) {
            struct render_result result;
            assert_int_equal(support_draw(renderer, &result, PLANE, f ? 1 : TRUTH, -90 * sin(a),
                                          90 * cos(a), 5.0, 400.0, 400.0, 2400.0, 2400.0,
                                          rows[i].material, 64, 64, 16, filters[f]),
                             STATUS_OK);
            for (size_t p = 0; p < 4 * PIXELS; p++)
                mean[f] += (double)result.pixels[p] / (4 * PIXELS);
            render_result_finish(&result);
        }
        double mip = fabs(mean[1] - mean[0]), view = fabs(mean[2] - mean[0]);
        if (view > rows[i].view)
            fail_msg("%s at %g: none %g, mip %g, view %g", rows[i].material, rows[i].slant_deg,
                     mean[0], mean[1], mean[2]);
        sum_mip += mip;
        sum_view += view;
    }
    assert_true(sum_view < 0.5 * sum_mip);
}

#define LIT_PLANE                                                                                  \
    "{'image': {'width': 12, 'height': 12, 'samples': %d}, 'lights': [{'direction': [%g, %g, "     \
    "%g], 'color': [3, 3, 3]}], 'ambient': [0, 0, 0], 'camera': {'eye': [0, -3, 3], 'target': "    \
    "[0, 0, 0], 'up': [0, 0, 1], 'ortho_height': 1}, 'objects': [{'shell': {'mesh': {'shape': "    \
    "'plane', 'size': [8, 8], 'divisions': [2, 2]}, 'thickness': 0.12, 'tiles': [48, 48], "        \
    "'material': {'builtin': 'fur', 'size': [%d, %d, %d], 'specular': %g, 'shininess': 32}}, "     \
    "'path': 'tetra', 'quality': {'samples': 64, 'filter': '%s'}}]}"

/* Light falls on each normal that a sample sees, not on their mean. Fur at 45 degrees, 32 voxels a
 * sample and more, lit from the viewer's side, from beyond, aside, and from above; voxels 0.7, 3
 * and 11 times as high as wide; glossy. Measured: colours off by 3 % at most, 12 % where glossy;
 * light on their mean made them 24 % too dark to 96 % too bright, glossy ones three times as
 * bright. */
static void lit_planes_keep_their_mean(void **state) {
    (void)state;
    static const struct {
        double light[3];
        int size[3];
        double specular, most; /* of the mean's error, over the mean */
    } rows[] = {{{0, 1, -1}, {64, 64, 16}, 0, 0.04},  {{0, -1, -1}, {64, 64, 16}, 0, 0.04},
                {{1, 0, -1}, {64, 64, 16}, 0, 0.04},  {{0, 0, -1}, {64, 64, 16}, 0, 0.04},
                {{-1, 1, -2}, {32, 32, 32}, 0, 0.04}, {{-1, 1, -2}, {128, 128, 8}, 0, 0.04},
                {{0, 1, -1}, {64, 64, 16}, 1, 0.13},  {{0, -1, -1}, {64, 64, 16}, 1, 0.13},
                {{1, 0, -1}, {64, 64, 16}, 1, 0.13}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        double mean[2] = {0};
        for (int f = 0; f < 2; f++) {
            struct render_result result;
            assert_int_equal(support_draw(renderer, &result, LIT_PLANE, f ? 1 : TRUTH,
                                          rows[i].light[0], rows[i].light[1], rows[i].light[2],
                                          rows[i].size[0], rows[i].size[1], rows[i].size[2],
                                          rows[i].specular, f ? "view" : "none"),
                             STATUS_OK);
            for (size_t p = 0; p < 12 * 12; p++)
                for (size_t c = 0; c < 3; c++)
                    mean[f] += (double)result.pixels[4 * p + c];
            render_result_finish(&result);
        }
        if (!(fabs(mean[1] / mean[0] - 1) < rows[i].most))
            fail_msg("row %zu: %g, not %g", i, mean[1], mean[0]);
    }
}

/* Where no sample covers a voxel nothing is made, compiled or fetched for it. */
static void near_by_nothing_is_filtered(void **state) {
    (void)state;
    struct render_result result[3];
    static const char *const filters[3] = {"none", "mip", "view"};
    renderer_destroy(renderer); /* nothing uploaded before */
    for (int f = 0; f < 3; f++) {
        renderer = support_renderer();
        assert_int_equal(support_draw(renderer, &result[f], PLANE, 1, -1.0, 1.0, 1.0, 2.0, 2.0, 1.0,
                                      1.0, "fur", 16, 16, 8, filters[f]),
                         STATUS_OK);
        assert_false(told(&result[f], "filter"));
        assert_int_equal(result[f].report.work.upload_bytes, result[0].report.work.upload_bytes);
        assert_memory_equal(result[f].pixels, result[0].pixels, sizeof(float) * 4 * PIXELS);
        const char *program;
        uint32_t variant;
        for (size_t i = 0; renderer_variant(renderer, i, &program, &variant); i++)
            assert_int_equal(variant & FLAG_FILTER, 0);
        if (f < 2)
            renderer_destroy(renderer);
    }
    for (int f = 0; f < 3; f++)
        render_result_finish(&result[f]);
}

/* Ten thousand tiles, one voxel across, none but layers, grazing, and as far as numbers go: finite,
 * and as opaque on the average as many samples are. */
static void extremes(void **state) {
    (void)state;
    static const struct {
        double eye[2], fov, tiles[2];
        int size[3];
    } rows[] = {
        {{-90, 90}, 5, {10000, 10000}, {16, 16, 8}},
        {{-9000, 60}, 1, {10000, 10000}, {16, 16, 8}},
        {{-1e6, 1e6}, 0.01, {10000, 10000}, {16, 16, 8}},
        {{-90, 90}, 5, {10000, 10000}, {512, 1, 1}},
        {{-90, 90}, 5, {10000, 10000}, {1, 1, 64}},
        {{-90, 90}, 5, {10000, 10000}, {1, 1, 1}},
        {{-90, 90}, 5, {0.01, 10000}, {7, 5, 3}},
    };
    for (size_t i = 0; i < 2 * sizeof rows / sizeof *rows; i++) {
        const int *n = rows[i / 2].size;
        struct render_result truth, result;
        double far = 0, mean[2] = {0};
        for (int k = 0; k < 2; k++) {
            struct render_result *one = k ? &result : &truth;
            assert_int_equal(support_draw(renderer, one, PLANE, k ? 1 : TRUTH, rows[i / 2].eye[0],
                                          rows[i / 2].eye[1], rows[i / 2].fov, 4000.0, 4000.0,
                                          rows[i / 2].tiles[0], rows[i / 2].tiles[1], "clouds",
                                          n[0], n[1], n[2],
                                          !k      ? "none"
                                          : i % 2 ? "view"
                                                  : "mip"),
                             STATUS_OK);
            for (size_t p = 0; p < PIXELS; p++)
                mean[k] += (double)one->pixels[4 * p + 3] / PIXELS;
        }
        for (size_t p = 0; p < 4 * PIXELS; p++)
            far = fmax(far, fabs((double)result.pixels[p]));
        assert_true(isfinite(far) && far <= 1.001);
        if (fabs(mean[1] - mean[0]) > 0.15)
            fail_msg("row %zu: %g, not %g", i, mean[1], mean[0]);
        render_result_finish(&truth);
        render_result_finish(&result);
    }
}

#define LIT_EXTREME                                                                                \
    "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'lights': [{'direction': [1, 2, -3], "   \
    "'color': [1, 1, 1]}], 'ambient': [0, 0, 0], 'camera': {'eye': [0, %g, %g], 'fov_y_deg': "     \
    "%g}, "                                                                                        \
    "'objects': [{'transform': {'scale': [-1, 1, 1]}, 'shell': {'mesh': {'shape': '%s'}, "         \
    "'thickness': %g, 'tiles': [%g, %g], 'material': {'builtin': '%s', 'size': [%d, %d, %d], "     \
    "'specular': 1, 'shininess': %g}}, 'path': 'tetra', 'quality': {'filter': 'view'}}]}"

/* Shells as thin as a millionth, tiles drawn out a million times, the poles of a sphere, lobes of
 * any width: light is finite, and no more than a white Lambert and Blinn surface gives. */
static void light_stays_within_its_range(void **state) {
    (void)state;
    static const struct {
        double eye[2], fov, thickness, tiles[2], shininess;
        const char *shape, *material;
        int size[3];
    } rows[] = {
        {{-48, 35}, 2.6, 0.12, {120, 60}, 1, "torus", "fur", {64, 64, 16}},
        {{-48, 35}, 2.6, 1e-6, {1e4, 1e4}, 1e4, "torus", "fur", {16, 16, 8}},
        {{-48, 35}, 2.6, 0.1, {0.01, 1e4}, 10, "torus", "clouds", {16, 16, 8}},
        {{-1, 60}, 3, 0.15, {400, 400}, 1e3, "sphere", "clouds", {32, 32, 8}},
        {{-1, 1e5}, 1e-3, 0.15, {400, 4}, 1e3, "sphere", "chain", {33, 7, 5}},
        {{-40, 1}, 3, 0.5, {4000, 4000}, 100, "plane", "fur", {1, 512, 2}},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct render_result result;
        double least = INFINITY, most = 0;
        assert_int_equal(support_draw(renderer, &result, LIT_EXTREME, rows[i].eye[0],
                                      rows[i].eye[1], rows[i].fov, rows[i].shape, rows[i].thickness,
                                      rows[i].tiles[0], rows[i].tiles[1], rows[i].material,
                                      rows[i].size[0], rows[i].size[1], rows[i].size[2],
                                      rows[i].shininess),
                         STATUS_OK);
        assert_true(told(&result, "filter"));
        for (size_t p = 0; p < 16 * 16 * 4; p++) {
            assert_true(isfinite(result.pixels[p]));
            least = fmin(least, (double)result.pixels[p]);
            most = fmax(most, (double)result.pixels[p]);
        }
        if (least < 0 || most > 2.001)
            fail_msg("row %zu: %g to %g", i, least, most);
        render_result_finish(&result);
    }
}

#define TWO                                                                                        \
    "{'image': {'width': 32, 'height': 32, 'samples': %d}, 'camera': {'eye': [0, -48, 35.2], "     \
    "'fov_y_deg': 2.6}, 'objects': [{'shell': {'mesh': {'shape': 'torus'}, 'thickness': 0.12, "    \
    "'material': {'builtin': 'clouds', 'size': [64, 64, 16]}}, 'quality': {'filter': '%s'%s}}, "   \
    "{'shell': {'mesh': {'shape': 'sphere'}, 'material': {'builtin': 'fur', 'size': [32, 32, "     \
    "16]}}, 'quality': {'filter': '%s'%s}}]}"

static void several_shells(void **state) {
    (void)state;
    struct render_result truth, none, mip;
    assert_int_equal(support_draw(renderer, &truth, TWO, TRUTH, "none", "", "none", ""), STATUS_OK);
    assert_int_equal(support_draw(renderer, &none, TWO, 1, "none", "", "none", ""), STATUS_OK);
    assert_int_equal(support_draw(renderer, &mip, TWO, 1, "mip", "", "mip", ""), STATUS_OK);
    assert_true(told(&mip, "overlap") && told(&mip, "filter"));
    double without = rmse(&none, &truth), with = rmse(&mip, &truth);
    if (with > 0.7 * without)
        fail_msg("none %g, mip %g", without, with);
    render_result_finish(&truth);
    render_result_finish(&none);
    render_result_finish(&mip);
    assert_int_equal(support_draw(renderer, &none, TWO, 1, "view", "", "view", ""),
                     STATUS_NOT_IMPLEMENTED);
    const char *sorted = ", 'order': 'sorted'";
    assert_int_equal(support_draw(renderer, &none, TWO, 1, "view", sorted, "view", sorted),
                     STATUS_OK);
    render_result_finish(&none);
}

static void what_is_refused_and_warned_of(void **state) {
    (void)state;
    struct render_result result;
    assert_int_equal(support_draw(renderer, &result, TORUS, 1, "fur", "mip", ", 'map': 'affine'"),
                     STATUS_NOT_IMPLEMENTED);
    assert_int_equal(
        support_draw(renderer, &result, TORUS, 1, "fur", "view", ", 'method': 'hybrid'"),
        STATUS_NOT_IMPLEMENTED);
    /* Seven views of 256 x 256 x 64 voxels are 680 MB. */
    assert_int_equal(support_draw(renderer, &result, PLANE, 1, -300.0, 300.0, 3.0, 4.0, 4.0, 4.0,
                                  4.0, "fur", 256, 256, 64, "view"),
                     STATUS_NOT_IMPLEMENTED);
    /* Some of it is near, and some far: a solid stays one. */
    assert_int_equal(support_draw(renderer, &result, PLANE, 1, -30.0, 0.5, 60.0, 4000.0, 4000.0,
                                  4000.0, 4000.0, "chain", 16, 16, 8, "view"),
                     STATUS_OK);
    assert_true(warned(&result, "solid-not-filtered"));
    assert_false(told(&result, "far-solids"));
    render_result_finish(&result);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_is_nearer_to_many_samples),
        cmocka_unit_test(planes_keep_their_mean_at_any_slant),
        cmocka_unit_test(lit_planes_keep_their_mean),
        cmocka_unit_test(near_by_nothing_is_filtered),
        cmocka_unit_test(extremes),
        cmocka_unit_test(light_stays_within_its_range),
        cmocka_unit_test(several_shells),
        cmocka_unit_test(what_is_refused_and_warned_of),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
