/* The rational ray against direct inversion: wherever the ray is said to be in a prism, Newton on
 * P(b, w) = x in three unknowns, which knows nothing of rays, finds the same (b, w); and where it
 * is said to be outside, it finds none inside. Fixed seeds; PELT_POINTS sets how many points (make
 * stability takes a million). */
#include <math.h>
#include <stdlib.h>

#include "renderer/reference/prism.h"
#include "renderer/reference/vector.h"
#include "tests/reference_fixture.h"

struct random {
    uint64_t state;
};

/* splitmix64 (Steele, Lea, Flood 2014), to [0, 1). */
static double uniform(struct random *random) {
    uint64_t z = random->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return (double)((z ^ z >> 31) >> 11) * 0x1p-53;
}

static void map_point(const struct world_object *object, const uint32_t v[3], const double b[3],
                      double w, double out[3]) {
    for (int i = 0; i < 3; i++) {
        out[i] = 0;
        for (int k = 0; k < 3; k++)
            out[i] += b[k] * (object->bottom[v[k]][i] + w * object->offset[v[k]][i]);
    }
}

/* Newton on P = x from the middle of the prism, damped; false where it does not settle. */
static bool invert_point(const struct world_object *object, const uint32_t v[3], const double x[3],
                         double b[3], double *w) {
    b[0] = b[1] = b[2] = 1.0 / 3;
    *w = 0.5;
    double miss = INFINITY;
    for (int round = 0; round < 100; round++) {
        double p[3], r[3], e1[3], e2[3], o[3], c1[3], c2[3], c3[3];
        map_point(object, v, b, *w, p);
        for (int i = 0; i < 3; i++) {
            r[i] = x[i] - p[i];
            e1[i] = object->bottom[v[1]][i] - object->bottom[v[0]][i] +
                    *w * (object->offset[v[1]][i] - object->offset[v[0]][i]);
            e2[i] = object->bottom[v[2]][i] - object->bottom[v[0]][i] +
                    *w * (object->offset[v[2]][i] - object->offset[v[0]][i]);
            o[i] = b[0] * object->offset[v[0]][i] + b[1] * object->offset[v[1]][i] +
                   b[2] * object->offset[v[2]][i];
        }
        miss = sqrt(dot3(r, r));
        cross3(e2, o, c1);
        cross3(o, e1, c2);
        cross3(e1, e2, c3);
        double det = dot3(c3, o);
        double step[3] = {dot3(c1, r) / det, dot3(c2, r) / det, dot3(c3, r) / det};
        double most = fmax(fabs(step[0]), fmax(fabs(step[1]), fabs(step[2])));
        if (!isfinite(most))
            return false;
        double factor = most > 0.5 ? 0.5 / most : 1;
        b[1] += factor * step[0];
        b[2] += factor * step[1];
        b[0] = 1 - b[1] - b[2];
        *w += factor * step[2];
        if (most < 1e-13)
            break;
    }
    return miss < 1e-10;
}

static double least_of(const double b[3], double w) {
    return fmin(fmin(b[0], fmin(b[1], b[2])), fmin(w, 1 - w));
}

struct tally {
    long inside, outside, twice;
    double worst;
};

/* Points of a ray through the whole of a prism's surroundings, inside and outside. */
static void try_ray(const struct world_object *object, uint32_t index, const double o[3],
                    const double d[3], struct tally *tally) {
    struct object_ray ray;
    struct prism_ray prism;
    struct prism_interval intervals[PRISM_INTERVALS_MAX];
    object_ray_init(object, o, d, &ray);
    const uint32_t *v = object->mesh->vertex[index];
    int count = prism_meet(object, index, &ray, &prism, intervals);
    tally->twice += count > 1;
    double middle[3], along = 0;
    map_point(object, v, (const double[3]){1.0 / 3, 1.0 / 3, 1.0 / 3}, 0.5, middle);
    for (int i = 0; i < 3; i++)
        along += (middle[i] - ray.o[i]) * ray.d[i] / (ray.speed * ray.speed);
    for (int k = 0; k < 16; k++) {
        double t = along + (k - 7.5) * 0.05, x[3], b[3], w, found[3];
        bool within = false;
        for (int n = 0; n < count; n++) {
            const struct prism_interval *span = &intervals[n];
            if (!(t >= span->t[0] && t <= span->t[1]))
                continue;
            within = true;
            w = prism_w(&prism, span, t);
            assert_true(prism_barycentric(&prism, t, w, found));
        }
        double said = within ? w : 0;
        for (int i = 0; i < 3; i++)
            x[i] = ray.o[i] + t * ray.d[i];
        bool settled = invert_point(object, v, x, b, &w);
        if (within) {
            assert_true(settled);
            for (int i = 0; i < 3; i++)
                tally->worst = fmax(tally->worst, fabs(b[i] - found[i]));
            tally->worst = fmax(tally->worst, fabs(w - said));
            assert_true(least_of(b, w) > -1e-9);
            tally->inside++;
        } else if (settled) {
            assert_true(least_of(b, w) < 1e-9);
            tally->outside++;
        }
    }
}

static void test_inversion(void **state) {
    (void)state;
    struct truth_fixture truth;
    assert_int_equal(
        truth_open(&truth, "{'objects': [{'shell': {'mesh': {'shape': 'torus', 'divisions': [9, "
                           "6]}, 'thickness': 0.3, 'material': {'builtin': 'homogeneous'}}}]}"),
        STATUS_OK);
    struct world world;
    struct error err = {0};
    assert_int_equal(world_init(&truth.scene, &truth.sources, &world, &err), STATUS_OK);
    const struct world_object *object = &world.objects[0];
    assert_int_equal(object->folded, 0);
    const char *text = getenv("PELT_POINTS");
    long wanted = text ? atol(text) : 20000;
    struct random random = {7};
    struct tally tally = {0, 0, 0, 0};
    while (tally.inside < wanted) {
        uint32_t index = (uint32_t)(uniform(&random) * object->mesh->triangle_count);
        const uint32_t *v = object->mesh->vertex[index];
        /* From one point in or near the prism to another; every fourth ray within one layer. */
        double p[2][3], d[3];
        double w = uniform(&random);
        bool level = uniform(&random) < 0.25;
        for (int k = 0; k < 2; k++) {
            double b[3] = {uniform(&random) * 1.4 - 0.2, uniform(&random) * 1.4 - 0.2, 0};
            b[2] = 1 - b[0] - b[1];
            map_point(object, v, b, level ? w : uniform(&random) * 1.4 - 0.2, p[k]);
        }
        for (int i = 0; i < 3; i++) {
            d[i] = p[1][i] - p[0][i];
            p[0][i] += object->shift[i];
        }
        unit3(d);
        try_ray(object, index, p[0], d, &tally);
    }
    /* Measured at a million points: 1e-14. */
    print_message("%ld points inside, %ld outside, %ld rays twice through a prism, off by %.1e\n",
                  tally.inside, tally.outside, tally.twice, tally.worst);
    assert_true(tally.outside > wanted / 4);
    assert_true(tally.twice > 0);
    if (!(tally.worst <= 1e-9))
        fail_msg("off by %.2e", tally.worst);
    world_finish(&world);
    truth_close(&truth);
}

/* Every ray through a closed shell is in exactly one prism at a time: their intervals join. */
static void test_intervals_join(void **state) {
    (void)state;
    struct truth_fixture truth;
    assert_int_equal(
        truth_open(&truth, "{'objects': [{'shell': {'mesh': {'shape': 'sphere', 'divisions': [8, "
                           "5]}, 'thickness': 0.4, 'material': {'builtin': 'homogeneous'}}}]}"),
        STATUS_OK);
    struct world world;
    struct error err = {0};
    assert_int_equal(world_init(&truth.scene, &truth.sources, &world, &err), STATUS_OK);
    const struct world_object *object = &world.objects[0];
    struct random random = {3};
    for (int n = 0; n < 2000; n++) {
        double o[3], d[3];
        for (int i = 0; i < 3; i++) {
            o[i] = 2 * uniform(&random) - 1;
            d[i] = 2 * uniform(&random) - 1;
        }
        if (n % 3 == 0) /* along the axes and through vertices, where everything ties */
            for (int i = 0; i < 3; i++) {
                d[i] = i == n / 3 % 3;
                o[i] = n % 2 ? 0 : o[i];
            }
        unit3(d);
        struct object_ray ray;
        object_ray_init(object, o, d, &ray);
        double inner = 0, length = 0;
        struct prism_interval all[256];
        int total = 0;
        for (uint32_t f = 0; f < object->mesh->triangle_count; f++) {
            struct prism_ray prism;
            struct prism_interval intervals[PRISM_INTERVALS_MAX];
            int count = prism_meet(object, f, &ray, &prism, intervals);
            for (int i = 0; i < count; i++) {
                length += intervals[i].t[1] - intervals[i].t[0];
                assert_true(total < 256);
                all[total++] = intervals[i];
            }
        }
        /* The union of the intervals is as long as their sum. */
        for (int i = 1; i < total; i++)
            for (int k = i; k > 0 && all[k].t[0] < all[k - 1].t[0]; k--) {
                struct prism_interval spare = all[k];
                all[k] = all[k - 1];
                all[k - 1] = spare;
            }
        double end = -INFINITY;
        for (int i = 0; i < total; i++) {
            inner += fmax(0, all[i].t[1] - fmax(end, all[i].t[0]));
            end = fmax(end, all[i].t[1]);
        }
        if (!(fabs(inner - length) < 1e-9))
            fail_msg("ray %d: %.12g in prisms, %.12g in their union", n, length, inner);
    }
    world_finish(&world);
    truth_close(&truth);
}

/* ---- a prism that folds ---- */

/* Whether (x, y, z) lies in the triangle of its own layer: all offsets rise by 1, so w is z. */
static bool in_layer(const struct world_object *object, const double x[3]) {
    double q[3][2];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 2; i++)
            q[k][i] = object->bottom[k][i] + x[2] * object->offset[k][i] - x[i];
    double a = cross2(q[0], q[1]), b = cross2(q[1], q[2]), c = cross2(q[2], q[0]);
    return x[2] >= 0 && x[2] <= 1 && ((a >= 0 && b >= 0 && c >= 0) || (a <= 0 && b <= 0 && c <= 0));
}

/* Length of a ray within it: by steps, each change of side closed in by bisection. */
static double length_by_steps(const struct world_object *object, const double o[3],
                              const double d[3]) {
    enum { STEPS = 8000 };
    double length = 0, x[3];
    for (int n = 0; n < STEPS; n++) {
        double t[2] = {-4 + 8.0 * n / STEPS, -4 + 8.0 * (n + 1) / STEPS};
        bool side[2];
        for (int k = 0; k < 2; k++) {
            for (int i = 0; i < 3; i++)
                x[i] = o[i] + t[k] * d[i];
            side[k] = in_layer(object, x);
        }
        double low = t[0], high = t[1];
        for (int r = 0; r < 50 && side[0] != side[1]; r++) {
            double middle = (low + high) / 2;
            for (int i = 0; i < 3; i++)
                x[i] = o[i] + middle * d[i];
            *(in_layer(object, x) == side[0] ? &low : &high) = middle;
        }
        length +=
            side[0] == side[1] ? (side[0] ? t[1] - t[0] : 0) : (side[0] ? low - t[0] : t[1] - high);
    }
    return length;
}

/* Layers that shrink to a line, or to a point, half way up and open again turned over. */
static void test_folded(void **state) {
    (void)state;
    static const double shrink[3][2] = {{-2, 0}, {-2, -2}, {-1.3, -3}};
    static const double corner[3][2] = {{-1, -0.7}, {1.1, -0.6}, {0.1, 0.9}};
    struct random random = {5};
    struct scene_object spec = {.shell.tiles = {1, 1}};
    for (int kind = 0; kind < 3; kind++) {
        double bottom[3][3] = {{0}}, offset[3][3], uv[1][3][2] = {{{0}}};
        uint32_t vertex[1][3] = {{0, 1, 2}};
        bool folds[1] = {true};
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) {
                bottom[k][i] = i < 2 ? corner[k][i] : 0;
                offset[k][i] = i < 2 ? shrink[kind][i] * corner[k][i] : 1;
            }
        struct mesh mesh = {
            .vertex_count = 3, .triangle_count = 1, .vertex = vertex, .corner_uv = uv};
        struct world_object object = {
            .spec = &spec, .mesh = &mesh, .bottom = bottom, .offset = offset, .folds = folds};
        for (int i = 0; i < 3; i++)
            object.object_from_world[i][i] = 1;
        double crossed = 0;
        int exact = 0;
        for (int n = 0; n < 60; n++) {
            double o[3] = {0.6 * uniform(&random) - 0.3, 0.6 * uniform(&random) - 0.3,
                           uniform(&random)};
            double d[3] = {2 * uniform(&random) - 1, 2 * uniform(&random) - 1,
                           2 * uniform(&random) - 1};
            unit3(d);
            struct object_ray ray;
            struct prism_ray prism;
            struct prism_interval intervals[PRISM_INTERVALS_MAX];
            object_ray_init(&object, o, d, &ray);
            int count = prism_meet(&object, 0, &ray, &prism, intervals);
            double length = 0, expected = length_by_steps(&object, o, d);
            for (int k = 0; k < count; k++)
                length += intervals[k].t[1] - intervals[k].t[0];
            /* A part shorter than a step of 1e-3 may be missed by the search in steps. */
            double off = fabs(length - expected);
            if (!(off < 2e-3))
                fail_msg("shape %d, ray %d: %.12g, expected %.12g", kind, n, length, expected);
            exact += off < 1e-9;
            crossed += expected;
        }
        assert_true(crossed > 10);
        assert_true(exact > 55);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_folded),
        cmocka_unit_test(test_inversion),
        cmocka_unit_test(test_intervals_join),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
