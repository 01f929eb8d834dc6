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

/* ---- poses ---- */

static enum status acquire_posed(struct fixture *fixture, const char *name, const char *animation,
                                 double time_s, const struct mesh **mesh, struct error *err) {
    char path[128];
    snprintf(path, sizeof path, "tests/data/gltf/%s", name);
    struct scene_mesh spec = {.kind = SCENE_MESH_ASSET,
                              .asset = path,
                              .has_time = true,
                              .time_s = time_s,
                              .animation = animation};
    return mesh_acquire(fixture->cache, &spec, true, "/objects/0/mesh", &fixture->source, mesh,
                        err);
}

static const struct mesh *load_posed(void **state, const char *name, const char *animation,
                                     double time_s) {
    const struct mesh *mesh = NULL;
    struct error err = {0};
    if (acquire_posed(*state, name, animation, time_s, &mesh, &err) != STATUS_OK)
        fail_msg("%s: %s", name, err.fault_count ? err.faults[0].message : "no message");
    return mesh;
}

/* Whether some vertex lies there; fp32 in the file. */
static void check_vertex(const struct mesh *mesh, double x, double y, double z) {
    double best = 1e30;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        const double *p = mesh->position[v];
        best = fmin(best, hypot(hypot(p[0] - x, p[1] - y), p[2] - z));
    }
    if (!(best < 1e-6))
        fail_msg("no vertex at %g %g %g: %g away", x, y, z, best);
}

/* The upper half turns about z of the file at (0, 1, 0); in the middle the two joints' mean. */
static void skins_bend(void **state) {
    static const double times[] = {0, 0.5, 1, 2, 99};
    struct mesh_cache *cache = ((struct fixture *)*state)->cache;
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        const struct mesh *mesh = load_posed(state, "skin.glb", "bend", times[i]);
        double angle = fmin(times[i], 2) / 2 * acos(0), c = cos(angle), s = sin(angle);
        assert_int_equal(mesh->vertex_count, 12);
        for (int k = 0; k < 4; k++) {
            double x = k & 1 ? 0.5 : -0.5, z = k & 2 ? 0.5 : -0.5;
            check_vertex(mesh, x, -z, 0);
            check_vertex(mesh, (x + c * x) / 2, -z, 1 + s * x / 2);
            check_vertex(mesh, c * x - s, -z, 1 + s * x + c); /* weight 0.5: divided by its sum */
        }
        assert_true(mesh->rest && mesh->vertex == mesh->rest->vertex);
        assert_true(measure_volume(mesh) > 0.5);
        mesh_release(cache, mesh);
    }
    /* A joint above: everything follows it, all at once. */
    const struct mesh *low = load_posed(state, "skin.glb", "lift", 2.9);
    const struct mesh *high = load_posed(state, "skin.glb", "lift", 3);
    check_bounds(low, (double[3]){-0.5, -0.5, 0}, (double[3]){0.5, 0.5, 2});
    check_bounds(high, (double[3]){-0.5, -4.5, 0}, (double[3]){0.5, -3.5, 2});
    mesh_release(cache, low);
    mesh_release(cache, high);
}

/* Without a time: as it lies in the file. */
static void the_rest_pose_stays(void **state) {
    struct mesh_cache *cache = ((struct fixture *)*state)->cache;
    const struct mesh *rest = load(state, "skin.glb", true);
    const struct mesh *posed = load_posed(state, "skin.glb", NULL, 1);
    check_bounds(rest, (double[3]){-0.5, -0.5, 0}, (double[3]){0.5, 0.5, 2});
    assert_ptr_not_equal(posed->rest, rest); /* whose nodes may have welded */
    assert_int_equal(rest->references, 1);
    assert_int_equal(posed->rest->references, 1);
    assert_true(posed->serial != rest->serial);
    const struct mesh *again = load_posed(state, "skin.glb", "bend", 1);
    assert_true(again->serial != posed->serial); /* the first, by its name: another key */
    assert_ptr_equal(again->rest, posed->rest);
    mesh_release(cache, again);
    mesh_release(cache, posed);
    const struct mesh *found = load_posed(state, "skin.glb", NULL, 1);
    assert_ptr_equal(found, posed);
    mesh_release(cache, found);
    mesh_release(cache, rest);
}

static void targets_morph(void **state) {
    static const struct {
        const char *animation;
        double time, lift, widen;
    } cases[] = {{"swell", 0, 0, 0},   {"swell", 0.25, 0.25, 0}, {"swell", 1, 1, 0},
                 {"swell", 2, 0.5, 1}, {"swell", 7, 0, 2},       {"elsewhere", 0, 0, 0.5}};
    struct mesh_cache *cache = ((struct fixture *)*state)->cache;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct mesh *mesh = load_posed(state, "morph.glb", cases[i].animation, cases[i].time);
        double lift = cases[i].lift, wide = 1 + cases[i].widen;
        check_bounds(mesh, (double[3]){0, 0, lift}, (double[3]){wide, 1, lift});
        double length = hypot(lift, 1 - lift); /* of (lift, 1 - lift, 0) */
        for (uint32_t v = 0; v < mesh->vertex_count; v++) {
            assert_true(fabs(mesh->normal[v][0] - lift / length) < 1e-6);
            assert_true(fabs(mesh->normal[v][2] - (1 - lift) / length) < 1e-6);
        }
        mesh_release(cache, mesh);
    }
}

static void nodes_move(void **state) {
    struct mesh_cache *cache = ((struct fixture *)*state)->cache;
    /* Cubic: 0 at 1 s, leaving at 1 a second; 2 at 3 s, where it rests. Half way: 1 + 2 / 8. */
    const struct mesh *mesh = load_posed(state, "animated_nodes.glb", NULL, 2);
    check_vertex(mesh, 1.25, 0, 0);
    check_vertex(mesh, 1.25 + 1, 0, 0);
    /* Scaled from 2 s on, and mirrored: its sides face outwards all the same. */
    check_vertex(mesh, 12, 0, 0);
    check_vertex(mesh, 10, 2, 0);
    /* Two thirds of a quarter turn. */
    check_vertex(mesh, cos(acos(0) * 2 / 3), 0, sin(acos(0) * 2 / 3));
    assert_int_equal(mesh->vertex_count, 12); /* two lie in one place at rest, and part */
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        for (int k = 0; k < 3; k++)
            assert_true(isfinite(mesh->normal[v][k]));
    mesh_release(cache, mesh);
}

static void broken_poses_are_refused(void **state) {
    static const struct {
        const char *name, *part;
    } cases[] = {
        {"bad_pose_joint.glb", "follows joint 9 of skin 0, which has 2"},
        {"bad_pose_nan.glb", "a weight is negative or no finite number"},
        {"bad_pose_negative.glb", "a weight is negative or no finite number"},
        {"bad_pose_weightless.glb", "the weights sum to 0"},
        {"bad_pose_bone.glb", "node 1 for a joint, which the scene does not have"},
        {"bad_pose_bones.glb", "node 7 for a joint"},
        {"bad_pose_order.glb", "key 2 of an animation is not later"},
        {"bad_pose_count.glb", "5 values for 2 keys, not 6"},
        {"bad_pose_value.glb", "is no finite number"},
        {"bad_pose_node.glb", "moves node 5; there are 1"},
        {"bad_pose_target.glb", "a target has 3 vertices, not 4"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct mesh *mesh = load(state, cases[i].name, true); /* at rest nothing is wrong */
        struct error err = {0};
        assert_int_equal(acquire_posed(*state, cases[i].name, NULL, 1, &mesh, &err),
                         STATUS_BAD_ASSET);
        assert_string_equal(err.faults[0].pointer, "/objects/0/mesh/asset");
        if (!strstr(err.faults[0].message, cases[i].part))
            fail_msg("%s: %s", cases[i].name, err.faults[0].message);
        error_clear(&err);
    }
    const struct mesh *mesh;
    struct error err = {0};
    assert_int_equal(acquire_posed(*state, "bad_pose_still.glb", NULL, 1, &mesh, &err),
                     STATUS_BAD_ASSET);
    assert_string_equal(err.faults[0].pointer, "/objects/0/mesh/time");
    error_clear(&err);
    assert_int_equal(acquire_posed(*state, "skin.glb", "fly", 1, &mesh, &err), STATUS_BAD_ASSET);
    assert_string_equal(err.faults[0].pointer, "/objects/0/mesh/animation");
    assert_string_equal(err.faults[0].message,
                        "the file has no animation of that name, but bend, lift");
    error_clear(&err);
}

/* Every file cut off anywhere, and with any single byte inverted: refused or read, never worse. The
 * sanitizer build is what this is for. */
static void damage_is_survived(void **state) {
    (void)state;
    const struct gltf_module *gltf = module_open(MODULE_MESH_GLTF, NULL);
    assert_non_null(gltf);
    static const char *const names[] = {"materials.glb",   "sparse.glb", "nodes.glb",
                                        "hard_edges.gltf", "skin.glb",   "morph.glb"};
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
                gltf->load(part, cut, MESH_TRIANGLES_MAX, NULL, &soup, message, sizeof message);
            assert_int_equal(outcome, GLTF_BAD);
            assert_true(message[0] && !soup.position);
            free(part);
        }
        unsigned char *copy = malloc(bytes.size);
        for (size_t at = 0; at < bytes.size; at++) {
            memcpy(copy, bytes.data, bytes.size);
            copy[at] ^= 0xff;
            struct gltf_soup soup;
            enum gltf_outcome outcome = gltf->load(copy, bytes.size, MESH_TRIANGLES_MAX, NULL,
                                                   &soup, message, sizeof message);
            if (outcome == GLTF_OK) {
                for (uint64_t c = 0; c < 3 * soup.triangle_count; c++)
                    for (int k = 0; k < 3; k++)
                        assert_true(isfinite(soup.position[c][k]));
                gltf->free(&soup);
            }
            struct gltf_pose pose = {NULL, 0.5};
            outcome = gltf->load(copy, bytes.size, MESH_TRIANGLES_MAX, &pose, &soup, message,
                                 sizeof message);
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
        cmocka_unit_test_setup_teardown(skins_bend, setup, teardown),
        cmocka_unit_test_setup_teardown(the_rest_pose_stays, setup, teardown),
        cmocka_unit_test_setup_teardown(targets_morph, setup, teardown),
        cmocka_unit_test_setup_teardown(nodes_move, setup, teardown),
        cmocka_unit_test_setup_teardown(broken_poses_are_refused, setup, teardown),
        cmocka_unit_test(damage_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
