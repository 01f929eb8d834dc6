/* Neighbours across edges.
 *
 * Every triangle corner k starts a half-edge to corner (k + 1) % 3. Half-edges are brought together
 * by their two vertices with two stable counting sorts (larger vertex, then smaller): linear,
 * without a hash that an asset could attack, and in an order that depends on the mesh alone. A
 * group of one is a border; of two that run in opposite directions, a pair of neighbours; anything
 * else is non-manifold or turned over, and stays without neighbours. */
#include "renderer/asset/mesh_build.h"

#include <stdlib.h>

static uint32_t edge_end(const struct mesh *mesh, uint32_t half, bool larger) {
    const uint32_t *v = mesh->vertex[half / 3];
    /* NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign): sort_by_end fills all of `from` */
    uint32_t a = v[half % 3], b = v[(half % 3 + 1) % 3];
    return (a > b) == larger ? a : b;
}

/* Stable counting sort of the half-edges in `from` (NULL: in order) by one end into `to`. */
static void sort_by_end(const struct mesh *mesh, const uint32_t *from, uint32_t *to, uint32_t count,
                        uint32_t *start, bool larger) {
    for (uint32_t v = 0; v <= mesh->vertex_count; v++)
        start[v] = 0;
    for (uint32_t i = 0; i < count; i++)
        start[edge_end(mesh, i, larger) + 1]++;
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        start[v + 1] += start[v];
    for (uint32_t i = 0; i < count; i++) {
        uint32_t half = from ? from[i] : i;
        to[start[edge_end(mesh, half, larger)]++] = half;
    }
}

bool mesh_find_neighbours(struct mesh *mesh) {
    uint32_t count = 3 * mesh->triangle_count;
    uint32_t *by_larger = calloc(count, sizeof *by_larger);
    uint32_t *sorted = calloc(count, sizeof *sorted);
    uint32_t *start = malloc(((size_t)mesh->vertex_count + 1) * sizeof *start);
    bool done = by_larger && sorted && start;
    struct mesh_diagnosis *found = &mesh->diagnosis;
    if (done) {
        sort_by_end(mesh, NULL, by_larger, count, start, true);
        sort_by_end(mesh, by_larger, sorted, count, start, false);
    }
    for (uint32_t i = 0, end; done && i < count; i = end) {
        uint32_t small = edge_end(mesh, sorted[i], false), large = edge_end(mesh, sorted[i], true);
        for (end = i + 1; end < count && edge_end(mesh, sorted[end], false) == small &&
                          edge_end(mesh, sorted[end], true) == large;)
            end++;
        for (uint32_t j = i; j < end; j++)
            mesh->neighbour[sorted[j] / 3][sorted[j] % 3] = MESH_NONE;
        uint32_t a = sorted[i], b = sorted[end - 1];
        if (end - i == 1) {
            found->open_edges++;
        } else if (end - i == 2 && mesh->vertex[a / 3][a % 3] != mesh->vertex[b / 3][b % 3]) {
            mesh->neighbour[a / 3][a % 3] = b / 3;
            mesh->neighbour[b / 3][b % 3] = a / 3;
        } else {
            /* Stable sorts: sorted[i] has the lowest triangle of its group. */
            if (!found->non_manifold || a / 3 < found->non_manifold_first)
                found->non_manifold_first = a / 3;
            found->non_manifold++;
        }
    }
    free(by_larger);
    free(sorted);
    free(start);
    return done;
}
