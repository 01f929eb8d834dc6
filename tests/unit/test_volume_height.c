/* Height fields: no terraces, the ends of the range, resampling, colours, faults. Images are made
 * in memory (libpng, OpenEXR through the module) and handed over by a source of the test's own. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>
#include <gnutls/crypto.h>
#include <math.h>
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"
#include "renderer/asset/volume.h"

enum { FILES_MAX = 4 };

/* Files by name; counts what is open, so that a leak of one shows. */
struct shelf {
    struct {
        const char *name;
        unsigned char *data;
        size_t bytes;
    } files[FILES_MAX];
    int count, open;
};

static enum status shelf_open(void *user, const char *name, const char *pointer,
                              struct asset_bytes *bytes, struct error *err) {
    struct shelf *shelf = user;
    for (int i = 0; i < shelf->count; i++)
        if (strcmp(shelf->files[i].name, name) == 0) {
            *bytes =
                (struct asset_bytes){.data = shelf->files[i].data, .size = shelf->files[i].bytes};
            assert_int_equal(
                gnutls_hash_fast(GNUTLS_DIG_SHA256, bytes->data, bytes->size, bytes->sha256), 0);
            shelf->open++;
            return STATUS_OK;
        }
    return error_fault(err, STATUS_ASSET_NOT_FOUND, pointer, "no file %s", name);
}

static void shelf_close(void *user, struct asset_bytes *bytes) {
    struct shelf *shelf = user;
    assert_non_null(bytes->data);
    shelf->open--;
}

static void shelf_add(struct shelf *shelf, const char *name, unsigned char *data, size_t bytes) {
    assert_true(shelf->count < FILES_MAX);
    shelf->files[shelf->count].name = name;
    shelf->files[shelf->count].data = data;
    shelf->files[shelf->count++].bytes = bytes;
}

static void shelf_clear(struct shelf *shelf) {
    assert_int_equal(shelf->open, 0);
    for (int i = 0; i < shelf->count; i++)
        free(shelf->files[i].data);
    *shelf = (struct shelf){0};
}

struct buffer {
    unsigned char *data;
    size_t bytes;
};

static void append(png_structp png, png_bytep data, png_size_t bytes) {
    struct buffer *buffer = png_get_io_ptr(png);
    buffer->data = realloc(buffer->data, buffer->bytes + bytes);
    memcpy(buffer->data + buffer->bytes, data, bytes);
    buffer->bytes += bytes;
}

static void flush(png_structp png) {
    (void)png;
}

/* Adds a PNG file: `channels` 1 (grey) or 3 (RGB), samples most significant byte first. */
static void add_png(struct shelf *shelf, const char *name, int width, int height, int channels,
                    int bits, const unsigned char *samples) {
    struct buffer buffer = {NULL, 0};
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_set_write_fn(png, &buffer, append, flush);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, bits,
                 channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int y = 0; y < height; y++)
        png_write_row(png, samples + (size_t)y * (size_t)(width * channels * bits / 8));
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    shelf_add(shelf, name, buffer.data, buffer.bytes);
}

static void add_grey16(struct shelf *shelf, const char *name, int width, int height,
                       double (*value)(int x, int y)) {
    unsigned char *samples = malloc((size_t)width * (size_t)height * 2);
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            unsigned v = (unsigned)(value(x, y) * 65535 + 0.5);
            samples[2 * (y * width + x)] = (unsigned char)(v >> 8);
            samples[2 * (y * width + x) + 1] = (unsigned char)v;
        }
    add_png(shelf, name, width, height, 1, 16, samples);
    free(samples);
}

/* Adds an OpenEXR file whose every pixel is RGBA = value. */
static void add_exr(struct shelf *shelf, const char *name, const float value[4]) {
    const struct image_module *module = module_open(MODULE_IMAGE_OIIO, NULL);
    assert_non_null(module);
    float rgba[8 * 8 * 4];
    for (int i = 0; i < 8 * 8 * 4; i++)
        rgba[i] = value[i % 4];
    char message[256];
    unsigned char *data;
    size_t bytes;
    assert_int_equal(module->encode_exr(rgba, 8, 8, &data, &bytes, message, sizeof message), 0);
    shelf_add(shelf, name, data, bytes);
}

static struct scene_material material(const char *height, const char *color, int nx, int ny,
                                      int nz) {
    return (struct scene_material){.kind = SCENE_MATERIAL_HEIGHT,
                                   .height = height,
                                   .color_image = color,
                                   .size = {nx, ny, nz},
                                   .lit = true};
}

struct fixture {
    struct shelf shelf;
    struct volume_cache *cache;
    const struct volume *volume;
};

static void make(struct fixture *f, const struct scene_material *spec) {
    struct asset_source source = {shelf_open, shelf_close, &f->shelf};
    struct error err = {0};
    bool made;
    f->cache = volume_cache_create(0);
    if (volume_acquire(f->cache, spec, 1.0, "/m", &source, &f->volume, &made, &err) != STATUS_OK)
        fail_msg("%s: %s", err.faults[0].pointer, err.faults[0].message);
    assert_true(made);
    assert_non_null(f->volume->solid);
    assert_null(f->volume->medium);
}

static void drop(struct fixture *f) {
    volume_release(f->cache, f->volume);
    volume_cache_destroy(f->cache);
    shelf_clear(&f->shelf);
}

static const float *voxel(const struct volume *v, int x, int y, int z) {
    return v->solid +
           4 * (((size_t)z * (size_t)v->size[1] + (size_t)y) * (size_t)v->size[0] + (size_t)x);
}

/* s at (x, y, z) in voxels from the tile's corner, trilinear, periodic in x and y. */
static double solid_at(const struct volume *v, double x, double y, double z) {
    double p[3] = {x - 0.5, y - 0.5, fmin(fmax(z - 0.5, 0), v->size[2] - 1)};
    double base[3] = {floor(p[0]), floor(p[1]), floor(p[2])};
    double s = 0;
    for (int corner = 0; corner < 8; corner++) {
        int at[3];
        double weight = 1;
        for (int i = 0; i < 3; i++) {
            int up = corner >> i & 1;
            double f = p[i] - base[i];
            weight *= up ? f : 1 - f;
            at[i] = (int)base[i] + up;
            at[i] = i < 2 ? (at[i] + v->size[i]) % v->size[i]
                          : (at[i] < v->size[2] ? at[i] : v->size[2] - 1);
        }
        s += weight * (double)voxel(v, at[0], at[1], at[2])[3];
    }
    return s;
}

/* Height of the 1/2 level over (x, y), in voxels, by bisection from where it is solid. */
static double level_at(const struct volume *v, double x, double y) {
    double low = 0, high = v->size[2];
    assert_true(solid_at(v, x, y, low) >= 0.5);
    assert_true(solid_at(v, x, y, high) < 0.5);
    for (int i = 0; i < 50; i++) {
        double middle = (low + high) / 2;
        *(solid_at(v, x, y, middle) >= 0.5 ? &low : &high) = middle;
    }
    return low;
}

/* A plane that rises by 0.05 voxels (of 32) from column to column. */
static double gentle_slope(int x, int y) {
    (void)y;
    return 0.25 + 0.05 * (x + 0.5) / 32;
}

/* Its 1/2 level is that plane to 1e-3 voxels, away from the jump at the seam; measured 2.5e-4, the
 * bend that the clamp gives. A solid bit would be off by 0.5. */
static void a_gentle_slope_does_not_terrace(void **state) {
    (void)state;
    struct fixture f = {0};
    add_grey16(&f.shelf, "h", 256, 4, gentle_slope);
    struct scene_material spec = material("h", NULL, 256, 4, 32);
    make(&f, &spec);
    double worst = 0;
    for (double x = 2; x < 254; x += 0.13)
        worst = fmax(worst, fabs(level_at(f.volume, x, 2.2) - (8 + 0.05 * x)));
    print_message("slope of 0.05: off by %.1e voxels at most\n", worst);
    assert_true(worst < 1e-3);
    drop(&f);
}

/* A roof whose sides rise by 4 voxels (of 64) from column to column. */
static double steep_roof(int x, int y) {
    (void)y;
    return (4 + 4 * (x < 14 ? x : 27 - x)) / 64.0;
}

/* Where the ramps of neighbouring columns would no longer meet, the level still is the slope:
 * within 0.05 voxels; measured 0.0085 (16-bit steps are 0.001). A depth along w alone is off
 * by 1.0. */
static void a_steep_slope_does_not_terrace(void **state) {
    (void)state;
    struct fixture f = {0};
    add_grey16(&f.shelf, "h", 28, 1, steep_roof);
    struct scene_material spec = material("h", NULL, 28, 1, 64);
    make(&f, &spec);
    double worst = 0;
    for (double x = 1.5; x < 13; x += 0.03)
        worst = fmax(worst, fabs(level_at(f.volume, x, 0.5) - (4 + 4 * (x - 0.5))));
    print_message("slope of 4: off by %.1e voxels at most\n", worst);
    assert_true(worst < 0.05);
    drop(&f);
}

static double zero(int x, int y) {
    (void)x, (void)y;
    return 0;
}

static double one(int x, int y) {
    (void)x, (void)y;
    return 1;
}

static void height_zero_is_nothing_and_one_is_full(void **state) {
    (void)state;
    for (int depth = 1; depth <= 64; depth = depth * 3 + 1)
        for (int full = 0; full < 2; full++) {
            struct fixture f = {0};
            add_grey16(&f.shelf, "h", 3, 3, full ? one : zero);
            struct scene_material spec = material("h", NULL, 3, 3, depth);
            make(&f, &spec);
            for (int z = 0; z < depth; z++) {
                float s = voxel(f.volume, 1, 1, z)[3];
                assert_true(full ? s >= 0.5f : s < 0.5f);
            }
            drop(&f);
        }
}

static double checker(int x, int y) {
    return (x + y) & 1;
}

static double step(int x, int y) {
    (void)y;
    return x < 2 ? 0.25 : 0.75;
}

/* Finer images are averaged over each voxel's footprint; coarser ones are interpolated, round the
 * seam too. */
static void images_are_resampled(void **state) {
    (void)state;
    struct fixture f = {0};
    /* 3 x 3 pixels of a checkerboard: 5 white and 4 black, or the reverse. */
    add_grey16(&f.shelf, "h", 60, 45, checker);
    struct scene_material spec = material("h", NULL, 20, 15, 8);
    make(&f, &spec);
    for (int y = 0; y < 15; y++)
        for (int x = 0; x < 20; x++)
            assert_true(fabs(fabs(level_at(f.volume, x + 0.5, y + 0.5) - 4) - 8.0 / 18) < 1e-3);
    drop(&f);

    /* 4 x 4 pixels: half and half. */
    add_grey16(&f.shelf, "h", 60, 60, checker);
    spec = material("h", NULL, 15, 15, 8);
    make(&f, &spec);
    assert_true(fabs(level_at(f.volume, 7.5, 7.5) - 4) < 1e-5);
    drop(&f);

    add_grey16(&f.shelf, "h", 4, 1, step);
    spec = material("h", NULL, 8, 1, 32);
    make(&f, &spec);
    /* Pixel centres at voxels 1, 3, 5, 7; voxel centres a quarter pixel aside of them. */
    const double expected[8] = {12, 8, 8, 12, 20, 24, 24, 20};
    for (int x = 0; x < 8; x++)
        assert_true(fabs(level_at(f.volume, x + 0.5, 0.5) - expected[x]) < 1e-3);
    drop(&f);
}

static double ramp(int x, int y) {
    return (x + 16.0 * y) / 1000;
}

static void the_image_decides_an_open_size(void **state) {
    (void)state;
    struct fixture f = {0};
    add_grey16(&f.shelf, "h", 7, 5, ramp);
    struct scene_material spec = material("h", NULL, 0, 0, 0);
    make(&f, &spec);
    assert_int_equal(f.volume->size[0], 7);
    assert_int_equal(f.volume->size[1], 5);
    assert_int_equal(f.volume->size[2], 32);
    drop(&f);
    add_grey16(&f.shelf, "h", 600, 5, zero);
    make(&f, &spec);
    assert_int_equal(f.volume->size[0], 512);
    drop(&f);
}

/* sRGB 188 is linear 0.5028 (IEC 61966-2-1), taken out of the s-weighted colour again. */
static void colours_are_made_linear_and_weighted(void **state) {
    (void)state;
    struct fixture f = {0};
    unsigned char rgb[4 * 4 * 3];
    for (int i = 0; i < 4 * 4 * 3; i++)
        rgb[i] = (unsigned char)(i % 3 == 0 ? 188 : i % 3 == 1 ? 255 : 10);
    add_grey16(&f.shelf, "h", 4, 4, gentle_slope);
    add_png(&f.shelf, "c", 4, 4, 3, 8, rgb);
    struct scene_material spec = material("h", "c", 4, 4, 8);
    make(&f, &spec);
    for (int z = 0; z < 8; z++) {
        const float *v = voxel(f.volume, 1, 2, z);
        if (v[3] == 0.0f) {
            assert_true(v[0] == 0.0f && v[1] == 0.0f && v[2] == 0.0f);
            continue;
        }
        assert_true(fabs((double)(v[0] / v[3]) - 0.502886) < 1e-5);
        assert_true(fabs((double)(v[1] / v[3]) - 1) < 1e-6);
        assert_true(fabs((double)(v[2] / v[3]) - 10 / 255.0 / 12.92) < 1e-6);
    }
    drop(&f);
}

static void floats_are_linear(void **state) {
    (void)state;
    struct fixture f = {0};
    add_exr(&f.shelf, "h", (const float[]){0.5f, 0.9f, 0.9f, 1});
    add_exr(&f.shelf, "c", (const float[]){0.25f, -1.0f, 3.0f, 1});
    struct scene_material spec = material("h", "c", 4, 4, 8);
    make(&f, &spec);
    assert_true(fabs(level_at(f.volume, 1, 1) - 4) < 1e-5); /* the first channel */
    const float *v = voxel(f.volume, 0, 0, 0);
    assert_true(v[0] == 0.25f && v[1] == 0.0f && v[2] == 3.0f && v[3] == 1.0f);
    drop(&f);
}

static void without_an_image_the_colour_is_the_material_s(void **state) {
    (void)state;
    struct fixture f = {0};
    add_grey16(&f.shelf, "h", 4, 4, one);
    struct scene_material spec = material("h", NULL, 4, 4, 8);
    spec.has_color = true;
    spec.color[0] = 0.125;
    make(&f, &spec);
    assert_true(voxel(f.volume, 0, 0, 0)[0] == 0.125f);
    assert_true(voxel(f.volume, 0, 0, 0)[1] == 0.0f);
    drop(&f);
}

static void refused(struct shelf *shelf, const struct scene_material *spec, enum status status,
                    const char *pointer, const char *text) {
    struct asset_source source = {shelf_open, shelf_close, shelf};
    struct volume_cache *cache = volume_cache_create(1 << 20);
    const struct volume *volume;
    bool made;
    struct error err = {0};
    assert_int_equal(volume_acquire(cache, spec, 1.0, "/m", &source, &volume, &made, &err), status);
    assert_null(volume);
    assert_int_equal(err.fault_count, 1);
    assert_string_equal(err.faults[0].pointer, pointer);
    if (!strstr(err.faults[0].message, text))
        fail_msg("\"%s\" does not say \"%s\"", err.faults[0].message, text);
    error_clear(&err);
    volume_cache_destroy(cache);
    assert_int_equal(shelf->open, 0);
}

static void bad_images_are_refused_with_their_pointer(void **state) {
    (void)state;
    struct shelf shelf = {0};
    add_grey16(&shelf, "h", 4, 4, one);
    shelf_add(&shelf, "text", (unsigned char *)strdup("no picture"), 10);
    add_exr(&shelf, "nan", (const float[]){NAN, 0, 0, 1});
    add_exr(&shelf, "infinite", (const float[]){0, 0, INFINITY, 1});
    struct scene_material spec = material("text", NULL, 4, 4, 4);
    refused(&shelf, &spec, STATUS_BAD_ASSET, "/m/height", "not an image");
    spec = material("h", "text", 4, 4, 4);
    refused(&shelf, &spec, STATUS_BAD_ASSET, "/m/color", "not an image");
    spec = material("nan", NULL, 4, 4, 4);
    refused(&shelf, &spec, STATUS_BAD_ASSET, "/m/height", "finite");
    spec = material("h", "infinite", 4, 4, 4);
    refused(&shelf, &spec, STATUS_BAD_ASSET, "/m/color", "finite");
    spec = material("gone", NULL, 4, 4, 4);
    refused(&shelf, &spec, STATUS_ASSET_NOT_FOUND, "/m/height", "gone");
    spec = material("h", "gone", 4, 4, 4);
    refused(&shelf, &spec, STATUS_ASSET_NOT_FOUND, "/m/color", "gone");
    shelf_clear(&shelf);
}

/* The key is of the bytes, not of the name. */
static void the_cache_knows_images_by_their_bytes(void **state) {
    (void)state;
    struct shelf shelf = {0};
    add_grey16(&shelf, "a", 4, 4, one);
    add_grey16(&shelf, "b", 4, 4, one);
    add_grey16(&shelf, "c", 4, 4, zero);
    struct asset_source source = {shelf_open, shelf_close, &shelf};
    struct volume_cache *cache = volume_cache_create(1 << 20);
    const char *names[] = {"a", "b", "c"};
    const struct volume *volumes[3];
    for (int i = 0; i < 3; i++) {
        struct scene_material spec = material(names[i], NULL, 4, 4, 4);
        bool made;
        assert_int_equal(volume_acquire(cache, &spec, 1.0, "/m", &source, &volumes[i], &made, NULL),
                         STATUS_OK);
        assert_int_equal(made, i != 1);
    }
    assert_ptr_equal(volumes[0], volumes[1]);
    assert_ptr_not_equal(volumes[0], volumes[2]);
    for (int i = 0; i < 3; i++)
        volume_release(cache, volumes[i]);
    volume_cache_destroy(cache);
    shelf_clear(&shelf);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_gentle_slope_does_not_terrace),
        cmocka_unit_test(a_steep_slope_does_not_terrace),
        cmocka_unit_test(height_zero_is_nothing_and_one_is_full),
        cmocka_unit_test(images_are_resampled),
        cmocka_unit_test(the_image_decides_an_open_size),
        cmocka_unit_test(colours_are_made_linear_and_weighted),
        cmocka_unit_test(floats_are_linear),
        cmocka_unit_test(without_an_image_the_colour_is_the_material_s),
        cmocka_unit_test(bad_images_are_refused_with_their_pointer),
        cmocka_unit_test(the_cache_knows_images_by_their_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
