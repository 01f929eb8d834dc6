/* See view_pyramid.h: from above and below layer by layer, every level at once, since means are
 * additive; from the sides axis by axis, rays through cells of one level being put together of those
 * of the level before. */
#include "renderer/bake/view_pyramid.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/bake/normals.h"

static const double DEEPEST = 600;

/* Finer cells that lie within a coarser one along an axis, with the share of each. */
struct cover {
    int first, last;
    double from, to;
};

static struct cover cover_of(int fine, int coarse, int cell) {
    struct cover cover = {.from = (double)cell * fine / coarse,
                          .to = (double)(cell + 1) * fine / coarse};
    cover.first = (int)cover.from;
    cover.last = (int)ceil(cover.to) - 1;
    cover.last = cover.last < fine ? cover.last : fine - 1;
    return cover;
}

static double share_of(const struct cover *cover, int i) {
    return fmin(cover->to, i + 1) - fmax(cover->from, i);
}

/* What is baked: voxels and, where lit, what light falls on in each, w n. */
struct source {
    const struct volume *volume;
    float *facing; /* 3 a voxel, or NULL */
};

static size_t voxel_index(const struct source *source, int x, int y, int z) {
    const int *n = source->volume->size;
    return ((size_t)z * (size_t)n[1] + (size_t)y) * (size_t)n[0] + (size_t)x;
}

/* `color` and `facing` are for each `shown`, which is theirs too. */
static void write_texel(const struct view_level *level, size_t index, double sigma, double shown,
                        const double color[3], const double facing[4]) {
    float *out = level->medium + 4 * index;
    double over = shown > 0 ? 1 / shown : 0;
    for (int c = 0; c < 3; c++)
        out[c] = (float)(sigma * color[c] * over);
    out[3] = (float)sigma;
    if (!level->gradient)
        return;
    /* The gradient whose own weight, g / (g + 0.01), is the length of w n. */
    double length =
        over * sqrt(facing[0] * facing[0] + facing[1] * facing[1] + facing[2] * facing[2]);
    double stretch = 0.01 * over / (1 - fmin(length, 0.99));
    for (int c = 0; c < 4; c++)
        level->gradient[4 * index + (size_t)c] =
            bake_half_from_float((float)(facing[c] * (c < 3 ? stretch : over)));
}

/* ---- from above, from below ---- */

struct column {
    double before, after; /* let through to this layer, and past it */
    double shown, color[3], facing[3], sigma;
};

static void add_column(struct column *to, const struct column *from, double share) {
    to->before += share * from->before;
    to->after += share * from->after;
    to->shown += share * from->shown;
    to->sigma += share * from->sigma;
    for (int c = 0; c < 3; c++) {
        to->color[c] += share * from->color[c];
        to->facing[c] += share * from->facing[c];
    }
}

static struct column look_at_voxel(const struct source *source, size_t index, double *tau) {
    const float *voxel = source->volume->medium + 4 * index;
    struct column column = {.before = exp(-*tau), .sigma = (double)voxel[3]};
    double sigma = (double)voxel[3], own = sigma / source->volume->size[2];
    *tau = fmin(*tau + own, DEEPEST);
    column.after = exp(-*tau);
    column.shown = column.before * -expm1(-own);
    for (int c = 0; c < 3 && sigma > 0; c++) {
        column.color[c] = column.shown * (double)voxel[c] / sigma;
        column.facing[c] = source->facing ? column.shown * (double)source->facing[3 * index + (size_t)c] : 0;
    }
    return column;
}

/* Means over the cells of a level. */
static void condense(const struct column *fine, const int from[2], struct column *coarse,
                     const int to[2]) {
    for (int y = 0; y < to[1]; y++) {
        struct cover rows = cover_of(from[1], to[1], y);
        for (int x = 0; x < to[0]; x++) {
            struct cover columns = cover_of(from[0], to[0], x);
            struct column sum = {0};
            double area = (rows.to - rows.from) * (columns.to - columns.from);
            for (int j = rows.first; j <= rows.last; j++)
                for (int i = columns.first; i <= columns.last; i++)
                    add_column(&sum, &fine[(size_t)j * (size_t)from[0] + (size_t)i],
                               share_of(&rows, j) * share_of(&columns, i) / area);
            coarse[(size_t)y * (size_t)to[0] + (size_t)x] = sum;
        }
    }
}

static void write_layer(const struct view_level *level, const struct column *columns, int image,
                        int layers) {
    size_t count = (size_t)level->size[0] * (size_t)level->size[1], at = count * (size_t)image;
    for (size_t i = 0; i < count; i++) {
        const struct column *c = &columns[i];
        bool seen = c->after > exp(-DEEPEST / 2);
        double sigma = seen ? log(c->before / c->after) * layers : c->sigma;
        const double facing[4] = {c->facing[0], c->facing[1], c->facing[2], 0};
        write_texel(level, at + i, fmax(sigma, 0), c->shown, c->color, facing);
    }
}

static enum status look_along_w(const struct source *source, struct view_pyramid *pyramid,
                                bool above) {
    const int *n = source->volume->size;
    size_t count = (size_t)n[0] * (size_t)n[1];
    double *tau = calloc(count, sizeof *tau);
    struct column *columns = malloc(2 * count * sizeof *columns);
    if (!tau || !columns) {
        free(tau);
        free(columns);
        return STATUS_OUT_OF_MEMORY;
    }
    for (int i = 0; i < n[2]; i++) {
        int z = above ? n[2] - 1 - i : i;
        struct column *fine = columns, *coarse = columns + count;
        for (size_t k = 0; k < count; k++)
            fine[k] = look_at_voxel(source, (size_t)z * count + k, &tau[k]);
        const int *from = n;
        for (int l = 0; l < pyramid->count; l++) {
            const struct view_level *level = &pyramid->level[l];
            condense(fine, from, coarse, level->size);
            write_layer(level, coarse, (above ? VIEW_ABOVE : VIEW_BELOW) * n[2] + z, n[2]);
            struct column *swap = fine;
            fine = coarse;
            coarse = swap;
            from = level->size;
        }
    }
    free(tau);
    free(columns);
    return STATUS_OK;
}

/* ---- from the sides ---- */

/* A ray through a cell along an axis, and what it gathers coming from its upper [0] and its lower
 * end [1]. */
struct ray {
    double tau;
    double color[2][3], facing[2][3];
};

/* Lengthens a ray by a share of the next cell, which lies above. */
static void go_on(struct ray *ray, const struct ray *next, double share) {
    double tau = share * next->tau;
    double part = share < 1 && next->tau > 0 ? expm1(-tau) / expm1(-next->tau) : 1;
    double through_next = exp(-tau), through = exp(-ray->tau);
    for (int c = 0; c < 3; c++) {
        ray->color[0][c] = part * next->color[0][c] + through_next * ray->color[0][c];
        ray->facing[0][c] = part * next->facing[0][c] + through_next * ray->facing[0][c];
        ray->color[1][c] += through * part * next->color[1][c];
        ray->facing[1][c] += through * part * next->facing[1][c];
    }
    ray->tau = fmin(ray->tau + tau, DEEPEST);
}

static struct ray ray_in_voxel(const struct source *source, size_t index, double length) {
    const float *voxel = source->volume->medium + 4 * index;
    double sigma = (double)voxel[3];
    struct ray ray = {.tau = fmin(sigma * length, DEEPEST)};
    double shown = -expm1(-ray.tau);
    for (int end = 0; end < 2 && sigma > 0; end++)
        for (int c = 0; c < 3; c++) {
            ray.color[end][c] = shown * (double)voxel[c] / sigma;
            ray.facing[end][c] = source->facing ? shown * (double)source->facing[3 * index + (size_t)c] : 0;
        }
    return ray;
}

/* Of one layer of a cell, as rays along an axis see it: what they lose, the colour that they gather,
 * w n, and how far that faces the viewer. */
enum { LOST, COLOR, FACING = COLOR + 3, TOWARD = FACING + 3, SIDE_SUMS };

/* `rays` run along `axis` in one layer, `lines` beside one another: their means over the cells of a
 * level into sums[cell * SIDE_SUMS]. */
static void mean_of_rays(const struct ray *rays, int lines, int axis, const int size[2],
                         float *sums) {
    int along = size[axis], across = size[1 - axis];
    for (int j = 0; j < across; j++) {
        struct cover cover = cover_of(lines, across, j);
        for (int i = 0; i < along; i++) {
            double sum[SIDE_SUMS] = {0}, width = cover.to - cover.from;
            for (int line = cover.first; line <= cover.last; line++) {
                const struct ray *ray = &rays[(size_t)line * (size_t)along + (size_t)i];
                double share = share_of(&cover, line) / width;
                sum[LOST] += share * -expm1(-ray->tau);
                for (int c = 0; c < 3; c++) {
                    sum[COLOR + c] += share / 2 * (ray->color[0][c] + ray->color[1][c]);
                    sum[FACING + c] += share / 2 * (ray->facing[0][c] + ray->facing[1][c]);
                }
                sum[TOWARD] += share / 2 * (ray->facing[0][axis] - ray->facing[1][axis]);
            }
            int x = axis == 0 ? i : j, y = axis == 0 ? j : i;
            float *out = sums + ((size_t)y * (size_t)size[0] + (size_t)x) * SIDE_SUMS;
            for (int c = 0; c < SIDE_SUMS; c++)
                out[c] = (float)sum[c];
        }
    }
}

/* Means of one cell over the layers within `height`, in layers, about each, for one axis; added to
 * that cell's texels, `of_cell`, a layer after another, in which LOST is the extinction. `below` is
 * for layers + 1 sums. */
static void add_axis(const float *sums, size_t cells, size_t cell, int layers, double height,
                     double length, double *below, double *of_cell) {
    memset(below, 0, SIDE_SUMS * sizeof *below);
    for (int k = 0; k < layers * SIDE_SUMS; k++) {
        size_t z = (size_t)k / SIDE_SUMS, c = (size_t)k % SIDE_SUMS;
        below[SIDE_SUMS + k] = below[k] + (double)sums[(z * cells + cell) * SIDE_SUMS + c];
    }
    for (int z = 0; z < layers; z++) {
        double from = fmin(fmax(z + 0.5 - height / 2, 0), z);
        double to = fmax(fmin(z + 0.5 + height / 2, layers), z + 1);
        double mean[SIDE_SUMS];
        for (int c = 0; c < SIDE_SUMS; c++) {
            int i = (int)from, j = (int)to < layers ? (int)to : layers - 1;
            const double *low = below + i * SIDE_SUMS + c, *high = below + j * SIDE_SUMS + c;
            mean[c] = (*high + (to - j) * (high[SIDE_SUMS] - *high) - *low -
                       (from - i) * (low[SIDE_SUMS] - *low)) /
                      (to - from);
        }
        double lost = fmin(mean[LOST], -expm1(-DEEPEST)), sigma = -log1p(-lost) / length;
        sigma = fmin(sigma, DEEPEST / length);
        double *out = of_cell + z * SIDE_SUMS;
        out[LOST] += sigma / 2;
        for (int c = COLOR; c < SIDE_SUMS && lost > 0; c++)
            out[c] += sigma / 2 * mean[c] / lost;
    }
}

struct side_work {
    struct ray *rays;    /* of one layer, and room for the next level's */
    float *sums[2];      /* for each axis, of one level: layer, cell, SIDE_SUMS */
    double *below, *of_cell;
};

/* All rays of a layer along an axis, through cells of level l (0: of two voxels, or three). */
static const struct ray *trace_layer(const struct source *source, const struct view_pyramid *pyramid,
                                     int l, int axis, int z, double length, struct ray *rays) {
    const int *n = source->volume->size;
    int lines = n[1 - axis], from = n[axis];
    struct ray *fine = rays, *coarse = rays + (size_t)n[0] * (size_t)n[1];
    for (int line = 0; line < lines; line++)
        for (int i = 0; i < from; i++) {
            size_t index = axis == 0 ? voxel_index(source, i, line, z) : voxel_index(source, line, i, z);
            fine[(size_t)line * (size_t)from + (size_t)i] =
                ray_in_voxel(source, index, length / from);
        }
    for (int k = 0; k <= l; k++) {
        int to = pyramid->level[k].size[axis];
        for (int line = 0; line < lines; line++)
            for (int i = 0; i < to; i++) {
                struct cover cover = cover_of(from, to, i);
                struct ray ray = {0};
                for (int j = cover.first; j <= cover.last; j++)
                    go_on(&ray, &fine[(size_t)line * (size_t)from + (size_t)j],
                          share_of(&cover, j));
                coarse[(size_t)line * (size_t)to + (size_t)i] = ray;
            }
        struct ray *swap = fine;
        fine = coarse;
        coarse = swap;
        from = to;
    }
    return fine;
}

static void look_from_sides(const struct source *source, const double aspect[2],
                            const struct view_pyramid *pyramid, int l, struct side_work *work) {
    const struct view_level *level = &pyramid->level[l];
    const int *n = source->volume->size;
    int layers = n[2];
    size_t cells = (size_t)level->size[0] * (size_t)level->size[1];
    for (int axis = 0; axis < 2; axis++)
        for (int z = 0; z < layers; z++)
            mean_of_rays(trace_layer(source, pyramid, l, axis, z, aspect[axis], work->rays),
                         n[1 - axis], axis, level->size,
                         work->sums[axis] + (size_t)z * cells * SIDE_SUMS);
    /* As high as wide. */
    double length[2], height = 0;
    for (int axis = 0; axis < 2; axis++) {
        length[axis] = aspect[axis] / level->size[axis];
        height += length[axis] * layers / 2;
    }
    for (size_t cell = 0; cell < cells; cell++) {
        memset(work->of_cell, 0, (size_t)layers * SIDE_SUMS * sizeof *work->of_cell);
        for (int axis = 0; axis < 2; axis++)
            add_axis(work->sums[axis], cells, cell, layers, height, length[axis], work->below,
                     work->of_cell);
        for (int z = 0; z < layers; z++) {
            const double *sum = work->of_cell + z * SIDE_SUMS;
            write_texel(level, ((size_t)VIEW_SIDE * (size_t)layers + (size_t)z) * cells + cell,
                        sum[LOST], sum[LOST], sum + COLOR, sum + FACING);
        }
    }
}

static enum status look_along_surface(const struct source *source, const double aspect[2],
                                      const struct view_pyramid *pyramid) {
    const int *n = source->volume->size, *most = pyramid->level[0].size;
    size_t rays = (size_t)n[0] * (size_t)n[1], layers = (size_t)n[2];
    size_t sums = (size_t)most[0] * (size_t)most[1] * layers * SIDE_SUMS;
    struct side_work work = {.rays = malloc(2 * rays * sizeof *work.rays),
                             .sums = {malloc(sums * sizeof **work.sums),
                                      malloc(sums * sizeof **work.sums)},
                             .below = malloc((layers + 1) * SIDE_SUMS * sizeof *work.below),
                             .of_cell = malloc(layers * SIDE_SUMS * sizeof *work.of_cell)};
    bool whole = work.rays && work.sums[0] && work.sums[1] && work.below && work.of_cell;
    for (int l = 0; l < pyramid->count && whole; l++)
        look_from_sides(source, aspect, pyramid, l, &work);
    free(work.rays);
    free(work.sums[0]);
    free(work.sums[1]);
    free(work.below);
    free(work.of_cell);
    return whole ? STATUS_OK : STATUS_OUT_OF_MEMORY;
}

/* ---- all ---- */

static enum status make_source(const struct volume *volume, bool lit, struct source *source) {
    *source = (struct source){.volume = volume};
    if (!lit)
        return STATUS_OK;
    size_t voxels = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    uint16_t *gradients = malloc(voxels * 4 * sizeof *gradients);
    source->facing = malloc(voxels * 3 * sizeof *source->facing);
    enum status status = !gradients || !source->facing
                             ? STATUS_OUT_OF_MEMORY
                             : bake_gradients(volume, BAKE_FIELD_MEDIUM, gradients);
    for (size_t i = 0; i < voxels && status == STATUS_OK; i++) {
        float g[3], length = 0;
        for (int c = 0; c < 3; c++) {
            g[c] = bake_float_from_half(gradients[4 * i + (size_t)c]);
            length += g[c] * g[c];
        }
        for (int c = 0; c < 3; c++)
            source->facing[3 * i + (size_t)c] = g[c] / (sqrtf(length) + 0.01f);
    }
    free(gradients);
    return status;
}

static enum status make_levels(const struct volume *volume, bool lit,
                               struct view_pyramid *pyramid) {
    struct pyramid sizes;
    const int flat[3] = {volume->size[0], volume->size[1], 1};
    pyramid_sizes(flat, &sizes);
    *pyramid = (struct view_pyramid){.layers = volume->size[2]};
    for (int l = 1; l < sizes.count; l++) {
        struct view_level *level = &pyramid->level[pyramid->count++];
        memcpy(level->size, sizes.level[l].size, sizeof level->size);
        size_t texels = (size_t)level->size[0] * (size_t)level->size[1] *
                        (size_t)volume->size[2] * VIEW_SIDES;
        level->medium = malloc(texels * 4 * sizeof *level->medium);
        level->gradient = lit ? malloc(texels * 4 * sizeof *level->gradient) : NULL;
        if (!level->medium || (lit && !level->gradient))
            return STATUS_OUT_OF_MEMORY;
    }
    return STATUS_OK;
}

enum status view_pyramid_make(const struct volume *volume, const double aspect[2], bool lit,
                              struct view_pyramid *pyramid) {
    struct source source;
    enum status status = make_levels(volume, lit, pyramid);
    if (status != STATUS_OK) {
        view_pyramid_finish(pyramid);
        return status;
    }
    status = make_source(volume, lit, &source);
    for (int above = 0; above < 2 && status == STATUS_OK; above++)
        status = look_along_w(&source, pyramid, above == 1);
    if (status == STATUS_OK)
        status = look_along_surface(&source, aspect, pyramid);
    free(source.facing);
    if (status != STATUS_OK)
        view_pyramid_finish(pyramid);
    return status;
}

void view_pyramid_finish(struct view_pyramid *pyramid) {
    for (int l = 0; l < pyramid->count; l++) {
        free(pyramid->level[l].medium);
        free(pyramid->level[l].gradient);
    }
    *pyramid = (struct view_pyramid){0};
}
