/* Built-in shapes against closed forms: topology by Euler's characteristic, area and volume by
 * their order of convergence, normals and orientation by the analytic surface. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "renderer/asset/mesh.h"
#include "tests/unit/mesh_measure.h"

static const double PI = 3.14159265358979323846;

static const struct mesh *make(struct mesh_cache *cache, struct scene_mesh spec) {
    const struct mesh *mesh = NULL;
    struct error err = {0};
    enum status status = mesh_acquire(cache, &spec, true, "/mesh", NULL, &mesh, &err);
    if (status != STATUS_OK)
        fail_msg("%s", err.fault_count ? err.faults[0].message : "no message");
    return mesh;
}

/* What holds for every shape: unit normals on the side that triangles face (those of the vertices
 * where the surface is smooth), neighbours that agree, UVs that turn with the surface. */
static void check_sound(const struct mesh *mesh, bool smooth) {
    assert_int_equal(mesh->diagnosis.non_manifold, 0);
    assert_int_equal(mesh->diagnosis.zero_area, 0);
    assert_false(mesh->diagnosis.normals_made);
    assert_false(mesh->diagnosis.uvs_made);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const double *n = mesh->normal[v];
        assert_true(fabs(n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1) < 1e-14);
        for (int k = 0; k < 3; k++) {
            assert_true(mesh->position[v][k] >= mesh->bounds_min[k]);
            assert_true(mesh->position[v][k] <= mesh->bounds_max[k]);
        }
    }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double n[3];
        measure_area_vector(mesh, t, n);
        const double(*uv)[2] = (const double(*)[2])mesh->corner_uv[t];
        double turn = (uv[1][0] - uv[0][0]) * (uv[2][1] - uv[0][1]) -
                      (uv[2][0] - uv[0][0]) * (uv[1][1] - uv[0][1]);
        assert_true(turn > 0);
        for (int k = 0; k < 3; k++) {
            const double *vertex = mesh->normal[mesh->vertex[t][k]];
            const float *corner = mesh->corner_normal[t][k];
            if (smooth)
                assert_true(n[0] * vertex[0] + n[1] * vertex[1] + n[2] * vertex[2] > 0);
            assert_true(
                n[0] * (double)corner[0] + n[1] * (double)corner[1] + n[2] * (double)corner[2] > 0);
            assert_true(uv[k][0] >= 0 && uv[k][0] <= 1 && uv[k][1] >= 0 && uv[k][1] <= 1);
            uint32_t other = mesh->neighbour[t][k];
            if (other == MESH_NONE)
                continue;
            assert_true(other < mesh->triangle_count && other != t);
            uint32_t a = mesh->vertex[t][k], b = mesh->vertex[t][(k + 1) % 3];
            int back = -1;
            for (int i = 0; i < 3; i++)
                if (mesh->vertex[other][i] == b && mesh->vertex[other][(i + 1) % 3] == a)
                    back = i;
            assert_true(back >= 0);
            assert_int_equal(mesh->neighbour[other][back], t);
        }
    }
}

static void sphere_is_closed_and_converges(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 30);
    double error[3][2];
    for (int k = 0; k < 3; k++) {
        int m = 16 << k;
        const struct mesh *mesh = make(
            cache,
            (struct scene_mesh){.kind = SCENE_MESH_SPHERE, .radius = 1.5, .divisions = {2 * m, m}});
        check_sound(mesh, true);
        assert_int_equal(mesh->vertex_count, 2 * m * (m - 1) + 2);
        assert_int_equal(mesh->triangle_count, 2 * 2 * m * (m - 1));
        assert_int_equal(mesh->diagnosis.open_edges, 0);
        assert_int_equal(measure_euler(mesh), 2);
        for (uint32_t v = 0; v < mesh->vertex_count; v++) {
            const double *p = mesh->position[v], *n = mesh->normal[v];
            double r = sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
            assert_true(fabs(r - 1.5) < 1e-15 * 4);
            for (int c = 0; c < 3; c++)
                assert_true(fabs(n[c] - p[c] / r) < 1e-7); /* corners are fp32 */
        }
        error[k][0] = 1 - measure_area(mesh) / (4 * PI * 1.5 * 1.5);
        error[k][1] = 1 - measure_volume(mesh) / (4 * PI / 3 * 1.5 * 1.5 * 1.5);
        mesh_release(cache, mesh);
    }
    for (int which = 0; which < 2; which++)
        for (int k = 0; k < 2; k++) {
            assert_true(error[k][which] > 0); /* inscribed */
            assert_true(fabs(log2(error[k][which] / error[k + 1][which]) - 2) < 0.02);
        }
    mesh_cache_destroy(cache);
}

static void torus_is_closed_and_converges(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 30);
    double error[2];
    for (int k = 0; k < 2; k++) {
        int n = 48 << k, m = 32 << k;
        const struct mesh *mesh = make(
            cache, (struct scene_mesh){
                       .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {n, m}});
        check_sound(mesh, true);
        assert_int_equal(mesh->vertex_count, n * m);
        assert_int_equal(mesh->diagnosis.open_edges, 0);
        assert_int_equal(measure_euler(mesh), 0);
        error[k] = 1 - measure_volume(mesh) / (2 * PI * PI * 1 * 0.4 * 0.4);
        mesh_release(cache, mesh);
    }
    assert_true(error[0] > 0 && fabs(log2(error[0] / error[1]) - 2) < 0.02);
    mesh_cache_destroy(cache);
}

static void cylinder_is_an_open_tube(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 30);
    const struct mesh *mesh = make(
        cache, (struct scene_mesh){
                   .kind = SCENE_MESH_CYLINDER, .radius = 2, .height = 3, .divisions = {30, 4}});
    check_sound(mesh, true);
    assert_int_equal(mesh->diagnosis.open_edges, 2 * 30);
    assert_int_equal(measure_euler(mesh), 0);
    assert_true(mesh->bounds_min[2] == -1.5 && mesh->bounds_max[2] == 1.5);
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        assert_true(mesh->normal[v][2] == 0);
        assert_true(fabs(mesh->normal[v][0] - mesh->position[v][0] / 2) < 1e-7);
    }
    mesh_cache_destroy(cache);
}

static void plane_faces_up(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 30);
    const struct mesh *mesh = make(
        cache, (struct scene_mesh){.kind = SCENE_MESH_PLANE, .size = {4, 2}, .divisions = {8, 3}});
    check_sound(mesh, true);
    assert_int_equal(mesh->triangle_count, 48);
    assert_int_equal(mesh->diagnosis.open_edges, 22);
    assert_int_equal(measure_euler(mesh), 1);
    assert_true(fabs(measure_area(mesh) - 8) < 1e-14);
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        assert_true(mesh->normal[v][2] == 1 && mesh->position[v][2] == 0);
    mesh_cache_destroy(cache);
}

static void terrain_is_seeded_and_within_its_height(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 30);
    struct scene_mesh spec = {.kind = SCENE_MESH_TERRAIN,
                              .size = {4, 2},
                              .height = 0.7,
                              .seed = 7,
                              .divisions = {128, 64}};
    const struct mesh *mesh = make(cache, spec);
    check_sound(mesh, true);
    assert_int_equal(measure_euler(mesh), 1);
    assert_true(mesh->bounds_min[2] >= 0 && mesh->bounds_max[2] <= 0.7);
    assert_true(mesh->bounds_max[2] - mesh->bounds_min[2] > 0.35);

    struct mesh_cache *other_cache = mesh_cache_create(1 << 30);
    const struct mesh *again = make(other_cache, spec);
    assert_memory_equal(mesh->position, again->position,
                        mesh->vertex_count * sizeof *mesh->position);
    spec.seed = 8;
    const struct mesh *other = make(cache, spec);
    int differ = 0;
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        differ += mesh->position[v][2] != other->position[v][2];
    assert_true(differ > (int)mesh->vertex_count * 9 / 10);
    mesh_cache_destroy(cache);
    mesh_cache_destroy(other_cache);
}

static void teapot_welds_between_patches(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 30);
    int n = 16, m = 12; /* fewer, and the lip of the spout turns too fast for its triangles */
    const struct mesh *mesh =
        make(cache, (struct scene_mesh){.kind = SCENE_MESH_TEAPOT, .divisions = {n, m}});
    assert_int_equal(mesh->diagnosis.non_manifold, 0);
    assert_int_equal(mesh->diagnosis.zero_area, 0);
    /* Borders: inside of the rim, outside of the lid (4 patches each), both ends of handle and
     * spout (2 patches each). */
    assert_int_equal(mesh->diagnosis.open_edges, 2 * 4 * n + 4 * 2 * n);
    /* Not smooth: the handle's lower end touches the body in one vertex. */
    check_sound(mesh, false);
    assert_true(fabs(mesh->bounds_min[2]) < 1e-12 && fabs(mesh->bounds_max[2] - 1.575) < 1e-12);
    mesh_cache_destroy(cache);
}

static void seams_weld_with_any_divisions(void **state) {
    (void)state;
    struct mesh_cache *cache = mesh_cache_create(1 << 20);
    for (int n = 3; n < 40; n++) {
        const struct mesh *sphere =
            make(cache, (struct scene_mesh){
                            .kind = SCENE_MESH_SPHERE, .radius = 0.1, .divisions = {n, 2 + n % 7}});
        assert_int_equal(sphere->diagnosis.open_edges, 0);
        assert_int_equal(measure_euler(sphere), 2);
        mesh_release(cache, sphere);
        const struct mesh *torus = make(cache, (struct scene_mesh){.kind = SCENE_MESH_TORUS,
                                                                   .radius = 0.7,
                                                                   .tube = 0.3,
                                                                   .divisions = {n, 3 + n % 11}});
        assert_int_equal(torus->diagnosis.open_edges, 0);
        assert_int_equal(measure_euler(torus), 0);
        mesh_release(cache, torus);
    }
    mesh_cache_destroy(cache);
}

static void refuse(struct scene_mesh spec, enum status expected, const char *pointer) {
    struct mesh_cache *cache = mesh_cache_create(1 << 20);
    const struct mesh *mesh = NULL;
    struct error err = {0};
    assert_int_equal(mesh_acquire(cache, &spec, true, "/mesh", NULL, &mesh, &err), expected);
    assert_null(mesh);
    assert_int_equal(err.fault_count, 1);
    assert_string_equal(err.faults[0].pointer, pointer);
    error_clear(&err);
    mesh_cache_destroy(cache);
}

static void impossible_divisions_are_refused(void **state) {
    (void)state;
    struct scene_mesh sphere = {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {2, 8}};
    refuse(sphere, STATUS_INVALID_SCENE, "/mesh/divisions/0");
    sphere.divisions[0] = 100000, sphere.divisions[1] = 100000;
    refuse(sphere, STATUS_TOO_COMPLEX, "/mesh/divisions");
    refuse((struct scene_mesh){.kind = SCENE_MESH_TEAPOT, .divisions = {INT32_MAX, INT32_MAX}},
           STATUS_TOO_COMPLEX, "/mesh/divisions");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sphere_is_closed_and_converges),
        cmocka_unit_test(torus_is_closed_and_converges),
        cmocka_unit_test(cylinder_is_an_open_tube),
        cmocka_unit_test(plane_faces_up),
        cmocka_unit_test(terrain_is_seeded_and_within_its_height),
        cmocka_unit_test(teapot_welds_between_patches),
        cmocka_unit_test(seams_weld_with_any_divisions),
        cmocka_unit_test(impossible_divisions_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
