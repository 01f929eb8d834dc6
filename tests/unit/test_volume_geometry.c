/* Tiles of real geometry: distances, insides, colours, periods, and what is no tile. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/volume.h"
#include "renderer/asset/volume_distance.h"
#include "renderer/asset/volume_random.h"
#include "tests/unit/asset_files.h"

struct fixture {
    int open;
    struct volume_cache *cache;
    const struct volume *volume;
};

static enum status acquire(struct fixture *f, const struct scene_mesh *mesh, int nx, int ny, int nz,
                           struct error *err) {
    struct asset_source source = {files_open, files_close, &f->open};
    struct scene_material spec = {
        .kind = SCENE_MATERIAL_GEOMETRY, .geometry = *mesh, .size = {nx, ny, nz}, .lit = true};
    bool made;
    f->cache = volume_cache_create(1 << 20);
    enum status status =
        volume_acquire(f->cache, &spec, 1.0, "/m", &source, &f->volume, &made, err);
    assert_int_equal(f->open, 0);
    return status;
}

static struct fixture get(const struct scene_mesh *mesh, int nx, int ny, int nz) {
    struct fixture f = {0};
    struct error err = {0};
    if (acquire(&f, mesh, nx, ny, nz, &err) != STATUS_OK)
        fail_msg("%s", err.faults[0].message);
    assert_non_null(f.volume->solid);
    assert_null(f.volume->medium);
    return f;
}

static void drop(struct fixture *f) {
    volume_release(f->cache, f->volume);
    volume_cache_destroy(f->cache);
}

static const float *voxel(const struct fixture *f, int x, int y, int z) {
    const int *n = f->volume->size;
    return f->volume->solid + 4 * ((size_t)((z * n[1] + y) * n[0] + x));
}

/* The largest error of s against a field, over all voxels; and how many are on the ramp. */
static double worst_of(const struct fixture *f, double (*depth)(const double p[3]), int *ramp) {
    double worst = 0;
    *ramp = 0;
    for (int z = 0; z < f->volume->size[2]; z++)
        for (int y = 0; y < f->volume->size[1]; y++)
            for (int x = 0; x < f->volume->size[0]; x++) {
                double p[3] = {x + 0.5, y + 0.5, z + 0.5};
                double s = fmin(fmax(0.5 + depth(p) / 2, 0), 1);
                worst = fmax(worst, fabs(s - (double)voxel(f, x, y, z)[3]));
                *ramp += s > 0 && s < 1;
            }
    return worst;
}

/* 40 voxels across, a layer free below and above. The nearest copy is one of the tile or beside. */
static double sphere_depth(const double p[3]) {
    double best = -1e9;
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++)
            best = fmax(best, 20 - hypot(hypot(p[0] - 20 + 40 * i, p[1] - 20 + 40 * j), p[2] - 21));
    return best;
}

static double torus_depth(const double p[3]) {
    double best = -1e9;
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++) {
            double ring = hypot(p[0] - 28 + 56 * i, p[1] - 28 + 56 * j) - 20;
            best = fmax(best, 8 - hypot(ring, p[2] - 9));
        }
    return best;
}

/* The facets of 192 x 96 and 256 x 128 divisions lie up to 20 (1 - cos(pi / 96)) = 0.011 voxels
 * below the surfaces, half of that in s: 0.0053 for both, measured 0.0056 and 0.0050; bound 0.008.
 */
static void spheres_and_tori_are_their_fields(void **state) {
    (void)state;
    struct scene_mesh sphere = {.kind = SCENE_MESH_SPHERE, .radius = 0.3, .divisions = {192, 96}};
    struct scene_mesh torus = {
        .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.4, .divisions = {256, 128}};
    int ramp;
    struct fixture f = get(&sphere, 40, 40, 42);
    double worst = worst_of(&f, sphere_depth, &ramp);
    print_message("sphere: s off by %.4f over %d voxels of the ramp\n", worst, ramp);
    assert_true(ramp > 5000 && worst < 0.008);
    assert_int_equal(f.volume->notes.open_edges, 0);
    drop(&f);
    f = get(&torus, 56, 56, 18);
    worst = worst_of(&f, torus_depth, &ramp);
    print_message("torus: s off by %.4f over %d voxels of the ramp\n", worst, ramp);
    assert_true(ramp > 5000 && worst < 0.008);
    drop(&f);
}

/* A box that is turned, in voxel coordinates. */
static void make_box(double corner[8][3], double reach) {
    static const double axes[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
    for (int k = 0; k < 8; k++)
        for (int i = 0; i < 3; i++)
            corner[k][i] = 8.0 + ((k & 1) ? reach : -reach) * axes[0][i] +
                           ((k & 2) ? reach : -reach) * axes[1][i] +
                           ((k & 4) ? reach : -reach) * axes[2][i];
}

static const int box_sides[12][3] = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6},
                                     {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7},
                                     {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};

static void add_box(struct distance_grid *grid, double reach, bool turned) {
    double box[8][3], corner[3][3];
    make_box(box, reach);
    for (uint32_t t = 0; t < 12; t++) {
        for (int k = 0; k < 3; k++)
            memcpy(corner[turned ? 2 - k : k], box[box_sides[t][k]], sizeof corner[k]);
        assert_int_equal(distance_add(grid, (const double(*)[3])corner, t), STATUS_OK);
        distance_add_winding(grid, (const double(*)[3])corner);
    }
}

/* Every centre winds as often as it lies inside, for a turned box and one inside it, facing out or
 * in; an axis-aligned box whose sides pass through centres loses none. */
static void winding_tells_the_inside(void **state) {
    (void)state;
    static const double axes[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
    static const int size[3] = {16, 16, 16};
    struct distance_grid grid;
    assert_true(distance_init(&grid, size));
    add_box(&grid, 4.117, false); /* no centre lies on a side: those are multiples of 0.02 */
    add_box(&grid, 2.313, true);
    distance_wind(&grid);
    int counts[2] = {0, 0};
    for (int i = 0; i < 16 * 16 * 16; i++) {
        double p[3] = {i % 16 - 7.5, i / 16 % 16 - 7.5, i / 256 - 7.5}, most = 0;
        for (int a = 0; a < 3; a++)
            most = fmax(most, fabs(p[0] * axes[a][0] + p[1] * axes[a][1] + p[2] * axes[a][2]));
        int sign = grid.winding[i] ? (most > 2.313 ? 1 : 0) : 0;
        if (most < 2.313)
            assert_int_equal(grid.winding[i],
                             0); /* out and in again: the inner box faces inwards */
        else
            assert_int_equal(abs(grid.winding[i]), most < 4.117);
        counts[sign]++;
    }
    assert_true(counts[1] > 300 && counts[1] < 600); /* 8.234^3 - 4.626^3 = 459 */
    distance_finish(&grid);

    assert_true(distance_init(&grid, size));
    double box[8][3], corner[3][3];
    for (int k = 0; k < 8; k++)
        for (int i = 0; i < 3; i++)
            box[k][i] = (k >> i & 1) ? 10.5 : 4.5; /* through centres; along x and y each belongs to
                                                      one side */
    for (uint32_t t = 0; t < 12; t++) {
        for (int k = 0; k < 3; k++)
            memcpy(corner[k], box[box_sides[t][k]], sizeof corner[k]);
        distance_add_winding(&grid, (const double(*)[3])corner);
    }
    distance_wind(&grid);
    int inside = 0;
    for (int i = 0; i < 16 * 16 * 16; i++) {
        assert_in_range(grid.winding[i], 0, 1);
        inside += grid.winding[i] != 0;
    }
    assert_int_equal(inside, 6 * 6 * 6);
    distance_finish(&grid);
}

static double uniform(uint32_t *state, double low, double high) {
    return low + (high - low) * (double)random_next(state);
}

/* Random triangles, slivers and points among them, in a grid with a side of 5: every voxel's
 * distance is the least over all triangles and copies, by a search of each triangle's points. */
static void distances_are_exact(void **state) {
    (void)state;
    enum { NX = 9, NY = 5, NZ = 7, TRIANGLES = 40, STEPS = 40 };
    static const int size[3] = {NX, NY, NZ};
    double corner[TRIANGLES][3][3];
    uint32_t random = 5;
    struct distance_grid grid;
    assert_true(distance_init(&grid, size));
    for (uint32_t t = 0; t < TRIANGLES; t++) {
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                corner[t][k][i] = k && t % 4 ? corner[t][0][i] + uniform(&random, -1.2, 1.2)
                                             : uniform(&random, 0, size[i]);
        if (t % 8 == 1)
            memcpy(corner[t][2], corner[t][1], sizeof corner[t][2]); /* no area */
        if (t % 4 == 0 && t)
            for (int k = 1; k < 3; k++)
                for (int i = 0; i < 3; i++)
                    corner[t][k][i] = corner[t][0][i]; /* a point */
        assert_int_equal(distance_add(&grid, (const double(*)[3])corner[t], t), STATUS_OK);
    }
    double worst = 0;
    int near = 0;
    for (int v = 0; v < NX * NY * NZ; v++) {
        double best = DISTANCE_BAND;
        for (int t = 0; t < TRIANGLES; t++)
            for (int j = -1; j <= 1; j++)
                for (int i = -1; i <= 1; i++) {
                    double p[3] = {v % NX + 0.5 + NX * i, v / NX % NY + 0.5 + NY * j,
                                   v / NX / NY + 0.5};
                    for (int a = 0; a <= STEPS; a++)
                        for (int b = 0; a + b <= STEPS; b++) {
                            double d2 = 0;
                            for (int c = 0; c < 3; c++) {
                                double q = corner[t][0][c] +
                                           (corner[t][1][c] - corner[t][0][c]) * a / STEPS +
                                           (corner[t][2][c] - corner[t][0][c]) * b / STEPS - p[c];
                                d2 += q * q;
                            }
                            best = d2 < best * best ? sqrt(d2) : best;
                        }
                }
        double found = (double)grid.distance[v];
        assert_true(found <= best + 1e-6);
        worst = fmax(worst, best - found);
        near += found < 1;
    }
    print_message("distances: below a search by %.4f at most, %d voxels within 1\n", worst, near);
    assert_true(worst <
                0.12); /* the search's own steps: up to 12 voxels / 40 apart, measured 0.024 */
    assert_true(near > 50);
    distance_finish(&grid);
}

/* A cylinder without lids: a wall two voxels thick, hollow, and the report says so. */
static void open_meshes_are_sheets(void **state) {
    (void)state;
    struct scene_mesh mesh = {
        .kind = SCENE_MESH_CYLINDER, .radius = 0.5, .height = 1, .divisions = {96, 4}};
    struct fixture f = get(&mesh, 40, 40, 22);
    assert_int_equal(f.volume->notes.open_edges, 2 * 96);
    for (int x = 0; x < 40; x++) {
        double wall = fabs(fabs(x + 0.5 - 20) - 20); /* from the wall through the tile's side */
        double s = fmin(fmax(0.5 + (1 - wall) / 2, 0), 1);
        assert_true(fabs(s - (double)voxel(&f, x, 20, 11)[3]) < 0.02);
    }
    struct report *report = calloc(1, sizeof *report);
    volume_warn(f.volume, "/m", report);
    assert_int_equal(report->warning_count, 1);
    assert_string_equal(report->warnings[0].code, "geometry-open");
    free(report);
    drop(&f);
}

/* Two cubes of an asset: one in its base colour, one with a texture of four colours on its upper
 * side. Between them nothing; parts touch the tile's sides, and one another across them. */
static void colours_are_the_assets(void **state) {
    (void)state;
    struct scene_mesh mesh = {.kind = SCENE_MESH_ASSET, .asset = "tests/data/gltf/cubes.glb"};
    struct fixture f = {0};
    struct error err = {0};
    if (acquire(&f, &mesh, 48, 16, 18, &err) != STATUS_OK)
        fail_msg("%s %s", err.faults[0].pointer, err.faults[0].message);
    assert_int_equal(f.volume->notes.open_edges, 0);
    for (int x = 0; x < 16; x++) /* the left third */
        for (int z = 1; z < 17; z++) {
            const float *v = voxel(&f, x, 8, z);
            assert_true(v[3] > 0.5f);
            if (x > 1 && x < 14 && z > 2 && z < 15)
                continue; /* no surface is near */
            assert_true(v[0] == 0.25f * v[3] && v[1] == 0.0f && v[2] == 0.0f);
        }
    for (int x = 17; x < 31; x++)
        assert_true(voxel(&f, x, 8, 9)[3] == 0.0f);
    /* A texture of 2 x 2: red and green in its first row, which is the far side; blue and white. */
    static const float corners[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
    for (int k = 0; k < 4; k++) {
        const float *v = voxel(&f, 32 + (k & 1 ? 12 : 3), k & 2 ? 3 : 12, 16);
        assert_true(v[3] == 0.75f);
        for (int c = 0; c < 3; c++) /* (3.5/16, its quarter point is 4/16): bilinear, 6 % off */
            assert_true(fabsf(v[c] / v[3] - corners[k][c]) < 0.13f);
    }
    drop(&f);
}

/* Any size can be made, also of one voxel. */
static void any_size_is_made(void **state) {
    (void)state;
    static const int sizes[][3] = {{1, 1, 1}, {512, 1, 1}, {1, 1, 64}, {2, 300, 2}, {3, 3, 3}};
    struct scene_mesh mesh = {
        .kind = SCENE_MESH_TORUS, .radius = 1, .tube = 0.3, .divisions = {24, 12}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        struct fixture f = get(&mesh, sizes[k][0], sizes[k][1], sizes[k][2]);
        for (int i = 0; i < 4 * sizes[k][0] * sizes[k][1] * sizes[k][2]; i++)
            assert_true(f.volume->solid[i] >= 0.0f && f.volume->solid[i] <= 1.0f);
        drop(&f);
    }
}

static void what_is_no_tile_is_refused(void **state) {
    (void)state;
    struct scene_mesh plane = {.kind = SCENE_MESH_PLANE, .size = {1, 1}, .divisions = {2, 2}};
    struct fixture f = {0};
    struct error err = {0};
    assert_int_equal(acquire(&f, &plane, 8, 8, 8, &err), STATUS_BAD_ASSET);
    assert_string_equal(err.faults[0].pointer, "/m/geometry");
    assert_non_null(strstr(err.faults[0].message, "no extent along z"));
    assert_null(f.volume);
    error_clear(&err);
    volume_cache_destroy(f.cache);

    /* More distances than anyone waits for. */
    static const int size[3] = {64, 64, 8};
    static const double corner[3][3] = {{0, 0, 0}, {64, 0, 8}, {0, 64, 8}};
    struct distance_grid grid;
    assert_true(distance_init(&grid, size));
    assert_int_equal(distance_add(&grid, corner, 0), STATUS_OK);
    assert_true(grid.work > 4096 && grid.work < 64 * 64 * 8 * 2);
    grid.work = (1u << 29) - 100;
    assert_int_equal(distance_add(&grid, corner, 1), STATUS_TOO_COMPLEX);
    distance_finish(&grid);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spheres_and_tori_are_their_fields),
        cmocka_unit_test(winding_tells_the_inside),
        cmocka_unit_test(distances_are_exact),
        cmocka_unit_test(open_meshes_are_sheets),
        cmocka_unit_test(colours_are_the_assets),
        cmocka_unit_test(any_size_is_made),
        cmocka_unit_test(what_is_no_tile_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
