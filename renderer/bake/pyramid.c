/* See pyramid.h. Each level is made from the one before, a coarse cell at a time. */
#include "renderer/bake/pyramid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/bake/normals.h"

/* A coarse cell covers at most four finer ones along an axis, two of them in part: n / floor(n / 2)
 * is at most 3. */
enum { COVERED_MAX = 4, COLUMNS_MAX = COVERED_MAX * COVERED_MAX };

struct cover {
    int first, count;
    double share[COVERED_MAX]; /* of each finer cell that lies within; they sum up to n / coarse */
};

static struct cover cover_of(int fine, int coarse, int cell) {
    struct cover cover = {0};
    double from = (double)cell * fine / coarse, to = (double)(cell + 1) * fine / coarse;
    cover.first = (int)from;
    for (int i = cover.first; i < to && i < fine && cover.count < COVERED_MAX; i++)
        cover.share[cover.count++] = fmin(to, i + 1) - fmax(from, i);
    return cover;
}

void pyramid_sizes(const int size[3], struct pyramid *pyramid) {
    memset(pyramid, 0, sizeof *pyramid);
    int n[3] = {size[0], size[1], size[2]};
    for (;;) {
        memcpy(pyramid->level[pyramid->count++].size, n, sizeof n);
        if ((n[0] == 1 && n[1] == 1 && n[2] == 1) || pyramid->count == PYRAMID_LEVELS_MAX)
            return;
        for (int i = 0; i < 3; i++)
            n[i] = n[i] > 1 ? n[i] / 2 : 1;
    }
}

/* One column through the layers of a coarse cell. */
struct column {
    double area, tau;
    double emitted[3], facing[3]; /* E, and the same of w n or T */
};

static const float *voxel_at(const struct pyramid_level *level, int x, int y, int z) {
    size_t index = ((size_t)z * (size_t)level->size[1] + (size_t)y) * (size_t)level->size[0];
    return level->medium + 4 * (index + (size_t)x);
}

/* w n of a stored gradient. */
static void facing_of(const uint16_t *gradient, double facing[3]) {
    double g[3], length = 0;
    for (int i = 0; i < 3; i++) {
        g[i] = (double)bake_float_from_half(gradient[i]);
        length += g[i] * g[i];
    }
    length = sqrt(length);
    for (int i = 0; i < 3; i++)
        facing[i] = g[i] / (length + 0.01);
}

/* The gradient whose w n it is. |w n| < 1, since no gradient is longer than sqrt(3) / 2. */
static void gradient_of(const double facing[3], uint16_t *gradient) {
    double length = sqrt(facing[0] * facing[0] + facing[1] * facing[1] + facing[2] * facing[2]);
    for (int i = 0; i < 3; i++)
        gradient[i] = bake_half_from_float((float)(0.01 * facing[i] / (1 - fmin(length, 0.99))));
    gradient[3] = 0;
}

/* T of a stored sum. */
static void tangent_of(const float *strands, double tangent[3]) {
    for (int i = 0; i < 3; i++)
        tangent[i] = strands[3] > 0 ? (double)strands[i] / (double)strands[3] : 0;
}

static struct column look_down(const struct pyramid_level *fine, int x, int y,
                               const struct cover *layers) {
    struct column column = {0};
    for (int i = layers->count - 1; i >= 0; i--) {
        const float *voxel = voxel_at(fine, x, y, layers->first + i);
        double sigma = (double)voxel[3], tau = sigma * layers->share[i] / fine->size[2];
        if (!(tau > 0))
            continue;
        double shown = exp(-column.tau) * -expm1(-tau);
        double facing[3] = {0};
        if (fine->gradient)
            facing_of(fine->gradient + (voxel - fine->medium), facing);
        else if (fine->strands)
            tangent_of(fine->strands + (voxel - fine->medium), facing);
        for (int c = 0; c < 3; c++) {
            column.emitted[c] += shown * (double)voxel[c] / sigma;
            column.facing[c] += shown * facing[c];
        }
        column.tau += tau;
    }
    return column;
}

/* -log of the mean of exp(-tau): about the clearest column, so that nothing vanishes. */
static double mean_depth(const struct column *column, int count) {
    double least = INFINITY, sum = 0, area = 0;
    for (int i = 0; i < count; i++)
        least = fmin(least, column[i].tau);
    for (int i = 0; i < count; i++) {
        sum += column[i].area * expm1(least - column[i].tau);
        area += column[i].area;
    }
    return least - log1p(sum / area);
}

static void fill_cell(const struct pyramid_level *fine, const struct pyramid_level *coarse,
                      const struct cover cover[3], size_t index) {
    struct column column[COLUMNS_MAX];
    int count = 0;
    double area = 0, emitted[3] = {0}, facing[3] = {0};
    for (int y = 0; y < cover[1].count; y++)
        for (int x = 0; x < cover[0].count; x++) {
            struct column *one = &column[count++];
            *one = look_down(fine, cover[0].first + x, cover[1].first + y, &cover[2]);
            one->area = cover[0].share[x] * cover[1].share[y];
            area += one->area;
            for (int c = 0; c < 3; c++) {
                emitted[c] += one->area * one->emitted[c];
                facing[c] += one->area * one->facing[c];
            }
        }
    double tau = mean_depth(column, count), hidden = -expm1(-tau) * area;
    double sigma = tau * coarse->size[2];
    float *out = coarse->medium + 4 * index;
    for (int c = 0; c < 3; c++) {
        out[c] = hidden > 0 ? (float)(sigma * emitted[c] / hidden) : 0;
        facing[c] = hidden > 0 ? facing[c] / hidden : 0;
    }
    out[3] = (float)sigma;
    if (coarse->gradient)
        gradient_of(facing, coarse->gradient + 4 * index);
    if (!coarse->strands)
        return;
    for (int c = 0; c < 3; c++)
        coarse->strands[4 * index + (size_t)c] = (float)(sigma * facing[c]);
    coarse->strands[4 * index + 3] = (float)sigma;
}

static void fill_level(const struct pyramid_level *fine, const struct pyramid_level *coarse) {
    struct cover cover[3];
    size_t index = 0;
    for (int z = 0; z < coarse->size[2]; z++) {
        cover[2] = cover_of(fine->size[2], coarse->size[2], z);
        for (int y = 0; y < coarse->size[1]; y++) {
            cover[1] = cover_of(fine->size[1], coarse->size[1], y);
            for (int x = 0; x < coarse->size[0]; x++) {
                cover[0] = cover_of(fine->size[0], coarse->size[0], x);
                fill_cell(fine, coarse, cover, index++);
            }
        }
    }
}

enum status pyramid_make(const struct volume *volume, enum pyramid_light light,
                         struct pyramid *pyramid) {
    pyramid_sizes(volume->size, pyramid);
    enum status status = STATUS_OK;
    for (int l = 0; l < pyramid->count && status == STATUS_OK; l++) {
        struct pyramid_level *level = &pyramid->level[l];
        size_t voxels = (size_t)level->size[0] * (size_t)level->size[1] * (size_t)level->size[2];
        level->medium = l == 0 ? volume->medium : malloc(voxels * 4 * sizeof *level->medium);
        bool lit = light == PYRAMID_NORMALS, stranded = light == PYRAMID_STRANDS;
        level->gradient = lit ? malloc(voxels * 4 * sizeof *level->gradient) : NULL;
        if (stranded)
            level->strands = l == 0 ? volume->strands : malloc(voxels * 4 * sizeof *level->strands);
        if (!level->medium || (lit && !level->gradient) || (stranded && !level->strands))
            status = STATUS_OUT_OF_MEMORY;
        else if (l == 0)
            status = lit ? bake_gradients(volume, BAKE_FIELD_MEDIUM, level->gradient) : STATUS_OK;
        else
            fill_level(level - 1, level);
    }
    if (status != STATUS_OK)
        pyramid_finish(pyramid);
    return status;
}

enum status pyramid_strand_layers(const struct volume *volume, struct pyramid *layers) {
    pyramid_sizes((const int[3]){volume->size[0], volume->size[1], 1}, layers);
    layers->level[0].strands = volume->strands;
    for (int l = 0; l < layers->count; l++) {
        struct pyramid_level *level = &layers->level[l], *fine = level - 1;
        level->size[2] = volume->size[2];
        if (l == 0)
            continue;
        size_t count = (size_t)level->size[0] * (size_t)level->size[1];
        level->strands = calloc(count * (size_t)level->size[2], 4 * sizeof *level->strands);
        if (!level->strands) {
            pyramid_finish(layers);
            return STATUS_OUT_OF_MEMORY;
        }
        size_t fine_count = (size_t)fine->size[0] * (size_t)fine->size[1];
        for (int y = 0; y < level->size[1]; y++)
            for (int x = 0; x < level->size[0]; x++) {
                struct cover u = cover_of(fine->size[0], level->size[0], x);
                struct cover v = cover_of(fine->size[1], level->size[1], y);
                double area = (double)fine_count / (double)count;
                for (int i = 0; i < u.count * v.count; i++) {
                    int fx = u.first + i % u.count, fy = v.first + i / u.count;
                    double share = u.share[i % u.count] * v.share[i / u.count] / area;
                    size_t from = (size_t)fy * (size_t)fine->size[0] + (size_t)fx;
                    size_t to = (size_t)y * (size_t)level->size[0] + (size_t)x;
                    for (int z = 0; z < level->size[2]; z++, from += fine_count, to += count)
                        for (int c = 0; c < 4; c++)
                            level->strands[4 * to + (size_t)c] +=
                                (float)(share * (double)fine->strands[4 * from + (size_t)c]);
                }
            }
    }
    return STATUS_OK;
}

void pyramid_finish(struct pyramid *pyramid) {
    for (int l = 0; l < pyramid->count; l++) {
        if (l > 0) {
            free(pyramid->level[l].medium);
            free(pyramid->level[l].strands);
        }
        free(pyramid->level[l].gradient);
    }
    memset(pyramid, 0, sizeof *pyramid);
}
