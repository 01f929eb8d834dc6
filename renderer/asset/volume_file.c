/* Volumes from files: OpenVDB, and stacks of images, as a medium.
 *
 * OpenVDB: a density is an extinction per object unit, times the shell's thickness here; colours
 * are linear. A stack's alpha is that of its own layers: sigma * thickness = -log1p(-alpha) *
 * layers. An alpha of 1 would be infinite: it counts as 1 less half a step of the file's samples
 * (2^-24 for floats), so 8 bits reach 6.2 times the number of layers. Colours of 8 and 16 bits are
 * sRGB.
 *
 * The grid is the file's, or what `size` says: extinction, and colour weighed by it, are averaged
 * over each voxel where the file is finer and interpolated where it is coarser, which keeps optical
 * depths. Periodic in u and v; layers from w = 0 up.
 *
 * Values that are no numbers are refused. Densities below 0, which simulations leave behind, count
 * as 0, alphas outside [0, 1] are brought there, densities above 1e12 (the most that a scene may
 * ask of a homogeneous medium) are capped; volume_warn() tells how many. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_resample.h"

static const float DENSITY_MAX = 1e12f;
static const float grey = 0.8f; /* where a file has no colours */

static enum status file_fault(struct error *err, enum status status, const char *pointer,
                              const char *message) {
    char path[256];
    snprintf(path, sizeof path, "%s/volume", pointer);
    return error_fault(err, status, path, "%s", message);
}

static enum status decode(const struct asset_bytes *bytes, const char *pointer,
                          struct volume_pixels *pixels, struct error *err) {
    *pixels = (struct volume_pixels){0};
    const struct image_module *module = module_open(MODULE_IMAGE_OIIO, err);
    if (!module)
        return err && err->status != STATUS_OK ? err->status : STATUS_IO_ERROR;
    char message[512];
    int result = module->decode_volume(bytes->data, bytes->size, pixels, message, sizeof message);
    if (result == IMAGE_OUT_OF_MEMORY)
        return file_fault(err, STATUS_OUT_OF_MEMORY, pointer, message);
    return result == 0 ? STATUS_OK : file_fault(err, STATUS_BAD_ASSET, pointer, message);
}

/* What turns the file's samples into extinction and colour. */
struct meaning {
    const struct volume_pixels *pixels;
    float per_density; /* the thickness */
    float layers;
    float alpha_max;
    bool srgb;
};

/* Extinction-weighted colour and extinction (times the thickness) of one voxel. */
static void read_voxel(const struct meaning *meaning, const float *in, struct volume_notes *notes,
                       float out[4]) {
    const struct volume_pixels *pixels = meaning->pixels;
    float weight = in[pixels->channels - 1], color[3] = {grey, grey, grey};
    if (weight < 0.0f) {
        weight = 0.0f;
        notes->negative++;
    }
    if (pixels->is_density) {
        notes->huge += weight > DENSITY_MAX;
        out[3] = fminf(weight, DENSITY_MAX) * meaning->per_density;
    } else {
        notes->huge += weight > 1.0f;
        out[3] = -log1pf(-fminf(weight, meaning->alpha_max)) * meaning->layers;
    }
    for (int c = 0; c < 3 && pixels->channels > 1; c++) {
        float value = fmaxf(in[pixels->channels == 4 ? c : 0], 0.0f);
        if (pixels->premultiplied)
            value = weight > 0.0f ? value / fminf(weight, 1.0f) : 0.0f;
        color[c] = meaning->srgb ? resample_linear_from_srgb(fminf(value, 1.0f)) : value;
    }
    for (int c = 0; c < 3; c++)
        out[c] = color[c] * out[3];
}

/* Turns the samples into 4 floats a voxel. NULL where memory ran out. */
static float *read_voxels(const struct meaning *meaning, struct volume_notes *notes) {
    const struct volume_pixels *pixels = meaning->pixels;
    size_t count = (size_t)pixels->size[0] * (size_t)pixels->size[1] * (size_t)pixels->size[2];
    float *voxels = calloc(count, 4 * sizeof *voxels);
    for (size_t i = 0; voxels && i < count; i++)
        read_voxel(meaning, pixels->data + i * (size_t)pixels->channels, notes, voxels + 4 * i);
    return voxels;
}

/* One layer of the target from the layers that make it, along u and v. */
static void resample_layer(const float *source, const int from[3], const struct taps *across,
                           const struct taps *down, float weight, const int to[3], float *target) {
    for (int y = 0; y < to[1]; y++)
        for (int x = 0; x < to[0]; x++, target += 4)
            for (int j = 0; j < down[y].count; j++) {
                size_t row = (size_t)((down[y].first + j) % from[1]) * (size_t)from[0];
                for (int i = 0; i < across[x].count; i++) {
                    const float *in =
                        source + 4 * (row + (size_t)((across[x].first + i) % from[0]));
                    float w = weight * down[y].weights[j] * across[x].weights[i];
                    for (int c = 0; c < 4; c++)
                        target[c] += w * in[c];
                }
            }
}

static enum status resample(const float *source, const int from[3], struct volume *volume) {
    const int *to = volume->size;
    struct taps *across = resample_taps(from[0], to[0], true),
                *down = resample_taps(from[1], to[1], true),
                *up = resample_taps(from[2], to[2], false);
    volume->medium = volume_alloc_voxels(to);
    bool got = across && down && up && volume->medium;
    size_t from_layer = 4 * (size_t)from[0] * (size_t)from[1];
    size_t to_layer = 4 * (size_t)to[0] * (size_t)to[1];
    for (int z = 0; got && z < to[2]; z++)
        for (int k = 0; k < up[z].count; k++) {
            int layer = up[z].first + k < from[2] ? up[z].first + k : from[2] - 1;
            resample_layer(source + from_layer * (size_t)layer, from, across, down,
                           up[z].weights[k], to, volume->medium + to_layer * (size_t)z);
        }
    free(across);
    free(down);
    free(up);
    return got ? STATUS_OK : STATUS_OUT_OF_MEMORY;
}

enum status volume_make_file(const struct asset_bytes *bytes, double thickness, const char *pointer,
                             struct volume *volume, struct error *err) {
    struct volume_pixels pixels;
    enum status status = decode(bytes, pointer, &pixels, err);
    if (status != STATUS_OK)
        return status;
    size_t count = (size_t)pixels.size[0] * (size_t)pixels.size[1] * (size_t)pixels.size[2];
    float *voxels = NULL;
    for (size_t i = 0; i < count * (size_t)pixels.channels; i++)
        if (!isfinite(pixels.data[i])) {
            status = file_fault(err, STATUS_BAD_ASSET, pointer,
                                "the volume holds a value that is not a finite number");
            goto done;
        }
    for (int i = 0; i < 3; i++)
        if (volume->size[i] == 0) {
            int most = i == 2 ? VOLUME_DEPTH_MAX : VOLUME_SIDE_MAX;
            volume->size[i] = pixels.size[i] < most ? pixels.size[i] : most;
        }
    struct meaning meaning = {.pixels = &pixels,
                              .per_density = (float)thickness,
                              .layers = (float)pixels.size[2],
                              .srgb = !pixels.is_float};
    meaning.alpha_max = pixels.is_float || pixels.bits > 16
                            ? 1.0f - 0x1p-24f
                            : 1.0f - 0.5f / (float)((1 << pixels.bits) - 1);
    voxels = read_voxels(&meaning, &volume->notes);
    if (!voxels || resample(voxels, pixels.size, volume) != STATUS_OK) {
        status = file_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for the volume");
        goto done;
    }
    volume->medium_max = volume_medium_max(volume->medium, volume->size);
done:
    free(voxels);
    free(pixels.data);
    return status;
}
