/* From soup to mesh: welding, flat triangles and slivers, normals, made UVs, neighbours, at every
 * scale that a scene may have. */
#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/asset/mesh_build.h"
#include "tests/unit/mesh_measure.h"

/* Triangles from indices into points; no normals, no UVs. */
static struct mesh_soup soup_of(const double (*point)[3], const int (*triangle)[3], int count) {
    struct mesh_soup soup;
    assert_true(mesh_soup_init(&soup, (uint64_t)count));
    for (int t = 0; t < count; t++)
        for (int k = 0; k < 3; k++)
            memcpy(soup.position[3 * t + k], point[triangle[t][k]], sizeof *point);
    soup.triangle_count = (uint64_t)count;
    return soup;
}

static struct mesh *build(struct mesh_soup *soup) {
    struct mesh *mesh = NULL;
    struct error err = {0};
    if (mesh_build(soup, "/mesh", &mesh, &err) != STATUS_OK)
        fail_msg("%s", err.faults[0].message);
    mesh_soup_finish(soup);
    return mesh;
}

static const double CUBE[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                  {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
static const int CUBE_TRIANGLES[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                          {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                          {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};

static struct mesh *cube(double scale, double shift) {
    double point[8][3];
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++)
            point[i][k] = CUBE[i][k] * scale + shift;
    struct mesh_soup soup = soup_of((const double(*)[3])point, CUBE_TRIANGLES, 12);
    return build(&soup);
}

static void zeros_of_both_signs_weld(void **state) {
    (void)state;
    const double point[6][3] = {{0, 0, 0},       {1, 0, 0},    {0, 1, 0},
                                {-0.0, 0, -0.0}, {0, 1, -0.0}, {-1, 0, 0}};
    struct mesh_soup soup = soup_of(point, (const int[2][3]){{0, 1, 2}, {3, 4, 5}}, 2);
    struct mesh *mesh = build(&soup);
    assert_int_equal(mesh->vertex_count, 4);
    assert_int_equal(mesh->neighbour[0][2], 1);
    assert_int_equal(mesh->neighbour[1][0], 0);
    for (uint32_t v = 0; v < 4; v++)
        for (int k = 0; k < 3; k++)
            assert_true(mesh->position[v][k] != 0 || !signbit(mesh->position[v][k]));
    mesh_destroy(mesh);
}

static void neighbours_by_a_bit_do_not_weld(void **state) {
    (void)state;
    const double next = nextafter(1, 2);
    const double point[6][3] = {{0, 0, 0}, {1, 0, 0},    {0, 1, 0},
                                {1, 1, 0}, {next, 0, 0}, {0, 0, 1}};
    struct mesh_soup soup = soup_of(point, (const int[2][3]){{0, 1, 2}, {4, 3, 2}}, 2);
    struct mesh *mesh = build(&soup);
    assert_int_equal(mesh->vertex_count, 5);
    assert_int_equal(mesh->diagnosis.open_edges, 6);
    mesh_destroy(mesh);
}

/* Many points, among them all that share low bits: numbering by first appearance, nothing lost. */
static void welding_numbers_by_first_appearance(void **state) {
    (void)state;
    enum { DISTINCT = 5000, COUNT = 3 * DISTINCT };
    double(*point)[3] = calloc(COUNT, sizeof *point);
    uint32_t *id = malloc(COUNT * sizeof *id), *first = malloc(COUNT * sizeof *first), distinct;
    for (int i = 0; i < COUNT; i++) {
        int which = i < DISTINCT ? i : (int)((uint64_t)i * 2654435761u % DISTINCT);
        point[i][0] = ldexp(1, which % 100);
        point[i][1] = which / 100;
    }
    assert_true(mesh_weld((const double(*)[3])point, COUNT, id, first, &distinct));
    assert_int_equal(distinct, DISTINCT);
    for (int i = 0; i < COUNT; i++) {
        assert_int_equal(id[i], i < DISTINCT ? i : (int)((uint64_t)i * 2654435761u % DISTINCT));
        assert_int_equal(first[id[i]], id[i]);
    }
    free(point);
    free(id);
    free(first);
}

static bool flat_at(double scale, double shift, double height) {
    const double a[3] = {shift, shift, shift};
    const double b[3] = {shift + scale, shift, shift};
    const double c[3] = {shift + scale / 2, shift + scale * height, shift};
    return mesh_triangle_is_flat(a, b, c);
}

static void slivers_are_kept_and_flats_are_not(void **state) {
    (void)state;
    static const double scales[] = {1e-30, 1e-9, 1, 1e6, 1e30};
    for (size_t i = 0; i < sizeof scales / sizeof *scales; i++) {
        assert_false(flat_at(scales[i], 0, 1));
        assert_false(flat_at(scales[i], 0, 1e-6));  /* a million to one */
        assert_false(flat_at(scales[i], 0, 1e-12)); /* a million millions to one */
        assert_true(flat_at(scales[i], 0, 0));
        assert_true(flat_at(scales[i], 0, 1e-17));
    }
    /* A million units from the origin, where a coordinate's last place is 1e-10. */
    assert_false(flat_at(1, 1e6, 1e-6));
    assert_true(flat_at(1, 1e6, 1e-10));
    /* In line, but not along an axis: rounding gives it an area of 1e-17. */
    assert_true(mesh_triangle_is_flat((double[3]){0.1, 0.2, 0.3}, (double[3]){0.2, 0.4, 0.6},
                                      (double[3]){0.3, 0.6, 0.9}));
    assert_true(
        mesh_triangle_is_flat((double[3]){1, 2, 3}, (double[3]){1, 2, 3}, (double[3]){4, 5, 6}));
}

static void flats_leave_no_vertices_behind(void **state) {
    (void)state;
    const double point[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {7, 7, 7}, {8, 8, 8}};
    struct mesh_soup soup =
        soup_of(point, (const int[4][3]){{3, 4, 4}, {0, 1, 2}, {0, 3, 0}, {4, 4, 4}}, 4);
    struct mesh *mesh = build(&soup);
    assert_int_equal(mesh->triangle_count, 1);
    assert_int_equal(mesh->vertex_count, 3);
    assert_int_equal(mesh->diagnosis.zero_area, 3);
    assert_int_equal(mesh->diagnosis.zero_area_first, 0);
    assert_true(mesh->bounds_max[0] == 1);
    mesh_destroy(mesh);
}

/* The same mesh at any scale and far away: topology, normals and UVs do not change. */
static void scale_and_place_do_not_matter(void **state) {
    (void)state;
    struct mesh *unit = cube(1, 0);
    static const double scales[] = {1e-30, 1e-6, 1e6, 1e30}, shifts[] = {0, 0, 1e12, 0};
    for (size_t i = 0; i < 4; i++) {
        struct mesh *mesh = cube(scales[i], shifts[i]);
        assert_int_equal(mesh->vertex_count, 8);
        assert_int_equal(mesh->diagnosis.open_edges, 0);
        assert_int_equal(mesh->diagnosis.zero_area, 0);
        assert_memory_equal(mesh->neighbour, unit->neighbour, 12 * sizeof *unit->neighbour);
        for (uint32_t v = 0; v < 8; v++)
            for (int k = 0; k < 3; k++)
                assert_true(fabs(mesh->normal[v][k] - unit->normal[v][k]) < 1e-9);
        for (uint32_t t = 0; t < 12; t++)
            for (int k = 0; k < 3; k++)
                for (int c = 0; c < 2; c++)
                    assert_true(fabs(mesh->corner_uv[t][k][c] - unit->corner_uv[t][k][c]) < 1e-9);
        mesh_destroy(mesh);
    }
    mesh_destroy(unit);
}

/* One unit of UV area over the whole surface, right-handed on all six sides, v up on upright ones.
 */
static void made_uvs_are_a_box_projection(void **state) {
    (void)state;
    struct mesh *mesh = cube(3, -1);
    assert_true(mesh->diagnosis.uvs_made);
    assert_int_equal(mesh->diagnosis.uvs_made_count, 8);
    assert_int_equal(mesh->diagnosis.uvs_made_first, 0);
    double total = 0;
    for (uint32_t t = 0; t < 12; t++) {
        double n[3], (*uv)[2] = mesh->corner_uv[t];
        measure_area_vector(mesh, t, n);
        double turn = (uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) -
                      (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1]);
        assert_true(turn > 0);
        total += turn / 2;
        for (int k = 0; k < 3; k++) {
            const double *p = mesh->position[mesh->vertex[t][k]];
            if (n[2] == 0)
                assert_true(fabs(uv[k][1] - (p[2] + 1) / sqrt(54)) < 1e-15);
        }
    }
    assert_true(fabs(total - 1) < 1e-14);
    mesh_destroy(mesh);
}

/* On a bumpy ball: no triangle's map is stretched by more than 2, and bumps do not tear it to
 * pieces. */
static void made_uvs_stretch_by_two_at_most(void **state) {
    (void)state;
    struct scene_mesh spec = {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {96, 48}};
    struct mesh_soup soup;
    assert_int_equal(mesh_shape_make(&spec, "", &soup, NULL), STATUS_OK);
    for (uint64_t i = 0; i < 3 * soup.triangle_count; i++) {
        double *p = soup.position[i];
        double bump = 1 + 0.02 * sin(31 * p[0]) * sin(37 * p[1] + 1) * sin(29 * p[2] + 2);
        for (int k = 0; k < 3; k++)
            p[k] *= bump;
    }
    memset(soup.has_uv, 0, soup.triangle_count);
    struct mesh *mesh = build(&soup);
    double density = 1 / measure_area(mesh);
    int seams = 0;
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double n[3], (*uv)[2] = mesh->corner_uv[t];
        measure_area_vector(mesh, t, n);
        double turn = (uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) -
                      (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1]);
        double part = turn / 2 / (density * sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]));
        assert_true(part > 0.5 - 1e-9 && part < 1 + 1e-9);
        for (int k = 0; k < 3; k++) {
            uint32_t other = mesh->neighbour[t][k], v = mesh->vertex[t][k];
            for (int i = 0; i < 3; i++)
                if (mesh->vertex[other][i] == v)
                    seams += mesh->corner_uv[other][i][0] != uv[k][0] ||
                             mesh->corner_uv[other][i][1] != uv[k][1];
        }
    }
    /* Corners at seams: 1,054 were found, and 3,724 where each triangle goes by its own normal. */
    assert_true(seams < 1500);
    mesh_destroy(mesh);
}

static void made_normals_weigh_angles(void **state) {
    (void)state;
    struct mesh *mesh = cube(1, 0);
    assert_int_equal(mesh->diagnosis.normals_made_count, 8);
    for (uint32_t v = 0; v < 8; v++)
        for (int k = 0; k < 3; k++)
            assert_true(fabs(fabs(mesh->normal[v][k]) - sqrt(1.0 / 3)) < 1e-15);
    for (uint32_t t = 0; t < 12; t++) /* corners without a normal of their own take the vertex' */
        for (int k = 0; k < 3; k++)
            for (int c = 0; c < 3; c++)
                assert_true(mesh->corner_normal[t][k][c] ==
                            (float)mesh->normal[mesh->vertex[t][k]][c]);
    mesh_destroy(mesh);
}

/* Two triangles back to back: the normals cancel, the first triangle's stands in. */
static void cancelled_normals_fall_back(void **state) {
    (void)state;
    const double point[3][3] = {{0, 0, 0}, {1, 0, 0}, {0.3, 0.9, 0}};
    struct mesh_soup soup = soup_of(point, (const int[2][3]){{0, 1, 2}, {0, 2, 1}}, 2);
    struct mesh *mesh = build(&soup);
    assert_int_equal(mesh->vertex_count, 3);
    assert_int_equal(mesh->diagnosis.non_manifold, 0);
    assert_int_equal(measure_euler(mesh), 2);
    for (uint32_t v = 0; v < 3; v++)
        assert_true(mesh->normal[v][0] == 0 && mesh->normal[v][1] == 0 && mesh->normal[v][2] == 1);
    mesh_destroy(mesh);
}

static void given_normals_are_taken_unless_unusable(void **state) {
    (void)state;
    const double point[5][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {5, 1, 0}};
    struct mesh_soup soup = soup_of(point, (const int[2][3]){{0, 1, 2}, {1, 3, 4}}, 2);
    soup.has_normal[0] = 1;
    static const float given[3][3] = {{0, 3, 4}, {0, 0, 0}, {NAN, 0, 1}};
    memcpy(soup.normal, given, sizeof given);
    struct mesh *mesh = build(&soup);
    assert_true(fabs(mesh->normal[0][1] - 0.6) < 1e-15 && fabs(mesh->normal[0][2] - 0.8) < 1e-15);
    for (uint32_t v = 1; v < 5; v++)
        assert_true(mesh->normal[v][2] == 1);
    assert_int_equal(mesh->diagnosis.normals_made_count, 4);
    assert_int_equal(mesh->diagnosis.normals_made_first, 1);
    assert_true(mesh->corner_normal[0][0][1] == 0.6f && mesh->corner_normal[0][1][2] == 1);
    mesh_destroy(mesh);
}

/* Three triangles on one edge; two that face opposite ways; the same triangle twice. */
static void bad_edges_are_counted_and_left_open(void **state) {
    (void)state;
    const double point[8][3] = {{0, 0, 0},   {0, 0, 1}, {1, 0, 0}, {-1, 1, 0},
                                {-1, -1, 0}, {9, 0, 0}, {9, 1, 0}, {9, 0, 1}};
    struct mesh_soup soup =
        soup_of(point, (const int[4][3]){{5, 6, 7}, {0, 1, 2}, {1, 0, 3}, {0, 1, 4}}, 4);
    struct mesh *mesh = build(&soup);
    assert_int_equal(mesh->diagnosis.non_manifold, 1);
    assert_int_equal(mesh->diagnosis.non_manifold_first, 1);
    assert_int_equal(mesh->diagnosis.open_edges, 3 + 3 * 2);
    for (uint32_t t = 0; t < 4; t++)
        for (int k = 0; k < 3; k++)
            assert_int_equal(mesh->neighbour[t][k], MESH_NONE);
    mesh_destroy(mesh);

    soup = soup_of(point, (const int[2][3]){{0, 1, 2}, {0, 1, 3}}, 2);
    mesh = build(&soup);
    assert_int_equal(mesh->diagnosis.non_manifold, 1);
    assert_int_equal(mesh->neighbour[0][0], MESH_NONE);
    mesh_destroy(mesh);

    soup = soup_of(point, (const int[2][3]){{0, 1, 2}, {1, 2, 0}}, 2);
    mesh = build(&soup);
    assert_int_equal(mesh->diagnosis.non_manifold, 3);
    assert_int_equal(mesh->diagnosis.open_edges, 0);
    mesh_destroy(mesh);
}

/* A strip with a half turn cannot be oriented: exactly one edge does not fit. */
static void a_moebius_strip_has_one_bad_edge(void **state) {
    (void)state;
    enum { N = 24 };
    double point[2 * N][3];
    int triangle[2 * N][3];
    for (int i = 0; i < N; i++)
        for (int side = 0; side < 2; side++) {
            double a = 2 * 3.14159265358979323846 * i / N, w = side ? 0.3 : -0.3;
            double r = 1 + w * cos(a / 2);
            double *p = point[2 * i + side];
            p[0] = r * cos(a), p[1] = r * sin(a), p[2] = w * sin(a / 2);
        }
    for (int i = 0; i < N; i++) {
        int a = 2 * i, b = a + 1, flip = i == N - 1;
        int c = 2 * ((i + 1) % N) + flip, d = 2 * ((i + 1) % N) + !flip;
        memcpy(triangle[2 * i], (int[3]){a, c, d}, sizeof *triangle);
        memcpy(triangle[2 * i + 1], (int[3]){a, d, b}, sizeof *triangle);
    }
    struct mesh_soup soup = soup_of((const double(*)[3])point, (const int(*)[3])triangle, 2 * N);
    struct mesh *mesh = build(&soup);
    assert_int_equal(mesh->vertex_count, 2 * N);
    assert_int_equal(mesh->diagnosis.non_manifold, 1);
    assert_int_equal(mesh->diagnosis.open_edges, 2 * N);
    mesh_destroy(mesh);
}

/* A fan of many triangles about one point: no step may be quadratic in a vertex' triangles. Only
 * the test's own limit of 300 s would notice, at 10^10 steps. */
static void a_large_fan_is_built(void **state) {
    (void)state;
    enum { N = 200000 };
    struct mesh_soup soup;
    assert_true(mesh_soup_init(&soup, N));
    for (int t = 0; t < N; t++)
        for (int k = 1; k < 3; k++)
            mesh_circle_point(t + k - 1, N, &soup.position[3 * t + k][0],
                              &soup.position[3 * t + k][1]);
    soup.triangle_count = N;
    struct mesh *mesh = build(&soup);
    assert_int_equal(mesh->vertex_count, N + 1);
    assert_int_equal(mesh->diagnosis.open_edges, N);
    assert_int_equal(measure_euler(mesh), 1);
    mesh_destroy(mesh);
}

static void empty_and_oversized_soups_are_refused(void **state) {
    (void)state;
    struct mesh_soup soup;
    struct mesh *mesh;
    struct error err = {0};
    assert_true(mesh_soup_init(&soup, 0));
    assert_int_equal(mesh_build(&soup, "/a", &mesh, &err), STATUS_BAD_ASSET);
    soup.triangle_count = MESH_TRIANGLES_MAX + 1ull; /* refused before any is looked at */
    assert_int_equal(mesh_build(&soup, "/b", &mesh, &err), STATUS_TOO_COMPLEX);
    assert_null(mesh);
    assert_int_equal(err.fault_count, 2);
    error_clear(&err);
    mesh_soup_finish(&soup);
    assert_false(mesh_soup_init(&soup, UINT64_MAX / 4));
    assert_null(soup.position);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(zeros_of_both_signs_weld),
        cmocka_unit_test(neighbours_by_a_bit_do_not_weld),
        cmocka_unit_test(welding_numbers_by_first_appearance),
        cmocka_unit_test(slivers_are_kept_and_flats_are_not),
        cmocka_unit_test(flats_leave_no_vertices_behind),
        cmocka_unit_test(scale_and_place_do_not_matter),
        cmocka_unit_test(made_uvs_are_a_box_projection),
        cmocka_unit_test(made_uvs_stretch_by_two_at_most),
        cmocka_unit_test(made_normals_weigh_angles),
        cmocka_unit_test(cancelled_normals_fall_back),
        cmocka_unit_test(given_normals_are_taken_unless_unusable),
        cmocka_unit_test(bad_edges_are_counted_and_left_open),
        cmocka_unit_test(a_moebius_strip_has_one_bad_edge),
        cmocka_unit_test(a_large_fan_is_built),
        cmocka_unit_test(empty_and_oversized_soups_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
