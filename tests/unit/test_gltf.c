/* glTF assets: what the small files of tests/data/gltf (made by tests/tools/make_gltf.py) must
 * become, and how each broken one is refused. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/asset/mesh.h"
#include "renderer/asset/mesh_gltf.h"
#include "renderer/asset/module.h"
#include "tests/unit/asset_files.h"
#include "tests/unit/mesh_measure.h"

struct fixture {
    struct mesh_cache *cache;
    int open; /* assets */
    struct asset_source source;
};

static int setup(void **state) {
    struct fixture *fixture = calloc(1, sizeof *fixture);
    fixture->cache = mesh_cache_create(1 << 26);
    fixture->source = (struct asset_source){files_open, files_close, &fixture->open};
    *state = fixture;
    return 0;
}

static int teardown(void **state) {
    struct fixture *fixture = *state;
    assert_int_equal(fixture->open, 0);
    mesh_cache_destroy(fixture->cache);
    free(fixture);
    return 0;
}

static enum status acquire(struct fixture *fixture, const char *name, bool want_textures,
                           const struct mesh **mesh, struct error *err) {
    char path[128];
    snprintf(path, sizeof path, "tests/data/gltf/%s", name);
    struct scene_mesh spec = {.kind = SCENE_MESH_ASSET, .asset = path};
    return mesh_acquire(fixture->cache, &spec, want_textures, "/objects/0/mesh", &fixture->source,
                        mesh, err);
}

static const struct mesh *load(void **state, const char *name, bool want_textures) {
    const struct mesh *mesh = NULL;
    struct error err = {0};
    if (acquire(*state, name, want_textures, &mesh, &err) != STATUS_OK)
        fail_msg("%s: %s", name, err.fault_count ? err.faults[0].message : "no message");
    return mesh;
}

static void check_bounds(const struct mesh *mesh, const double low[3], const double high[3]) {
    for (int k = 0; k < 3; k++) {
        assert_true(fabs(mesh->bounds_min[k] - low[k]) < 1e-12);
        assert_true(fabs(mesh->bounds_max[k] - high[k]) < 1e-12);
    }
}

static void check_cube(const struct mesh *mesh) {
    assert_int_equal(mesh->vertex_count, 8);
    assert_int_equal(mesh->triangle_count, 12);
    assert_int_equal(mesh->diagnosis.open_edges, 0);
    assert_int_equal(mesh->diagnosis.non_manifold, 0);
    assert_int_equal(measure_euler(mesh), 2);
    assert_true(fabs(measure_volume(mesh) - 1) < 1e-14);
    /* Y up in the file, Z up here: (x, y, z) -> (x, -z, y). */
    check_bounds(mesh, (double[3]){0, -1, 0}, (double[3]){1, 0, 1});
    /* Angle-weighted, a cube's vertex normals are its diagonals, however its sides are split. */
    for (uint32_t v = 0; v < 8; v++)
        for (int k = 0; k < 3; k++) {
            double middle = (mesh->bounds_min[k] + mesh->bounds_max[k]) / 2;
            double sign = mesh->position[v][k] > middle ? 1 : -1;
            assert_true(fabs(mesh->normal[v][k] - sign * sqrt(1.0 / 3)) < 1e-14);
        }
}

static void plain_corners_weld(void **state) {
    const struct mesh *mesh = load(state, "plain.glb", true);
    check_cube(mesh);
    assert_int_equal(mesh->diagnosis.normals_made_count, 8);
    assert_int_equal(mesh->diagnosis.uvs_made_count, 8);
    assert_int_equal(mesh->surface_count, 1);
    for (int c = 0; c < 4; c++)
        assert_true(mesh->surfaces[0].base_color[c] == 1);
    assert_int_equal(mesh->surfaces[0].image, -1);
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void hard_edges_weld_and_stay_hard(void **state) {
    const struct mesh *mesh = load(state, "hard_edges.gltf", true);
    check_cube(mesh);
    assert_false(mesh->diagnosis.normals_made);
    assert_false(mesh->diagnosis.uvs_made);
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        double n[3];
        measure_area_vector(mesh, t, n);
        for (int k = 0; k < 3; k++) {
            for (int c = 0; c < 3; c++)
                assert_true((double)mesh->corner_normal[t][k][c] == 2 * n[c]);
            assert_true(mesh->corner_uv[t][k][0] == 0 || mesh->corner_uv[t][k][0] == 1);
        }
    }
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void strips_and_fans_face_one_way(void **state) {
    const struct mesh *mesh = load(state, "strips_and_fans.glb", true);
    assert_int_equal(mesh->triangle_count, 8 + 6);
    assert_int_equal(mesh->diagnosis.zero_area, 0); /* a strip's jumps are not faults */
    assert_int_equal(mesh->diagnosis.non_manifold, 0);
    double hexagon = 1.5 * sqrt(3), n[3], facing = 0;
    assert_true(fabs(measure_area(mesh) - (4 + hexagon)) < 1e-6);
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        measure_area_vector(mesh, t, n);
        facing += n[1];
    }
    /* All face the file's +z, which is -y here. */
    assert_true(fabs(facing + 4 + hexagon) < 1e-6);
    assert_int_equal(measure_euler(mesh), 3); /* three discs */
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void materials_and_textures(void **state) {
    const struct mesh *mesh = load(state, "materials.glb", true);
    assert_int_equal(mesh->triangle_count, 4);
    assert_int_equal(mesh->surface_count, 2);
    assert_int_equal(mesh->image_count, 1);
    for (uint32_t t = 0; t < 4; t++) {
        const struct mesh_surface *surface = &mesh->surfaces[mesh->surface[t]];
        bool red = mesh->position[mesh->vertex[t][0]][0] < 1.5;
        assert_int_equal(surface->image, red ? -1 : 0);
        assert_true(surface->base_color[0] == (red ? 0.25f : 1.0f));
        assert_true(surface->base_color[1] == (red ? 0.0f : 0.5f));
        /* The textured one uses its second set of UVs; the first is 9 everywhere. */
        for (int k = 0; k < 3; k++)
            assert_true(mesh->corner_uv[t][k][0] <= 1);
    }
    static const uint8_t pixels[16] = {255, 0, 0,   255, 0,   255, 0,   255,
                                       0,   0, 255, 255, 255, 255, 255, 128};
    assert_int_equal(mesh->images[0].width, 2);
    assert_int_equal(mesh->images[0].height, 2);
    assert_memory_equal(mesh->images[0].rgba, pixels, sizeof pixels);
    mesh_release(((struct fixture *)*state)->cache, mesh);

    const struct mesh *bare = load(state, "materials.glb", false);
    assert_ptr_not_equal(bare, mesh);
    assert_int_equal(bare->image_count, 0);
    for (uint32_t s = 0; s < bare->surface_count; s++)
        assert_int_equal(bare->surfaces[s].image, -1);
    mesh_release(((struct fixture *)*state)->cache, bare);
}

static void texture_coordinates_are_transformed(void **state) {
    const struct mesh *mesh = load(state, "texture_transform.glb", false);
    /* (u, v) -> scale by 2 -> a quarter turn counter-clockwise, v down: (v, -u) -> offset. */
    static const double expected[3][2] = {{0.5, 0.25}, {0.5, -1.75}, {2.5, 0.25}};
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 2; c++)
            assert_true(fabs(mesh->corner_uv[0][k][c] - expected[k][c]) < 1e-15 * 8);
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void nodes_place_and_mirror(void **state) {
    const struct mesh *mesh = load(state, "nodes.glb", true);
    assert_int_equal(mesh->triangle_count, 5 * 4);
    assert_int_equal(mesh->diagnosis.open_edges, 0);
    assert_int_equal(measure_euler(mesh), 5 * 2);
    /* Volumes 1, 8, 1 (mirrored), 1 and 3 (mirrored) sixths: all positive once winding follows. */
    assert_true(fabs(measure_volume(mesh) - (1 + 8 + 1 + 1 + 3) / 6.0) < 1e-12);
    double volume[5] = {0};
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        /* Each instance apart: its own share of the volume, about one of its own points. */
        double n[3];
        measure_area_vector(mesh, t, n);
        const double *p = mesh->position[mesh->vertex[t][0]];
        const double *q = mesh->position[mesh->vertex[t / 4 * 4][0]];
        volume[t / 4] += (n[0] * (p[0] - q[0]) + n[1] * (p[1] - q[1]) + n[2] * (p[2] - q[2])) / 3;
    }
    static const double sixths[5] = {1, 8, 1, 1, 3};
    for (int i = 0; i < 5; i++)
        assert_true(fabs(volume[i] - sixths[i] / 6) < 1e-13);
    /* In the file's axes: x from -10 to 12, y from 0 to 11, z from 0 to 10 (the turned one lies in
     * 9 <= z <= 10: x went to -z). */
    check_bounds(mesh, (double[3]){-10, -10, 0}, (double[3]){12, 0, 11});
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void scenes_choose_nodes(void **state) {
    const struct mesh *mesh = load(state, "second_scene.glb", true);
    check_bounds(mesh, (double[3]){5, -1, 0}, (double[3]){6, 0, 1});
    mesh_release(((struct fixture *)*state)->cache, mesh);
    mesh = load(state, "no_scene.glb", true);
    check_bounds(mesh, (double[3]){0, -1, 0}, (double[3]){1, 0, 1});
    assert_true(fabs(measure_volume(mesh) - 1.0 / 6) < 1e-15);
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void sparse_accessors_replace(void **state) {
    const struct mesh *mesh = load(state, "sparse.glb", true);
    assert_int_equal(mesh->vertex_count, 4);
    assert_true(fabs(measure_volume(mesh) - 1.0 / 6) < 1e-15);
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void quantized_attributes_with_a_stride(void **state) {
    const struct mesh *mesh = load(state, "quantized.glb", true);
    check_bounds(mesh, (double[3]){0, 0, 0}, (double[3]){1, 0, 1});
    assert_false(mesh->diagnosis.normals_made);
    for (uint32_t t = 0; t < 2; t++)
        for (int k = 0; k < 3; k++) {
            const double *p = mesh->position[mesh->vertex[t][k]];
            assert_true((double)mesh->corner_normal[t][k][1] == -1);
            assert_true(mesh->corner_uv[t][k][0] == p[0] && mesh->corner_uv[t][k][1] == p[2]);
        }
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void triangles_without_area_are_counted(void **state) {
    const struct mesh *mesh = load(state, "degenerate.glb", true);
    assert_int_equal(mesh->triangle_count, 2);
    assert_int_equal(mesh->vertex_count, 4);
    assert_int_equal(mesh->diagnosis.zero_area, 3);
    assert_int_equal(mesh->diagnosis.zero_area_first, 1);
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

static void the_bunny_is_closed(void **state) {
    struct fixture *fixture = *state;
    struct scene_mesh spec = {.kind = SCENE_MESH_ASSET, .asset = "api/examples/assets/bunny.glb"};
    const struct mesh *mesh = NULL;
    assert_int_equal(
        mesh_acquire(fixture->cache, &spec, true, "/mesh", &fixture->source, &mesh, NULL),
        STATUS_OK);
    assert_int_equal(mesh->vertex_count, 1839);
    assert_int_equal(mesh->triangle_count, 3674);
    assert_int_equal(mesh->diagnosis.open_edges, 0);
    assert_int_equal(mesh->diagnosis.non_manifold, 0);
    assert_int_equal(measure_euler(mesh), 2);
    assert_true(measure_volume(mesh) > 0);
    assert_true(mesh->bounds_min[2] == 0 && fabs(mesh->bounds_max[2] - 2) < 1e-6);
    mesh_release(fixture->cache, mesh);
}

static const struct refusal {
    const char *name;
    enum status status;
    const char *message; /* part of it */
} refusals[] = {
    {"bad_accessor.glb", STATUS_BAD_ASSET, "accessor 0 reaches past the end of buffer view 0"},
    {"bad_bomb.glb", STATUS_TOO_COMPLEX, "more than 4000000 triangles"},
    {"bad_buffers.glb", STATUS_TOO_COMPLEX, "10000 buffers share a binary chunk"},
    {"bad_chunk_length.glb", STATUS_BAD_ASSET, "binary chunk reaches past its end"},
    {"bad_corner_count.glb", STATUS_BAD_ASSET, "4 corners, which do not make triangles"},
    {"bad_count.glb", STATUS_BAD_ASSET, "accessor 0 claims 4611686018427387904 elements"},
    {"bad_cut_short.glb", STATUS_BAD_ASSET, "cut short: its header says 800 bytes, 400 are there"},
    {"bad_cycle.glb", STATUS_BAD_ASSET, "not a tree: node 0 is reached twice"},
    {"bad_depth.gltf", STATUS_BAD_ASSET, "nests deeper than 64"},
    {"bad_draco.glb", STATUS_BAD_ASSET, "requires the extension KHR_draco_mesh_compression"},
    {"bad_external.glb", STATUS_BAD_ASSET, "refers to another file"},
    {"bad_far.glb", STATUS_BAD_ASSET, "vertex 2 is too far away once its node's transform"},
    {"bad_flat.glb", STATUS_BAD_ASSET, "none of the mesh's 4 triangles has an area"},
    {"bad_index.glb", STATUS_BAD_ASSET, "index 3 is vertex 4; there are 4"},
    {"bad_infinity.glb", STATUS_BAD_ASSET, "vertex 0 is not a finite number"},
    {"bad_json.gltf", STATUS_BAD_ASSET, "not valid glTF"},
    {"bad_kind.glb", STATUS_BAD_ASSET, "neither .glb"},
    {"bad_nan.glb", STATUS_BAD_ASSET, "vertex 0 is not a finite number"},
    {"bad_no_mesh.glb", STATUS_BAD_ASSET, "the file has no mesh"},
    {"bad_node.glb", STATUS_BAD_ASSET, "refers to node 7; there are 1"},
    {"bad_picture.glb", STATUS_BAD_ASSET, "texture 0 is neither PNG nor JPEG"},
    {"bad_points_only.glb", STATUS_BAD_ASSET, "shows no triangles"},
    {"bad_shared_child.glb", STATUS_BAD_ASSET, "not a tree: node 60 is reached twice"},
    {"bad_sparse.glb", STATUS_BAD_ASSET, "sparse index 2 is 4, out of order or not below 4"},
    {"bad_texture.glb", STATUS_BAD_ASSET, "texture 0 is not in the file"},
    {"bad_view.glb", STATUS_BAD_ASSET, "buffer view 1 reaches past the end of buffer 0"},
};

static void broken_files_are_refused(void **state) {
    for (size_t i = 0; i < sizeof refusals / sizeof *refusals; i++) {
        const struct mesh *mesh = NULL;
        struct error err = {0};
        enum status status = acquire(*state, refusals[i].name, true, &mesh, &err);
        if (status != refusals[i].status || err.fault_count != 1 ||
            !strstr(err.faults[0].message, refusals[i].message))
            fail_msg("%s: %s: %s", refusals[i].name, status_slug(status),
                     err.fault_count ? err.faults[0].message : "no message");
        assert_string_equal(err.faults[0].pointer, "/objects/0/mesh/asset");
        assert_null(mesh);
        error_clear(&err);
    }
}

/* Textures that nobody wants are not looked at: not even a broken one stops the mesh. */
static void unwanted_textures_are_left_alone(void **state) {
    const struct mesh *mesh = load(state, "bad_picture.glb", false);
    assert_int_equal(mesh->triangle_count, 1);
    mesh_release(((struct fixture *)*state)->cache, mesh);
}

/* Every file cut off anywhere, and with any single byte inverted: refused or read, never worse. The
 * sanitizer build is what this is for. */
static void damage_is_survived(void **state) {
    (void)state;
    const struct gltf_module *gltf = module_open(MODULE_MESH_GLTF, NULL);
    assert_non_null(gltf);
    static const char *const names[] = {"materials.glb", "sparse.glb", "nodes.glb",
                                        "hard_edges.gltf"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[128], message[256];
        snprintf(path, sizeof path, "tests/data/gltf/%s", names[i]);
        int open = 0;
        struct asset_bytes bytes;
        assert_int_equal(files_open(&open, path, "", &bytes, NULL), STATUS_OK);
        for (size_t cut = 0; cut < bytes.size; cut++) {
            unsigned char *part = malloc(cut ? cut : 1); /* exactly: overruns show */
            memcpy(part, bytes.data, cut);
            struct gltf_soup soup;
            enum gltf_outcome outcome =
                gltf->load(part, cut, MESH_TRIANGLES_MAX, &soup, message, sizeof message);
            assert_int_equal(outcome, GLTF_BAD);
            assert_true(message[0] && !soup.position);
            free(part);
        }
        unsigned char *copy = malloc(bytes.size);
        for (size_t at = 0; at < bytes.size; at++) {
            memcpy(copy, bytes.data, bytes.size);
            copy[at] ^= 0xff;
            struct gltf_soup soup;
            enum gltf_outcome outcome =
                gltf->load(copy, bytes.size, MESH_TRIANGLES_MAX, &soup, message, sizeof message);
            if (outcome == GLTF_OK) {
                for (uint64_t c = 0; c < 3 * soup.triangle_count; c++)
                    for (int k = 0; k < 3; k++)
                        assert_true(isfinite(soup.position[c][k]));
                gltf->free(&soup);
            }
            assert_null(soup.position);
        }
        free(copy);
        files_close(&open, &bytes);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(plain_corners_weld, setup, teardown),
        cmocka_unit_test_setup_teardown(hard_edges_weld_and_stay_hard, setup, teardown),
        cmocka_unit_test_setup_teardown(strips_and_fans_face_one_way, setup, teardown),
        cmocka_unit_test_setup_teardown(materials_and_textures, setup, teardown),
        cmocka_unit_test_setup_teardown(texture_coordinates_are_transformed, setup, teardown),
        cmocka_unit_test_setup_teardown(nodes_place_and_mirror, setup, teardown),
        cmocka_unit_test_setup_teardown(scenes_choose_nodes, setup, teardown),
        cmocka_unit_test_setup_teardown(sparse_accessors_replace, setup, teardown),
        cmocka_unit_test_setup_teardown(quantized_attributes_with_a_stride, setup, teardown),
        cmocka_unit_test_setup_teardown(triangles_without_area_are_counted, setup, teardown),
        cmocka_unit_test_setup_teardown(the_bunny_is_closed, setup, teardown),
        cmocka_unit_test_setup_teardown(broken_files_are_refused, setup, teardown),
        cmocka_unit_test_setup_teardown(unwanted_textures_are_left_alone, setup, teardown),
        cmocka_unit_test(damage_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
