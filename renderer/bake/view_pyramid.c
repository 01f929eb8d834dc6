/* See view_pyramid.h: from above and below layer by layer, every level at once, since means are
 * additive; from the sides axis by axis, rays through cells of one level being put together of
 * those of the level before. */
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

/* Least of what is let through that is told: far below what can be seen, and above where 32 bits
 * end. */
static const double LEAST_LEFT = 1e-30;

/* `left` is let through to a layer, `shown` of it is lost there, in which `color` and `facing` are
 * contained; `plain` is what a layer of the mean extinction would lose, for where nothing is left.
 */
static void write_texel(const struct view_level *level, size_t index, double left, double shown,
                        double plain, const double color[3], const double facing[4]) {
    float *out = level->medium + 4 * index;
    bool seen = left > LEAST_LEFT;
    level->left[index] = (float)(seen ? left : LEAST_LEFT);
    out[3] = (float)(seen ? shown : LEAST_LEFT * plain);
    double over = shown > 0 ? 1 / shown : 0;
    for (int c = 0; c < 3; c++)
        out[c] = out[3] * (float)(color[c] * over);
    for (int c = 0; c < 4 && level->facing; c++)
        level->facing[4 * index + (size_t)c] = out[3] * (float)(facing[c] * over);
}

/* ---- from above, from below ---- */

enum { AZIMUTHS = 4 };

/* Sums over rays. */
struct column {
    double count;
    double before; /* let through to this layer */
    double sigma, color[3];
    double shown[AZIMUTHS], facing[AZIMUTHS][3];
};

static void add_column(struct column *to, const struct column *from, double share) {
    enum { NUMBERS = sizeof *to / sizeof(double) };
    double *sum = &to->count;
    const double *one = &from->count;
    for (int i = 0; i < NUMBERS; i++)
        sum[i] += share * one[i];
}

/* Rays that come through the layers one way, from as many azimuths. */
struct beam {
    bool above;
    double secant;             /* of the slant */
    int azimuths;              /* 1, or AZIMUTHS */
    double way[AZIMUTHS][2];   /* along the surface: unit vectors */
    double drift[AZIMUTHS][2]; /* voxels a layer along u and v */
    int steps;                 /* in a layer */
};

static int wrap(double cell, int size) {
    double rest = cell - size * floor(cell / size);
    return rest < size ? (int)rest : 0;
}

/* Where the rays of one azimuth are at a step, from the voxels that they began in: cells on, and
 * the shares of the four that lie about. */
struct place {
    int on[2];
    float share[4];
};

static struct place place_of(const int n[3], const double drift[2], double layers) {
    struct place place;
    double rest[2];
    for (int a = 0; a < 2; a++) {
        double way = drift[a] * layers;
        place.on[a] = wrap(floor(way), n[a]);
        rest[a] = way - floor(way);
    }
    for (int k = 0; k < 4; k++)
        place.share[k] =
            (float)((k & 1 ? rest[0] : 1 - rest[0]) * (k >> 1 ? rest[1] : 1 - rest[1]));
    return place;
}

/* What lies there: extinction-weighted colour, extinction, and w n weighted likewise. */
static void read_place(const struct source *source, const struct place *place, int x, int y, int z,
                       float voxel[4], float facing[3]) {
    const int *n = source->volume->size;
    int column[2] = {x + place->on[0], 0}, row[2] = {y + place->on[1], 0};
    column[0] -= column[0] >= n[0] ? n[0] : 0;
    row[0] -= row[0] >= n[1] ? n[1] : 0;
    column[1] = column[0] + 1 < n[0] ? column[0] + 1 : 0;
    row[1] = row[0] + 1 < n[1] ? row[0] + 1 : 0;
    for (int k = 0; k < 4; k++) {
        size_t index = voxel_index(source, column[k & 1], row[k >> 1], z);
        const float *from = source->volume->medium + 4 * index;
        float part = place->share[k];
        for (int c = 0; c < 4; c++)
            voxel[c] += part * from[c];
        for (int c = 0; c < 3 && source->facing; c++)
            facing[c] += part * from[3] * source->facing[3 * index + (size_t)c];
    }
}

static void go_through(const float voxel[4], const float facing[3], double length, int azimuth,
                       double *left, struct column *column) {
    column->sigma += (double)voxel[3] * length;
    if (!(voxel[3] > 0))
        return;
    double lost = -expm1(-(double)voxel[3] * length), shown = *left * lost;
    *left = fmax(*left * (1 - lost), exp(-DEEPEST));
    column->shown[azimuth] += shown;
    for (int c = 0; c < 3; c++) {
        column->color[c] += shown * (double)(voxel[c] / voxel[3]);
        column->facing[azimuth][c] += shown * (double)(facing[c] / voxel[3]);
    }
}

/* The most steps in a layer: where a slant passes over more voxels than that, one knows nothing of
 * the next. */
enum { STEPS_MAX = 8 };

/* All rays through layer z, the i-th that they meet; each is added to the column that it is in half
 * way. Neighbours have different azimuths, and four by four all. */
static void pass_layer(const struct source *source, const struct beam *beam, int z, int i,
                       double *left, struct column *columns) {
    const int *n = source->volume->size;
    double length = beam->secant / n[2] / beam->steps;
    struct place place[AZIMUTHS][STEPS_MAX], to[AZIMUTHS];
    for (int k = 0; k < beam->azimuths; k++) {
        to[k] = place_of(n, beam->drift[k], i + 0.5);
        for (int step = 0; step < beam->steps; step++)
            place[k][step] = place_of(n, beam->drift[k], i + (step + 0.5) / beam->steps);
    }
    for (int y = 0; y < n[1]; y++)
        for (int x = 0; x < n[0]; x++) {
            int azimuth = beam->azimuths > 1 ? (x & 1) + 2 * (y & 1) : 0;
            size_t ray = (size_t)y * (size_t)n[0] + (size_t)x;
            struct column column = {.count = 1, .before = left[ray]};
            for (int step = 0; step < beam->steps; step++) {
                float voxel[4] = {0}, facing[3] = {0};
                read_place(source, &place[azimuth][step], x, y, z, voxel, facing);
                go_through(voxel, facing, length, azimuth, &left[ray], &column);
            }
            column.sigma /= length * beam->steps;
            int at[2] = {(x + to[azimuth].on[0]) % n[0], (y + to[azimuth].on[1]) % n[1]};
            add_column(&columns[(size_t)at[1] * (size_t)n[0] + (size_t)at[0]], &column, 1.0);
        }
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

/* Each azimuth has its own mean of w n, and of how far that faces it. */
static void write_layer(const struct view_level *level, const struct column *columns, double depth,
                        const struct beam *beam, int image) {
    size_t count = (size_t)level->size[0] * (size_t)level->size[1], at = count * (size_t)image;
    for (size_t i = 0; i < count; i++) {
        const struct column *c = &columns[i];
        double shown = 0, facing[4] = {0}, azimuths = 0;
        for (int k = 0; k < beam->azimuths; k++) {
            shown += c->shown[k];
            azimuths += c->shown[k] > 0;
        }
        for (int k = 0; k < beam->azimuths; k++) {
            double over = c->shown[k] > 0 ? shown / (c->shown[k] * azimuths) : 0;
            for (int a = 0; a < 3; a++)
                facing[a] += over * c->facing[k][a];
            for (int a = 0; a < 2; a++)
                facing[3] -= over * c->facing[k][a] * beam->way[k][a];
        }
        /* Slants: what is lost of what is left alone. */
        double whole = beam->azimuths > 1 ? c->before : c->count, over = whole > 0 ? 1 / whole : 0;
        double color[3];
        for (int a = 0; a < 4; a++) {
            color[a < 3 ? a : 0] = c->color[a < 3 ? a : 0] * over;
            facing[a] *= over;
        }
        write_texel(level, at + i, c->before * over, shown * over,
                    -expm1(-c->sigma / fmax(c->count, 1e-30) * depth), color, facing);
    }
}

static struct beam beam_of(const struct source *source, const double aspect[2], bool above,
                           int slant) {
    static const double cos2[VIEW_SLANTS] = {1, VIEW_COS2_1, VIEW_COS2_2};
    /* Along the axes, or the diagonal, a slanting ray meets the same row again and again. */
    static const double way[2] = {0.894427190999916, 0.447213595499958}; /* (2, 1) / sqrt(5) */
    const int *n = source->volume->size;
    struct beam beam = {above, 1 / sqrt(cos2[slant]), slant ? AZIMUTHS : 1, {{0}}, {{0}}, 1};
    double tangent = sqrt(1 / cos2[slant] - 1);
    for (int k = 0; k < beam.azimuths && slant; k++) {
        double sign = k < 2 ? 1 : -1, farthest = 0;
        beam.way[k][0] = sign * (k % 2 ? -way[1] : way[0]);
        beam.way[k][1] = sign * (k % 2 ? way[0] : way[1]);
        for (int a = 0; a < 2; a++) {
            beam.drift[k][a] = beam.way[k][a] * tangent / n[2] * n[a] / aspect[a];
            farthest = fmax(farthest, fabs(beam.drift[k][a]));
        }
        beam.steps = (int)fmax(2, fmin(ceil(2 * farthest), STEPS_MAX));
    }
    return beam;
}

static enum status look_through(const struct source *source, const struct beam *beam, int image,
                                struct view_pyramid *pyramid) {
    const int *n = source->volume->size;
    size_t count = (size_t)n[0] * (size_t)n[1];
    double *left = calloc(count, sizeof *left);
    struct column *columns = malloc(2 * count * sizeof *columns);
    if (!left || !columns) {
        free(left);
        free(columns);
        return STATUS_OUT_OF_MEMORY;
    }
    for (size_t k = 0; k < count; k++)
        left[k] = 1;
    for (int i = 0; i < n[2]; i++) {
        int z = beam->above ? n[2] - 1 - i : i;
        struct column *fine = columns, *coarse = columns + count;
        memset(fine, 0, count * sizeof *fine);
        pass_layer(source, beam, z, i, left, fine);
        const int *from = n;
        for (int l = 0; l < pyramid->count; l++) {
            const struct view_level *level = &pyramid->level[l];
            condense(fine, from, coarse, level->size);
            write_layer(level, coarse, beam->secant / n[2], beam, image * n[2] + z);
            struct column *swap = fine;
            fine = coarse;
            coarse = swap;
            from = level->size;
        }
    }
    free(left);
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
            ray.facing[end][c] =
                source->facing ? shown * (double)source->facing[3 * index + (size_t)c] : 0;
        }
    return ray;
}

/* Of one layer of a cell, as rays along an axis see it: what they lose, the colour that they
 * gather, w n, and how far that faces the viewer. */
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
        double lost = fmin(mean[LOST], -expm1(-DEEPEST)), sigma = -log1p(-lost) / length;
        sigma = fmin(sigma, DEEPEST / length);
        double *out = of_cell + z * SIDE_SUMS;
        out[LOST] += sigma / 2;
        for (int c = COLOR; c < SIDE_SUMS && lost > 0; c++)
            out[c] += sigma / 2 * mean[c] / lost;
    }
}

struct side_work {
    struct ray *rays; /* of one layer, and room for the next level's */
    float *sums[2];   /* for each axis: level, layer, cell, SIDE_SUMS */
    double *below, *of_cell;
};

/* All rays of a layer along an axis, through the cells of each level in turn. */
static void trace_layer(const struct source *source, const struct view_pyramid *pyramid, int axis,
                        int z, double length, struct side_work *work) {
    const int *n = source->volume->size;
    int lines = n[1 - axis], from = n[axis];
    struct ray *fine = work->rays, *coarse = work->rays + (size_t)n[0] * (size_t)n[1];
    for (int line = 0; line < lines; line++)
        for (int i = 0; i < from; i++) {
            int at[2] = {i, line};
            size_t index = voxel_index(source, at[axis], at[1 - axis], z);
            fine[(size_t)line * (size_t)from + (size_t)i] =
                ray_in_voxel(source, index, length / from);
        }
    float *sums = work->sums[axis];
    for (int l = 0; l < pyramid->count; l++) {
        const int *size = pyramid->level[l].size;
        int to = size[axis];
        for (int i = 0; i < to; i++) {
            struct cover cover = cover_of(from, to, i);
            for (int line = 0; line < lines; line++) {
                struct ray ray = {0};
                for (int j = cover.first; j <= cover.last; j++)
                    go_on(&ray, &fine[(size_t)line * (size_t)from + (size_t)j],
                          share_of(&cover, j));
                coarse[(size_t)line * (size_t)to + (size_t)i] = ray;
            }
        }
        size_t cells = (size_t)size[0] * (size_t)size[1];
        mean_of_rays(coarse, lines, axis, size, sums + (size_t)z * cells * SIDE_SUMS);
        sums += cells * (size_t)n[2] * SIDE_SUMS;
        struct ray *swap = fine;
        fine = coarse;
        coarse = swap;
        from = to;
    }
}

/* `sums`: of this level, for each axis. */
static void write_side(const struct view_level *level, const double aspect[2], int layers,
                       float *const sums[2], const struct side_work *work) {
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
            double color[3], facing[4], lost = -expm1(-sum[LOST] / layers);
            double over = sum[LOST] > 0 ? lost / sum[LOST] : 0;
            for (int c = 0; c < 3; c++)
                color[c] = sum[COLOR + c] * over;
            for (int c = 0; c < 4; c++)
                facing[c] = sum[FACING + c] * over;
            write_texel(level, ((size_t)VIEW_SIDE * (size_t)layers + (size_t)z) * cells + cell, 1,
                        lost, lost, color, facing);
        }
    }
}

static enum status look_along_surface(const struct source *source, const double aspect[2],
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
        write_side(level, aspect, n[2], of_level, &work);
        at += (size_t)level->size[0] * (size_t)level->size[1] * layers * SIDE_SUMS;
    }
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
        size_t texels =
            (size_t)level->size[0] * (size_t)level->size[1] * (size_t)volume->size[2] * VIEW_SIDES;
        level->medium = malloc(texels * 4 * sizeof *level->medium);
        level->left = malloc(texels * sizeof *level->left);
        level->facing = lit ? malloc(texels * 4 * sizeof *level->facing) : NULL;
        if (!level->medium || !level->left || (lit && !level->facing))
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
    for (int k = 0; k < 2 * VIEW_SLANTS && status == STATUS_OK; k++) {
        bool above = k < VIEW_SLANTS;
        struct beam beam = beam_of(&source, aspect, above, k % VIEW_SLANTS);
        int image = (above ? VIEW_ABOVE : VIEW_BELOW) + k % VIEW_SLANTS;
        status = look_through(&source, &beam, image, pyramid);
    }
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
        free(pyramid->level[l].left);
        free(pyramid->level[l].facing);
    }
    *pyramid = (struct view_pyramid){0};
}
