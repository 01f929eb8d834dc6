/* Compares pictures: reads lines of two EXR files and their background each, four numbers, straight
 * linear RGBA, and writes for each line what renderer/error says of them, as JSON:
 * {"touched": ..., "whole": ..., "pixels": ...}. The second picture is the truth; pixels are
 * touched where either is drawn on. For tests/stability/corpus.py, whose Python reads no EXR. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/image_oiio.h"
#include "renderer/asset/module.h"
#include "renderer/error/metrics.h"
#include "service/files.h"

static float *read_exr(const struct image_module *oiio, const char *path, int size[2]) {
    unsigned char *data = NULL;
    size_t bytes = 0;
    struct image_pixels image = {0};
    struct error err = {0};
    char message[256] = "";
    if (files_read(path, 1 << 30, &data, &bytes, &err) != STATUS_OK ||
        oiio->decode(data, bytes, &image, message, sizeof message) != 0 || !image.is_float ||
        image.channels != 4) {
        fprintf(stderr, "%s: %s\n", path, message[0] ? message : "no picture of four floats");
        exit(1);
    }
    free(data);
    size[0] = image.width;
    size[1] = image.height;
    return image.data;
}

int main(void) {
    struct error err = {0};
    const struct image_module *oiio = module_open(MODULE_IMAGE_OIIO, &err);
    double background[4];
    char a_path[2048], b_path[2048];
    if (!oiio) {
        fprintf(stderr, "%s\n", err.fault_count ? err.faults[0].message : "no OpenImageIO");
        return 1;
    }
    while (scanf("%2047s %2047s %lf %lf %lf %lf", a_path, b_path, &background[0], &background[1],
                 &background[2], &background[3]) == 6) {
        int a_size[2], b_size[2];
        float *a = read_exr(oiio, a_path, a_size), *b = read_exr(oiio, b_path, b_size);
        struct error_metrics metrics;
        if (memcmp(a_size, b_size, sizeof a_size) != 0 ||
            error_compare(a, b, a_size[0], a_size[1], NULL, background, NULL, &metrics, &err) !=
                STATUS_OK) {
            fprintf(stderr, "%s and %s cannot be compared\n", a_path, b_path);
            return 1;
        }
        printf("{\"touched\": %.9g, \"whole\": %.9g, \"pixels\": %zu}\n", metrics.touched.rmse,
               metrics.whole.rmse, metrics.touched.pixels);
        free(a);
        free(b);
    }
    return 0;
}
