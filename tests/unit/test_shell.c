/* Shells: volumes, adjacency, shared diagonals, diagnosis. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shell/prism_map.h"
#include "renderer/shell/shell.h"
#include "tests/unit/ray_fixture.h"

static const double tiles[2] = {12, 6};

static struct shell *build(struct mesh_cache *cache, const struct scene_mesh *spec,
                           double thickness, const struct mesh **mesh) {
    struct error err = {0};
    struct shell *shell = NULL;
    assert_int_equal(mesh_acquire(cache, spec, false, "", NULL, mesh, &err), STATUS_OK);
    assert_int_equal(shell_build(*mesh, thickness, tiles, "", &shell, &err), STATUS_OK);
    return shell;
}

static double volume(const struct shell *shell, uint32_t t) {
    double e[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            e[k][i] =
                shell->position[shell->tetra[t][k + 1]][i] - shell->position[shell->tetra[t][0]][i];
    return (e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
            e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
            e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0])) /
           6;
}

static int compare(const void *a, const void *b) {
    uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

static void face_of(const struct shell *shell, uint32_t t, int k, uint32_t face[3]) {
    for (int v = 0; v < 3; v++)
        face[v] = shell->tetra[t][(k + 1 + v) & 3];
    qsort(face, 3, sizeof *face, compare);
}

/* Linked faces hold the same three vertices and point back; on a closed mesh only bottoms and tops
 * are left open; no two unlinked faces are the same triangle. */
static void test_links(void **state) {
    (void)state;
    static const struct scene_mesh specs[] = {
        {.kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {17, 9}},
        {.kind = SCENE_MESH_SPHERE, .radius = 2, .divisions = {13, 7}},
    };
    struct mesh_cache *cache = mesh_cache_create(1 << 24);
    for (int s = 0; s < 2; s++) {
        const struct mesh *mesh;
        struct shell *shell = build(cache, &specs[s], 0.1, &mesh);
        assert_int_equal(mesh->diagnosis.open_edges, 0);
        uint32_t open = 0;
        for (uint32_t t = 0; t < shell->tetra_count; t++)
            for (int k = 0; k < 4; k++) {
                uint32_t other = shell->neighbour[t][k], here[3], there[3];
                face_of(shell, t, k, here);
                if (other == SHELL_NONE) {
                    open++;
                    bool bottom = here[2] < mesh->vertex_count, top = here[0] >= mesh->vertex_count;
                    assert_true(bottom || top);
                    continue;
                }
                int back = 0;
                for (int m = 0; m < 4; m++)
                    if (shell->neighbour[other][m] == t) {
                        face_of(shell, other, m, there);
                        back += memcmp(here, there, sizeof here) == 0;
                    }
                assert_int_equal(back, 1);
            }
        assert_int_equal(open, 2 * mesh->triangle_count);
        shell_destroy(shell);
        mesh_release(cache, mesh);
    }
    mesh_cache_destroy(cache);
}

/* Neighbours on opposite sides of each shared face, so volumes add up without overlap: over a plane
 * exactly, over a sphere to the second order of its divisions. */
static void test_volumes(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 24);
    const struct mesh *mesh;
    struct scene_mesh plane = {.kind = SCENE_MESH_PLANE, .size = {3, 2}, .divisions = {5, 4}};
    struct shell *shell = build(cache, &plane, 0.25, &mesh);
    double total = 0;
    for (uint32_t t = 0; t < shell->tetra_count; t++)
        total += fabs(volume(shell, t));
    assert_true(fabs(total - 3 * 2 * 0.25) < 1e-12);
    shell_destroy(shell);
    mesh_release(cache, mesh);

    double error[2];
    for (int round = 0; round < 2; round++) {
        struct scene_mesh sphere = {
            .kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {40 << round, 20 << round}};
        shell = build(cache, &sphere, 0.2, &mesh);
        total = 0;
        for (uint32_t t = 0; t < shell->tetra_count; t++)
            total += fabs(volume(shell, t));
        error[round] = fabs(total - 4 * M_PI / 3 * (1.2 * 1.2 * 1.2 - 1));
        shell_destroy(shell);
        mesh_release(cache, mesh);
    }
    assert_true(error[0] / error[1] > 3.5 && error[0] / error[1] < 4.5);
    mesh_cache_destroy(cache);
}

/* Where a normal points below its triangles, or a cell has no volume, cells overlap or are flat: a
 * ray that leaves a cell through a face enters the one that is linked there, at the same place, and
 * no other. */
static void test_cut_links(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 24);
    static const struct scene_mesh spec = {
        .kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {16, 8}};
    const struct mesh *mesh;
    struct error err = {0};
    assert_int_equal(mesh_acquire(cache, &spec, false, "", NULL, &mesh, &err), STATUS_OK);
    struct mesh bent = *mesh;
    bent.normal = malloc(bent.vertex_count * sizeof *bent.normal);
    assert_non_null(bent.normal);
    memcpy(bent.normal, mesh->normal, bent.vertex_count * sizeof *bent.normal);
    const uint32_t lower = bent.vertex_count / 2, flat = lower + 5;
    for (int i = 0; i < 3; i++) {
        bent.normal[lower][i] *= -1;
        bent.normal[flat][i] = 0; /* prisms of no height there */
    }
    struct shell *shell = NULL;
    assert_int_equal(shell_build(&bent, 0.3, tiles, "", &shell, &err), STATUS_OK);
    assert_true(shell->diagnosis.inverted > 0 && shell->diagnosis.flat > 0);
    /* The table for the shaders tells which prisms' cells are turned differently. */
    float(*map)[MAP_TEXELS][4] = malloc(shell->tetra_count * sizeof *map);
    assert_non_null(map);
    prism_map_fill(shell, map);
    float(*side)[SIDE_TEXELS][4] = malloc(mesh->triangle_count * sizeof *side);
    assert_non_null(side);
    prism_sides_fill(shell, side);
    int torn = 0;
    for (uint32_t f = 0; f < mesh->triangle_count; f++) {
        double least = INFINITY, most = -INFINITY, smallest = INFINITY;
        for (uint32_t t = 3 * f; t < 3 * f + 3; t++) {
            /* T1 has its corners the other way around. */
            double signed_volume = volume(shell, t) * (t % 3 == 1 ? -1 : 1);
            least = fmin(least, signed_volume);
            most = fmax(most, signed_volume);
            smallest = fmin(smallest, fabs(signed_volume));
        }
        if (smallest < 1e-12) /* rounding decides */
            continue;
        bool expected = least < 0 && most > 0;
        for (uint32_t t = 3 * f; t < 3 * f + 3; t++)
            assert_true(map[t][4][3] < 0 ? expected : !expected);
        assert_true((side[f][SIDE_OFFSETS][3] == 0) == expected);
        torn += expected;
    }
    assert_true(torn > 0 && torn < 20);
    free(map);
    free(side);
    struct projection projection;
    look_at(shell, (const double[3]){0.4, -3, 1.1}, false, 96, &projection);
    int crossed = 0, left = 0;
    for (int y = 0; y < 96; y++)
        for (int x = 0; x < 96; x++) {
            double o[3], d[3], in, out;
            ray_at(&projection.view, x, y, o, d);
            for (uint32_t t = 0; t < shell->tetra_count; t++) {
                if (!meet(shell, t, o, d, &in, &out) || out - in < 1e-9)
                    continue;
                int ways = 0;
                for (int k = 0; k < 4; k++) {
                    uint32_t other = shell->neighbour[t][k];
                    double from, to;
                    if (other == SHELL_NONE || !meet(shell, other, o, d, &from, &to) ||
                        to - from < 1e-9)
                        continue;
                    assert_true(from > out - 1e-9 || to < in + 1e-9);
                    ways += fabs(from - out) < 1e-9;
                }
                assert_true(ways <= 1);
                crossed += ways;
                left += !ways;
            }
        }
    assert_true(crossed > 1000 && left > 1000);
    projection_finish(&projection);
    shell_destroy(shell);
    free(bent.normal);
    mesh_release(cache, mesh);
    mesh_cache_destroy(cache);
}

/* The record for the shaders says what the shell says. */
static void test_cells(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 24);
    const struct mesh *mesh;
    struct scene_mesh spec = {
        .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {12, 8}};
    struct shell *shell = build(cache, &spec, 0.1, &mesh);
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        float(*c)[4] = shell->cell[t];
        for (int v = 0; v < 4; v++)
            for (int i = 0; i < 3; i++)
                assert_true(c[v][i] == (float)shell->position[shell->tetra[t][v]][i]);
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                assert_true(fabs((double)c[4 + k][i] - (shell->position[shell->tetra[t][k + 1]][i] -
                                                        shell->position[shell->tetra[t][0]][i])) <
                            1e-7);
        /* w of each vertex: 0 below, 1 above; the first is always below. */
        assert_true(shell->tetra[t][0] < mesh->vertex_count);
        const float w[3] = {c[4][3], c[7][0], c[7][3]};
        for (int k = 0; k < 3; k++)
            assert_true(w[k] == (shell->tetra[t][k + 1] >= mesh->vertex_count));
        /* The first tile of the periodic texture. */
        assert_true(c[0][3] >= 0 && c[0][3] < 2 && c[1][3] >= 0 && c[1][3] < 2);
    }
    shell_destroy(shell);
    mesh_release(cache, mesh);
    mesh_cache_destroy(cache);
}

/* Prisms whose tetrahedra are not all of one sense: those overlap. */
static uint32_t turned(const struct shell *shell, const struct mesh *mesh) {
    uint32_t count = 0;
    for (uint32_t f = 0; f < mesh->triangle_count; f++) {
        double v[3] = {volume(shell, 3 * f), volume(shell, 3 * f + 1), volume(shell, 3 * f + 2)};
        count += !(v[0] * v[1] < 0 && v[1] * v[2] < 0); /* the cut alternates their sense */
    }
    return count;
}

/* In the hole of a torus the normals meet the axis at radius - tube = 0.6. Thicker shells fold, and
 * are thinned there and nowhere else. */
static void test_folds(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 24);
    const struct mesh *mesh;
    struct scene_mesh spec = {
        .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {64, 32}};
    struct shell *thin = build(cache, &spec, 0.5, &mesh);
    assert_int_equal(thin->diagnosis.folded, 0);
    assert_int_equal(thin->diagnosis.limited, 0);
    assert_int_equal(turned(thin, mesh), 0);
    shell_destroy(thin);
    mesh_release(cache, mesh);

    struct shell *thick = build(cache, &spec, 0.75, &mesh);
    assert_true(thick->diagnosis.folded > 0);
    assert_int_equal(thick->diagnosis.inverted, 0);
    assert_int_equal(turned(thick, mesh), 0);
    assert_true(thick->diagnosis.least < 0.65 && thick->diagnosis.least > 0.3);
    assert_true(thick->diagnosis.limited < mesh->vertex_count / 2);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        double height2 = 0;
        for (int i = 0; i < 3; i++) {
            double d = thick->position[mesh->vertex_count + v][i] - thick->position[v][i];
            height2 += d * d;
        }
        if (hypot(mesh->position[v][0], mesh->position[v][1]) > 1)
            assert_true(fabs(sqrt(height2) - 0.75) < 1e-9);
    }
    struct report report = {0};
    shell_warn(thick, "/objects/0/shell/mesh", &report);
    assert_int_equal(report.warning_count, 1);
    assert_string_equal(report.warnings[0].code, "folded-prisms");
    assert_true(report.warnings[0].count == thick->diagnosis.folded);
    assert_true(report.warnings[0].first == thick->diagnosis.folded_first);
    shell_destroy(thick);
    mesh_release(cache, mesh);
    mesh_cache_destroy(cache);
}

/* The second request for the same shell builds nothing, another thickness does, and what nobody
 * holds goes when the memory is wanted. */
static void test_cache(void **state) {
    (void)state;
    struct mesh_cache *meshes = mesh_cache_create(1 << 24);
    struct shell_cache *cache = shell_cache_create(1);
    const struct mesh *mesh;
    struct error err = {0};
    struct scene_mesh spec = {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {8, 6}};
    assert_int_equal(mesh_acquire(meshes, &spec, false, "", NULL, &mesh, &err), STATUS_OK);
    const struct shell *a, *b, *c;
    assert_int_equal(shell_acquire(cache, mesh, 0.1, tiles, "", &a, &err), STATUS_OK);
    assert_int_equal(shell_acquire(cache, mesh, 0.1, tiles, "", &b, &err), STATUS_OK);
    assert_int_equal(shell_acquire(cache, mesh, 0.2, tiles, "", &c, &err), STATUS_OK);
    assert_ptr_equal(a, b);
    assert_true(a->serial != c->serial);
    uint64_t serial = a->serial;
    shell_release(cache, a);
    shell_release(cache, b);
    assert_int_equal(shell_acquire(cache, mesh, 0.1, tiles, "", &a, &err), STATUS_OK);
    assert_true(a->serial != serial); /* one byte is kept: it was gone */
    shell_release(cache, a);
    shell_release(cache, c);
    shell_cache_destroy(cache);
    mesh_release(meshes, mesh);
    mesh_cache_destroy(meshes);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_links),   cmocka_unit_test(test_cut_links),
        cmocka_unit_test(test_volumes), cmocka_unit_test(test_cells),
        cmocka_unit_test(test_folds),   cmocka_unit_test(test_cache),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
