/* What a walk from cell to cell needs besides the cells: where each sample's ray enters the shell,
 * and where it stands to begin with. */
#ifndef PELT_RENDERER_SHELL_ENTRIES_H
#define PELT_RENDERER_SHELL_ENTRIES_H

#include <stdint.h>

#include "api/status.h"
#include "renderer/shell/abuffer.h"
#include "renderer/shell/project.h"
#include "renderer/shell/shell.h"

struct entries {
    uint32_t *first; /* for each sample, bottom row first, and one past the last */
    uint32_t *entry; /* cell << 2 | face, nearest first */
    uint64_t count;
    uint32_t starts; /* cells that the eye stands well within, one for each fold */
    uint32_t start;  /* cell << 2 in which the eye stands, LINK_NONE: in none. Where it stands on
                        the sides of cells each ray's first entry is the one that it heads into */
};

/* Draws the faces through which rays enter. `projection` must be in perspective where some vertex
 * is behind the eye: with parallel rays each would begin in a cell of its own.
 * `met`: NULL, or set to 1 for each sample, bottom row first, whose ray is within the shell
 * somewhere. STATUS_OUT_OF_MEMORY. */
enum status entries_find(const struct shell *shell, const struct projection *projection,
                         uint8_t *met, struct entries *entries, struct error *err);
/* A cell that the eye stands in, or on: the faces that it stands on, with their inward normals. */
struct eye_cell {
    uint32_t cell;
    int count;
    uint32_t face[4];
    double inward[4][3];
};

enum { EYE_WITHIN_MAX = 8 };

/* The cells that the eye stands well within, one for each fold (the first EYE_WITHIN_MAX of them);
 * where there are none, those on whose sides it stands. `list` is the caller's to free. */
struct eye_cells {
    uint32_t within[EYE_WITHIN_MAX], within_count;
    struct eye_cell *list;
    size_t count, capacity;
};

/* Empty where nothing lies behind the eye, or rays are parallel. False where memory ran out. */
bool entries_find_eye(const struct shell *shell, const struct projection *projection,
                      struct eye_cells *cells);

/* Where the eye stands on sides (cells->count > 0): the face through which a sample's ray enters a
 * cell there, LINK_NONE: it heads out of the shell. `*guess` is where the last one was found. */
uint32_t entries_at_eye(const struct eye_cells *cells, const struct view *view, size_t sample,
                        size_t *guess);

/* Draws the boundary faces of a shell through which rays enter (`enters`; not those that the eye
 * stands on), or leave, as nodes (first_cell + cell) << 2 | face. STATUS_OUT_OF_MEMORY. */
enum status entries_draw(const struct shell *shell, const struct projection *projection,
                         const struct eye_cells *cells, uint32_t first_cell, bool enters,
                         struct abuffer *buffer, struct error *err);
void entries_finish(struct entries *entries);

/* A shell for walking: WALK_TEXELS texels a cell, and four links. With v_0 the first vertex
 * relative to the centre, g_k the gradient of the barycentric coordinate lambda_k, u_k = uvw_k -
 * uvw_0 and s the scale that brings the g_k near 1 for normals: (v_0, uvw_0.x) (g_1, uvw_0.y) (g_2,
 * u_1.x) (g_3, u_1.y) (u_1.z, u_2) (u_3, s) link[k] is what lies across face k: cell << 2 | its
 * face, or LINK_NONE. A cell without volume has gradients of 0, no links, and no face that is
 * drawn: no ray enters it. `low` receives what fp32 leaves off v_0 and g_k (shell/precision.h);
 * may be NULL. The arrays are the caller's, of tetra_count elements. */
void entries_walk_cells(const struct shell *shell, float (*cell)[WALK_TEXELS][4],
                        uint32_t (*link)[4], float (*low)[LOW_TEXELS][4]);

#endif
