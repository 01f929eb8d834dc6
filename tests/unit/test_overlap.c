/* Where shells and folds overlap, extinctions add and colours mix by extinction: against the closed
 * form for slabs of homogeneous material, against the reference for voxels on planes, where
 * tetrahedra are no approximation. */
#include <math.h>
#include <stdlib.h>

#include "renderer/truth.h"
#include "tests/unit/asset_files.h"
#include "tests/unit/renderer_fixture.h"

/* A slab across the view, from z = low to high in the world. */
struct slab {
    double low, high, sigma; /* extinction in the world */
    enum { R, G, B } color;
    double scale;  /* 0: 1. Of its transform: the object is as much smaller, and as much denser */
    bool mirrored; /* its shell grows downward */
};

static const double colors[][3] = {{1, 0.125, 0.25}, {0.0625, 1, 0.5}, {0.25, 0.5, 1}};

enum { SLABS_MAX = 8, JSON_MAX = 8192 };

static void write_slabs(char *json, const struct slab *slabs, int count, const char *order) {
    size_t used = 0;
    for (int i = 0; i < count; i++) {
        const struct slab *s = &slabs[i];
        double scale = s->scale ? s->scale : 1;
        int n = snprintf(
            json + used, JSON_MAX - used,
            "%s{'shell': {'mesh': {'shape': 'plane', 'size': [%.17g, %.17g], 'divisions': [3, %d]},"
            " 'thickness': %.17g, 'material': {'builtin': 'homogeneous', 'extinction': %.17g, "
            "'color': [%g, %g, %g]}}, 'path': 'tetra', 'quality': {'order': '%s'}, 'transform': "
            "{'translate': "
            "[0, 0, %.17g], 'scale': [%.17g, %.17g, %.17g]}}",
            i ? ", " : "", 8 / scale, 8 / scale, 2 + i, (s->high - s->low) / scale,
            s->sigma * scale, colors[s->color][0], colors[s->color][1], colors[s->color][2], order,
            s->mirrored ? s->high : s->low, scale, scale, s->mirrored ? -scale : scale);
        assert_true(n > 0 && used + (size_t)n < JSON_MAX);
        used += (size_t)n;
    }
}

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Down from z = top to `bottom`, each unit of z being `stretch` long: between the slabs' faces all
 * is constant. Returns what is let through. */
static double closed_form(const struct slab *slabs, int count, double top, double bottom,
                          double stretch, double color[3]) {
    double z[2 * SLABS_MAX + 2] = {top, bottom}, left = 1;
    int n = 2;
    for (int i = 0; i < count; i++) {
        z[n++] = fmin(fmax(slabs[i].low, bottom), top);
        z[n++] = fmin(fmax(slabs[i].high, bottom), top);
    }
    qsort(z, (size_t)n, sizeof *z, ascending);
    memset(color, 0, 3 * sizeof *color);
    for (int k = n - 1; k > 0; k--) {
        double middle = (z[k] + z[k - 1]) / 2, sigma = 0, emitted[3] = {0};
        for (int i = 0; i < count; i++) {
            if (middle < slabs[i].low || middle > slabs[i].high)
                continue;
            sigma += slabs[i].sigma;
            for (int c = 0; c < 3; c++)
                emitted[c] += slabs[i].sigma * colors[slabs[i].color][c];
        }
        double lost = -left * expm1(-sigma * (z[k] - z[k - 1]) * stretch);
        for (int c = 0; c < 3 && sigma > 0; c++)
            color[c] += lost * emitted[c] / sigma;
        left -= lost;
    }
    return left;
}

static void assert_close(double found, double expected, double relative) {
    if (!(fabs(found - expected) <= relative * fabs(expected) + 1e-12))
        fail_msg("%.9g, expected %.9g (off by %.2e)", found, expected, found / expected - 1);
}

static bool has_pass(const struct report_pass *passes, size_t count, const char *name) {
    for (size_t i = 0; i < count; i++)
        if (strcmp(passes[i].name, name) == 0)
            return true;
    return false;
}

static uint64_t warning(const struct report *report, const char *code) {
    for (size_t i = 0; i < report->warning_count; i++)
        if (strcmp(report->warnings[i].code, code) == 0)
            return report->warnings[i].count;
    return 0;
}

#define SLAB(low, high, sigma, color)                                                              \
    { low, high, sigma, color, 0, false }

static const struct {
    const char *what;
    struct slab slab[SLABS_MAX];
    int count;
    bool joint;
} stacks[] = {
    {"partly", {SLAB(0, 0.5, 2, R), SLAB(0.25, 0.75, 4, G)}, 2, true},
    {"partly, the other order", {SLAB(0.25, 0.75, 4, G), SLAB(0, 0.5, 2, R)}, 2, true},
    {"wholly", {SLAB(0, 1, 1, R), SLAB(0.3, 0.4, 20, G)}, 2, true},
    {"the same place", {SLAB(0, 0.5, 2, R), SLAB(0, 0.5, 4, G)}, 2, true},
    {"one face in common", {SLAB(0, 0.5, 2, R), SLAB(0, 0.25, 4, G)}, 2, true},
    {"touching", {SLAB(0, 0.5, 2, R), SLAB(0.5, 1, 4, G)}, 2, false},
    {"apart", {SLAB(0, 0.25, 2, R), SLAB(0.5, 1, 4, G)}, 2, false},
    {"three", {SLAB(0, 0.5, 2, R), SLAB(0.25, 0.75, 4, G), SLAB(0.375, 1, 1, B)}, 3, true},
    {"three of one", {SLAB(0, 0.5, 2, R), SLAB(0, 0.5, 2, G), SLAB(0, 0.5, 2, B)}, 3, true},
    {"a pair before a pair",
     {SLAB(0, 0.2, 2, R), SLAB(0.1, 0.3, 4, G), SLAB(0.5, 0.7, 2, B), SLAB(0.6, 0.8, 8, R)},
     4,
     true},
    {"five",
     {SLAB(0, 0.5, 1, R), SLAB(0.1, 0.6, 2, G), SLAB(0.2, 0.7, 1, B), SLAB(0.3, 0.8, 2, R),
      SLAB(0.4, 0.9, 1, G)},
     5,
     true},
    {"thin and thick", {SLAB(0, 0.5, 1e-5, R), SLAB(0.25, 0.75, 1e-4, G)}, 2, true},
    {"stiff", {SLAB(0, 0.5, 200, R), SLAB(0.25, 0.5, 1000, G)}, 2, true},
    {"mirrored", {{0, 0.5, 2, R, 0, true}, SLAB(0.25, 0.75, 4, G)}, 2, true},
    {"a millionth and a million",
     {{0, 0.5, 2, R, 1e-6, false}, {0.25, 0.75, 4, G, 1e6, false}},
     2,
     true},
};

static void test_slabs(void **state) {
    (void)state;
    for (size_t k = 0; k < sizeof stacks / sizeof *stacks; k++) {
        char json[JSON_MAX];
        struct render_result result;
        write_slabs(json, stacks[k].slab, stacks[k].count, "walk");
        assert_int_equal(support_draw(renderer, &result,
                                      "{'image': {'width': 17, 'height': 13, 'samples': 1}, "
                                      "'camera': {'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': "
                                      "[0, 1, 0], 'ortho_height': 2}, 'objects': [%s]}",
                                      json),
                         STATUS_OK);
        double color[3];
        double left = closed_form(stacks[k].slab, stacks[k].count, 5, -1, 1, color);
        for (int p = 0; p < 17 * 13; p++) {
            for (int c = 0; c < 3; c++)
                assert_close(result.pixels[4 * p + c], color[c], 1e-5);
            assert_close(result.pixels[4 * p + 3], 1 - left, 1e-5);
        }
        const struct report *report = &result.report;
        if (has_pass(report->passes, report->pass_count, "overlap") != stacks[k].joint ||
            has_pass(report->left_out, report->left_out_count, "overlap") == stacks[k].joint)
            fail_msg("%s: the plan does not say what was done", stacks[k].what);
        render_result_finish(&result);
    }
}

/* From within, where two and three of them overlap, in perspective; and down to something opaque.
 */
static void test_eye_and_occluder(void **state) {
    (void)state;
    static const struct slab slabs[] = {
        {0, 0.5, 2, R, 0, false}, {0.25, 0.75, 4, G, 0, true}, {0.375, 1, 1, B, 0, false}};
    static const double eyes[] = {0.3, 0.4375, 3};
    for (int cut = 0; cut < 2; cut++)
        for (size_t e = 0; e < sizeof eyes / sizeof *eyes; e++) {
            char json[JSON_MAX];
            struct render_result result;
            write_slabs(json, slabs, 3, "auto");
            const char *mesh = ", {'mesh': {'shape': 'plane', 'size': [8, 8]}, 'color': [1, 0.5, "
                               "0.25], 'transform': {'translate': [0, 0, 0.28125]}}";
            assert_int_equal(
                support_draw(renderer, &result,
                             "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'ambient': [1, "
                             "1, 1], 'lights': [], 'camera': {'eye': [0, 0, %.17g], 'target': [0, "
                             "0, -9], 'up': [0, 1, 0], 'fov_y_deg': 60}, 'objects': [%s%s]}",
                             eyes[e], json, cut ? mesh : ""),
                STATUS_OK);
            for (int y = 0; y < 16; y++)
                for (int x = 0; x < 16; x++) {
                    double px = ((x + 0.5) / 8 - 1) * tan(M_PI / 6);
                    double py = ((y + 0.5) / 8 - 1) * tan(M_PI / 6);
                    double color[3];
                    double left = closed_form(slabs, 3, eyes[e], cut ? 0.28125 : -1,
                                              sqrt(1 + px * px + py * py), color);
                    const float *pixel = support_pixel(&result, x, y);
                    /* The occluder's depth has 24 bits of 1 / (2 + t). */
                    for (int c = 0; c < 3; c++)
                        assert_close(pixel[c], color[c] + (cut ? left * ldexp(1, -c) : 0),
                                     cut ? 1e-4 : 1e-5);
                    assert_close(pixel[3], cut ? 1 : 1 - left, 1e-5);
                }
            render_result_finish(&result);
        }
}

/* More than can be walked at once: the cells are sorted, and told of, unless the scene insists. The
 * depth is exact all the same. A picture that walks nothing after one that did draws nothing of it.
 */
static void test_too_many(void **state) {
    (void)state;
    struct slab slabs[6];
    struct render_result sorted;
    char two[JSON_MAX];
    write_slabs(two, stacks[0].slab, 2, "sorted");
    assert_int_equal(support_draw(renderer, &sorted,
                                  "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': "
                                  "{'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], "
                                  "'ortho_height': 2}, 'objects': [%s]}",
                                  two),
                     STATUS_OK);
    assert_close(sorted.pixels[3], -expm1(-3), 1e-5);
    assert_int_equal(warning(&sorted.report, "overlap-approximate"), 256);
    render_result_finish(&sorted);
    for (int i = 0; i < 6; i++)
        slabs[i] = (struct slab){0.1 * i, 0.1 * i + 0.7, 0.5, i % 3, 0, false};
    for (int insist = 0; insist < 2; insist++) {
        char json[JSON_MAX];
        struct render_result result;
        write_slabs(json, slabs, 6, insist ? "walk" : "auto");
        enum status status = support_draw(
            renderer, &result,
            "{'image': {'width': 16, 'height': 16, 'samples': 1}, 'camera': {'eye': [0, 0, 5], "
            "'target': [0, 0, 0], 'up': [0, 1, 0], 'ortho_height': 2}, 'objects': [%s]}",
            json);
        assert_int_equal(status, insist ? STATUS_NOT_IMPLEMENTED : STATUS_OK);
        if (insist)
            break;
        double color[3], left = closed_form(slabs, 6, 5, -1, 1, color);
        for (int p = 0; p < 256; p++)
            assert_close(result.pixels[4 * p + 3], 1 - left, 1e-5);
        const struct report *report = &result.report;
        assert_int_equal(warning(report, "overlap-approximate"), 256);
        assert_int_equal(report->resolved.objects[5].quality.order, SCENE_ORDER_SORTED);
        assert_true(has_pass(report->passes, report->pass_count, "sort"));
        assert_false(has_pass(report->left_out, report->left_out_count, "sort"));
        render_result_finish(&result);
    }
}

struct compared {
    double rmse;
    uint64_t folds_overlap;
    bool joint, walked, solid_folds;
};

/* Draws a scene whose assets lie in the tree, both ways. */
__attribute__((format(printf, 3, 4))) static struct compared
compare_from(const char *camera, const char *lights, const char *objects, ...) {
    char list[JSON_MAX], json[JSON_MAX];
    va_list args;
    va_start(args, objects);
    int length = vsnprintf(list, sizeof list, objects, args);
    va_end(args);
    assert_true(length > 0 && (size_t)length < sizeof list);
    length = snprintf(json, sizeof json,
                      "{'image': {'width': 40, 'height': 40, 'samples': 1}, 'camera': {%s}, "
                      "'lights': [%s], 'ambient': [0.1, 0.2, 0.1], 'objects': [%s]}",
                      camera, lights, list);
    assert_true(length > 0 && (size_t)length < sizeof json);
    support_quote(json);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct render_result result;
    struct truth truth;
    int open = 0;
    struct asset_source source = {files_open, files_close, &open};
    assert_int_equal(scene_read(json, (size_t)length, &arena, &scene, &err), STATUS_OK);
    if (renderer_render(renderer, &scene, &source, &result, &err) != STATUS_OK)
        fail_msg("%s", err.faults[0].message);
    struct reference_request request = {0};
    assert_int_equal(truth_render(&scene, &source, &request, &truth, &err), STATUS_OK);
    double sum = 0, touched = 0;
    for (size_t p = 0; p < 1600; p++) {
        touched += truth.touched[p];
        for (size_t c = 0; c < 4 && truth.touched[p]; c++)
            sum += pow((double)result.pixels[4 * p + c] - truth.pixels[4 * p + c], 2) / 4;
    }
    assert_true(touched > 300);
    struct compared compared = {
        .rmse = sqrt(sum / touched),
        .folds_overlap = warning(&result.report, "folds-overlap"),
        .joint = has_pass(result.report.passes, result.report.pass_count, "overlap"),
        .walked = result.report.resolved.objects[0].quality.order == SCENE_ORDER_WALK,
        .solid_folds = has_pass(result.report.passes, result.report.pass_count, "folds"),
    };
    render_result_finish(&result);
    truth_finish(&truth);
    arena_free(&arena);
    return compared;
}

#define CAMERA               "'eye': [0.7, -2.8, 2.1], 'target': [0, 0, 0.1], 'fov_y_deg': 45"
#define compare(lights, ...) compare_from(CAMERA, lights, __VA_ARGS__)
#define LIGHT                "{'direction': [-1, 1, -2], 'color': [3, 2, 1]}"
#define PLANE                "'mesh': {'shape': 'plane', 'divisions': [3, 3]}, 'tiles': [3, 2]"
#define CLOUDS               "'builtin': 'clouds', 'size': [32, 32, 16]"
#define FUR                  "'builtin': 'fur', 'size': [32, 32, 16]"

/* Some three times what was measured. */
static void test_meets_the_reference(void **state) {
    (void)state;
    static const struct {
        const char *lights, *objects;
        double most;
    } cases[] = {
        /* fur on a base, and a slab through it */
        {LIGHT,
         "{'shell': {" PLANE ", 'thickness': 0.2, 'base': {'color': [0.3, 0.2, 0.1]}, 'material': "
         "{" FUR "}}, 'quality': {'samples': 512}}, {'shell': {" PLANE ", 'thickness': 0.2, "
         "'material': {'builtin': 'homogeneous', 'extinction': 3, 'color': [1, 0.2, 0.1]}}, "
         "'transform': {'translate': [0.3, 0, 0.1], 'rotate_deg': [0, 8, 10]}}",
         3e-5},
        /* lit, glossy, mirrored and turned, with unlit ones */
        {LIGHT,
         "{'shell': {" PLANE ", 'thickness': 0.2, 'material': {" CLOUDS ", 'specular': 0.5}}, "
         "'quality': {'samples': 512}}, {'shell': {" PLANE ", 'thickness': 0.2, 'material': {" FUR
         "}}, 'transform': {'translate': [0.3, 0.2, 0.1], 'rotate_deg': [20, 0, 10], 'scale': [1, "
         "1, -1.3]}, 'quality': {'samples': 512}}, {'shell': {" PLANE ", 'thickness': 0.3, "
         "'material': {" CLOUDS ", 'seed': 3, 'lit': false}}, 'transform': {'rotate_deg': [0, 15, "
         "0]}, 'quality': {'samples': 512}}",
         1e-4},
        /* one shell, two folds that face one another */
        {LIGHT,
         "{'shell': {'mesh': {'asset': 'tests/data/gltf/facing_plates.glb'}, 'thickness': 0.2, "
         "'material': {" CLOUDS "}}, 'quality': {'samples': 512}}",
         1e-4},
        /* the same, and another through both */
        {LIGHT,
         "{'shell': {'mesh': {'asset': 'tests/data/gltf/facing_plates.glb'}, 'thickness': 0.2, "
         "'material': {" CLOUDS "}}, 'quality': {'samples': 512}}, {'shell': {" PLANE
         ", 'thickness': 0.2, 'material': {" FUR "}}, 'transform': {'translate': [0.1, 0.1, "
         "0.05], 'rotate_deg': [15, 0, 0]}, 'quality': {'samples': 512}}",
         1e-4},
        /* no overlap, but each hides the other: a plate between two */
        {LIGHT,
         "{'shell': {'mesh': {'asset': 'tests/data/gltf/facing_plates.glb'}, 'thickness': 0.05, "
         "'material': {" CLOUDS "}}, 'quality': {'samples': 512}}, {'shell': {" PLANE
         ", 'thickness': 0.05, 'material': {" FUR "}}, 'transform': {'translate': [0, 0, "
         "0.125]}, 'quality': {'samples': 512}}",
         1e-4},
        /* ambient light alone on one of the two */
        {"",
         "{'shell': {" PLANE ", 'thickness': 0.2, 'material': {" CLOUDS
         "}}, 'quality': {'samples': 512}}, {'shell': {" PLANE
         ", 'thickness': 0.2, 'material': {" FUR
         ", 'lit': false}}, 'transform': {'translate': [0.1, 0.1, 0.05], 'rotate_deg': [15, 0, "
         "0]}, 'quality': {'samples': 512}}",
         1e-4},
    };
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        struct compared compared = compare(cases[k].lights, "%s", cases[k].objects);
        print_message("case %zu: rmse %.1e\n", k, compared.rmse);
        if (!(compared.rmse <= cases[k].most) || !compared.joint || !compared.walked)
            fail_msg("case %zu: rmse %.2e", k, compared.rmse);
    }
}

/* The integration stays of second order where stretches overlap. */
static void test_order(void **state) {
    (void)state;
    double before = 0;
    for (int samples = 16; samples <= 256; samples *= 4) {
        struct compared compared =
            compare(LIGHT,
                    "{'shell': {'mesh': {'asset': 'tests/data/gltf/facing_plates.glb'}, "
                    "'thickness': 0.2, 'material': {" CLOUDS ", 'lit': false}}, 'quality': "
                    "{'samples': %d}}, {'shell': {" PLANE ", 'thickness': 0.2, 'material': {" CLOUDS
                    ", 'lit': false, 'seed': 3}}, 'transform': {'translate': [0.1, 0.1, 0.05], "
                    "'rotate_deg': [15, 0, 0]}, 'quality': {'samples': %d}}",
                    samples, samples);
        double order = log2(before / compared.rmse) / 2;
        print_message("%d samples: rmse %.2e%s\n", samples, compared.rmse,
                      samples > 16 ? "" : " (first)");
        if (samples > 16 && !(order > 1.6))
            fail_msg("%d samples: order %.2f", samples, order);
        before = compared.rmse;
    }
}

#define PLATES(material, more)                                                                     \
    "{'shell': {'mesh': {'asset': 'tests/data/gltf/facing_plates.glb'}, 'thickness': 0.2, "        \
    "'material': {'builtin': " material ", 'size': [32, 32, 16]}" more                             \
    "}, 'quality': {'samples': "                                                                   \
    "512, 'order': 'walk'}}"

/* Of solids that reach into one another the nearest surface is seen, not that of the first fold:
 * from outside, over a base, with a medium in the same voxels, by parallel rays; and from where the
 * eye stands in both folds, whose cells are drawn. */
static void test_solid_folds(void **state) {
    (void)state;
    static const struct {
        const char *camera, *object;
        double most;
        bool cells;
    } cases[] = {
        {CAMERA, PLATES("'chain'", ""), 1e-3, false}, /* by the first fold's surface 0.035 */
        {CAMERA, PLATES("'chain'", ", 'base': {'color': [1, 0, 0]}"), 1e-3, false},
        {CAMERA, PLATES("'trees'", ""), 1e-3, false},
        {"'eye': [0.7, -2.8, 2.1], 'target': [0, 0, 0.1], 'ortho_height': 2.4",
         PLATES("'chain'", ""), 1e-3, false},
        {"'eye': [0.05, 0.1, 0.15], 'target': [1, 0.4, 0.17]", PLATES("'chain'", ""), 1e-3, true},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct compared compared = compare_from(cases[i].camera, LIGHT, "%s", cases[i].object);
        print_message("%zu: rmse %.1e\n", i, compared.rmse);
        assert_true(compared.rmse < cases[i].most);
        assert_true(compared.solid_folds == !cases[i].cells);
    }
}

/* A shell that folds over itself more often than can be walked at once is walked one fold after
 * another, and told of. */
static void test_many_folds(void **state) {
    (void)state;
    struct compared compared = compare(
        LIGHT, "{'shell': {'mesh': {'asset': 'tests/data/gltf/stacked_plates.glb'}, 'thickness': "
               "0.4, 'material': {'builtin': 'homogeneous', 'extinction': 1, 'color': [1, 0.5, "
               "0.25]}}, 'path': 'tetra'}");
    assert_true(compared.folds_overlap > 300);
    assert_false(compared.joint);
    assert_true(compared.walked);
    assert_true(compared.rmse < 2e-6); /* of one colour: no order can be wrong */
}

/* Where prisms are not affine the joint walk reads them by their own map, shell by shell as each
 * asks: two spheres' shells, one within the other, lit, and one of them constant. */
static void test_curved(void **state) {
    (void)state;
#define SPHERES(map)                                                                               \
    "{'shell': {'mesh': {'shape': 'sphere', 'divisions': [24, 12]}, 'thickness': 0.3, 'tiles': "   \
    "[3, 2], 'material': {" CLOUDS "}}, 'quality': {'samples': 256, 'map': '" map "'}}, "          \
    "{'shell': {'mesh': {'shape': 'sphere', 'divisions': [20, 12], 'radius': 0.9}, 'thickness': "  \
    "0.25, 'tiles': [2, 2], 'material': {" FUR "}}, 'quality': {'samples': 256, 'map': '" map      \
    "'}}, {'shell': {'mesh': {'shape': 'sphere', 'divisions': [16, 8]}, 'thickness': 0.1, "        \
    "'material': {'builtin': 'homogeneous', 'extinction': 1, 'color': [1, 0.5, 0.25]}}}"
    struct compared affine = compare(LIGHT, SPHERES("affine"));
    struct compared exact = compare(LIGHT, SPHERES("exact"));
    print_message("affine %.1e, exact %.1e\n", affine.rmse, exact.rmse);
    assert_true(affine.joint && exact.joint);
    assert_true(exact.rmse < affine.rmse / 5 && exact.rmse < 5e-3);
#undef SPHERES
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slabs),      cmocka_unit_test(test_eye_and_occluder),
        cmocka_unit_test(test_too_many),   cmocka_unit_test(test_meets_the_reference),
        cmocka_unit_test(test_order),      cmocka_unit_test(test_solid_folds),
        cmocka_unit_test(test_many_folds), cmocka_unit_test(test_curved),
    };
    return cmocka_run_group_tests(tests, open_renderer, close_renderer);
}
