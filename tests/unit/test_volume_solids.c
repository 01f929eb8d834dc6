/* The built-in solids: the field is a depth in voxels, and what each material shows. */
#include "tests/unit/volume_fixture.h"

/* Distance to a torus leaning by `angle` about u, by brute force: points along its centre line,
 * refined; shares nothing with the generator but the design's numbers. */
static double torus_distance(const double p[3], const double c[3], double angle, double radius,
                             double wire) {
    double best = 1e9, at = 0, step = 0.01;
    for (int pass = 0; pass < 3; pass++) {
        double from = pass ? at - step : 0, to = pass ? at + step : 6.2831853;
        step = pass ? step / 100 : step;
        for (double a = from; a <= to; a += step) {
            double q[3] = {c[0] + radius * cos(a), c[1] + radius * sin(a) * cos(angle),
                           c[2] + radius * sin(a) * sin(angle)};
            double d = sqrt((p[0] - q[0]) * (p[0] - q[0]) + (p[1] - q[1]) * (p[1] - q[1]) +
                            (p[2] - q[2]) * (p[2] - q[2]));
            if (d < best) {
                best = d;
                at = a;
            }
        }
    }
    return best - wire;
}

/* Nearest wire of all rings and their periodic copies near a point, in tile widths. */
static double chain_distance(const double p[3]) {
    double radius = 1.0 / (3 * 2.4), best = 1e9;
    for (int row = -2; row < 10; row++)
        for (int column = -1; column < 4; column++) {
            int odd = row & 1;
            double c[3] = {(column + (odd ? 0.75 : 0.25)) / 3.0, (row + 0.5) / 8.0, 0.125};
            if (fabs(p[0] - c[0]) > 0.3 || fabs(p[1] - c[1]) > 0.3)
                continue;
            double d = torus_distance(p, c, odd ? -M_PI / 6 : M_PI / 6, radius, 0.155 * radius);
            best = fmin(best, d);
        }
    return best;
}

/* In cubic voxels s is the ramp of the true distance: within 2e-4 (float rounding of coordinates;
 * measured 1e-6), at every 23rd voxel of a 64-voxel tile. */
static void chain_is_the_distance_to_its_rings(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_CHAIN, 1, 64, 64, 16);
    double worst = 0;
    int ramp = 0;
    for (size_t i = 0; i < count_of(&volume); i += 23) {
        double p[3] = {((double)(i % 64) + 0.5) / 64, ((double)(i / 64 % 64) + 0.5) / 64,
                       ((double)(i / 4096) + 0.5) / 64};
        double s = fmin(fmax(0.5 - 32 * chain_distance(p), 0.0), 1.0);
        worst = fmax(worst, fabs(s - (double)volume.solid[4 * i + 3]));
        ramp += s > 0.0 && s < 1.0;
    }
    print_message("chain: worst error of s %.2e over %d voxels of the ramp\n", worst, ramp);
    assert_true(ramp > 300);
    assert_true(worst < 2e-4);
    drop(&volume);
}

/* In voxels that are not cubes the 1/2 level still lies on the true surface: along each axis, a
 * crossing between two voxels is within 0.001 tile widths (a quarter of a layer's height) of it;
 * measured 0.0002. */
static void chain_surface_holds_in_flat_voxels(void **state) {
    (void)state;
    enum { NX = 128, NY = 64, NZ = 64 };
    struct volume volume = make(SCENE_BUILTIN_CHAIN, 1, NX, NY, NZ);
    double worst = 0;
    int crossings = 0;
    for (int y = 0; y < NY; y += 9)
        for (int x = 0; x < NX; x += 5)
            for (int z = 0; z + 1 < NZ; z++) {
                size_t i = ((size_t)z * NY + (size_t)y) * NX + (size_t)x;
                double a = (double)volume.solid[4 * i + 3],
                       b = (double)volume.solid[4 * (i + (size_t)NX * NY) + 3];
                if ((a < 0.5) == (b < 0.5))
                    continue;
                double at = (0.5 - a) / (b - a);
                double p[3] = {(x + 0.5) / NX, (y + 0.5) / NY, (z + 0.5 + at) / NZ * 0.25};
                worst = fmax(worst, fabs(chain_distance(p)));
                crossings++;
            }
    print_message("chain: surface off by %.2e at most over %d crossings\n", worst, crossings);
    assert_true(crossings > 100);
    assert_true(worst < 0.001);
    drop(&volume);
}

/* s-weighted colour divided by s is the ring's colour, also outside the surface: never darkened by
 * the empty voxels around it. */
static void chain_colour_reaches_outside(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_CHAIN, 1, 64, 64, 16);
    int outside = 0;
    for (size_t i = 0; i < count_of(&volume); i++) {
        const float *f = volume.solid + 4 * i;
        if (f[3] <= 0.01f || f[3] >= 0.5f)
            continue;
        outside++;
        assert_true(f[0] / f[3] > 0.12f && f[0] / f[3] < 0.40f);
    }
    assert_true(outside > 1000);
    drop(&volume);
}

/* Of a column: the topmost surface (in tile widths), how often air lies over solid, and whether a
 * look from above goes through. */
struct column {
    double top;
    int layers;
};

static struct column column_at(const struct volume *volume, int x, int y) {
    struct column column = {0, 0};
    bool above = false;
    for (int z = volume->size[2] - 1; z >= 0; z--) {
        float s = volume->solid[voxel_at(volume, x, y, z) + 3];
        if (s >= 0.5f && !above) {
            if (column.layers++ == 0)
                column.top = (double)((float)z + 0.5f) / volume->size[2] * VOLUME_TILE_DEPTH;
        }
        above = s >= 0.5f;
    }
    return column;
}

/* Share of columns with at least `least` layers of solid. */
static double share_of_columns(const struct volume *volume, int least) {
    int found = 0;
    for (int y = 0; y < volume->size[1]; y++)
        for (int x = 0; x < volume->size[0]; x++)
            found += column_at(volume, x, y).layers >= least;
    return (double)found / volume->size[0] / volume->size[1];
}

/* s is 1/2 + d/2 with d a distance in voxels: where all neighbours lie on the ramp its gradient is
 * 1/2. Creases differ; so of each material's ramp 4 of 5
 * voxels must be within a third of it (measured 0.83 for bark, 0.91 for rocks' noise, else more).
 */
static void solids_are_depths_in_voxels(void **state) {
    (void)state;
    static const struct {
        enum scene_builtin builtin;
        const char *name;
    } rows[] = {{SCENE_BUILTIN_WEAVE, "weave"},
                {SCENE_BUILTIN_ROCKS, "rocks"},
                {SCENE_BUILTIN_GRATE, "grate"},
                {SCENE_BUILTIN_SCALES, "scales"}};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        struct volume volume = make(rows[k].builtin, 2, 128, 128, 32);
        check_voxels(&volume);
        int ramp = 0, right = 0;
        for (int z = 1; z < 31; z++)
            for (int y = 0; y < 128; y++)
                for (int x = 0; x < 128; x++) {
                    static const int steps[6][3] = {{-1, 0, 0}, {1, 0, 0},  {0, -1, 0},
                                                    {0, 1, 0},  {0, 0, -1}, {0, 0, 1}};
                    float s[6];
                    bool all = true;
                    for (int i = 0; i < 6; i++) {
                        s[i] = volume.solid[voxel_at(&volume, x + steps[i][0], y + steps[i][1],
                                                     z + steps[i][2]) +
                                            3];
                        all = all && s[i] > 0.0f && s[i] < 1.0f;
                    }
                    if (!all)
                        continue;
                    float gx = s[1] - s[0], gy = s[3] - s[2], gz = s[5] - s[4];
                    float g = 0.5f * sqrtf(gx * gx + gy * gy + gz * gz);
                    ramp++;
                    right += g > 0.5f * 0.667f && g < 0.5f * 1.333f;
                }
        print_message("%s: %d voxels of the ramp, %.3f of them right\n", rows[k].name, ramp,
                      (double)right / ramp);
        assert_true(ramp > 200);
        assert_true(right > 0.6 * ramp);
        drop(&volume);
    }
}

/* How much of the tile is solid does not depend on the grid: the mean of s is the same within 4 %
 * from 96 x 96 x 32 to 192 x 128 x 64 (chain, whose wires are as thin as the ramp is wide, has the
 * most). */
static void solids_do_not_depend_on_the_grid(void **state) {
    (void)state;
    static const enum scene_builtin kinds[] = {SCENE_BUILTIN_CHAIN,  SCENE_BUILTIN_WEAVE,
                                               SCENE_BUILTIN_ROCKS,  SCENE_BUILTIN_GRATE,
                                               SCENE_BUILTIN_SCALES, SCENE_BUILTIN_BARK};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        double mean[2];
        for (int fine = 0; fine < 2; fine++) {
            struct volume volume =
                fine ? make(kinds[k], 1, 192, 128, 64) : make(kinds[k], 1, 96, 96, 32);
            double sum = 0;
            for (size_t i = 3; i < 4 * count_of(&volume); i += 4)
                sum += (double)volume.solid[i];
            mean[fine] = sum / (double)count_of(&volume);
            drop(&volume);
        }
        print_message("material %d: solid %.4f coarse, %.4f fine\n", (int)kinds[k], mean[0],
                      mean[1]);
        assert_true(fabs(mean[0] / mean[1] - 1.0) < 0.04);
    }
}

/* Over one, under one: at each crossing both threads lie on one another, and from one to the next
 * the other one is on top; between four of them one sees through. */
static void weave_goes_over_and_under(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_WEAVE, 1, 128, 128, 32);
    for (int j = 0; j < 4; j++)
        for (int i = 0; i < 4; i++) {
            int x = 16 + 32 * i, y = 16 + 32 * j;
            struct column here = column_at(&volume, x, y);
            assert_int_equal(here.layers, 1); /* they touch */
            assert_true(here.top > 0.22 && here.top < 0.25);
            /* Half way to the next crossing the thread on top has come down to the middle: along u
             * or v, in turns. */
            double along_u = column_at(&volume, x, y + 13).top,
                   along_v = column_at(&volume, x + 13, y).top;
            assert_true(((i + j) & 1) ? along_v < along_u : along_u < along_v);
        }
    double open = 1.0 - share_of_columns(&volume, 1);
    print_message("weave: %.3f open\n", open);
    assert_true(open > 0.03 && open < 0.07); /* (1 - 4 * 2 * 0.098)^2 = 0.047 */
    drop(&volume);
}

/* Ground everywhere, stones of many heights, most of which lie over air, none cut off. */
static void rocks_lie_heaped(void **state) {
    (void)state;
    for (uint32_t seed = 1; seed <= 3; seed++) {
        struct volume volume = make(SCENE_BUILTIN_ROCKS, seed, 96, 96, 32);
        double sum = 0, squares = 0;
        for (int y = 0; y < 96; y++)
            for (int x = 0; x < 96; x++) {
                assert_true(volume.solid[voxel_at(&volume, x, y, 1) + 3] > 0.5f);
                assert_true(volume.solid[voxel_at(&volume, x, y, 31) + 3] < 0.5f);
                double top = column_at(&volume, x, y).top;
                sum += top;
                squares += top * top;
            }
        double mean = sum / (96 * 96), spread = sqrt(squares / (96 * 96) - mean * mean);
        double over_air = share_of_columns(&volume, 2);
        print_message("rocks %u: mean top %.3f, spread %.3f, over air %.3f\n", seed, mean, spread,
                      over_air);
        assert_true(mean > 0.08 && mean < 0.2);
        assert_true(spread > 0.03);
        assert_true(over_air > 0.2 && over_air < 0.9);
        drop(&volume);
    }
}

/* Trunks below, leaves above, sky over all. */
static void trees_stand_on_trunks(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_TREES, 1, 128, 128, 32);
    size_t layer = 128 * 128;
    double leaves[32] = {0}, wood[32] = {0};
    for (size_t z = 0; z < 32; z++)
        for (size_t i = z * layer; i < (z + 1) * layer; i++) {
            leaves[z] += (volume.medium[4 * i + 3] > 16.0f) / (double)layer;
            wood[z] += (volume.solid[4 * i + 3] >= 0.5f) / (double)layer;
        }
    print_message("trees: wood %.4f, leaves %.3f below; wood %.4f, leaves %.3f in the crowns\n",
                  wood[1], leaves[1], wood[16], leaves[16]);
    assert_true(wood[1] > 0.005 && wood[1] < 0.04);
    assert_true(leaves[1] < 0.015);
    assert_true(leaves[16] > 0.08 && leaves[16] < 0.5);
    assert_true(leaves[31] == 0.0 && wood[31] == 0.0);
    drop(&volume);
}

/* Away from the welds it is the distance to upright bars and round rods: within 0.01 of s, from the
 * differences that its gradient is made of (measured 0.0027).
 * One sees through as much of it as these leave open. */
static void grate_is_the_distance_to_its_bars(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_GRATE, 1, 128, 128, 32);
    double worst = 0;
    int ramp = 0;
    for (int z = 0; z < 32; z++)
        for (int y = 0; y < 128; y++)
            for (int x = 0; x < 128; x++) {
                double u = (x + 0.5) / 128, v = (y + 0.5) / 128, w = (z + 0.5) / 128;
                double across = fabs(fmod(u, 0.25) - 0.125) - 0.026 + 0.014;
                double up = fabs(w - 0.1025) - 0.0825 + 0.014;
                double bar =
                    hypot(fmax(across, 0), fmax(up, 0)) + fmin(fmax(across, up), 0) - 0.014;
                double rod = hypot(fabs(fmod(v, 0.25) - 0.125), w - 0.178) - 0.031;
                if (fabs(bar - rod) < 0.026)
                    continue;
                double s = fmin(fmax(0.5 - 64 * fmin(bar, rod), 0), 1);
                double found = (double)volume.solid[voxel_at(&volume, x, y, z) + 3];
                worst = fmax(worst, s > 0.0 && s < 1.0 ? fabs(s - found) : 0.0);
                ramp += s > 0.0 && s < 1.0;
            }
    double open = 1.0 - share_of_columns(&volume, 1);
    print_message("grate: s off by %.1e over %d voxels; %.3f open\n", worst, ramp, open);
    assert_true(ramp > 5000);
    assert_true(worst < 0.01);
    assert_true(open > 0.54 &&
                open < 0.62); /* (1 - 4 * 0.052)(1 - 4 * 0.062) = 0.596, less welds */
    drop(&volume);
}

/* Skin everywhere, and scales over air over more scales nearly everywhere. */
static void scales_overlap(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_SCALES, 1, 128, 128, 64);
    double one = share_of_columns(&volume, 1), two = share_of_columns(&volume, 2),
           three = share_of_columns(&volume, 3);
    print_message("scales: columns with 1, 2, 3 layers: %.3f %.3f %.3f\n", one, two, three);
    assert_true(one == 1.0);
    assert_true(two > 0.8);
    assert_true(three > 0.2);
    for (int i = 0; i < 128 * 128; i++)
        assert_true(volume.solid[voxel_at(&volume, i % 128, i / 128, 63) + 3] == 0.0f);
    drop(&volume);
}

/* A height field without overhangs, whose plates are longer along v than wide along u, with
 * fissures that go deep. */
static void bark_is_plates_along_v(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_BARK, 1, 128, 128, 64);
    double low = 0, high = 0, steps[2] = {0, 0};
    for (int y = 0; y < 128; y++)
        for (int x = 0; x < 128; x++) {
            for (int z = 0; z < 63; z++)
                assert_true(volume.solid[voxel_at(&volume, x, y, z) + 3] >=
                            volume.solid[voxel_at(&volume, x, y, z + 1) + 3]);
            double top = column_at(&volume, x, y).top / VOLUME_TILE_DEPTH;
            low += top < 0.3;
            high += top > 0.55;
            steps[0] += fabs(top - column_at(&volume, (x + 4) % 128, y).top / VOLUME_TILE_DEPTH);
            steps[1] += fabs(top - column_at(&volume, x, (y + 4) % 128).top / VOLUME_TILE_DEPTH);
        }
    print_message("bark: %.3f deep, %.3f high, %.2f times rougher across\n", low / 16384,
                  high / 16384, steps[0] / steps[1]);
    assert_true(low / 16384 > 0.1 && low / 16384 < 0.5);
    assert_true(high / 16384 > 0.15 && high / 16384 < 0.7);
    assert_true(steps[0] > 1.3 * steps[1]);
    drop(&volume);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chain_is_the_distance_to_its_rings),
        cmocka_unit_test(chain_surface_holds_in_flat_voxels),
        cmocka_unit_test(chain_colour_reaches_outside),
        cmocka_unit_test(solids_are_depths_in_voxels),
        cmocka_unit_test(solids_do_not_depend_on_the_grid),
        cmocka_unit_test(weave_goes_over_and_under),
        cmocka_unit_test(rocks_lie_heaped),
        cmocka_unit_test(trees_stand_on_trunks),
        cmocka_unit_test(grate_is_the_distance_to_its_bars),
        cmocka_unit_test(scales_overlap),
        cmocka_unit_test(bark_is_plates_along_v),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
