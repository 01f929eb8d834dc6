/* Periodic Perlin and Worley noise; see volume_random.h. */
#include "renderer/asset/volume_random.h"

#include <stdlib.h>

/* Whole part towards minus infinity; |x| is far below 2^31 here. */
static int floor_int(float x) {
    int i = (int)x;
    return i - ((float)i > x);
}

static int wrap(int i, int period) {
    int r = i % period;
    return r < 0 ? r + period : r;
}

static float fade(float t) {
    return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f);
}

static float mix(float a, float b, float t) {
    return a + (b - a) * t;
}

/* One of Perlin's twelve edge directions, dotted with (x, y, z). */
static float gradient_dot(uint32_t hash, float x, float y, float z) {
    uint32_t h = hash >> 28;
    float u = h < 8 ? x : y;
    float v = h < 4 ? y : (h == 12 || h == 14) ? x : z;
    return ((h & 1) ? -u : u) + ((h & 2) ? -v : v);
}

float random_noise(uint32_t seed, float x, float y, float z, int period_x, int period_y) {
    int ix = floor_int(x), iy = floor_int(y), iz = floor_int(z);
    float fx = x - (float)ix, fy = y - (float)iy, fz = z - (float)iz;
    uint32_t xs[2] = {(uint32_t)wrap(ix, period_x), (uint32_t)wrap(ix + 1, period_x)};
    uint32_t ys[2] = {(uint32_t)wrap(iy, period_y), (uint32_t)wrap(iy + 1, period_y)};
    float corner[2][2][2];
    for (int k = 0; k < 2; k++) {
        uint32_t hz = random_hash2(seed, (uint32_t)(iz + k));
        for (int j = 0; j < 2; j++) {
            uint32_t hy = random_hash(hz + ys[j] * 0x9e3779b1u);
            for (int i = 0; i < 2; i++)
                corner[k][j][i] = gradient_dot(random_hash(hy + xs[i] * 0x85ebca77u), fx - (float)i,
                                               fy - (float)j, fz - (float)k);
        }
    }
    float tx = fade(fx), ty = fade(fy), tz = fade(fz);
    float near = mix(mix(corner[0][0][0], corner[0][0][1], tx),
                     mix(corner[0][1][0], corner[0][1][1], tx), ty);
    float far = mix(mix(corner[1][0][0], corner[1][0][1], tx),
                    mix(corner[1][1][0], corner[1][1][1], tx), ty);
    return mix(near, far, tz);
}

/* Of one lattice plane above (x, y): the noise of its gradients alone is constant + slope * height.
 */
struct plane {
    float constant, slope;
};

static struct plane plane_at(uint32_t seed, const uint32_t xs[2], const uint32_t ys[2], int z,
                             float fx, float fy, float tx, float ty) {
    uint32_t hz = random_hash2(seed, (uint32_t)z);
    float constant[2][2], slope[2][2];
    for (int j = 0; j < 2; j++) {
        uint32_t hy = random_hash(hz + ys[j] * 0x9e3779b1u);
        for (int i = 0; i < 2; i++) {
            uint32_t hash = random_hash(hy + xs[i] * 0x85ebca77u);
            constant[j][i] = gradient_dot(hash, fx - (float)i, fy - (float)j, 0.0f);
            slope[j][i] = gradient_dot(hash, 0.0f, 0.0f, 1.0f);
        }
    }
    return (struct plane){
        mix(mix(constant[0][0], constant[0][1], tx), mix(constant[1][0], constant[1][1], tx), ty),
        mix(mix(slope[0][0], slope[0][1], tx), mix(slope[1][0], slope[1][1], tx), ty)};
}

void random_noise_line(uint32_t seed, float x, float y, float z, float dz, int period_x,
                       int period_y, float amplitude, int count, float *sums) {
    int ix = floor_int(x), iy = floor_int(y), iz = floor_int(z);
    float fx = x - (float)ix, fy = y - (float)iy;
    uint32_t xs[2] = {(uint32_t)wrap(ix, period_x), (uint32_t)wrap(ix + 1, period_x)};
    uint32_t ys[2] = {(uint32_t)wrap(iy, period_y), (uint32_t)wrap(iy + 1, period_y)};
    float tx = fade(fx), ty = fade(fy);
    struct plane near = plane_at(seed, xs, ys, iz, fx, fy, tx, ty);
    struct plane far = plane_at(seed, xs, ys, iz + 1, fx, fy, tx, ty);
    for (int i = 0; i < count; i++) {
        float at = z + (float)i * dz;
        int cell = floor_int(at);
        if (cell != iz) {
            near = cell == iz + 1 ? far : plane_at(seed, xs, ys, cell, fx, fy, tx, ty);
            far = plane_at(seed, xs, ys, cell + 1, fx, fy, tx, ty);
            iz = cell;
        }
        float fz = at - (float)cell;
        sums[i] += amplitude * mix(near.constant + near.slope * fz,
                                   far.constant + far.slope * (fz - 1.0f), fade(fz));
    }
}

bool random_cells_make(struct random_cells *cells, uint32_t seed, int nx, int ny, int nz) {
    *cells = (struct random_cells){{nx, ny, nz}, NULL};
    cells->points =
        calloc((size_t)(nx + 2) * (size_t)(ny + 2) * (size_t)(nz + 2), sizeof *cells->points);
    if (!cells->points)
        return false;
    float(*point)[3] = cells->points;
    for (int k = -1; k <= nz; k++)
        for (int j = -1; j <= ny; j++)
            for (int i = -1; i <= nx; i++, point++) {
                uint32_t h =
                    random_hash4(seed, (uint32_t)wrap(i, nx), (uint32_t)wrap(j, ny), (uint32_t)k);
                (*point)[0] = (float)i + (float)(h & 1023) * 0x1p-10f;
                (*point)[1] = (float)j + (float)((h >> 10) & 1023) * 0x1p-10f;
                (*point)[2] = (float)k + (float)((h >> 20) & 1023) * 0x1p-10f;
            }
    return true;
}

void random_cells_free(struct random_cells *cells) {
    free(cells->points);
    cells->points = NULL;
}

/* The cell of a coordinate within [0, count]. */
static int cell_of(float x, int count) {
    int i = (int)x;
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

float random_cells_at(const struct random_cells *cells, float x, float y, float z) {
    int ix = cell_of(x, cells->count[0]), iy = cell_of(y, cells->count[1]),
        iz = cell_of(z, cells->count[2]);
    int row = cells->count[0] + 2, slab = row * (cells->count[1] + 2);
    float nearest = 1.0f;
    for (int k = 0; k < 3; k++)
        for (int j = 0; j < 3; j++) {
            const float(*point)[3] =
                (const float(*)[3])(cells->points + (iz + k) * slab + (iy + j) * row + ix);
            for (int i = 0; i < 3; i++) {
                float dx = point[i][0] - x, dy = point[i][1] - y, dz = point[i][2] - z;
                float d = dx * dx + dy * dy + dz * dz;
                nearest = d < nearest ? d : nearest;
            }
        }
    return nearest;
}
