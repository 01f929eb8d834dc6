/* Of the samples of a picture those on whose rays an order is wrong are found, all and no others,
 * and each has its ray's own. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shell/ray_order.h"
#include "tests/unit/campfire.h"
#include "tests/unit/ray_fixture.h"

enum { MET_MAX = 512 };

struct met {
    double begin, end;
    uint32_t tetra;
};

static int nearer_last(const void *a, const void *b) {
    double p = ((const struct met *)a)->begin + ((const struct met *)a)->end;
    double q = ((const struct met *)b)->begin + ((const struct met *)b)->end;
    return (p < q) - (p > q);
}

/* What a sample's ray meets, farthest first, from the cells' planes. */
static int meet_all(const struct shell *shell, const struct view *view, int x, int y,
                    struct met met[MET_MAX]) {
    double o[3], d[3];
    ray_at(view, x, y, o, d);
    int count = 0;
    for (uint32_t t = 0; t < shell->tetra_count; t++)
        if (meet(shell, t, o, d, &met[count].begin, &met[count].end)) {
            met[count].tetra = t;
            assert_true(++count < MET_MAX);
        }
    qsort(met, (size_t)count, sizeof *met, nearer_last);
    return count;
}

/* Compares with what every sample's ray meets. Returns how many samples are ordered anew. */
static int check(const struct shell *shell, const struct projection *projection,
                 const struct sort_result *sorted, const struct ray_orders *orders) {
    const struct view *view = &projection->view;
    size_t samples = (size_t)view->width * (size_t)view->height;
    const struct ray_rectangle **of = calloc(samples, sizeof *of);
    uint32_t *rank = malloc((shell->tetra_count + (size_t)1) * sizeof *rank);
    uint64_t total = 0;
    assert_true(of && rank);
    for (uint64_t i = 0; i < sorted->count; i++)
        rank[(uint32_t)sorted->order[i]] = (uint32_t)i;
    for (size_t r = 0; r < orders->rectangle_count; r++) {
        const struct ray_rectangle *one = &orders->rectangle[r];
        assert_true(one->x1 <= (uint32_t)view->width && one->y1 <= (uint32_t)view->height);
        for (uint32_t y = one->y0; y < one->y1; y++)
            for (uint32_t x = one->x0; x < one->x1; x++, total++) {
                size_t at = y * (size_t)view->width + x;
                assert_null(of[at]); /* apart from one another */
                of[at] = one;
            }
    }
    assert_int_equal(total, orders->samples);
    int found = 0;
    struct met met[MET_MAX];
    for (int y = 0; y < view->height; y++)
        for (int x = 0; x < view->width; x++) {
            int count = meet_all(shell, view, x, y, met);
            bool wrong = false, thin = false;
            for (int i = 1; i < count; i++) {
                wrong |= rank[met[i - 1].tetra] > rank[met[i].tetra];
                /* What rounding decides is not asked. */
                thin |=
                    met[i].end - met[i].begin < 1e-9 || met[i - 1].end - met[i - 1].begin < 1e-9;
            }
            if (thin)
                continue;
            const struct ray_rectangle *one = of[(size_t)y * (size_t)view->width + (size_t)x];
            assert_int_equal(wrong, one != NULL);
            if (!one)
                continue;
            found++;
            assert_int_equal(one->count, count);
            for (int i = 0; i < count; i++)
                assert_int_equal(orders->cell[one->first + (uint64_t)i], met[i].tetra);
        }
    free(of);
    free(rank);
    return found;
}

static void test_campfire(void **state) {
    (void)state;
    struct campfire campfire;
    build_campfire(&campfire);
    struct ray_orders orders = {0};
    for (int orthographic = 0; orthographic < 2; orthographic++) {
        struct projection projection;
        const double eye[3] = {0.001, 0, 6};
        look_at(&campfire.shell, eye, orthographic, 128, &projection);
        struct sort_shell one = {&campfire.shell, &projection};
        struct sort_result sorted;
        struct error err = {0};
        assert_int_equal(sort_tetrahedra(&one, 1, NULL, &sorted, &err), STATUS_OK);
        assert_int_equal(sorted.cycles, 1);
        assert_int_equal(ray_orders_find(&one, 1, &sorted, &orders, &err), STATUS_OK);
        assert_int_equal(orders.left_over, 0);
        int found = check(&campfire.shell, &projection, &sorted, &orders);
        /* One of the three crossings, and no more. */
        assert_true(found > 10 && found < 128 * 128 / 50);
        /* As wide and as high as they can be. */
        assert_true(orders.rectangle_count < (size_t)found / 2);
        sort_result_finish(&sorted);
        projection_finish(&projection);
    }
    ray_orders_finish(&orders);
}

/* A whole shell as one cycle whose order is wrong nearly everywhere: seen from outside, from within
 * the shell, and by parallel rays. */
static void test_wrong_order(void **state) {
    (void)state;
    struct mesh_cache *meshes = mesh_cache_create(1 << 24);
    struct scene_mesh spec = {
        .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {10, 6}};
    const struct mesh *mesh;
    struct shell *shell;
    struct error err = {0};
    struct ray_orders orders = {0};
    assert_int_equal(mesh_acquire(meshes, &spec, false, "", NULL, &mesh, &err), STATUS_OK);
    assert_int_equal(shell_build(mesh, 0.15, (const double[2]){1, 1}, "", &shell, &err), STATUS_OK);
    static const double eyes[][3] = {{0, -3, 2.2}, {1.46, 0.02, 0.1}};
    for (int e = 0; e < 2; e++)
        for (int orthographic = 0; orthographic < 2; orthographic++) {
            struct projection projection;
            struct sort_result sorted;
            look_at(shell, eyes[e], orthographic, 48, &projection);
            struct sort_shell one = {shell, &projection};
            assert_int_equal(sort_tetrahedra(&one, 1, NULL, &sorted, &err), STATUS_OK);
            assert_int_equal(ray_orders_find(&one, 1, &sorted, &orders, &err), STATUS_OK);
            assert_int_equal(orders.rectangle_count + orders.cell_count, 0); /* nothing is done */
            struct sort_cycle all = {0, sorted.count};
            for (uint64_t i = 0; i < sorted.count / 2; i++) {
                uint64_t swap = sorted.order[i];
                sorted.order[i] = sorted.order[sorted.count - 1 - i];
                sorted.order[sorted.count - 1 - i] = swap;
            }
            sorted.cycle = &all;
            sorted.cycles = 1;
            assert_int_equal(ray_orders_find(&one, 1, &sorted, &orders, &err), STATUS_OK);
            assert_true(check(shell, &projection, &sorted, &orders) > 200);
            sorted.cycle = NULL;
            sort_result_finish(&sorted);
            projection_finish(&projection);
        }
    ray_orders_finish(&orders);
    shell_destroy(shell);
    mesh_release(meshes, mesh);
    mesh_cache_destroy(meshes);
}

/* More than can be drawn sample by sample: the rest is counted. */
static void test_too_many(void **state) {
    (void)state;
    enum { CELLS = 1800 };
    static double position[4 * CELLS][3];
    static uint32_t tetra[CELLS][4], neighbour[CELLS][4];
    memset(neighbour, 0xff, sizeof neighbour);
    uint64_t order[CELLS];
    /* A stack of flat cells, each turned a little, so that no two rays meet the same ones. */
    for (uint32_t t = 0; t < CELLS; t++) {
        double a = t * 0.01, z = t * 1.0 / CELLS;
        for (uint32_t v = 0; v < 4; v++) {
            tetra[t][v] = 4 * t + v;
            position[4 * t + v][0] = v < 3 ? cos(a + v * 2 * M_PI / 3) : 0;
            position[4 * t + v][1] = v < 3 ? sin(a + v * 2 * M_PI / 3) : 0;
            position[4 * t + v][2] = v < 3 ? z : z + 0.5 / CELLS;
        }
        order[t] = CELLS - 1 - t;
    }
    struct shell shell = {.vertex_count = 4 * CELLS,
                          .tetra_count = CELLS,
                          .position = position,
                          .tetra = tetra,
                          .neighbour = neighbour,
                          .bounds_min = {-1, -1, -1},
                          .bounds_max = {1, 1, 1}};
    struct projection projection;
    look_at(&shell, (const double[3]){0.3, 0.1, 5}, false, 160, &projection);
    struct sort_cycle all = {0, CELLS};
    struct sort_result sorted = {.order = order, .count = CELLS, .cycle = &all, .cycles = 1};
    struct sort_shell one = {&shell, &projection};
    struct ray_orders orders = {0};
    struct error err = {0};
    assert_int_equal(ray_orders_find(&one, 1, &sorted, &orders, &err), STATUS_OK);
    assert_true(orders.left_over > 0 && orders.samples > 0);
    assert_true(orders.cell_count <= RAY_ORDER_CELLS_MAX);
    ray_orders_finish(&orders);
    projection_finish(&projection);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_campfire),
        cmocka_unit_test(test_wrong_order),
        cmocka_unit_test(test_too_many),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
