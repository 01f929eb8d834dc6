/* The built-in materials: tiling, seeds, determinism, extreme sizes, the shape of each. */
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
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

/* Media first. */
static const enum scene_builtin built_in[] = {SCENE_BUILTIN_FUR, SCENE_BUILTIN_CLOUDS,
                                              SCENE_BUILTIN_FOG, SCENE_BUILTIN_CHAIN};
enum { MEDIUM_COUNT = 3, BUILT_IN_COUNT = 4 };

static struct volume make(enum scene_builtin builtin, uint32_t seed, int nx, int ny, int nz) {
    struct scene_material spec = {
        .kind = SCENE_MATERIAL_BUILTIN, .builtin = builtin, .seed = seed, .lit = true};
    struct volume volume = {.size = {nx, ny, nz}};
    assert_true(volume_builtin_exists(builtin));
    assert_int_equal(volume_make_builtin(&spec, &volume), STATUS_OK);
    return volume;
}

static void drop(struct volume *volume) {
    free(volume->medium);
    free(volume->solid);
}

static const float *voxels(const struct volume *volume) {
    return volume->medium ? volume->medium : volume->solid;
}

static size_t count_of(const struct volume *volume) {
    return (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
}

/* Every voxel: finite, not negative, colour within its weight; medium_max is the largest. */
static void check_voxels(const struct volume *volume) {
    const float *f = voxels(volume);
    assert_non_null(f);
    assert_true((volume->medium != NULL) != (volume->solid != NULL));
    float max = 0.0f;
    for (size_t i = 0; i < count_of(volume); i++, f += 4) {
        for (int c = 0; c < 4; c++)
            assert_true(isfinite(f[c]) && f[c] >= 0.0f);
        for (int c = 0; c < 3; c++)
            assert_true(f[c] <= f[3] * 1.0001f);
        if (volume->solid)
            assert_true(f[3] <= 1.0f);
        max = fmaxf(max, f[3]);
    }
    if (volume->medium)
        assert_true(volume->medium_max == max);
}

/* Mean absolute difference between lines of voxels along an axis: of neighbours within the tile,
 * across its seam, and across a seam that is none (the last line against one in mid-tile). */
struct steps {
    double inside, seam, torn;
};

static struct steps measure_steps(const struct volume *volume, int axis) {
    const float *f = voxels(volume);
    int n = volume->size[axis], across = volume->size[1 - axis];
    size_t step = axis == 0 ? 1 : (size_t)volume->size[0];
    size_t other = axis == 0 ? (size_t)volume->size[0] : 1;
    size_t layer = (size_t)volume->size[0] * (size_t)volume->size[1];
    struct steps steps = {0, 0, 0};
    for (int z = 0; z < volume->size[2]; z++)
        for (int j = 0; j < across; j++) {
            const float *line = f + 4 * ((size_t)z * layer + (size_t)j * other) + 3;
            double first = (double)line[0], last = (double)line[4 * step * (size_t)(n - 1)];
            steps.seam += fabs(last - first);
            steps.torn += fabs(last - (double)line[4 * step * (size_t)(n * 5 / 13)]);
            for (int i = 0; i + 1 < n; i++)
                steps.inside += fabs((double)line[4 * step * (size_t)i] -
                                     (double)line[4 * step * (size_t)(i + 1)]) /
                                (n - 1);
        }
    return steps;
}

/* The seam is a line between voxels like any other. Mean of eight seeds, relative to the lines
 * inside: 0.61 to 1.17; torn, which is what a tile that does not wrap would give: 1.26 (fur, which
 * is nearly as rough from voxel to voxel) to 6.5. */
static void tiles_have_no_seam(void **state) {
    (void)state;
    for (int i = 0; i < BUILT_IN_COUNT; i++)
        for (int axis = 0; axis < 2; axis++) {
            struct steps sum = {0, 0, 0};
            for (uint32_t seed = 1; seed <= 8; seed++) {
                struct volume volume = make(built_in[i], seed, 64, 64, 16);
                struct steps steps = measure_steps(&volume, axis);
                sum.inside += steps.inside;
                sum.seam += steps.seam;
                sum.torn += steps.torn;
                drop(&volume);
            }
            print_message("material %d axis %d: seam %.2f, torn %.2f of an inner step\n", i, axis,
                          sum.seam / sum.inside, sum.torn / sum.inside);
            assert_true(sum.seam < 1.2 * sum.inside);
            assert_true(sum.torn > 1.2 * sum.inside);
        }
}

static void same_seed_same_bytes(void **state) {
    (void)state;
    for (int i = 0; i < BUILT_IN_COUNT; i++) {
        struct volume a = make(built_in[i], 7, 40, 24, 12), b = make(built_in[i], 7, 40, 24, 12);
        struct volume c = make(built_in[i], 8, 40, 24, 12);
        assert_memory_equal(voxels(&a), voxels(&b), count_of(&a) * 16);
        assert_true(memcmp(voxels(&a), voxels(&c), count_of(&a) * 16) != 0);
        drop(&a);
        drop(&b);
        drop(&c);
    }
}

static void any_size_is_made(void **state) {
    (void)state;
    static const int sizes[][3] = {{1, 1, 1},   {512, 1, 1}, {1, 512, 1}, {1, 1, 64}, {2, 2, 2},
                                   {7, 300, 3}, {3, 1, 64},  {64, 64, 1}, {31, 17, 5}};
    for (int i = 0; i < BUILT_IN_COUNT; i++)
        for (size_t j = 0; j < sizeof sizes / sizeof *sizes; j++) {
            struct volume volume = make(built_in[i], 3, sizes[j][0], sizes[j][1], sizes[j][2]);
            check_voxels(&volume);
            drop(&volume);
        }
}

/* The mean extinction is that of the hairs and clouds, not of the grid: within 15 % from 16 x 16 x
 * 8 to 256 x 256 x 64 (measured: 11 % for fur, whose hairs are cut off where they are a voxel
 * thick). */
static void extinction_does_not_depend_on_the_grid(void **state) {
    (void)state;
    for (int i = 0; i < MEDIUM_COUNT; i++) {
        double mean[2];
        for (int fine = 0; fine < 2; fine++) {
            struct volume volume =
                fine ? make(built_in[i], 1, 256, 256, 64) : make(built_in[i], 1, 16, 16, 8);
            double sum = 0;
            for (size_t k = 0; k < count_of(&volume); k++)
                sum += (double)volume.medium[4 * k + 3];
            mean[fine] = sum / (double)count_of(&volume);
            drop(&volume);
        }
        print_message("material %d: mean extinction %.3f coarse, %.3f fine\n", i, mean[0], mean[1]);
        assert_true(fabs(mean[0] / mean[1] - 1.0) < 0.15);
    }
}

/* Mean opacity of one voxel's height in layer z. */
static double layer_opacity(const struct volume *volume, int z) {
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1];
    const float *f = volume->medium + 4 * count * (size_t)z;
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += -expm1(-(double)f[4 * i + 3] / volume->size[2]);
    return sum / (double)count;
}

/* Dense at the roots, thinning out, nearly gone at the top; nobody sees the skin from above. */
static void fur_thins_towards_the_tips(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_FUR, 1, 128, 128, 32);
    check_voxels(&volume);
    assert_true(layer_opacity(&volume, 0) > 0.35);
    for (int z = 4; z < 32; z += 4)
        assert_true(layer_opacity(&volume, z) < layer_opacity(&volume, z - 4));
    assert_true(layer_opacity(&volume, 31) < 0.01);
    size_t count = 128 * 128, bare = 0;
    for (size_t i = 0; i < count; i++) {
        double depth = 0;
        for (size_t z = 0; z < 32; z++)
            depth += (double)volume.medium[4 * (z * count + i) + 3] / 32;
        bare += exp(-depth) > 0.5;
    }
    assert_true(bare < count / 100);
    drop(&volume);
}

static void fur_is_darker_at_the_roots(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_FUR, 1, 64, 64, 32);
    double green[2] = {0, 0}, weight[2] = {0, 0};
    size_t layer = 64 * 64;
    for (int top = 0; top < 2; top++)
        for (size_t i = 0; i < layer; i++) {
            const float *f = volume.medium + 4 * ((top ? 20 : 1) * layer + i);
            green[top] += (double)f[1];
            weight[top] += (double)f[3];
        }
    assert_true(green[1] / weight[1] > 2 * green[0] / weight[0]);
    drop(&volume);
}

static void clouds_have_clear_sky_above_and_below(void **state) {
    (void)state;
    struct volume volume = make(SCENE_BUILTIN_CLOUDS, 1, 64, 64, 32);
    size_t layer = 64 * 64, cloudy = 0;
    for (size_t i = 0; i < layer; i++) {
        assert_true(volume.medium[4 * i + 3] == 0.0f);
        assert_true(volume.medium[4 * (31 * layer + i) + 3] == 0.0f);
        double depth = 0;
        for (size_t z = 0; z < 32; z++)
            depth += (double)volume.medium[4 * (z * layer + i) + 3] / 32;
        cloudy += depth > 1.0;
    }
    /* Between a fifth and three fifths of the sky is covered: neither empty nor overcast. */
    assert_in_range(cloudy, layer / 5, layer * 3 / 5);
    drop(&volume);
}

/* Mean extinction of layer z, and its spread from place to place as a share of the mean. */
static double layer_extinction(const struct volume *volume, int z, double *spread) {
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1];
    const float *f = volume->medium + 4 * count * (size_t)z;
    double sum = 0, squares = 0;
    for (size_t i = 0; i < count; i++) {
        sum += (double)f[4 * i + 3];
        squares += (double)f[4 * i + 3] * (double)f[4 * i + 3];
    }
    double mean = sum / (double)count;
    *spread = sqrt(squares / (double)count - mean * mean) / mean;
    return mean;
}

/* Everywhere and even on the ground, ever thinner and more torn with height, nothing at the top. */
static void fog_thins_and_tears_with_height(void **state) {
    (void)state;
    for (uint32_t seed = 1; seed <= 4; seed++) {
        struct volume volume = make(SCENE_BUILTIN_FOG, seed, 64, 64, 32);
        check_voxels(&volume);
        double spread, below_spread, below = layer_extinction(&volume, 0, &below_spread);
        print_message("fog %u: ground %.2f, spread %.2f", seed, below, below_spread);
        assert_true(below > 3.0 && below_spread < 0.25);
        for (size_t i = 0; i < 64 * 64; i++)
            assert_true(volume.medium[4 * i + 3] > 0.5f); /* no bare ground */
        for (int z = 4; z < 28; z += 4) {
            double mean = layer_extinction(&volume, z, &spread);
            assert_true(mean < below && spread > below_spread);
            below = mean;
            below_spread = spread;
        }
        print_message("; at 3/4 %.3f, %.2f\n", below, below_spread);
        assert_true(below > 0.0 && below < 0.2 && below_spread > 1.5);
        for (size_t i = 31 * 64 * 64; i < 32 * 64 * 64; i++)
            assert_true(volume.medium[4 * i + 3] == 0.0f);
        drop(&volume);
    }
}

/* Noise along a line is the noise of its points, also where it starts below a lattice plane and
 * where a step leaps over several: within 4e-6, the rounding of coordinates (measured 5e-7). */
static void noise_along_a_line_is_the_noise(void **state) {
    (void)state;
    static const float starts[][4] = {{0.3f, 1.7f, 0.01f, 0.1f},
                                      {3.9f, 0.0f, -2.3f, 0.37f},
                                      {-0.5f, 4.25f, 0.5f, 2.75f},
                                      {1.0f, 2.0f, 3.0f, 1.0f}};
    double worst = 0;
    for (size_t k = 0; k < sizeof starts / sizeof *starts; k++) {
        const float *s = starts[k];
        float sums[40];
        for (int i = 0; i < 40; i++)
            sums[i] = 0.25f;
        random_noise_line(9, s[0], s[1], s[2], s[3], 4, 5, 2.0f, 40, sums);
        for (int i = 0; i < 40; i++) {
            float n = random_noise(9, s[0], s[1], s[2] + (float)i * s[3], 4, 5);
            worst = fmax(worst, fabs((double)sums[i] - (0.25 + 2.0 * (double)n)));
        }
    }
    print_message("noise along a line: off by %.1e\n", worst);
    assert_true(worst < 4e-6);
}

static void tint_is_taken(void **state) {
    (void)state;
    struct scene_material spec = {.has_color = true, .color = {1.0, 0.0, 0.0}};
    for (int m = 0; m < BUILT_IN_COUNT; m++) {
        struct volume volume = {.size = {24, 24, 16}};
        spec.builtin = built_in[m];
        assert_int_equal(volume_make_builtin(&spec, &volume), STATUS_OK);
        double red = 0;
        for (size_t i = 0; i < count_of(&volume); i++) {
            const float *f = voxels(&volume) + 4 * i;
            red += (double)f[0];
            assert_true(f[1] == 0.0f && f[2] == 0.0f);
        }
        assert_true(red > 0);
        drop(&volume);
    }
}

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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_have_no_seam),
        cmocka_unit_test(same_seed_same_bytes),
        cmocka_unit_test(any_size_is_made),
        cmocka_unit_test(extinction_does_not_depend_on_the_grid),
        cmocka_unit_test(fur_thins_towards_the_tips),
        cmocka_unit_test(fur_is_darker_at_the_roots),
        cmocka_unit_test(clouds_have_clear_sky_above_and_below),
        cmocka_unit_test(fog_thins_and_tears_with_height),
        cmocka_unit_test(noise_along_a_line_is_the_noise),
        cmocka_unit_test(tint_is_taken),
        cmocka_unit_test(chain_is_the_distance_to_its_rings),
        cmocka_unit_test(chain_surface_holds_in_flat_voxels),
        cmocka_unit_test(chain_colour_reaches_outside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
