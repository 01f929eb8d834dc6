/* Fur: thin, semi-transparent hairs that rise from the skin (w = 0) and lean over a combed
 * direction, as a density per voxel. After Kajiya and Kay 1989, "Rendering Fur with Three
 * Dimensional Textures", section 3 (texels); the density is that of the hairs' own volume in each
 * voxel, so that the mean extinction is the same at every size of the grid.
 *
 * A hair is a curve over its height t = w / length: root + comb * bend * t^2, gathered towards the
 * centre of its lock near the tip, thick and dark at the root, thin, pale and more transparent at
 * the tip. Within one layer of voxels it is a capsule from where it enters to where it leaves; the
 * capsule's share of each voxel is antialiased over about one voxel.
 *
 * Hair that has not grown all the way is the same hair, smaller: its tip is nearer to the root.
 *
 * Where the fur is lit by its strands, each voxel also keeps the mean direction of its hairs,
 * weighted by what they add to its extinction. All rise, so directions do not cancel but where
 * hairs cross.
 *
 * Left out: curls that turn back down (a hair is a function of w). */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum {
    HAIRS_SIDE = 90, /* hairs in one tile: a jittered grid of this many squared */
    LOCKS_SIDE = 10, /* locks of hair: likewise */
};

static const float UNDERCOAT = 0.33f; /* share of short hairs */

/* Sizes are in tile widths. */
static const float RADIUS_ROOT = 0.0042f; /* about half a voxel of 128 */
static const float RADIUS_TIP = 0.0012f;
static const float EXTINCTION_ROOT = 60.0f; /* of a hair's inside, times the thickness */
static const float EXTINCTION_TIP = 30.0f;

struct hair {
    float root[2];
    float lean[2];   /* offset of the tip along the comb */
    float gather[2]; /* further offset of the tip, towards the lock's centre */
    float length;    /* 0 to 1, of the thickness */
    float root_color[3], tip_color[3];
};

/* Offset from the root at t in [0, 1]. The skin is left at a slant, not upright, so that the coat
 * lies over the skin and hides it. */
static void hair_at(const struct hair *hair, float t, float point[2]) {
    float bend = t * (0.25f + 0.75f * t), gather = t * t * (3.0f - 2.0f * t);
    for (int i = 0; i < 2; i++)
        point[i] = hair->root[i] + hair->lean[i] * bend + hair->gather[i] * gather;
}

/* Centre of the lock that a root belongs to (the nearest of the jittered grid), and its hash. */
static uint32_t find_lock(uint32_t seed, const float root[2], float center[2]) {
    float best = 9.0f; /* squared tile widths: any centre is nearer */
    uint32_t best_hash = 0;
    int cell[2] = {(int)(root[0] * LOCKS_SIDE), (int)(root[1] * LOCKS_SIDE)};
    for (int j = -1; j <= 1; j++)
        for (int i = -1; i <= 1; i++) {
            uint32_t x = (uint32_t)(cell[0] + i + LOCKS_SIDE) % LOCKS_SIDE;
            uint32_t y = (uint32_t)(cell[1] + j + LOCKS_SIDE) % LOCKS_SIDE;
            uint32_t hash = random_hash4(seed, 0x10c4u, x, y);
            float cx = ((float)(cell[0] + i) + random_unit(hash)) / LOCKS_SIDE;
            float cy = ((float)(cell[1] + j) + random_unit(random_hash(hash))) / LOCKS_SIDE;
            float dx = cx - root[0], dy = cy - root[1], d = dx * dx + dy * dy;
            if (d < best) {
                best = d;
                best_hash = hash;
                center[0] = cx;
                center[1] = cy;
            }
        }
    return best_hash;
}

static struct hair make_hair(const struct scene_material *spec, uint32_t index) {
    static const float brown_root[3] = {0.085f, 0.040f, 0.018f};
    static const float brown_tip[3] = {0.46f, 0.285f, 0.145f};
    uint32_t state = random_hash4(spec->seed, 0xf0au, index, 1);
    struct hair hair;
    uint32_t column = index % HAIRS_SIDE, row = index / HAIRS_SIDE;
    hair.root[0] = ((float)column + random_next(&state)) / HAIRS_SIDE;
    hair.root[1] = ((float)row + random_next(&state)) / HAIRS_SIDE;
    float center[2] = {hair.root[0], hair.root[1]};
    uint32_t lock = find_lock(spec->seed, hair.root, center);

    bool undercoat = random_next(&state) < UNDERCOAT;
    float lock_length = 0.84f + 0.16f * random_unit(random_hash2(lock, 1));
    hair.length = undercoat ? random_between(&state, 0.25f, 0.55f)
                            : lock_length * random_between(&state, 0.70f, 1.0f);

    /* The coat lies along -v, the locks sway from it, each hair a little more. */
    float sway =
        0.55f * (random_unit(random_hash2(lock, 2)) - 0.5f) + 0.60f * (random_next(&state) - 0.5f);
    float reach = 0.24f * hair.length * random_between(&state, 0.6f, 1.4f);
    hair.lean[0] = reach * sway;
    hair.lean[1] = -reach;
    float hold = undercoat ? 0.08f : random_between(&state, 0.15f, 0.6f);
    for (int i = 0; i < 2; i++)
        hair.gather[i] = hold * (center[i] - hair.root[i]);
    float growth = spec->has_growth ? (float)spec->growth : 1.0f;
    hair.length *= growth;
    for (int i = 0; i < 2; i++) {
        hair.lean[i] *= growth;
        hair.gather[i] *= growth;
    }

    float shade =
        random_between(&state, 0.75f, 1.25f) * (0.85f + 0.30f * random_unit(random_hash2(lock, 3)));
    float warmth = random_between(&state, -0.06f, 0.06f);
    for (int i = 0; i < 3; i++) {
        float root = brown_root[i], tip = brown_tip[i];
        if (spec->has_color) {
            tip = (float)spec->color[i];
            root = 0.25f * tip;
        }
        float tint = shade * (1.0f + warmth * (float)(1 - i));
        hair.root_color[i] = fminf(root * tint, 1.0f);
        hair.tip_color[i] = fminf(tip * tint, 1.0f);
    }
    return hair;
}

/* The piece of a hair within one layer. */
struct piece {
    float a[2], b[2]; /* tile widths */
    float radius;
    float share;   /* how much of the layer's height it spans */
    float density; /* the extinction inside the hair */
    float color[3];
    float tangent[3]; /* unit, tile widths */
};

/* Adds a piece to its layer of `medium` and, if not NULL, of `strands`. */
static void splat_piece(float *layer, float *strands, const int size[3],
                        const struct piece *piece) {
    const float *a = piece->a, *b = piece->b, *color = piece->color;
    float radius = piece->radius, share = piece->share, density = piece->density;
    /* A hair thinner than a voxel is spread over the voxel and thinned out in proportion. */
    float cell[2] = {1.0f / (float)size[0], 1.0f / (float)size[1]};
    float wide[2] = {fmaxf(radius, 0.6f * cell[0]), fmaxf(radius, 0.6f * cell[1])};
    float ab[2] = {(b[0] - a[0]) / wide[0], (b[1] - a[1]) / wide[1]};
    float length2 = ab[0] * ab[0] + ab[1] * ab[1];
    /* Areas: of the hair's cut at one height, and of the capsule over which the layer spreads it.
     */
    const float pi = 3.14159265f;
    float area = (pi + 2.0f * sqrtf(length2)) * wide[0] * wide[1];
    float amount = density * share * fminf(1.0f, pi * radius * radius / area);
    float soft = 0.5f * fminf(cell[0] / wide[0], cell[1] / wide[1]); /* half a voxel, in radii */
    float margin[2] = {wide[0] * (1.0f + soft), wide[1] * (1.0f + soft)};
    int low[2], high[2];
    for (int i = 0; i < 2; i++) {
        low[i] = (int)ceilf((fminf(a[i], b[i]) - margin[i]) * (float)size[i] - 0.5f);
        high[i] = (int)floorf((fmaxf(a[i], b[i]) + margin[i]) * (float)size[i] - 0.5f);
    }
    float inverse_length2 = length2 > 0.0f ? 1.0f / length2 : 0.0f;
    float outer = 1.0f + soft, per_soft = 0.5f / soft;
    int first = fill_wrap(low[0], size[0]);
    for (int y = low[1]; y <= high[1]; y++) {
        float *row = layer + (size_t)fill_wrap(y, size[1]) * (size_t)size[0] * 4;
        float py = (((float)y + 0.5f) * cell[1] - a[1]) / wide[1];
        for (int x = low[0], column = first; x <= high[0]; x++, column++) {
            if (column == size[0])
                column = 0;
            float px = (((float)x + 0.5f) * cell[0] - a[0]) / wide[0];
            float t = (px * ab[0] + py * ab[1]) * inverse_length2;
            t = t < 0.0f ? 0.0f : t > 1.0f ? 1.0f : t;
            float dx = px - t * ab[0], dy = py - t * ab[1];
            float d2 = dx * dx + dy * dy;
            if (d2 >= outer * outer)
                continue;
            float cover = (outer - sqrtf(d2)) * per_soft;
            float extinction = cover < 1.0f ? amount * cover : amount;
            float *voxel = row + (size_t)column * 4;
            if (strands) {
                float *strand = strands + (voxel - layer);
                strand[0] += extinction * piece->tangent[0];
                strand[1] += extinction * piece->tangent[1];
                strand[2] += extinction * piece->tangent[2];
                strand[3] += extinction;
            }
            voxel[0] += extinction * color[0];
            voxel[1] += extinction * color[1];
            voxel[2] += extinction * color[2];
            voxel[3] += extinction;
        }
    }
}

static void set_tangent(struct piece *piece, float rise) {
    float t[3] = {piece->b[0] - piece->a[0], piece->b[1] - piece->a[1], rise};
    float length = sqrtf(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
    for (int i = 0; i < 3; i++)
        piece->tangent[i] = length > 0.0f ? t[i] / length : 0.0f;
}

static void splat_hair(struct volume *volume, const struct hair *hair) {
    const int *size = volume->size;
    size_t layer_floats = (size_t)size[0] * (size_t)size[1] * 4;
    float depth = (float)size[2];
    for (int z = 0; z < size[2] && (float)z < hair->length * depth; z++) {
        float low = (float)z / (depth * hair->length);
        float high = fminf(((float)z + 1.0f) / (depth * hair->length), 1.0f);
        float t = 0.5f * (low + high);
        struct piece piece = {.share = (high - low) * hair->length * depth};
        hair_at(hair, low, piece.a);
        hair_at(hair, high, piece.b);
        for (int i = 0; i < 3; i++)
            piece.color[i] = hair->root_color[i] + (hair->tip_color[i] - hair->root_color[i]) * t;
        piece.radius = RADIUS_ROOT + (RADIUS_TIP - RADIUS_ROOT) * t * t;
        piece.density = EXTINCTION_ROOT + (EXTINCTION_TIP - EXTINCTION_ROOT) * t;
        if (volume->strands)
            set_tangent(&piece, (high - low) * hair->length * (float)VOLUME_TILE_DEPTH);
        splat_piece(volume->medium + (size_t)z * layer_floats,
                    volume->strands ? volume->strands + (size_t)z * layer_floats : NULL, size,
                    &piece);
    }
}

enum status volume_make_fur(const struct scene_material *spec, struct volume *volume) {
    volume->medium = volume_alloc_voxels(volume->size);
    if (volume_wants_strands(spec))
        volume->strands = volume_alloc_voxels(volume->size);
    if (!volume->medium || (volume_wants_strands(spec) && !volume->strands))
        return STATUS_OUT_OF_MEMORY;
    for (uint32_t i = 0; i < HAIRS_SIDE * HAIRS_SIDE; i++) {
        struct hair hair = make_hair(spec, i);
        splat_hair(volume, &hair);
    }
    volume->medium_max = volume_medium_max(volume->medium, volume->size);
    return STATUS_OK;
}
