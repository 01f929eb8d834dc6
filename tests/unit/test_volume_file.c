/* Volumes from files: what each number becomes, how grids are resampled, what is refused. The files
 * are written by tests/tools/make_volumes.py. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/module.h"
#include "renderer/asset/volume.h"
#include "tests/unit/asset_files.h"

#define DATA "tests/data/volume/"

struct fixture {
    int open;
    struct volume_cache *cache;
    const struct volume *volume;
};

static enum status acquire(struct fixture *f, const char *name, const int size[3], double thickness,
                           struct error *err) {
    struct asset_source source = {files_open, files_close, &f->open};
    struct scene_material spec = {.kind = SCENE_MATERIAL_VOLUME, .volume = name, .lit = true};
    bool made;
    for (int i = 0; size && i < 3; i++)
        spec.size[i] = size[i];
    if (!f->cache)
        f->cache = volume_cache_create(1 << 20);
    enum status status =
        volume_acquire(f->cache, &spec, thickness, "/m", &source, &f->volume, &made, err);
    assert_int_equal(f->open, 0);
    assert_int_equal(made, status == STATUS_OK);
    return status;
}

static struct fixture get(const char *name, const int size[3], double thickness) {
    struct fixture f = {0};
    struct error err = {0};
    if (acquire(&f, name, size, thickness, &err) != STATUS_OK)
        fail_msg("%s: %s", name, err.faults[0].message);
    assert_non_null(f.volume->medium);
    assert_null(f.volume->solid);
    return f;
}

static void drop(struct fixture *f) {
    volume_release(f->cache, f->volume);
    volume_cache_destroy(f->cache);
}

static const float *voxel(const struct fixture *f, int x, int y, int z) {
    const int *n = f->volume->size;
    return f->volume->medium + 4 * ((size_t)((z * n[1] + y) * n[0] + x));
}

static double mean_of(const struct fixture *f, int channel) {
    const int *n = f->volume->size;
    size_t count = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    double sum = 0;
    for (size_t i = 0; i < count; i++)
        sum += (double)f->volume->medium[4 * i + (size_t)channel];
    return sum / (double)count;
}

static void assert_size(const struct fixture *f, int x, int y, int z) {
    assert_int_equal(f->volume->size[0], x);
    assert_int_equal(f->volume->size[1], y);
    assert_int_equal(f->volume->size[2], z);
}

/* A density is extinction per object unit: times the thickness here, voxel for voxel, wherever the
 * file's box begins; zipped or not. */
static void densities_are_per_unit(void **state) {
    (void)state;
    static const char *const names[] = {DATA "density.vdb", DATA "zip.vdb"};
    for (int k = 0; k < 2; k++) {
        struct fixture f = get(names[k], NULL, 0.25);
        assert_size(&f, 10, 6, 9);
        for (int z = 0; z < 9; z++)
            for (int y = 0; y < 6; y++)
                for (int x = 0; x < 10; x++) {
                    float sigma = 0.25f * (float)(x + 10 * y + 100 * z + 1);
                    assert_true(voxel(&f, x, y, z)[3] == sigma);
                    for (int c = 0; c < 3; c++)
                        assert_true(voxel(&f, x, y, z)[c] == 0.8f * sigma);
                }
        assert_true(f.volume->medium_max == 0.25f * 860.0f);
        assert_int_equal(f.volume->notes.negative + f.volume->notes.huge, 0);
        drop(&f);
    }
}

/* The grid `density` is taken, whatever comes first; colours from `Cd`, linear, not clamped. */
static void colours_come_from_their_own_grid(void **state) {
    (void)state;
    struct fixture f = get(DATA "color.vdb", NULL, 1.0);
    assert_size(&f, 10, 6, 9);
    for (int z = 0; z < 9; z += 4)
        for (int x = 0; x < 10; x += 3) {
            float sigma = (float)(x + 30 + 100 * z + 1);
            const float *v = voxel(&f, x, 3, z);
            assert_true(v[3] == sigma && v[0] == 0.25f * sigma && v[2] == 2.0f * sigma);
            assert_true(fabsf(v[1] - sigma / 1024 * sigma) <= 1e-6f * v[1]);
        }
    drop(&f);
}

/* Mean extinction and mean weighted colour stay where the grid is made coarser, also by no whole
 * number; where it is made finer they stay but for the ends along w, which are held. */
static void resampling_keeps_the_mean(void **state) {
    (void)state;
    struct fixture own = get(DATA "color.vdb", NULL, 1.0);
    static const int sizes[][3] = {{5, 3, 3}, {3, 4, 4}, {7, 5, 2}, {1, 1, 1}, {20, 13, 9}};
    for (size_t k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        struct fixture f = get(DATA "color.vdb", sizes[k], 1.0);
        assert_size(&f, sizes[k][0], sizes[k][1], sizes[k][2]);
        for (int c = 0; c < 4; c++)
            assert_true(fabs(mean_of(&f, c) / mean_of(&own, c) - 1) < 1e-5);
        drop(&f);
    }
    /* Linear along w, held at the ends: a voxel in the middle is where it should be. */
    static const int fine[3] = {10, 6, 27};
    struct fixture f = get(DATA "color.vdb", fine, 1.0);
    assert_true(fabsf(voxel(&f, 2, 1, 0)[3] - voxel(&own, 2, 1, 0)[3]) < 1e-3f);
    assert_true(fabsf(voxel(&f, 2, 1, 26)[3] - voxel(&own, 2, 1, 8)[3]) < 1e-3f);
    assert_true(fabsf(voxel(&f, 2, 1, 14)[3] - (voxel(&own, 2, 1, 4)[3] + 100.0f / 3)) < 1e-3f);
    drop(&f);
    drop(&own);
}

/* sigma * thickness = -log1p(-alpha) * layers; 8-bit colours are sRGB. Pages, a column and a row of
 * layers are the same volume. */
static void stacks_hold_alpha(void **state) {
    (void)state;
    static const char *const names[] = {DATA "pages.tif", DATA "column.png", DATA "row.png"};
    struct fixture first = get(names[0], NULL, 0.5);
    assert_size(&first, 4, 4, 3);
    for (int z = 0; z < 3; z++)
        for (int y = 0; y < 4; y++)
            for (int x = 0; x < 4; x++) {
                double alpha = (85.0 * z + 5 * x) / 255, sigma = -log1p(-alpha) * 3;
                double value = 60 * x / 255.0;
                double linear =
                    value <= 0.04045 ? value / 12.92 : pow((value + 0.055) / 1.055, 2.4);
                const float *v = voxel(&first, x, y, z);
                assert_true(fabs((double)v[3] - sigma) < 1e-6 * (1 + sigma));
                assert_true(fabs((double)v[0] - sigma * linear) < 1e-6 * (1 + sigma));
            }
    for (int k = 1; k < 3; k++) {
        struct fixture f = get(names[k], NULL, 0.5);
        assert_size(&f, 4, 4, 3);
        assert_memory_equal(f.volume->medium, first.volume->medium, 4 * 4 * 3 * 16);
        drop(&f);
    }
    drop(&first);
}

/* One channel is alpha; 8 and 16 bits say the same. An alpha of 1 is finite. */
static void grey_is_alpha(void **state) {
    (void)state;
    struct fixture a = get(DATA "grey.tif", NULL, 1.0), b = get(DATA "grey_16.tif", NULL, 1.0);
    struct fixture rgba = get(DATA "pages.tif", NULL, 1.0);
    for (int z = 0; z < 3; z++)
        for (int x = 0; x < 4; x++) {
            float sigma = voxel(&rgba, x, 2, z)[3];
            assert_true(voxel(&a, x, 2, z)[3] == sigma);
            assert_true(fabsf(voxel(&b, x, 2, z)[3] - sigma) < 1e-5f * (1 + sigma));
            assert_true(voxel(&a, x, 2, z)[1] == 0.8f * sigma);
        }
    drop(&a);
    drop(&b);
    drop(&rgba);
}

/* What simulations leave below 0, and what no medium can be: in range, and told. */
static void odd_values_are_brought_into_range(void **state) {
    (void)state;
    struct fixture f = get(DATA "odd.vdb", NULL, 2.0);
    assert_int_equal(f.volume->notes.negative, 10);
    assert_int_equal(f.volume->notes.huge, 4);
    assert_true(voxel(&f, 3, 0, 0)[3] == 0.0f);
    assert_true(voxel(&f, 0, 1, 2)[3] == 2e12f && f.volume->medium_max == 2e12f);
    struct report *report = calloc(1, sizeof *report);
    volume_warn(f.volume, "/m", report);
    assert_int_equal(report->warning_count, 2);
    assert_string_equal(report->warnings[0].code, "volume-negative");
    assert_string_equal(report->warnings[1].code, "volume-huge");
    assert_int_equal(report->warnings[1].count, 4);
    free(report);
    drop(&f);
}

/* The same file in a shell of another thickness is another volume, if it holds densities. */
static void thickness_is_part_of_the_key(void **state) {
    (void)state;
    struct fixture f = {0};
    assert_int_equal(acquire(&f, DATA "density.vdb", NULL, 1.0, NULL), STATUS_OK);
    const struct volume *one = f.volume;
    assert_int_equal(acquire(&f, DATA "density.vdb", NULL, 3.0, NULL), STATUS_OK);
    assert_true(f.volume->medium[3] == 3 * one->medium[3]);
    assert_true(memcmp(f.volume->key, one->key, 32) != 0);
    volume_release(f.cache, one);
    drop(&f);
}

static void refused(const char *name, const char *words) {
    struct fixture f = {0};
    struct error err = {0};
    enum status status = acquire(&f, name, NULL, 1.0, &err);
    if (status != STATUS_BAD_ASSET || !strstr(err.faults[0].message, words))
        fail_msg("%s: %s, not %s", name, status == STATUS_OK ? "was read" : err.faults[0].message,
                 words);
    assert_string_equal(err.faults[0].pointer, "/m/volume");
    assert_null(f.volume);
    error_clear(&err);
    volume_cache_destroy(f.cache);
}

static void bad_files_are_refused(void **state) {
    (void)state;
    static const struct {
        const char *name, *words;
    } rows[] = {
        {DATA "bad_nan.vdb", "not a finite number"},
        {DATA "bad_color_alone.vdb", "without a grid of floats"},
        {DATA "bad_cut_short.vdb", "cut short"},
        {DATA "bad_old.vdb", "version 200"},
        {DATA "bad_huge.vdb", "100000 x 100000 x 100000 voxels"},
        {DATA "bad_inside_out.vdb", "empty"},
        {DATA "bad_no_grid.vdb", "without a grid"},
        {DATA "bad_three_channels.tif", "3 channels"},
        {DATA "bad_shape.png", "4 x 10 pixels is no volume"},
        {DATA "bad_pages.tif", "layer 1"},
        {DATA "bad_cut_short.tif", "cut short"},
        {DATA "bad_round.tif", "damaged"},
        {"tests/data/image/bad_text.png", "not an image"},
        {"tests/data/image/bad_empty.png", "empty"},
        {"tests/data/image/bad_100000_wide.png", "100000"},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        refused(rows[k].name, rows[k].words);
}

/* A source that gives the beginning of a file. */
struct beginning {
    struct asset_bytes whole;
    size_t size;
};

static enum status open_beginning(void *user, const char *name, const char *pointer,
                                  struct asset_bytes *bytes, struct error *err) {
    (void)name, (void)pointer, (void)err;
    const struct beginning *b = user;
    *bytes = b->whole;
    bytes->size = b->size;
    bytes->sha256[0] = (unsigned char)b->size;
    bytes->sha256[1] = (unsigned char)(b->size >> 8);
    return STATUS_OK;
}

static void close_beginning(void *user, struct asset_bytes *bytes) {
    (void)user, (void)bytes;
}

/* Wherever a file ends early it is refused, and nothing else happens. */
static void files_that_end_early_are_refused(void **state) {
    (void)state;
    static const char *const names[] = {DATA "density.vdb", DATA "pages.tif", DATA "row.png"};
    for (int k = 0; k < 3; k++) {
        int open = 0;
        struct beginning b;
        assert_int_equal(files_open(&open, names[k], "", &b.whole, NULL), STATUS_OK);
        struct volume_cache *cache = volume_cache_create(0);
        struct asset_source source = {open_beginning, close_beginning, &b};
        struct scene_material spec = {.kind = SCENE_MATERIAL_VOLUME, .volume = "v"};
        size_t step = b.whole.size / 60 + 1, refusals = 0;
        for (b.size = 0; b.size + 4 < b.whole.size; b.size += step) {
            const struct volume *volume;
            bool made;
            struct error err = {0};
            enum status status =
                volume_acquire(cache, &spec, 1.0, "/m", &source, &volume, &made, &err);
            if (status != STATUS_BAD_ASSET)
                fail_msg("%s: %zu of %zu bytes: %s", names[k], b.size, b.whole.size,
                         status_slug(status));
            refusals++;
            error_clear(&err);
        }
        assert_true(refusals > 30);
        volume_cache_destroy(cache);
        files_close(&open, &b.whole);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(densities_are_per_unit),
        cmocka_unit_test(colours_come_from_their_own_grid),
        cmocka_unit_test(resampling_keeps_the_mean),
        cmocka_unit_test(stacks_hold_alpha),
        cmocka_unit_test(grey_is_alpha),
        cmocka_unit_test(odd_values_are_brought_into_range),
        cmocka_unit_test(thickness_is_part_of_the_key),
        cmocka_unit_test(bad_files_are_refused),
        cmocka_unit_test(files_that_end_early_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
