/* What a view makes of a shell where it stands on its cells, and where fp32 would lose them. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shell/entries.h"
#include "renderer/shell/precision.h"

static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/* A shell over a built-in shape as a camera sees it. */
struct scene_of_one {
    struct mesh_cache *meshes;
    const struct mesh *mesh;
    struct shell *shell;
    struct view world;
    struct projection projection;
};

static void scene_open(struct scene_of_one *scene, struct scene_mesh spec, double thickness) {
    memset(scene, 0, sizeof *scene);
    struct error err = {0};
    const double tiles[2] = {1, 1};
    scene->meshes = mesh_cache_create(1 << 26);
    assert_int_equal(mesh_acquire(scene->meshes, &spec, false, "", NULL, &scene->mesh, &err),
                     STATUS_OK);
    assert_int_equal(shell_build(scene->mesh, thickness, tiles, "", &scene->shell, &err),
                     STATUS_OK);
}

static void scene_look(struct scene_of_one *scene, const struct scene_camera *camera, int side) {
    struct scene_image image = {.width = side, .height = side, .samples = 1};
    struct error err = {0};
    struct view view;
    projection_finish(&scene->projection);
    view_from_camera(camera, &image, scene->shell->bounds_min, scene->shell->bounds_max, 1,
                     &scene->world);
    view_in_object(&scene->world, identity, scene->shell->center, &view);
    assert_int_equal(project_shell(scene->shell, &view, &scene->projection, &err), STATUS_OK);
}

static void scene_close(struct scene_of_one *scene) {
    projection_finish(&scene->projection);
    shell_destroy(scene->shell);
    mesh_release(scene->meshes, scene->mesh);
    mesh_cache_destroy(scene->meshes);
}

/* The least barycentric coordinate of a point: positive inside. */
static double inside(const struct shell *shell, uint32_t t, const double p[3]) {
    double least = INFINITY, whole = 0, part[4];
    for (int k = -1; k < 4; k++) {
        const double *v[4];
        for (int i = 0; i < 4; i++)
            v[i] = i == k ? p : shell->position[shell->tetra[t][i]];
        double a[3], b[3], c[3];
        for (int i = 0; i < 3; i++) {
            a[i] = v[1][i] - v[0][i];
            b[i] = v[2][i] - v[0][i];
            c[i] = v[3][i] - v[0][i];
        }
        double det = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                     a[2] * (b[0] * c[1] - b[1] * c[0]);
        if (k < 0)
            whole = det;
        else
            part[k] = det / whole;
    }
    for (int k = 0; k < 4; k++)
        least = fmin(least, part[k]);
    return least;
}

/* Every ray from an eye on a vertex of the shell that heads into it begins in the cell that it
 * heads into, whichever of the dozens around the vertex that is. */
static void test_eye_on_a_vertex(void **state) {
    (void)state;
    struct scene_of_one scene;
    scene_open(&scene,
               (struct scene_mesh){.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {24, 12}},
               0.2);
    uint32_t bottoms = scene.shell->vertex_count / 2, begun = 0;
    const uint32_t vertices[] = {0, bottoms / 3, bottoms - 1, bottoms + bottoms / 3};
    static const double targets[][3] = {{3, 1, 0.4}, {-2, 0.3, 1}, {0.3, -3, -0.2}};
    for (size_t k = 0; k < 4; k++)
        for (size_t g = 0; g < 3; g++) {
            struct scene_camera camera = {.given = true, .fov_y_deg = 100, .up = {0.1, 0.2, 1}};
            const double *eye = scene.shell->position[vertices[k]];
            for (int i = 0; i < 3; i++) {
                camera.eye[i] = eye[i] + scene.shell->center[i];
                camera.target[i] = targets[g][i];
            }
            scene_look(&scene, &camera, 24);
            const struct view *view = &scene.projection.view;
            struct entries entries;
            struct error err = {0};
            assert_int_equal(entries_find(scene.shell, &scene.projection, NULL, &entries, &err),
                             STATUS_OK);
            assert_int_equal(entries.start, LINK_NONE);
            for (int s = 0; s < 24 * 24; s++) {
                double x = (s % 24 + 0.5) / 12 - 1, y = (s / 24 + 0.5) / 12 - 1, p[3], least = -1;
                double d[3], length = 0;
                for (int i = 0; i < 3; i++) {
                    d[i] = view->d0[i] + x * view->du[i] + y * view->dv[i];
                    length += d[i] * d[i];
                }
                for (int i = 0; i < 3; i++)
                    p[i] = eye[i] + 1e-4 * d[i] / sqrt(length);
                for (uint32_t t = 0; t < scene.shell->tetra_count; t++)
                    least = fmax(least, inside(scene.shell, t, p));
                if (!(least > 1e-9))
                    continue;
                assert_true(entries.first[s] < entries.first[s + 1]);
                uint32_t first = entries.entry[entries.first[s]] >> 2;
                if (!(inside(scene.shell, first, p) > -1e-9))
                    fail_msg("vertex %u, sample %d: begins in cell %u, not where it heads",
                             vertices[k], s, first);
                begun++;
            }
            entries_finish(&entries);
        }
    assert_true(begun > 1000);
    scene_close(&scene);
}

/* Doubles are asked for where fp32 would be off by more than 1e-4, and nowhere else. */
static void test_precision(void **state) {
    (void)state;
    static const struct {
        const char *name;
        struct scene_mesh mesh;
        double thickness;
        struct scene_camera camera;
        bool wanted;
    } cases[] = {
        {"a sphere",
         {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {24, 12}},
         0.08,
         {.eye = {0, -4, 2}, .up = {0, 0, 1}, .fov_y_deg = 40},
         false},
        {"a thin sphere",
         {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {24, 12}},
         1e-5,
         {.eye = {0, -4, 2}, .up = {0, 0, 1}, .fov_y_deg = 40},
         true},
        {"a sphere from a million units",
         {.kind = SCENE_MESH_SPHERE, .radius = 1, .divisions = {24, 12}},
         0.08,
         {.eye = {0, -1e6, 2}, .up = {0, 0, 1}, .fov_y_deg = 1e-4},
         false},
        {"a millionth of a sphere",
         {.kind = SCENE_MESH_SPHERE, .radius = 1e-6, .divisions = {24, 12}},
         0.08e-6,
         {.eye = {0, -4e-6, 2e-6}, .up = {0, 0, 1}, .fov_y_deg = 40},
         false},
        {"a sliver from near",
         {.kind = SCENE_MESH_PLANE, .size = {1e6, 1}, .divisions = {1, 1}},
         0.5,
         {.eye = {0, 0, 5}, .up = {0, 1, 0}, .orthographic = true, .ortho_height = 1},
         true},
        {"a sliver whole",
         {.kind = SCENE_MESH_PLANE, .size = {1e3, 1}, .divisions = {1, 1}},
         0.5,
         {.eye = {0, 0, 5}, .up = {0, 1, 0}, .orthographic = true, .ortho_height = 1e3},
         false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct scene_of_one scene;
        struct scene_camera camera = cases[i].camera;
        camera.given = true;
        scene_open(&scene, cases[i].mesh, cases[i].thickness);
        scene_look(&scene, &camera, 256);
        if (precision_needs_fp64(scene.shell, &scene.projection, &scene.world) != cases[i].wanted)
            fail_msg("%s: %s", cases[i].name, cases[i].wanted ? "not asked for" : "asked for");
        scene_close(&scene);
    }
}

/* A vector is the sum of its two floats to 48 bits. */
static void test_low_parts(void **state) {
    (void)state;
    const double v[4][3] = {
        {M_PI, -M_E, 1e-9}, {1e9 / 3, 0, -1}, {1, 2, 3}, {-1.0 / 7, 1e5 / 7, 0}};
    float low[LOW_TEXELS][4];
    precision_low(v, low);
    for (int i = 0; i < 12; i++) {
        double value = v[i / 3][i % 3];
        assert_true(fabs((double)(float)value + (double)low[i / 4][i % 4] - value) <=
                    4e-15 * fabs(value));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_eye_on_a_vertex),
        cmocka_unit_test(test_precision),
        cmocka_unit_test(test_low_parts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
