/* SXMPVO: along every ray of the picture, whatever is nearer comes later in the order; cycles are
 * found; the A-buffer's samples are the picture's. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shell/abuffer.h"
#include "renderer/shell/overlap.h"
#include "renderer/shell/sort.h"
#include "tests/unit/campfire.h"
#include "tests/unit/ray_fixture.h"

static void check_order(const struct shell *shell, const struct projection *projection,
                        const struct sort_result *sorted) {
    uint32_t *rank = malloc(shell->tetra_count * sizeof *rank);
    assert_int_equal(sorted->count, shell->tetra_count);
    memset(rank, 0xff, shell->tetra_count * sizeof *rank);
    for (uint64_t i = 0; i < sorted->count; i++) {
        uint32_t t = (uint32_t)sorted->order[i];
        assert_true(t < shell->tetra_count && rank[t] == UINT32_MAX); /* each once */
        rank[t] = (uint32_t)i;
    }
    const struct view *view = &projection->view;
    struct met {
        double begin, end;
        uint32_t tetra;
    } met[512];
    int pairs = 0;
    for (int y = 0; y < view->height; y += 3)
        for (int x = 0; x < view->width; x += 3) {
            double o[3], d[3];
            ray_at(view, x, y, o, d);
            int count = 0;
            for (uint32_t t = 0; t < shell->tetra_count; t++)
                if (meet(shell, t, o, d, &met[count].begin, &met[count].end)) {
                    met[count].tetra = t;
                    assert_true(++count < 512);
                }
            for (int a = 0; a < count; a++)
                for (int b = 0; b < count; b++) {
                    /* a wholly before b, by more than rounding: b must be drawn first. */
                    if (!(met[a].end <= met[b].begin + 1e-12 &&
                          met[a].begin < met[b].begin - 1e-12))
                        continue;
                    pairs++;
                    assert_true(rank[met[b].tetra] < rank[met[a].tetra]);
                }
        }
    assert_true(pairs > 1000);
    free(rank);
}

static void test_order(void **state) {
    (void)state;
    static const struct scene_mesh specs[] = {
        {.kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {20, 10}},
        {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {16, 8}},
        {.kind = SCENE_MESH_TERRAIN,
         .size = {2, 2},
         .height = 0.6,
         .seed = 3,
         .divisions = {14, 14}},
    };
    static const double eyes[][3] = {
        {0, -3, 2.2}, {4, 0.3, 0.01}, {0.02, 0.01, 5}, {0.3, -0.9, 0.2}};
    const double tiles[2] = {1, 1};
    struct mesh_cache *meshes = mesh_cache_create(1 << 24);
    struct error err = {0};
    for (int s = 0; s < 3; s++)
        for (int e = 0; e < 4; e++)
            for (int ortho = 0; ortho < 2; ortho++) {
                const struct mesh *mesh;
                struct shell *shell;
                struct projection projection;
                struct sort_result sorted;
                assert_int_equal(mesh_acquire(meshes, &specs[s], false, "", NULL, &mesh, &err),
                                 STATUS_OK);
                assert_int_equal(shell_build(mesh, 0.15, tiles, "", &shell, &err), STATUS_OK);
                look_at(shell, eyes[e], ortho, 64, &projection);
                struct sort_shell one = {shell, &projection};
                assert_int_equal(sort_tetrahedra(&one, 1, NULL, &sorted, &err), STATUS_OK);
                assert_int_equal(sorted.cycles, 0);
                check_order(shell, &projection, &sorted);
                sort_result_finish(&sorted);
                projection_finish(&projection);
                shell_destroy(shell);
                mesh_release(meshes, mesh);
            }
    mesh_cache_destroy(meshes);
}

static void test_cycle(void **state) {
    (void)state;
    struct campfire campfire;
    build_campfire(&campfire);
    struct projection projection;
    const double eye[3] = {0.001, 0, 6};
    look_at(&campfire.shell, eye, true, 128, &projection);
    struct sort_shell one = {&campfire.shell, &projection};
    struct sort_result sorted;
    struct error err = {0};
    assert_int_equal(sort_tetrahedra(&one, 1, NULL, &sorted, &err), STATUS_OK);
    assert_int_equal(sorted.count, 3);
    assert_int_equal(sorted.cycles, 1);
    assert_int_equal(sorted.cycle[0].count, 3);
    sort_result_finish(&sorted);
    projection_finish(&projection);
}

/* Two shells, one wholly before the other, whichever is named first. */
static void test_two_shells(void **state) {
    (void)state;
    struct mesh_cache *meshes = mesh_cache_create(1 << 24);
    struct scene_mesh spec = {.kind = SCENE_MESH_SPHERE, .radius = 0.4, .divisions = {10, 6}};
    const struct mesh *mesh;
    struct shell *shell;
    struct error err = {0};
    const double tiles[2] = {1, 1};
    assert_int_equal(mesh_acquire(meshes, &spec, false, "", NULL, &mesh, &err), STATUS_OK);
    assert_int_equal(shell_build(mesh, 0.1, tiles, "", &shell, &err), STATUS_OK);
    struct projection near, far;
    const double near_eye[3] = {0, -3, 0}, far_eye[3] = {0, -5, 0};
    look_at(shell, near_eye, false, 64, &near);
    look_at(shell, far_eye, false, 64, &far);
    for (int swap = 0; swap < 2; swap++) {
        /* Depths are in units of the distance, so the farther one is put behind by hand. */
        for (uint32_t v = 0; v < shell->vertex_count; v++)
            for (int i = 0; i < 3 && swap == 0; i++)
                far.clip[v][i] *= 5.0 / 3;
        struct sort_shell both[2] = {{shell, swap ? &far : &near}, {shell, swap ? &near : &far}};
        struct sort_result sorted;
        assert_int_equal(sort_tetrahedra(both, 2, NULL, &sorted, &err), STATUS_OK);
        assert_int_equal(sorted.cycles, 0);
        /* Wherever both cover a sample, the far one's boundary cells come first. */
        uint32_t far_shell = swap ? 0 : 1;
        uint64_t last_far = 0, first_near = UINT64_MAX;
        assert_true(sorted.edges > 0);
        for (uint64_t i = 0; i < sorted.count; i++)
            if (sorted.order[i] >> 32 == far_shell)
                last_far = i;
            else if (i < first_near)
                first_near = i;
        /* Cells of the near shell's rim may come early: nothing lies behind them. The last far one
         * still precedes the near cells in the middle of the picture. */
        uint64_t near_after = 0;
        for (uint64_t i = last_far; i < sorted.count; i++)
            near_after += sorted.order[i] >> 32 != far_shell;
        assert_true(near_after > shell->tetra_count / 4);
        sort_result_finish(&sorted);
    }
    projection_finish(&near);
    projection_finish(&far);
    shell_destroy(shell);
    mesh_release(meshes, mesh);
    mesh_cache_destroy(meshes);
}

/* Shells that a ray leaves after a millionth of its length: nothing there is a cycle. */
static void test_thin(void **state) {
    (void)state;
    static const double thickness[] = {1e-5, 1e-6, 1e-7};
    for (size_t i = 0; i < sizeof thickness / sizeof *thickness; i++) {
        struct mesh_cache *meshes = mesh_cache_create(64 << 20);
        struct scene_mesh spec = {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {24, 12}};
        const struct mesh *mesh;
        struct shell *shell;
        struct error err = {0};
        assert_int_equal(mesh_acquire(meshes, &spec, false, "", NULL, &mesh, &err), STATUS_OK);
        assert_int_equal(shell_build(mesh, thickness[i], (const double[2]){1, 1}, "", &shell, &err),
                         STATUS_OK);
        struct projection projection;
        look_at(shell, (const double[3]){0.7, -2.8, 2.1}, false, 96, &projection);
        struct sort_result sorted;
        struct sort_shell one = {shell, &projection};
        assert_int_equal(sort_tetrahedra(&one, 1, NULL, &sorted, &err), STATUS_OK);
        assert_true(sorted.edges > 0);
        assert_int_equal(sorted.cycles, 0);
        sort_result_finish(&sorted);
        projection_finish(&projection);
        shell_destroy(shell);
        mesh_release(meshes, mesh);
        mesh_cache_destroy(meshes);
    }
}

/* Bands of a large A-buffer are read by threads, each of which must begin where those below it end:
 * the same entries as those read sample by sample. */
static void test_bands(void **state) {
    (void)state;
    const struct scene_mesh spec = {
        .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {20, 10}};
    const double tiles[2] = {1, 1}, eye[3] = {0, -3, 2.2};
    struct mesh_cache *meshes = mesh_cache_create(1 << 24);
    struct error err = {0};
    const struct mesh *mesh;
    struct shell *shell;
    assert_int_equal(mesh_acquire(meshes, &spec, false, "", NULL, &mesh, &err), STATUS_OK);
    assert_int_equal(shell_build(mesh, 0.15, tiles, "", &shell, &err), STATUS_OK);
    static const int sides[] = {1, 3, 301};
    for (int i = 0; i < 3; i++) {
        struct projection projection;
        look_at(shell, eye, false, sides[i], &projection);
        size_t samples = (size_t)sides[i] * (size_t)sides[i];
        uint8_t *met = calloc(2 * samples, 1);
        struct entries serial;
        struct overlap overlap;
        struct overlap_shell one = {.shell = shell, .projection = &projection};
        assert_int_equal(entries_find(shell, &projection, met, &serial, &err), STATUS_OK);
        assert_int_equal(overlap_find(&one, 1, met + samples, &overlap, &err), STATUS_OK);
        assert_memory_equal(met, met + samples, samples);
        assert_int_equal(overlap.draw_count, 1);
        const struct entries *banded = &overlap.draw[0].entries;
        assert_true(sides[i] < 9 || serial.first[samples] > samples / 2);
        assert_int_equal(banded->count, serial.count);
        assert_memory_equal(banded->first, serial.first, (samples + 1) * sizeof *serial.first);
        assert_memory_equal(banded->entry, serial.entry, serial.count * sizeof *serial.entry);
        overlap_finish(&overlap);
        entries_finish(&serial);
        free(met);
        projection_finish(&projection);
    }
    shell_destroy(shell);
    mesh_release(meshes, mesh);
    mesh_cache_destroy(meshes);
}

static void test_nothing(void **state) {
    (void)state;
    struct shell shell = {0};
    struct projection projection = {.view = {.width = 4, .height = 4}};
    struct sort_shell one = {&shell, &projection};
    struct sort_result sorted;
    struct error err = {0};
    assert_int_equal(sort_tetrahedra(&one, 1, NULL, &sorted, &err), STATUS_OK);
    assert_int_equal(sorted.count, 0);
    assert_null(sorted.order);
    assert_int_equal(sort_tetrahedra(&one, SORT_SHELLS_MAX + 1, NULL, &sorted, &err),
                     STATUS_TOO_COMPLEX);
    error_clear(&err);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order),      cmocka_unit_test(test_cycle),
        cmocka_unit_test(test_two_shells), cmocka_unit_test(test_thin),
        cmocka_unit_test(test_bands),      cmocka_unit_test(test_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
