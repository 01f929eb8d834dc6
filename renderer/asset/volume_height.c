/* Height fields: a grey image (0 is the base surface, 1 the top of the shell) and a colour image
 * become a solid field.
 *
 * The depth below the surface is measured along w: d = h * size[2] - (k + 1/2) voxels at the centre
 * of layer k, and s = clamp(1/2 + d/2, 0, 1) is linear over the two layers that enclose the
 * surface, so its 1/2 level under trilinear interpolation is h itself, with no terraces.
 *
 * That holds for as long as neighbouring columns differ by no more than a voxel or so. Where they
 * differ by g > 1 voxels the ramps of two columns no longer meet, and the level climbs in steps: at
 * g = 4 it is off by 1.0 voxel and its normals by 30 degrees (measured on a plane). There d is
 * measured along u or v, whichever is steeper, which is d / g: off by at most 0.026 voxels and 5.4
 * degrees at every slope from 1 to 8. The 1/2 level at a voxel's own centre is the same either way.
 *
 * Below the first layer's centre and above the last one's the field is constant, so heights under
 * half a voxel vanish and heights within half a voxel of the top fill the shell.
 *
 * Heights are linear whatever their depth; colours of 8 and 16 bits are sRGB, of floats linear.
 * Images are periodic like the tile: averaged over each voxel's footprint where they are finer than
 * the grid, interpolated linearly where they are coarser. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"
#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_resample.h"

enum { DEFAULT_DEPTH = 32, COLOR_CHANNELS = 3 };

/* What the samples of an image mean, and how many of its channels are wanted. */
struct reading {
    const struct image_pixels *image;
    int channels;     /* 1: heights; COLOR_CHANNELS: colours */
    float *linear_of; /* of each sRGB value of 8 or 16 bits; else NULL */
    float value_max;  /* the table's last index */
};

/* One sample, as a height or a linear colour; grey images give their one channel three times. */
static float read_sample(const struct reading *reading, const float *pixel, int channel) {
    const struct image_pixels *image = reading->image;
    float value = pixel[image->channels >= 3 ? channel : 0];
    if (reading->channels == 1)
        return value;
    if (reading->linear_of)
        return reading->linear_of[(int)(value * reading->value_max + 0.5f)];
    return image->is_float ? fmaxf(value, 0.0f) : resample_linear_from_srgb(value);
}

/* The image at the size of the grid, `channels` floats a sample; malloc'ed, NULL where memory ran
 * out. Row by row, so that no image of the source's size is made besides the source. */
static float *resample(const struct reading *reading, int nx, int ny) {
    const struct image_pixels *image = reading->image;
    int channels = reading->channels;
    struct taps *across = resample_taps(image->width, nx, true),
                *down = resample_taps(image->height, ny, true);
    size_t row_floats = (size_t)nx * (size_t)channels;
    float *result = calloc((size_t)ny * row_floats, sizeof *result);
    if (!across || !down || !result) {
        free(result);
        result = NULL;
        goto done;
    }
    for (int y = 0; y < ny; y++) {
        float *out = result + (size_t)y * row_floats;
        for (int j = 0; j < down[y].count; j++) {
            size_t row = (size_t)((down[y].first + j) % image->height) * (size_t)image->width;
            for (int x = 0; x < nx; x++)
                for (int i = 0; i < across[x].count; i++) {
                    size_t column = (size_t)((across[x].first + i) % image->width);
                    const float *pixel = image->data + (row + column) * (size_t)image->channels;
                    float weight = down[y].weights[j] * across[x].weights[i];
                    for (int c = 0; c < channels; c++)
                        out[x * channels + c] += weight * read_sample(reading, pixel, c);
                }
        }
    }
done:
    free(across);
    free(down);
    return result;
}

static enum status image_fault(struct error *err, const char *pointer, const char *member,
                               const char *message) {
    char path[256];
    snprintf(path, sizeof path, "%s/%s", pointer, member);
    return error_fault(err, STATUS_BAD_ASSET, path, "%s", message);
}

static enum status decode_image(const struct asset_bytes *bytes, const char *pointer,
                                const char *member, struct image_pixels *image, struct error *err) {
    *image = (struct image_pixels){0};
    const struct image_module *module = module_open(MODULE_IMAGE_OIIO, err);
    if (!module)
        return err && err->status != STATUS_OK ? err->status : STATUS_IO_ERROR;
    char message[512];
    int result = module->decode(bytes->data, bytes->size, image, message, sizeof message);
    if (result == IMAGE_OUT_OF_MEMORY)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "%s", message);
    if (result != 0)
        return image_fault(err, pointer, member, message);
    size_t count = (size_t)image->width * (size_t)image->height * (size_t)image->channels;
    for (size_t i = 0; image->is_float && i < count; i++)
        if (!isfinite(image->data[i])) {
            free(image->data);
            *image = (struct image_pixels){0};
            return image_fault(err, pointer, member,
                               "the image holds a value that is not a finite number");
        }
    return STATUS_OK;
}

/* Colours on the grid: of the image, of the material's `color`, or grey. */
static enum status make_colors(const struct scene_material *spec, const struct asset_bytes *bytes,
                               const char *pointer, const int size[3], float **colors,
                               struct error *err) {
    size_t count = (size_t)size[0] * (size_t)size[1];
    if (!bytes) {
        *colors = calloc(count, COLOR_CHANNELS * sizeof **colors);
        if (!*colors)
            return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for colours");
        for (size_t i = 0; i < count * COLOR_CHANNELS; i++)
            (*colors)[i] = spec->has_color ? (float)spec->color[i % COLOR_CHANNELS] : 0.5f;
        return STATUS_OK;
    }
    struct image_pixels image;
    enum status status = decode_image(bytes, pointer, "color", &image, err);
    if (status != STATUS_OK)
        return status;
    struct reading reading = {.image = &image, .channels = COLOR_CHANNELS};
    if (!image.is_float && image.bits <= 16) {
        int last = (1 << image.bits) - 1;
        reading.value_max = (float)last;
        reading.linear_of = malloc(((size_t)last + 1) * sizeof *reading.linear_of);
        for (int i = 0; reading.linear_of && i <= last; i++)
            reading.linear_of[i] = resample_linear_from_srgb((float)i / reading.value_max);
    } /* without a table it takes longer, and comes to the same */
    *colors = resample(&reading, size[0], size[1]);
    free(reading.linear_of);
    free(image.data);
    return *colors ? STATUS_OK
                   : error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for colours");
}

/* The largest difference of heights between a column and its eight neighbours, in voxels. */
static float steepness(const float *heights, const int size[3], int x, int y) {
    float here = heights[(size_t)y * (size_t)size[0] + (size_t)x], most = 0.0f;
    for (int j = -1; j <= 1; j++) {
        size_t row = (size_t)((y + j + size[1]) % size[1]) * (size_t)size[0];
        for (int i = -1; i <= 1; i++)
            most = fmaxf(most, fabsf(heights[row + (size_t)((x + i + size[0]) % size[0])] - here));
    }
    return most * (float)size[2];
}

static void fill_under(const struct volume *volume, size_t column, float height, float steep,
                       const float color[COLOR_CHANNELS]) {
    size_t layer = (size_t)volume->size[0] * (size_t)volume->size[1] * 4;
    float scale = 0.5f / fmaxf(1.0f, steep), depth = (float)volume->size[2];
    float *voxel = volume->solid + 4 * column;
    for (int z = 0; z < volume->size[2]; z++, voxel += layer) {
        float d = height * depth - ((float)z + 0.5f);
        float s = fminf(fmaxf(0.5f + scale * d, 0.0f), 1.0f);
        for (int c = 0; c < COLOR_CHANNELS; c++)
            voxel[c] = s * color[c];
        voxel[3] = s;
    }
}

void fill_heights(struct volume *volume, float *heights, const float *colors) {
    size_t count = (size_t)volume->size[0] * (size_t)volume->size[1];
    for (size_t i = 0; i < count; i++)
        heights[i] = fminf(fmaxf(heights[i], 0.0f), 1.0f);
    for (int y = 0; y < volume->size[1]; y++)
        for (int x = 0; x < volume->size[0]; x++) {
            size_t i = (size_t)y * (size_t)volume->size[0] + (size_t)x;
            fill_under(volume, i, heights[i], steepness(heights, volume->size, x, y),
                       colors + i * COLOR_CHANNELS);
        }
}

enum status volume_make_height(const struct scene_material *spec, const struct asset_bytes *height,
                               const struct asset_bytes *color, const char *pointer,
                               struct volume *volume, struct error *err) {
    struct image_pixels image;
    enum status status = decode_image(height, pointer, "height", &image, err);
    if (status != STATUS_OK)
        return status;
    int side[2] = {image.width, image.height};
    for (int i = 0; i < 2; i++)
        if (volume->size[i] == 0)
            volume->size[i] = side[i] < VOLUME_SIDE_MAX ? side[i] : VOLUME_SIDE_MAX;
    if (volume->size[2] == 0)
        volume->size[2] = DEFAULT_DEPTH;
    struct reading reading = {.image = &image, .channels = 1};
    float *heights = resample(&reading, volume->size[0], volume->size[1]), *colors = NULL;
    free(image.data);
    if (!heights) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for heights");
        goto done;
    }
    status = make_colors(spec, color, pointer, volume->size, &colors, err);
    if (status != STATUS_OK)
        goto done;
    volume->solid = volume_alloc_voxels(volume->size);
    if (!volume->solid) {
        status = error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for voxels");
        goto done;
    }
    fill_heights(volume, heights, colors);
done:
    free(heights);
    free(colors);
    return status;
}
