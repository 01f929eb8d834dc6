/* A binary hierarchy, split at the median of the longest axis of the centres: depth at most
 * log2(count) + 1 whatever the input, so traversal needs a stack of 40.
 *
 * The slab test is conservative: boxes are padded by far more than the rounding of the test, so no
 * box that the ray meets is passed over. Left out on purpose: surface-area heuristics; finding
 * candidates is a small part of what a ray costs here. */
#include "renderer/reference/bvh.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LEAF = 4, STACK = 64 };

struct node {
    struct bvh_box box;
    uint32_t first, count; /* of the order, in a leaf; else count is 0 and first the left child,
                              the right one behind it */
};

struct bvh {
    struct node *nodes;
    uint32_t node_count;
    uint32_t *order;
    struct bvh_box *boxes;
};

void bvh_destroy(struct bvh *bvh) {
    if (!bvh)
        return;
    free(bvh->nodes);
    free(bvh->order);
    free(bvh->boxes);
    free(bvh);
}

static double center_of(const struct bvh_box *box, int axis) {
    return box->low[axis] / 2 + box->high[axis] / 2;
}

/* Moves the half of [first, first + count) that is lowest along `axis` to its front (Hoare's
 * selection; ties by index, so that the order is always the same). */
static void split_median(struct bvh *bvh, uint32_t first, uint32_t count, int axis) {
    uint32_t *order = bvh->order + first;
    int64_t low = 0, high = (int64_t)count - 1, wanted = count / 2;
    while (low < high) {
        double pivot = center_of(&bvh->boxes[order[low + (high - low) / 2]], axis);
        int64_t i = low, j = high;
        while (i <= j) {
            while (center_of(&bvh->boxes[order[i]], axis) < pivot)
                i++;
            while (center_of(&bvh->boxes[order[j]], axis) > pivot)
                j--;
            if (i <= j) {
                uint32_t spare = order[i];
                order[i++] = order[j];
                order[j--] = spare;
            }
        }
        if (wanted <= j)
            high = j;
        else if (wanted >= i)
            low = i;
        else
            break;
    }
}

static void grow(struct bvh_box *box, const struct bvh_box *by) {
    for (int i = 0; i < 3; i++) {
        box->low[i] = fmin(box->low[i], by->low[i]);
        box->high[i] = fmax(box->high[i], by->high[i]);
    }
}

static void build(struct bvh *bvh) {
    struct {
        uint32_t node, first, count;
    } stack[STACK];
    int depth = 0;
    stack[depth].node = 0;
    stack[depth].first = 0;
    stack[depth++].count = bvh->nodes[0].count;
    bvh->node_count = 1;
    while (depth > 0) {
        depth--;
        uint32_t first = stack[depth].first, count = stack[depth].count;
        struct node *node = &bvh->nodes[stack[depth].node];
        double low[3], high[3];
        for (int i = 0; i < 3; i++) {
            node->box.low[i] = low[i] = INFINITY;
            node->box.high[i] = high[i] = -INFINITY;
        }
        for (uint32_t k = first; k < first + count; k++) {
            const struct bvh_box *box = &bvh->boxes[bvh->order[k]];
            grow(&node->box, box);
            for (int i = 0; i < 3; i++) {
                low[i] = fmin(low[i], center_of(box, i));
                high[i] = fmax(high[i], center_of(box, i));
            }
        }
        node->first = first;
        node->count = count;
        if (count <= LEAF)
            continue;
        int axis = 0;
        for (int i = 1; i < 3; i++)
            if (high[i] - low[i] > high[axis] - low[axis])
                axis = i;
        split_median(bvh, first, count, axis);
        node->first = bvh->node_count;
        node->count = 0;
        uint32_t half = count / 2;
        for (uint32_t side = 0; side < 2; side++) {
            stack[depth].node = bvh->node_count++;
            stack[depth].first = side ? first + half : first;
            stack[depth++].count = side ? count - half : half;
        }
    }
}

struct bvh *bvh_create(const struct bvh_box *boxes, uint32_t count, double padding) {
    struct bvh *bvh = calloc(1, sizeof *bvh);
    if (!bvh)
        return NULL;
    bvh->nodes = malloc((2 * (size_t)count + 1) * sizeof *bvh->nodes);
    bvh->order = malloc(((size_t)count + 1) * sizeof *bvh->order);
    bvh->boxes = malloc(((size_t)count + 1) * sizeof *bvh->boxes);
    if (!bvh->nodes || !bvh->order || !bvh->boxes) {
        bvh_destroy(bvh);
        return NULL;
    }
    for (uint32_t k = 0; k < count; k++) {
        bvh->order[k] = k;
        for (int i = 0; i < 3; i++) {
            bvh->boxes[k].low[i] = boxes[k].low[i] - padding;
            bvh->boxes[k].high[i] = boxes[k].high[i] + padding;
        }
    }
    bvh->nodes[0].count = count;
    build(bvh);
    return bvh;
}

static bool meets(const struct bvh_box *box, const double o[3], const double inverse[3],
                  double t_min, double t_max) {
    for (int i = 0; i < 3; i++) {
        double a = (box->low[i] - o[i]) * inverse[i], b = (box->high[i] - o[i]) * inverse[i];
        t_min = fmax(t_min, fmin(a, b));
        t_max = fmin(t_max, fmax(a, b));
    }
    return t_min <= t_max;
}

bool bvh_candidates(const struct bvh *bvh, const double o[3], const double d[3], double t_min,
                    const double *t_max, bvh_visit *visit, void *user) {
    double inverse[3];
    for (int i = 0; i < 3; i++)
        inverse[i] = 1 / d[i];
    uint32_t stack[STACK];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
        const struct node *node = &bvh->nodes[stack[--depth]];
        if (!meets(&node->box, o, inverse, t_min, *t_max))
            continue;
        if (node->count == 0 && bvh->node_count > 1) {
            stack[depth++] = node->first + 1;
            stack[depth++] = node->first;
            continue;
        }
        for (uint32_t k = 0; k < node->count; k++) {
            uint32_t index = bvh->order[node->first + k];
            if (meets(&bvh->boxes[index], o, inverse, t_min, *t_max) && !visit(user, index))
                return false;
        }
    }
    return true;
}
