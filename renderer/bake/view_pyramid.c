/* See view_pyramid.h: from above and below layer by layer, every level at once, since means are
 * additive. From the sides: view_sides.c. */
#include "renderer/bake/view_pyramid.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/bake/normals.h"
#include "renderer/bake/view_source.h"

struct view_cover view_cover_of(int fine, int coarse, int cell) {
    struct view_cover cover = {.from = (double)cell * fine / coarse,
                               .to = (double)(cell + 1) * fine / coarse};
    cover.first = (int)cover.from;
    cover.last = (int)ceil(cover.to) - 1;
    cover.last = cover.last < fine ? cover.last : fine - 1;
    return cover;
}

double view_share_of(const struct view_cover *cover, int i) {
    return fmin(cover->to, i + 1) - fmax(cover->from, i);
}

double view_depth_seen(double tau, double lost) {
    return tau > 1e-3 ? 1 / tau - (1 - lost) / lost : 0.5 - tau / 12;
}

void view_moments(const struct view_source *source, const float gradient[4], const float toward[3],
                  float *seen) {
    float n[3], g2 = 0, n2 = 0;
    for (int i = 0; i < 3; i++) {
        n[i] = gradient[i] * source->steep[i];
        g2 += gradient[i] * gradient[i];
        n2 += n[i] * n[i];
    }
    float g = sqrtf(g2), weight = n2 > 0 ? g / (g + 0.01f) : 0, over = 1 / sqrtf(fmaxf(n2, 1e-37f));
    float facing = n[0] * toward[0] + n[1] * toward[1] + n[2] * toward[2];
    float away = source->volume->surfaces ? 2 * over * fminf(facing, 0) : 0;
    for (int i = 0; i < 3; i++) {
        n[i] = n[i] * over - away * toward[i];
        seen[SEEN_MEAN + i] = weight * n[i];
        seen[SEEN_SQUARES + i] = weight * n[i] * n[i];
    }
    seen[SEEN_PRODUCTS] = weight * n[0] * n[1];
    seen[SEEN_PRODUCTS + 1] = weight * n[0] * n[2];
    seen[SEEN_PRODUCTS + 2] = weight * n[1] * n[2];
}

/* Least of what is let through that is told: far below what can be seen, and above where 32 bits
 * end. */
static const double LEAST_LEFT = 1e-30;

void view_write(const struct view_source *source, const struct view_level *level, size_t index,
                double left, double lost, double plain, const double *seen) {
    float *out = level->medium + 4 * index;
    bool any = left > LEAST_LEFT;
    level->left[index] = (float)(any ? left : LEAST_LEFT);
    out[3] = (float)(any ? lost : LEAST_LEFT * plain);
    double over = lost > 0 ? 1 / lost : 0;
    for (int c = 0; c < 3; c++)
        out[c] = out[3] * (float)(seen[SEEN_COLOR + c] * over);
    for (int k = 0; k < VIEW_MOMENTS && source->gradient; k++)
        for (size_t c = 0; c < 4; c++)
            level->moments[k][4 * index + c] =
                out[3] * (float)(seen[SEEN_MEAN + 4 * (size_t)k + c] * over);
}

/* ---- from above, from below ---- */

enum { AZIMUTHS = 4 };

/* Sums over rays. */
struct column {
    double count;
    double before; /* let through to this layer */
    double sigma, shown, seen[SEEN_COUNT];
};

/* `numbers`: of all that a column has, seen[] being the last. */
static void add_column(struct column *to, const struct column *from, double share, int numbers) {
    double *sum = &to->count;
    const double *one = &from->count;
    for (int i = 0; i < numbers; i++)
        sum[i] += share * one[i];
}

static int numbers_of(const struct view_source *source) {
    return (int)(offsetof(struct column, seen) / sizeof(double)) + source->count;
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

/* The four voxels of a layer about a place. */
struct around {
    size_t index[4];
};

static inline struct around around_of(const struct view_source *source, const struct place *place,
                                      int x, int y, int z) {
    const int *n = source->volume->size;
    int c0 = x + place->on[0], r0 = y + place->on[1];
    c0 -= c0 >= n[0] ? n[0] : 0;
    r0 -= r0 >= n[1] ? n[1] : 0;
    int c1 = c0 + 1 < n[0] ? c0 + 1 : 0, r1 = r0 + 1 < n[1] ? r0 + 1 : 0;
    return (struct around){{view_voxel(source, c0, r0, z), view_voxel(source, c1, r0, z),
                            view_voxel(source, c0, r1, z), view_voxel(source, c1, r1, z)}};
}

/* Four numbers a voxel at a place; compilers take the four at once. */
static inline void read_place(const float *voxels, const struct around *around, ptrdiff_t on,
                              const float share[4], float to[4]) {
    const float *a = voxels + 4 * ((ptrdiff_t)around->index[0] + on);
    const float *b = voxels + 4 * ((ptrdiff_t)around->index[1] + on);
    const float *d = voxels + 4 * ((ptrdiff_t)around->index[2] + on);
    const float *e = voxels + 4 * ((ptrdiff_t)around->index[3] + on);
    for (int c = 0; c < 4; c++)
        to[c] = share[0] * a[c] + share[1] * b[c] + share[2] * d[c] + share[3] * e[c];
}

/* Those moments that turn with the way to the viewer, -way. */
static void turn_moments(const double way[2], double *seen) {
    double x = -way[0], y = -way[1];
    double weight = seen[SEEN_SQUARES] + seen[SEEN_SQUARES + 1] + seen[SEEN_SQUARES + 2];
    seen[SEEN_MEAN + 3] = seen[SEEN_MEAN] * x + seen[SEEN_MEAN + 1] * y;
    seen[SEEN_SQUARES + 3] = weight * x;
    seen[SEEN_PRODUCTS + 3] = weight * y;
}

/* A step of a ray through one layer. */
struct step {
    const struct place *place;
    const float *toward;     /* the viewer */
    double length, at, size; /* where it begins in the layer, and how much of that it is */
    int z;
    ptrdiff_t before, after; /* voxels to the layers that the ray comes from and goes to */
};

/* Gradients are read as pictures read them, between layers too, and where the step's light comes
 * from: of what is opaque where the ray meets it, and there a layer's top is no more its side. */
static void read_normals(const struct view_source *source, const struct step *step,
                         const struct around *around, double tau, double lost, float *seen) {
    float at = (float)(step->at + step->size * view_depth_seen(tau, lost) - 0.5);
    float here[4], there[4], gradient[4], other = fabsf(at);
    read_place(source->gradient, around, 0, step->place->share, here);
    read_place(source->gradient, around, at < 0 ? step->before : step->after, step->place->share,
               there);
    for (int c = 0; c < 4; c++)
        gradient[c] = here[c] + other * (there[c] - here[c]);
    view_moments(source, gradient, step->toward, seen);
}

/* Of a ray in one layer, of what it had left there: what it sees, weighted by what is lost. */
struct glance {
    double sigma, shown, left;
    bool known;
    float sum[SEEN_COUNT], normals[SEEN_COUNT]; /* the latter: of the last step */
};

static void begin_glance(const struct view_source *source, struct glance *glance) {
    glance->sigma = glance->shown = 0;
    glance->left = 1;
    glance->known = false;
    for (int c = 0; c < source->count; c++)
        glance->sum[c] = 0;
}

/* Behind that much normals are read once a layer. */
static const double HIDDEN = 1e-3;

static void go_through(const struct view_source *source, const struct step *step, int x, int y,
                       double before, struct glance *glance) {
    struct around around = around_of(source, step->place, x, y, step->z);
    float voxel[4];
    read_place(source->volume->medium, &around, 0, step->place->share, voxel);
    double tau = (double)voxel[3] * step->length;
    if (!(tau > 0))
        return;
    glance->sigma += tau;
    double lost = -expm1(-tau), shown = glance->left * lost;
    float part = (float)shown, over = part / voxel[3];
    for (int c = 0; c < 3; c++)
        glance->sum[SEEN_COLOR + c] += over * voxel[c];
    if (source->gradient) {
        if (!glance->known || before * glance->left > HIDDEN)
            read_normals(source, step, &around, tau, lost, glance->normals);
        glance->known = true;
        for (int c = SEEN_MEAN; c < SEEN_COUNT; c++)
            glance->sum[c] += part * glance->normals[c];
    }
    glance->shown += shown;
    glance->left *= 1 - lost;
}

/* The most steps in a layer: where a slant passes over more voxels than that, one knows nothing of
 * the next. */
enum { STEPS_MAX = 8 };

/* All rays through layer z, the i-th that they meet; each is added to the column that it is in half
 * way. Neighbours have different azimuths, and four by four all. */
static void pass_layer(const struct view_source *source, const struct beam *beam, int z, int i,
                       double *left, struct column *columns) {
    const int *n = source->volume->size;
    double length = beam->secant / n[2] / beam->steps;
    ptrdiff_t layer = (ptrdiff_t)n[0] * n[1], up = z < n[2] - 1 ? layer : 0;
    ptrdiff_t down = z > 0 ? -layer : 0, before = beam->above ? up : down;
    ptrdiff_t after = beam->above ? down : up;
    struct place place[AZIMUTHS][STEPS_MAX], to[AZIMUTHS];
    float toward[AZIMUTHS][3];
    for (int k = 0; k < beam->azimuths; k++) {
        double cosine = 1 / beam->secant, sine = sqrt(1 - cosine * cosine);
        for (int a = 0; a < 2; a++)
            toward[k][a] = (float)(-sine * beam->way[k][a]);
        toward[k][2] = (float)(beam->above ? cosine : -cosine);
        to[k] = place_of(n, beam->drift[k], i + 0.5);
        for (int step = 0; step < beam->steps; step++)
            place[k][step] = place_of(n, beam->drift[k], i + (step + 0.5) / beam->steps);
    }
    for (int y = 0; y < n[1]; y++)
        for (int x = 0; x < n[0]; x++) {
            int azimuth = beam->azimuths > 1 ? (x & 1) + 2 * (y & 1) : 0;
            size_t ray = (size_t)y * (size_t)n[0] + (size_t)x;
            struct glance glance;
            begin_glance(source, &glance);
            for (int step = 0; step < beam->steps; step++) {
                double size = 1.0 / beam->steps;
                struct step one = {&place[azimuth][step],
                                   toward[azimuth],
                                   length,
                                   step * size,
                                   size,
                                   z,
                                   before,
                                   after};
                go_through(source, &one, x, y, left[ray], &glance);
            }
            struct column column = {1, left[ray], glance.sigma, left[ray] * glance.shown, {0}};
            for (int c = 0; c < source->count; c++)
                column.seen[c] = left[ray] * (double)glance.sum[c];
            if (source->gradient)
                turn_moments(beam->way[azimuth], column.seen);
            left[ray] = fmax(left[ray] * glance.left, exp(-VIEW_DEEPEST));
            column.sigma /= length * beam->steps;
            int at[2] = {(x + to[azimuth].on[0]) % n[0], (y + to[azimuth].on[1]) % n[1]};
            add_column(&columns[(size_t)at[1] * (size_t)n[0] + (size_t)at[0]], &column, 1.0,
                       numbers_of(source));
        }
}

/* Means over the cells of a level. */
static void condense(const struct column *fine, const int from[2], struct column *coarse,
                     const int to[2], int numbers) {
    for (int y = 0; y < to[1]; y++) {
        struct view_cover rows = view_cover_of(from[1], to[1], y);
        for (int x = 0; x < to[0]; x++) {
            struct view_cover columns = view_cover_of(from[0], to[0], x);
            struct column sum = {0};
            double area = (rows.to - rows.from) * (columns.to - columns.from);
            for (int j = rows.first; j <= rows.last; j++)
                for (int i = columns.first; i <= columns.last; i++)
                    add_column(&sum, &fine[(size_t)j * (size_t)from[0] + (size_t)i],
                               view_share_of(&rows, j) * view_share_of(&columns, i) / area,
                               numbers);
            coarse[(size_t)y * (size_t)to[0] + (size_t)x] = sum;
        }
    }
}

static void write_layer(const struct view_source *source, const struct view_level *level,
                        const struct column *columns, double depth, const struct beam *beam,
                        int image) {
    size_t count = (size_t)level->size[0] * (size_t)level->size[1], at = count * (size_t)image;
    for (size_t i = 0; i < count; i++) {
        const struct column *c = &columns[i];
        /* Slants: what is lost of what is left alone. */
        double whole = beam->azimuths > 1 ? c->before : c->count, over = whole > 0 ? 1 / whole : 0;
        double seen[SEEN_COUNT];
        for (int k = 0; k < source->count; k++)
            seen[k] = c->seen[k] * over;
        view_write(source, level, at + i, c->before * over, c->shown * over,
                   -expm1(-c->sigma / fmax(c->count, 1e-30) * depth), seen);
    }
}

static struct beam beam_of(const struct view_source *source, const double aspect[2], bool above,
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

static enum status look_through(const struct view_source *source, const struct beam *beam,
                                int image, struct view_pyramid *pyramid) {
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
            condense(fine, from, coarse, level->size, numbers_of(source));
            write_layer(source, level, coarse, beam->secant / n[2], beam, image * n[2] + z);
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

/* ---- all ---- */

static enum status make_source(const struct volume *volume, const double aspect[2], bool lit,
                               struct view_source *source) {
    *source = (struct view_source){.volume = volume, .count = lit ? SEEN_COUNT : SEEN_MEAN};
    if (!lit)
        return STATUS_OK;
    for (int i = 0; i < 3; i++)
        source->steep[i] = (float)(volume->size[i] / (i < 2 ? aspect[i] : 1));
    size_t voxels = (size_t)volume->size[0] * (size_t)volume->size[1] * (size_t)volume->size[2];
    uint16_t *gradients = malloc(voxels * 4 * sizeof *gradients);
    source->gradient = calloc(voxels, 4 * sizeof *source->gradient);
    enum status status = !gradients || !source->gradient
                             ? STATUS_OUT_OF_MEMORY
                             : bake_gradients(volume, BAKE_FIELD_MEDIUM, gradients);
    for (size_t i = 0; i < voxels && status == STATUS_OK; i++)
        for (size_t c = 0; c < 3; c++)
            source->gradient[4 * i + c] = bake_float_from_half(gradients[4 * i + c]);
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
        if (!level->medium || !level->left)
            return STATUS_OUT_OF_MEMORY;
        for (int k = 0; k < VIEW_MOMENTS && lit; k++) {
            level->moments[k] = malloc(texels * 4 * sizeof *level->moments[k]);
            if (!level->moments[k])
                return STATUS_OUT_OF_MEMORY;
        }
    }
    return STATUS_OK;
}

enum status view_pyramid_make(const struct volume *volume, const double aspect[2], bool lit,
                              struct view_pyramid *pyramid) {
    struct view_source source;
    enum status status = make_levels(volume, lit, pyramid);
    if (status != STATUS_OK) {
        view_pyramid_finish(pyramid);
        return status;
    }
    status = make_source(volume, aspect, lit, &source);
    for (int k = 0; k < 2 * VIEW_SLANTS && status == STATUS_OK; k++) {
        bool above = k < VIEW_SLANTS;
        struct beam beam = beam_of(&source, aspect, above, k % VIEW_SLANTS);
        int image = (above ? VIEW_ABOVE : VIEW_BELOW) + k % VIEW_SLANTS;
        status = look_through(&source, &beam, image, pyramid);
    }
    if (status == STATUS_OK)
        status = view_look_along_surface(&source, aspect, pyramid);
    free(source.gradient);
    if (status != STATUS_OK)
        view_pyramid_finish(pyramid);
    return status;
}

void view_pyramid_finish(struct view_pyramid *pyramid) {
    for (int l = 0; l < pyramid->count; l++) {
        free(pyramid->level[l].medium);
        free(pyramid->level[l].left);
        for (int k = 0; k < VIEW_MOMENTS; k++)
            free(pyramid->level[l].moments[k]);
    }
    *pyramid = (struct view_pyramid){0};
}
