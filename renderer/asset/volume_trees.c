/* A forest: broad-leaved trees and conifers, trunks and branches solid, leaves a medium that is
 * opaque from a few of them on; the "texture of a tree" of Dufort et al. 2005, color plate E, and
 * the trees of Lensch et al. 2002, figures 7 and 12.
 *
 * Trunks and branches are capsules that taper. A leaf is a small ball of extinction, spread over
 * its voxels and thinned out in proportion where it is smaller than one, so that the mean
 * extinction is that of the leaves at every size of the grid (as the hairs of volume_fur.c are).
 * The leaves of a broad-leaved tree hang around the ends of its branches; those of a conifer lie on
 * tiers of boughs that droop. Leaves are darker inside the crown and underneath. */
#include <math.h>
#include <stddef.h>

#include "renderer/asset/volume_fill.h"
#include "renderer/asset/volume_generators.h"
#include "renderer/asset/volume_random.h"

enum { TREES_SIDE = 5 }; /* trees in one tile: a jittered grid of this many squared */
enum { BOUGHS = 9, BOUGH_LEAVES = 110, TIERS = 8, TIER_LEAVES = 130 };

/* In tile widths. */
static const float LEAF_RADIUS = 0.0085f;
static const float EXTINCTION = 55.0f; /* of a leaf's inside, times the thickness */

/* A piece of wood: a capsule from a to b whose radius changes on the way. */
struct wood {
    float a[3], b[3];
    float radius[2];
    float color[3];
};

struct tree {
    float root[2];
    float height; /* of its top, in tile widths */
    float lean[2];
    uint32_t state;
    float wood[3], leaf[3];
};

static struct tree make_tree(const struct scene_material *spec, int column, int row,
                             bool *conifer) {
    static const float woods[2][3] = {{0.17f, 0.12f, 0.085f}, {0.14f, 0.085f, 0.055f}};
    static const float leaves[2][3] = {{0.125f, 0.20f, 0.038f}, {0.040f, 0.105f, 0.042f}};
    struct tree tree;
    tree.state = random_hash4(spec->seed, 0x73eeu, (uint32_t)column, (uint32_t)row);
    /* The grid starts anywhere, so that the tile's seam is no lane without trees. */
    int place[2] = {column, row};
    for (uint32_t i = 0; i < 2; i++)
        tree.root[i] = ((float)place[i] + 0.5f + random_between(&tree.state, -0.32f, 0.32f) +
                        random_unit(random_hash4(spec->seed, 0x95du, i, 0))) /
                       TREES_SIDE;
    *conifer = random_next(&tree.state) < 0.4f;
    tree.height = random_between(&tree.state, 0.165f, 0.235f);
    for (int i = 0; i < 2; i++)
        tree.lean[i] = random_between(&tree.state, -0.012f, 0.012f);
    float shade = random_between(&tree.state, 0.8f, 1.2f);
    float autumn = random_next(&tree.state);
    autumn = autumn * autumn * autumn * 0.9f;
    float change[3] = {1.0f + 1.3f * autumn, 1.0f + 0.15f * autumn, 1.0f - 0.3f * autumn};
    for (int i = 0; i < 3; i++) {
        float green = fill_tint(spec, i, leaves[*conifer][i] * (*conifer ? 1.0f : change[i]));
        tree.leaf[i] = fminf(shade * green, 1.0f);
        tree.wood[i] = spec->has_color ? 0.4f * (float)spec->color[i] : woods[*conifer][i];
    }
    return tree;
}

/* Distance to a capsule that tapers: to the point of its axis that is nearest, less the radius
 * there; exact to second order in the taper, which is below 0.06 here. */
static float wood_field(const void *part, const float point[3]) {
    const struct wood *wood = part;
    float ab[3], ap[3], along = 0.0f, length2 = 0.0f;
    for (int i = 0; i < 3; i++) {
        ab[i] = wood->b[i] - wood->a[i];
        ap[i] = point[i] - wood->a[i];
        along += ab[i] * ap[i];
        length2 += ab[i] * ab[i];
    }
    float t = length2 > 0.0f ? fminf(fmaxf(along / length2, 0.0f), 1.0f) : 0.0f, d2 = 0.0f;
    for (int i = 0; i < 3; i++) {
        float d = ap[i] - t * ab[i];
        d2 += d * d;
    }
    return sqrtf(d2) - (wood->radius[0] + (wood->radius[1] - wood->radius[0]) * t);
}

static float wood_depth(const void *part, const float point[3], const float h[3]) {
    return fill_field_depth(wood_field, part, point, h);
}

static void wood_color(const void *part, const float point[3], float color[3]) {
    const struct wood *wood = part;
    float shade = 0.6f + 0.4f * fill_smooth(0.0f, 0.15f, point[2]);
    for (int i = 0; i < 3; i++)
        color[i] = shade * wood->color[i];
}

static void add_wood(struct volume *volume, const struct tree *tree, const float a[3],
                     const float b[3], float radius_a, float radius_b) {
    struct wood wood = {.radius = {radius_a, radius_b}};
    float low[3], high[3];
    for (int i = 0; i < 3; i++) {
        wood.a[i] = a[i];
        wood.b[i] = b[i];
        wood.color[i] = tree->wood[i];
        low[i] = fminf(a[i] - radius_a, b[i] - radius_b);
        high[i] = fmaxf(a[i] + radius_a, b[i] + radius_b);
    }
    fill_part(volume->solid, volume->size, low, high, wood_depth, wood_color, &wood);
}

/* Adds one leaf. */
static void add_leaf(struct volume *volume, const float center[3], float radius,
                     const float color[3]) {
    const int *size = volume->size;
    float h[3], wide[3], amount = EXTINCTION;
    int low[3], high[3];
    for (int i = 0; i < 3; i++) {
        h[i] = (i == 2 ? (float)VOLUME_TILE_DEPTH : 1.0f) / (float)size[i];
        wide[i] = fmaxf(radius, 0.75f * h[i]);
        amount *= radius / wide[i];
        low[i] = (int)ceilf((center[i] - 1.5f * wide[i]) / h[i] - 0.5f);
        high[i] = (int)floorf((center[i] + 1.5f * wide[i]) / h[i] - 0.5f);
    }
    low[2] = low[2] < 0 ? 0 : low[2];
    high[2] = high[2] >= size[2] ? size[2] - 1 : high[2];
    for (int z = low[2]; z <= high[2]; z++)
        for (int y = low[1]; y <= high[1]; y++)
            for (int x = low[0]; x <= high[0]; x++) {
                float dx = (((float)x + 0.5f) * h[0] - center[0]) / wide[0];
                float dy = (((float)y + 0.5f) * h[1] - center[1]) / wide[1];
                float dz = (((float)z + 0.5f) * h[2] - center[2]) / wide[2];
                /* (1 - r^2/2.25)^2: its integral is 0.77 of a ball's with radius 1. */
                float fall = 1.0f - (dx * dx + dy * dy + dz * dz) / 2.25f;
                if (fall <= 0.0f)
                    continue;
                float extinction = amount * fall * fall;
                size_t row = (size_t)z * (size_t)size[1] + (size_t)fill_wrap(y, size[1]);
                float *voxel =
                    volume->medium + (row * (size_t)size[0] + (size_t)fill_wrap(x, size[0])) * 4;
                for (int i = 0; i < 3; i++)
                    voxel[i] += extinction * color[i];
                voxel[3] += extinction;
            }
}

/* A leaf of a tree: `outward` is 0 in the crown's heart and 1 at its rim. */
static void hang_leaf(struct volume *volume, struct tree *tree, const float at[3], float outward) {
    float shade = (0.35f + 0.65f * outward) * random_between(&tree->state, 0.7f, 1.3f);
    shade *= 0.55f + 0.45f * fminf(at[2] / tree->height, 1.0f);
    float color[3];
    for (int i = 0; i < 3; i++)
        color[i] = fminf(shade * tree->leaf[i], 1.0f);
    float radius = LEAF_RADIUS * random_between(&tree->state, 0.75f, 1.25f);
    if (at[2] + 1.5f * radius < (float)VOLUME_TILE_DEPTH)
        add_leaf(volume, at, radius, color);
}

static void grow_broadleaf(struct volume *volume, struct tree *tree) {
    uint32_t *state = &tree->state;
    float spread = random_between(state, 0.40f, 0.50f) * tree->height; /* half the crown's width */
    float foot[3] = {tree->root[0], tree->root[1], 0.0f};
    float fork[3] = {tree->root[0] + 0.5f * tree->lean[0], tree->root[1] + 0.5f * tree->lean[1],
                     0.42f * tree->height};
    float crown[3] = {tree->root[0] + tree->lean[0], tree->root[1] + tree->lean[1],
                      0.64f * tree->height};
    add_wood(volume, tree, foot, fork, 0.075f * tree->height, 0.05f * tree->height);
    for (int k = 0; k < BOUGHS; k++) {
        float way[3], end[3];
        fill_direction(state, way);
        float out = k ? 0.68f : 0.1f;
        for (int i = 0; i < 3; i++)
            end[i] = crown[i] + out * way[i] * (i == 2 ? 0.22f * tree->height : spread);
        add_wood(volume, tree, fork, end, 0.035f * tree->height, 0.008f * tree->height);
        float cluster = random_between(state, 0.40f, 0.52f) * spread;
        for (int n = 0; n < BOUGH_LEAVES; n++) {
            float at[3], away = 0.0f;
            fill_direction(state, way);
            float r = random_between(state, 0.55f, 1.0f);
            for (int i = 0; i < 3; i++) {
                at[i] = end[i] + r * cluster * way[i] * (i == 2 ? 0.75f : 1.0f);
                float d = (at[i] - crown[i]) / (i == 2 ? 0.36f * tree->height : 1.1f * spread);
                away += d * d;
            }
            hang_leaf(volume, tree, at, fminf(away, 1.0f));
        }
    }
}

static void grow_conifer(struct volume *volume, struct tree *tree) {
    uint32_t *state = &tree->state;
    float spread = random_between(state, 0.34f, 0.42f) * tree->height;
    float foot[3] = {tree->root[0], tree->root[1], 0.0f};
    float top[3] = {tree->root[0] + tree->lean[0], tree->root[1] + tree->lean[1],
                    0.96f * tree->height};
    add_wood(volume, tree, foot, top, 0.055f * tree->height, 0.006f * tree->height);
    for (int k = 0; k < TIERS; k++) {
        float t = 0.16f + 0.80f * ((float)k + 0.5f) / TIERS; /* height of the tier */
        float reach = spread * (1.0f - t) + 0.02f * tree->height;
        for (int n = 0; n < TIER_LEAVES * (TIERS + 2 - k) / TIERS; n++) {
            float c, s, out = sqrtf(random_next(state));
            fill_turn(random_next(state), &c, &s);
            float sag = 0.10f * out * out + random_between(state, -0.025f, 0.025f);
            float at[3] = {foot[0] + t * tree->lean[0] + out * reach * c,
                           foot[1] + t * tree->lean[1] + out * reach * s, (t - sag) * tree->height};
            hang_leaf(volume, tree, at, out);
        }
    }
}

enum status volume_make_trees(const struct scene_material *spec, struct volume *volume) {
    volume->medium = volume_alloc_voxels(volume->size);
    volume->solid = volume_alloc_voxels(volume->size);
    if (!volume->medium || !volume->solid)
        return STATUS_OUT_OF_MEMORY;
    for (int row = 0; row < TREES_SIDE; row++)
        for (int column = 0; column < TREES_SIDE; column++) {
            bool conifer;
            struct tree tree = make_tree(spec, column, row, &conifer);
            if (conifer)
                grow_conifer(volume, &tree);
            else
                grow_broadleaf(volume, &tree);
        }
    fill_clear_solid(volume);
    volume->medium_max = volume_medium_max(volume->medium, volume->size);
    return STATUS_OK;
}
