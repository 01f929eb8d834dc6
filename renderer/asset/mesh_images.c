/* An asset's textures: encoded bytes through the OpenImageIO module to 8-bit RGBA.
 *
 * glTF allows PNG and JPEG, told by their first bytes here, before any decoder sees them. Colours
 * stay sRGB encoded as in the file; whoever samples decodes them. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/mesh_asset.h"
#include "renderer/asset/module.h"

/* All images of one asset together: 256 MB once they are RGBA. */
enum { ASSET_PIXELS_MAX = 64 * 1024 * 1024 };

static bool is_png_or_jpeg(const struct gltf_image *image) {
    static const unsigned char png[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    static const unsigned char jpeg[3] = {0xff, 0xd8, 0xff};
    return (image->bytes >= sizeof png && memcmp(image->data, png, sizeof png) == 0) ||
           (image->bytes >= sizeof jpeg && memcmp(image->data, jpeg, sizeof jpeg) == 0);
}

static uint8_t to_byte(float value) {
    return value > 0 ? (uint8_t)lroundf(fminf(value, 1) * 255) : 0; /* NaN becomes 0 */
}

/* Grey, grey and alpha, RGB or RGBA to RGBA. */
static void expand(const struct image_pixels *from, uint8_t *rgba) {
    size_t count = (size_t)from->width * (size_t)from->height;
    int colors = from->channels >= 3 ? 3 : 1;
    bool alpha = from->channels > colors;
    for (size_t i = 0; i < count; i++) {
        const float *p = from->data + i * (size_t)from->channels;
        for (int c = 0; c < 3; c++)
            rgba[4 * i + (size_t)c] = to_byte(p[colors == 3 ? c : 0]);
        rgba[4 * i + 3] = alpha ? to_byte(p[colors]) : 255;
    }
}

enum status mesh_decode_images(const struct gltf_image *images, uint32_t count, const char *pointer,
                               struct mesh *mesh, struct error *err) {
    const struct image_module *oiio = module_open(MODULE_IMAGE_OIIO, err);
    if (!oiio)
        return STATUS_IO_ERROR;
    size_t pixels = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (!images[i].data)
            return error_fault(err, STATUS_BAD_ASSET, pointer,
                               "texture %u is not in the file: embed it as PNG or JPEG", i);
        if (!is_png_or_jpeg(&images[i]))
            return error_fault(err, STATUS_BAD_ASSET, pointer, "texture %u is neither PNG nor JPEG",
                               i);
        struct image_pixels decoded = {0};
        char message[256] = "";
        if (oiio->decode(images[i].data, images[i].bytes, &decoded, message, sizeof message) != 0)
            return error_fault(err, STATUS_BAD_ASSET, pointer, "texture %u: %s", i, message);
        size_t size = (size_t)decoded.width * (size_t)decoded.height;
        pixels += size;
        if (pixels > ASSET_PIXELS_MAX) {
            free(decoded.data);
            return error_fault(err, STATUS_TOO_COMPLEX, pointer,
                               "the textures have more than %d pixels together", ASSET_PIXELS_MAX);
        }
        struct mesh_image *image = &mesh->images[i];
        image->rgba = malloc(size * 4);
        if (image->rgba) {
            image->width = decoded.width;
            image->height = decoded.height;
            expand(&decoded, image->rgba);
        }
        free(decoded.data);
        if (!image->rgba)
            return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for texture %u", i);
        mesh->bytes += size * 4 + sizeof *image;
    }
    return STATUS_OK;
}
