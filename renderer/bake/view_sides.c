/* See view_pyramid.h: axis by axis, rays through cells of one level being put together of those of
 * the level before. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/bake/view_source.h"

/* A ray through a cell along an axis, and what it gathers coming from its upper [0] and its lower
 * end [1]: colour, w n and w n n^T, of which nothing turns yet. */
struct ray {
    double tau, through, lost; /* optical depth; exp(-tau); 1 - exp(-tau) */
    float seen[2][SEEN_COUNT];
};

/* Lengthens a ray by a share of the next cell, which lies above. */
static void go_on(struct ray *ray, const struct ray *next, double share, int count) {
    double tau = next->tau, through_next = next->through, lost_next = next->lost;
    float part = 1;
    if (share < 1) {
        tau *= share;
        through_next = exp(-tau);
        lost_next = -expm1(-tau);
        part = next->lost > 0 ? (float)(lost_next / next->lost) : 1;
    }
    float before = (float)through_next, after = (float)ray->through * part;
    for (int c = 0; c < count; c++) {
        ray->seen[0][c] = part * next->seen[0][c] + before * ray->seen[0][c];
        ray->seen[1][c] += after * next->seen[1][c];
    }
    ray->lost += ray->through * lost_next;
    ray->through = fmax(ray->through * through_next, exp(-VIEW_DEEPEST));
    ray->tau = fmin(ray->tau + tau, VIEW_DEEPEST);
}

/* `beside`: the voxels next to it on its way along `axis`, above and below. Gradients are read
 * where the light comes from, between voxels, as from above. */
static struct ray ray_in_voxel(const struct view_source *source, size_t index,
                               const size_t beside[2], int axis, double length) {
    const float toward[2][3] = {{axis == 0, axis == 1, 0}, {-(axis == 0), -(axis == 1), 0}};
    const float *voxel = source->volume->medium + 4 * index;
    double sigma = (double)voxel[3];
    struct ray ray = {.tau = fmin(sigma * length, VIEW_DEEPEST), .through = 1};
    if (!(sigma > 0))
        return ray;
    ray.lost = -expm1(-ray.tau);
    ray.through = exp(-ray.tau);
    float lost = (float)ray.lost, other = (float)(0.5 - view_depth_seen(ray.tau, ray.lost));
    for (int end = 0; end < 2; end++) {
        float *seen = ray.seen[end];
        for (int c = 0; c < 3; c++)
            seen[SEEN_COLOR + c] = voxel[c] / voxel[3];
        if (source->gradient) {
            const float *here = source->gradient + 4 * index;
            const float *next = source->gradient + 4 * beside[end];
            float gradient[4];
            for (int c = 0; c < 4; c++)
                gradient[c] = (1 - other) * here[c] + other * next[c];
            view_moments(source, gradient, toward[end], seen);
        }
        for (int c = 0; c < source->count; c++)
            seen[c] *= lost;
    }
    return ray;
}

/* Of one layer of a cell, as rays along an axis see it: what they lose, and what they see. */
enum { LOST, SEEN, SIDE_SUMS = SEEN + SEEN_COUNT };

/* Those moments that turn with the way to the viewer, who stands at either end: the mean of both.
 */
static void turn_moments(const struct ray *ray, int axis, double share, double *seen) {
    const float *upper = ray->seen[0], *lower = ray->seen[1];
    double weight = 0;
    for (int c = 0; c < 3; c++)
        weight += (double)(upper[SEEN_SQUARES + c] - lower[SEEN_SQUARES + c]);
    seen[SEEN_MEAN + 3] += share * (double)(upper[SEEN_MEAN + axis] - lower[SEEN_MEAN + axis]);
    seen[(axis ? SEEN_PRODUCTS : SEEN_SQUARES) + 3] += share * weight;
}

/* `rays` run along `axis` in one layer, `lines` beside one another: their means over the cells of a
 * level into sums[cell * SIDE_SUMS]. */
static void mean_of_rays(const struct view_source *source, const struct ray *rays, int lines,
                         int axis, const int size[2], float *sums) {
    int along = size[axis], across = size[1 - axis];
    for (int j = 0; j < across; j++) {
        struct view_cover cover = view_cover_of(lines, across, j);
        for (int i = 0; i < along; i++) {
            double sum[SIDE_SUMS] = {0}, width = cover.to - cover.from;
            for (int line = cover.first; line <= cover.last; line++) {
                const struct ray *ray = &rays[(size_t)line * (size_t)along + (size_t)i];
                double share = view_share_of(&cover, line) / width;
                sum[LOST] += share * ray->lost;
                for (int c = 0; c < source->count; c++)
                    sum[SEEN + c] += share / 2 * (double)(ray->seen[0][c] + ray->seen[1][c]);
                if (source->gradient)
                    turn_moments(ray, axis, share / 2, sum + SEEN);
            }
            int x = axis == 0 ? i : j, y = axis == 0 ? j : i;
            float *out = sums + ((size_t)y * (size_t)size[0] + (size_t)x) * SIDE_SUMS;
            for (int c = 0; c < SEEN + source->count; c++)
                out[c] = (float)sum[c];
        }
    }
}

/* Means of one cell over the layers within `height`, in layers, about each, for one axis; added to
 * that cell's texels, `of_cell`, a layer after another, in which LOST is the extinction. `below` is
 * for layers + 1 sums. */
static void add_axis(const float *sums, size_t cells, size_t cell, int layers, double height,
                     double length, double *below, double *of_cell) {
    double sum[SIDE_SUMS] = {0};
    for (int k = 0; k < (layers + 1) * SIDE_SUMS; k++) {
        size_t z = (size_t)k / SIDE_SUMS, c = (size_t)k % SIDE_SUMS;
        below[k] = sum[c];
        if (z < (size_t)layers)
            sum[c] += (double)sums[(z * cells + cell) * SIDE_SUMS + c];
    }
    for (int z = 0; z < layers; z++) {
        /* Above the shell there is nothing, and below it more of the lowest layer. */
        double reach = fmax(height, 1) / 2, from = z + 0.5 - reach;
        double to = fmin(z + 0.5 + reach, layers), under = fmax(-from, 0);
        double mean[SIDE_SUMS];
        from = fmax(from, 0);
        for (int c = 0; c < SIDE_SUMS; c++) {
            int i = (int)from, j = (int)to < layers ? (int)to : layers - 1;
            const double *low = below + i * SIDE_SUMS + c, *high = below + j * SIDE_SUMS + c;
            mean[c] = (*high + (to - j) * (high[SIDE_SUMS] - *high) - *low -
                       (from - i) * (low[SIDE_SUMS] - *low) + under * below[SIDE_SUMS + c]) /
                      (2 * reach);
        }
        double lost = fmin(mean[LOST], -expm1(-VIEW_DEEPEST)), sigma = -log1p(-lost) / length;
        sigma = fmin(sigma, VIEW_DEEPEST / length);
        double *out = of_cell + z * SIDE_SUMS;
        out[LOST] += sigma / 2;
        for (int c = SEEN; c < SIDE_SUMS && lost > 0; c++)
            out[c] += sigma / 2 * mean[c] / lost;
    }
}

struct side_work {
    struct ray *rays; /* of one layer, and room for the next level's */
    float *sums[2];   /* for each axis: level, layer, cell, SIDE_SUMS */
    double *below, *of_cell;
};

/* All rays of a layer along an axis, through the cells of each level in turn. */
static void trace_layer(const struct view_source *source, const struct view_pyramid *pyramid,
                        int axis, int z, double length, struct side_work *work) {
    const int *n = source->volume->size;
    int lines = n[1 - axis], from = n[axis];
    struct ray *fine = work->rays, *coarse = work->rays + (size_t)n[0] * (size_t)n[1];
    for (int line = 0; line < lines; line++)
        for (int i = 0; i < from; i++) {
            size_t index[3];
            for (int k = 0; k < 3; k++) {
                int at[2] = {(i + (k == 1 ? 1 : k == 2 ? from - 1 : 0)) % from, line};
                index[k] = view_voxel(source, at[axis], at[1 - axis], z);
            }
            fine[(size_t)line * (size_t)from + (size_t)i] =
                ray_in_voxel(source, index[0], index + 1, axis, length / from);
        }
    float *sums = work->sums[axis];
    for (int l = 0; l < pyramid->count; l++) {
        const int *size = pyramid->level[l].size;
        int to = size[axis];
        for (int i = 0; i < to; i++) {
            struct view_cover cover = view_cover_of(from, to, i);
            for (int line = 0; line < lines; line++) {
                struct ray ray = {.through = 1};
                for (int j = cover.first; j <= cover.last; j++)
                    go_on(&ray, &fine[(size_t)line * (size_t)from + (size_t)j],
                          view_share_of(&cover, j), source->count);
                coarse[(size_t)line * (size_t)to + (size_t)i] = ray;
            }
        }
        size_t cells = (size_t)size[0] * (size_t)size[1];
        mean_of_rays(source, coarse, lines, axis, size, sums + (size_t)z * cells * SIDE_SUMS);
        sums += cells * (size_t)n[2] * SIDE_SUMS;
        struct ray *swap = fine;
        fine = coarse;
        coarse = swap;
        from = to;
    }
}

/* `sums`: of this level, for each axis. */
static void write_side(const struct view_source *source, const struct view_level *level,
                       const double aspect[2], int layers, float *const sums[2],
                       const struct side_work *work) {
    size_t cells = (size_t)level->size[0] * (size_t)level->size[1];
    double length[2], height = 0; /* as high as wide */
    for (int axis = 0; axis < 2; axis++) {
        length[axis] = aspect[axis] / level->size[axis];
        height += length[axis] * layers / 2;
    }
    for (size_t cell = 0; cell < cells; cell++) {
        memset(work->of_cell, 0, (size_t)layers * SIDE_SUMS * sizeof *work->of_cell);
        for (int axis = 0; axis < 2; axis++)
            add_axis(sums[axis], cells, cell, layers, height, length[axis], work->below,
                     work->of_cell);
        for (int z = 0; z < layers; z++) {
            const double *sum = work->of_cell + z * SIDE_SUMS;
            double lost = -expm1(-sum[LOST] / layers), seen[SEEN_COUNT];
            double over = sum[LOST] > 0 ? lost / sum[LOST] : 0;
            for (int c = 0; c < source->count; c++)
                seen[c] = sum[SEEN + c] * over;
            view_write(source, level,
                       ((size_t)VIEW_SIDE * (size_t)layers + (size_t)z) * cells + cell, 1, lost,
                       lost, seen);
        }
    }
}

enum status view_look_along_surface(const struct view_source *source, const double aspect[2],
                                    const struct view_pyramid *pyramid) {
    const int *n = source->volume->size;
    size_t rays = (size_t)n[0] * (size_t)n[1], layers = (size_t)n[2], cells = 0;
    for (int l = 0; l < pyramid->count; l++)
        cells += (size_t)pyramid->level[l].size[0] * (size_t)pyramid->level[l].size[1];
    size_t sums = cells * layers * SIDE_SUMS;
    struct side_work work = {
        .rays = malloc(2 * rays * sizeof *work.rays),
        .sums = {calloc(sums + 1, sizeof **work.sums), calloc(sums + 1, sizeof **work.sums)},
        .below = calloc((layers + 1) * SIDE_SUMS, sizeof *work.below),
        .of_cell = malloc(layers * SIDE_SUMS * sizeof *work.of_cell)};
    bool whole = work.rays && work.sums[0] && work.sums[1] && work.below && work.of_cell;
    for (int k = 0; k < 2 * n[2] && whole; k++)
        trace_layer(source, pyramid, k % 2, k / 2, aspect[k % 2], &work);
    size_t at = 0;
    for (int l = 0; l < pyramid->count && whole; l++) {
        const struct view_level *level = &pyramid->level[l];
        float *const of_level[2] = {work.sums[0] + at, work.sums[1] + at};
        write_side(source, level, aspect, n[2], of_level, &work);
        at += (size_t)level->size[0] * (size_t)level->size[1] * layers * SIDE_SUMS;
    }
    free(work.rays);
    free(work.sums[0]);
    free(work.sums[1]);
    free(work.below);
    free(work.of_cell);
    return whole ? STATUS_OK : STATUS_OUT_OF_MEMORY;
}
