/* Where prisms fold, and how thin they must be not to.
 *
 * The Jacobian of P(b, w) is ((e1 + w g1) x (e2 + w g2)) . sum b_i h_i n_i with
 * g_k = h_k n_k - h_0 n_0: linear in b, so it keeps its sign over the prism exactly if it does
 * along each of the three normals, where it is a quadratic in w (Jiang et al. 2020 ask the same of
 * each prism). The tetrahedra that paths cut it into are asked as well, so that all draw one shell.
 * Vertices of a prism that folds are lowered by a fifth until none folds; a prism is
 * never the worse for a neighbour's lower vertices by more than the next round mends. */
#include "renderer/asset/mesh_thickness.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 32 }; /* 0.8^32 = 0.0008 of the thickness */
static const double SHRINK = 0.8;

enum fold { FOLD_NONE, FOLD_THICK, FOLD_ALWAYS };

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double det(const double a[3], const double b[3], const double c[3]) {
    double bc[3];
    cross(b, c, bc);
    return dot(a, bc);
}

/* The three tetrahedra into which paths cut a prism (from the bottom of each side's lower-numbered
 * vertex to the top of its higher-numbered one) can turn inside out before the prism itself does.
 */
static bool cells_turn(const struct mesh *mesh, const uint32_t vertex[3], const double *height) {
    uint32_t v[3] = {vertex[0], vertex[1], vertex[2]};
    int swaps = 0;
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 2; i++)
            if (v[i] > v[i + 1]) {
                uint32_t swap = v[i];
                v[i] = v[i + 1];
                v[i + 1] = swap;
                swaps++;
            }
    double bottom[3][3], top[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            bottom[k][i] = mesh->position[v[k]][i] - mesh->position[v[0]][i];
            top[k][i] = bottom[k][i] + height[v[k]] * mesh->normal[v[k]][i];
        }
    double sense = swaps & 1 ? -1 : 1;
    return !(sense * det(bottom[1], bottom[2], top[2]) > 0 &&
             sense * det(bottom[1], top[1], top[2]) < 0 && sense * det(top[0], top[1], top[2]) > 0);
}

static enum fold prism_folds(const struct mesh *mesh, uint32_t f, const double *height) {
    const uint32_t *v = mesh->vertex[f];
    double e1[3], e2[3], g1[3], g2[3], a[3], b1[3], b2[3], c[3];
    for (int i = 0; i < 3; i++) {
        double first = height[v[0]] * mesh->normal[v[0]][i];
        e1[i] = mesh->position[v[1]][i] - mesh->position[v[0]][i];
        e2[i] = mesh->position[v[2]][i] - mesh->position[v[0]][i];
        g1[i] = height[v[1]] * mesh->normal[v[1]][i] - first;
        g2[i] = height[v[2]] * mesh->normal[v[2]][i] - first;
    }
    cross(e1, e2, a);
    cross(e1, g2, b1);
    cross(g1, e2, b2);
    cross(g1, g2, c);
    enum fold fold = FOLD_NONE;
    for (int k = 0; k < 3; k++) {
        const double *n = mesh->normal[v[k]];
        double q0 = dot(a, n), q1 = dot(b1, n) + dot(b2, n), q2 = dot(c, n);
        if (!(q0 > 0))
            return FOLD_ALWAYS;
        double least = fmin(q0, q0 + q1 + q2);
        if (q2 > 0) {
            double w = -q1 / (2 * q2);
            if (w > 0 && w < 1)
                least = fmin(least, q0 + w * (q1 + w * q2));
        }
        if (!(least > 0))
            fold = FOLD_THICK;
    }
    if (fold == FOLD_NONE && cells_turn(mesh, v, height))
        fold = FOLD_THICK;
    return fold;
}

enum status mesh_thickness_limit(const struct mesh *mesh, double thickness,
                                 struct mesh_thickness *result, struct error *err) {
    memset(result, 0, sizeof *result);
    result->height = malloc((mesh->vertex_count + (size_t)1) * sizeof *result->height);
    uint8_t *lower = calloc(mesh->vertex_count + (size_t)1, 1);
    if (!result->height || !lower) {
        free(lower);
        mesh_thickness_finish(result);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %u vertices' thickness",
                           mesh->vertex_count);
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        result->height[v] = thickness;
    bool any = true;
    for (int round = 0; round < ROUNDS && any; round++) {
        any = false;
        for (uint32_t f = 0; f < mesh->triangle_count; f++) {
            enum fold fold = prism_folds(mesh, f, result->height);
            if (fold == FOLD_NONE)
                continue;
            if (round == 0 && fold == FOLD_THICK && result->folded++ == 0)
                result->folded_first = f;
            if (round == 0 && fold == FOLD_ALWAYS && result->inverted++ == 0)
                result->inverted_first = f;
            for (int k = 0; k < 3 && fold == FOLD_THICK; k++)
                lower[mesh->vertex[f][k]] = 1;
            any |= fold == FOLD_THICK;
        }
        for (uint32_t v = 0; v < mesh->vertex_count && any; v++)
            if (lower[v]) {
                result->height[v] *= SHRINK;
                lower[v] = 0;
            }
    }
    free(lower);
    result->least = thickness;
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        result->limited += result->height[v] < thickness;
        result->least = fmin(result->least, result->height[v]);
    }
    return STATUS_OK;
}

void mesh_thickness_finish(struct mesh_thickness *result) {
    free(result->height);
    result->height = NULL;
}
