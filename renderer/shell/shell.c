/* Building a shell over a mesh: prisms, tetrahedra, adjacency, and the table for the shaders.
 * The cut of a prism and the record of a tetrahedron are derived in shell.h.
 *
 * Adjacency needs no hash: a side of a prism is the lower triangle (b_a, b_b, t_b) and the upper
 * one (b_a, t_a, t_b) of its edge a < b, and which tetrahedra own them follows from the edge's
 * place in the prism's order alone. */
#include "renderer/shell/shell.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/asset/mesh_thickness.h"
#include "renderer/shell/prism_map.h"

/* One prism: its mesh triangle's corners in ascending order of their welded vertices. */
struct prism {
    int corner[3];
    uint32_t vertex[3];
};

static struct prism order_corners(const uint32_t vertex[3]) {
    struct prism prism = {.corner = {0, 1, 2}};
    for (int pass = 0; pass < 2; pass++)
        for (int i = 0; i < 2; i++)
            if (vertex[prism.corner[i]] > vertex[prism.corner[i + 1]]) {
                int swap = prism.corner[i];
                prism.corner[i] = prism.corner[i + 1];
                prism.corner[i + 1] = swap;
            }
    for (int i = 0; i < 3; i++)
        prism.vertex[i] = vertex[prism.corner[i]];
    return prism;
}

/* Which corner of the prism (0..2 in ascending order) and which end (0 below, 1 above) each vertex
 * of each tetrahedron is. */
static const uint8_t cut[3][4][2] = {
    {{0, 0}, {1, 0}, {2, 0}, {2, 1}},
    {{0, 0}, {1, 0}, {1, 1}, {2, 1}},
    {{0, 0}, {0, 1}, {1, 1}, {2, 1}},
};

/* Faces inside the prism: T0's face 2 is T1's face 2, T1's face 1 is T2's face 1. Faces on the
 * sides, [edge][0 lower, 1 upper] = {tetrahedron, face}; edges 0: v0 v1, 1: v1 v2, 2: v0 v2. T0's
 * face 3 is the bottom and T2's face 0 the top. */
static const uint8_t side[3][2][2] = {
    {{1, 3}, {2, 3}},
    {{0, 0}, {1, 0}},
    {{0, 1}, {2, 2}},
};

/* The edge (0..2 as in `side`) of a prism between two welded vertices; -1: none. */
static int edge_between(const struct prism *prism, uint32_t a, uint32_t b) {
    uint32_t low = a < b ? a : b, high = a < b ? b : a;
    for (int e = 0; e < 3; e++)
        if (prism->vertex[e == 1] == low && prism->vertex[e == 0 ? 1 : 2] == high)
            return e;
    return -1;
}

static void link_prisms(const struct mesh *mesh, struct shell *shell) {
    for (uint32_t f = 0; f < mesh->triangle_count; f++) {
        struct prism prism = order_corners(mesh->vertex[f]);
        uint32_t(*link)[4] = shell->neighbour + 3 * (size_t)f;
        memset(link, 0xff, 3 * sizeof *link);
        link[0][2] = 3 * f + 1;
        link[1][2] = 3 * f;
        link[1][1] = 3 * f + 2;
        link[2][1] = 3 * f + 1;
        for (int k = 0; k < 3; k++) {
            uint32_t other = mesh->neighbour[f][k];
            if (other == MESH_NONE)
                continue;
            uint32_t a = mesh->vertex[f][k], b = mesh->vertex[f][(k + 1) % 3];
            struct prism across = order_corners(mesh->vertex[other]);
            int here = edge_between(&prism, a, b), there = edge_between(&across, a, b);
            if (here < 0 || there < 0)
                continue;
            for (int level = 0; level < 2; level++)
                link[side[here][level][0]][side[here][level][1]] =
                    3 * other + side[there][level][0];
        }
    }
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Fills the shader's record of one tetrahedron; false where it has no volume. */
static bool fill_cell(const double p[4][3], const double uvw[4][3], float cell[CELL_TEXELS][4]) {
    double edge[3][3], normal[3];
    float u[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            edge[k][i] = p[k + 1][i] - p[0][i];
            u[k][i] = (float)(uvw[k + 1][i] - uvw[0][i]);
        }
    for (int i = 0; i < 3; i++) {
        for (int v = 0; v < 4; v++)
            cell[v][i] = (float)p[v][i];
        for (int k = 0; k < 3; k++)
            cell[4 + k][i] = (float)edge[k][i];
        cell[7][1 + i] = u[2][i];
    }
    cell[0][3] = (float)uvw[0][0];
    cell[1][3] = (float)uvw[0][1];
    cell[2][3] = u[0][0];
    cell[3][3] = u[0][1];
    cell[4][3] = u[0][2];
    cell[5][3] = u[1][0];
    cell[6][3] = u[1][1];
    cell[7][0] = u[1][2];
    cross(edge[1], edge[2], normal);
    return dot(edge[0], normal) != 0;
}

static void build_cells(const struct mesh *mesh, const double tiles[2], struct shell *shell) {
    double longest2 = 0;
    for (uint32_t f = 0; f < mesh->triangle_count; f++) {
        struct prism prism = order_corners(mesh->vertex[f]);
        double uv[3][2], lowest[2] = {INFINITY, INFINITY};
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 2; i++) {
                uv[c][i] = mesh->corner_uv[f][prism.corner[c]][i] * tiles[i];
                lowest[i] = fmin(lowest[i], uv[c][i]);
            }
        /* The texture is periodic: whole tiles go before fp32 loses the fraction (10,000 tiles of
         * 512 voxels would be out by a third of a voxel). */
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 2; i++)
                uv[c][i] -= floor(lowest[i]);
        for (uint32_t t = 0; t < 3; t++) {
            uint32_t index = 3 * f + t;
            double p[4][3], uvw[4][3];
            for (int v = 0; v < 4; v++) {
                int corner = cut[t][v][0], top = cut[t][v][1];
                uint32_t vertex = prism.vertex[corner] + (top ? mesh->vertex_count : 0);
                shell->tetra[index][v] = vertex;
                memcpy(p[v], shell->position[vertex], sizeof p[v]);
                uvw[v][0] = uv[corner][0];
                uvw[v][1] = uv[corner][1];
                uvw[v][2] = top;
            }
            for (int a = 0; a < 4; a++)
                for (int b = a + 1; b < 4; b++) {
                    double d[3] = {p[b][0] - p[a][0], p[b][1] - p[a][1], p[b][2] - p[a][2]};
                    longest2 = fmax(longest2, dot(d, d));
                }
            if (!fill_cell(p, uvw, shell->cell[index]) && shell->diagnosis.flat++ == 0)
                shell->diagnosis.flat_first = index;
        }
    }
    shell->longest = (float)fmin(sqrt(longest2) * 1.000001, FLT_MAX);
}

/* On which side of the face opposite vertex k of tetrahedron t a vertex lies: > 0 where k's own
 * does, 0 where either lies in it. */
static double side_of(const struct shell *shell, uint32_t t, uint32_t k, uint32_t vertex) {
    const double *p = shell->position[shell->tetra[t][(k + 1) & 3]];
    const double *q = shell->position[shell->tetra[t][(k + 2) & 3]];
    const double *r = shell->position[shell->tetra[t][(k + 3) & 3]];
    double a[3], b[3], own[3], other[3], normal[3];
    for (int i = 0; i < 3; i++) {
        a[i] = q[i] - p[i];
        b[i] = r[i] - p[i];
        own[i] = shell->position[shell->tetra[t][k]][i] - p[i];
        other[i] = shell->position[vertex][i] - p[i];
    }
    cross(a, b, normal);
    double here = dot(normal, own), there = dot(normal, other);
    return ((here > 0) - (here < 0)) * ((there > 0) - (there < 0));
}

/* Tetrahedra on one side of the face that they share overlap: no ray goes from one to the other.
 * Nor does it through one without volume. There the shell has a boundary, to either. */
static void cut_links(struct shell *shell) {
    for (uint32_t t = 0; t < shell->tetra_count; t++)
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t other = shell->neighbour[t][k];
            if (other == SHELL_NONE || other < t)
                continue;
            uint32_t across = shell_face_across(shell, t, k);
            if (side_of(shell, t, k, shell->tetra[other][across]) < 0)
                continue;
            shell->neighbour[t][k] = shell->neighbour[other][across] = SHELL_NONE;
        }
}

/* With edges e1, e2 and u's rises du1, du2 along them, |grad u|^2 = |du1 e2 - du2 e1|^2 / (2 A)^2.
 */
static void measure_mesh(const struct mesh *mesh, const double tiles[2], struct shell *shell) {
    double area = 0, sum[2] = {0, 0}, vectors[3] = {0, 0, 0};
    for (uint32_t f = 0; f < mesh->triangle_count; f++) {
        const double *p[3];
        double e1[3], e2[3], n[3];
        for (int c = 0; c < 3; c++)
            p[c] = mesh->position[mesh->vertex[f][c]];
        for (int i = 0; i < 3; i++) {
            e1[i] = p[1][i] - p[0][i];
            e2[i] = p[2][i] - p[0][i];
        }
        cross(e1, e2, n);
        double twice = sqrt(dot(n, n));
        if (!(twice > 0))
            continue;
        area += twice;
        for (int i = 0; i < 3; i++)
            vectors[i] += n[i];
        for (int a = 0; a < 2; a++) {
            const double(*uv)[2] = (const double(*)[2])mesh->corner_uv[f];
            double du1 = (uv[1][a] - uv[0][a]) * tiles[a], du2 = (uv[2][a] - uv[0][a]) * tiles[a];
            double g[3] = {du1 * e2[0] - du2 * e1[0], du1 * e2[1] - du2 * e1[1],
                           du1 * e2[2] - du2 * e1[2]};
            sum[a] += dot(g, g) / twice;
        }
    }
    for (int a = 0; a < 2; a++)
        shell->tiles_rate[a] = area > 0 ? sqrt(sum[a] / area) : 0;
    shell->flatness = area > 0 ? sqrt(dot(vectors, vectors)) / area : 0;
}

/* Of prism_map_bend(): below it a strip is narrower than what fp32 keeps of a cell. Planes and
 * spheres are at fp64's rounding. */
static const double BEND_SHOWS = 1e-6;

static void survey_maps(const struct mesh *mesh, struct shell *shell) {
    shell->affine = true;
    for (uint32_t f = 0; f < mesh->triangle_count; f++) {
        enum prism_map_kind kind = prism_map_look(shell, f);
        shell->affine &= kind == PRISM_MAP_AFFINE;
        shell->ruled |= prism_map_bend(shell, f) > BEND_SHOWS;
        if (kind == PRISM_MAP_UNEVEN && shell->diagnosis.uneven++ == 0)
            shell->diagnosis.uneven_first = f;
    }
}

enum status shell_build(const struct mesh *mesh, double thickness, const double tiles[2],
                        const char *pointer, struct shell **out, struct error *err) {
    *out = NULL;
    struct shell *shell = calloc(1, sizeof *shell);
    if (!shell)
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer, "no memory for a shell");
    shell->thickness = thickness;
    shell->vertex_count = 2 * mesh->vertex_count;
    shell->tetra_count = 3 * mesh->triangle_count;
    shell->position = malloc((shell->vertex_count + (size_t)1) * sizeof *shell->position);
    shell->tetra = malloc((shell->tetra_count + (size_t)1) * sizeof *shell->tetra);
    shell->neighbour = malloc((shell->tetra_count + (size_t)1) * sizeof *shell->neighbour);
    shell->cell = malloc((shell->tetra_count + (size_t)1) * sizeof *shell->cell);
    if (!shell->position || !shell->tetra || !shell->neighbour || !shell->cell) {
        shell_destroy(shell);
        return error_fault(err, STATUS_OUT_OF_MEMORY, pointer,
                           "no memory for a shell over %u triangles", mesh->triangle_count);
    }
    struct mesh_thickness limit;
    enum status status = mesh_thickness_limit(mesh, thickness, &limit, err);
    if (status != STATUS_OK) {
        shell_destroy(shell);
        return status;
    }
    for (int i = 0; i < 3; i++) {
        shell->bounds_min[i] = INFINITY;
        shell->bounds_max[i] = -INFINITY;
    }
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        for (int i = 0; i < 3; i++) {
            double bottom = mesh->position[v][i];
            double top = bottom + limit.height[v] * mesh->normal[v][i];
            shell->position[v][i] = bottom;
            shell->position[mesh->vertex_count + v][i] = top;
            shell->bounds_min[i] = fmin(shell->bounds_min[i], fmin(bottom, top));
            shell->bounds_max[i] = fmax(shell->bounds_max[i], fmax(bottom, top));
        }
    for (int i = 0; i < 3; i++)
        shell->center[i] = shell->bounds_min[i] + (shell->bounds_max[i] - shell->bounds_min[i]) / 2;
    /* Relative to the centre, and the tops by their offset from the bottoms, so that a thin shell
     * far from the origin keeps its thickness. */
    for (uint32_t v = 0; v < mesh->vertex_count; v++)
        for (int i = 0; i < 3; i++) {
            shell->position[v][i] -= shell->center[i];
            shell->position[mesh->vertex_count + v][i] =
                shell->position[v][i] + limit.height[v] * mesh->normal[v][i];
        }
    build_cells(mesh, tiles, shell);
    link_prisms(mesh, shell);
    cut_links(shell);
    measure_mesh(mesh, tiles, shell);
    survey_maps(mesh, shell);
    shell->diagnosis.folded = limit.folded;
    shell->diagnosis.folded_first = limit.folded_first;
    shell->diagnosis.limited = limit.limited;
    shell->diagnosis.least = limit.least;
    shell->diagnosis.inverted = limit.inverted;
    shell->diagnosis.inverted_first = limit.inverted_first;
    mesh_thickness_finish(&limit);
    shell->bytes = sizeof *shell + shell->vertex_count * sizeof *shell->position +
                   shell->tetra_count *
                       (sizeof *shell->tetra + sizeof *shell->neighbour + sizeof *shell->cell);
    *out = shell;
    return STATUS_OK;
}

void shell_destroy(struct shell *shell) {
    if (!shell)
        return;
    free(shell->position);
    free(shell->tetra);
    free(shell->neighbour);
    free(shell->cell);
    free(shell);
}

uint32_t shell_face_across(const struct shell *shell, uint32_t t, uint32_t k) {
    const uint32_t *here = shell->tetra[t], *there = shell->tetra[shell->neighbour[t][k]];
    for (uint32_t m = 0; m < 3; m++) {
        bool shared = false;
        for (uint32_t v = 0; v < 4; v++)
            shared |= v != k && here[v] == there[m];
        if (!shared)
            return m;
    }
    return 3;
}

void shell_warn(const struct shell *shell, const char *pointer, struct report *report) {
    const struct shell_diagnosis *found = &shell->diagnosis;
    if (found->folded)
        report_warn(report, "folded-prisms", pointer, found->folded, found->folded_first,
                    "prisms would fold over where normals converge faster than the thickness; the "
                    "shell is thinner at %llu vertices there, %.3g at the least",
                    (unsigned long long)found->limited, found->least);
    if (found->inverted)
        report_warn(report, "inverted-prisms", pointer, found->inverted, found->inverted_first,
                    "prisms stand on their heads: a vertex normal points below the triangle, "
                    "whatever the thickness; cells overlap there");
    if (found->flat)
        report_warn(report, "flat-tetrahedra", pointer, found->flat, found->flat_first,
                    "tetrahedra without volume hold no material");
}
