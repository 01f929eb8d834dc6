/* A height field whose image is one row of columns: known by hand along u. */
#ifndef PELT_TESTS_UNIT_HEIGHT_ROW_H
#define PELT_TESTS_UNIT_HEIGHT_ROW_H

#include <math.h>

#include "tests/reference_fixture.h"

struct row {
    const unsigned char *file;
    size_t bytes;
};

static inline enum status open_row(void *user, const char *name, const char *pointer,
                                   struct asset_bytes *bytes, struct error *err) {
    (void)name;
    (void)pointer;
    (void)err;
    const struct row *row = user;
    *bytes = (struct asset_bytes){.data = row->file, .size = row->bytes};
    for (size_t i = 0; i < row->bytes && i < 32; i++)
        bytes->sha256[i] = row->file[row->bytes - 1 - i];
    return STATUS_OK;
}

static inline void close_row(void *user, struct asset_bytes *bytes) {
    (void)user;
    (void)bytes;
}

/* The picture's file: 8 x 1 pixels of float in Radiance HDR, old run-free format: mantissas and a
 * shared exponent of 128, so v = mantissa / 256. */
static inline size_t make_file(const unsigned char heights[8], unsigned char *file) {
    static const char head[] = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 8\n";
    size_t n = sizeof head - 1;
    memcpy(file, head, n);
    for (int i = 0; i < 8; i++) {
        file[n++] = heights[i];
        file[n++] = heights[i];
        file[n++] = heights[i];
        file[n++] = 128;
    }
    return n;
}

/* A scene of such a field, as JSON with ' for ", which are replaced in place. */
static inline enum status height_row_open(struct truth_fixture *truth, struct row *row,
                                          char *json) {
    support_quote(json);
    memset(truth, 0, sizeof *truth);
    struct error err = {0};
    truth->assets = (struct asset_source){open_row, close_row, row};
    truth->sources = (struct reference_sources){mesh_cache_create(1 << 20),
                                                volume_cache_create(1 << 20), &truth->assets};
    enum status status = scene_read(json, strlen(json), &truth->arena, &truth->scene, &err);
    if (status == STATUS_OK)
        status = reference_create(&truth->scene, &truth->sources, &truth->reference, &err);
    for (size_t i = 0; i < err.fault_count; i++)
        print_message("%s\n", err.faults[i].message);
    error_clear(&err);
    return status;
}

/* The field itself, trilinear, at (u, w) of the one row; from the volume's own voxels. */
static inline double field_at(const struct volume *volume, double u, double w) {
    double x = u * volume->size[0] - 0.5, z = w * volume->size[2] - 0.5, sum = 0;
    for (int c = 0; c < 4; c++) {
        double fx = x - floor(x), fz = z - floor(z);
        int i = ((int)floor(x) + (c & 1) + 8) % 8, k = (int)floor(z) + (c >> 1);
        k = k < 0 ? 0 : k > volume->size[2] - 1 ? volume->size[2] - 1 : k;
        sum += (c & 1 ? fx : 1 - fx) * (c >> 1 ? fz : 1 - fz) *
               (double)volume->solid[4 * ((size_t)k * 8 + (size_t)i) + 3];
    }
    return sum;
}

#endif
