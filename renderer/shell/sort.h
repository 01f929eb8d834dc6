/* Visibility order of tetrahedra: SXMPVO (Cook, Max, Silva & Williams 2004), as used by Dufort et
 * al. 2005, section 4.1.
 *
 * Two kinds of "lies behind" relations make a graph: between neighbours, from the side of their
 * shared face on which the eye lies; and across gaps, from an A-buffer of the boundary faces drawn
 * at exactly the samples of the picture. A depth-first walk gives the order. Walking with Tarjan's
 * algorithm costs little more and yields, besides the order, the strongly connected components:
 * those of more than one tetrahedron are the cycles. No one order is right for all rays through
 * those; ray_order.h finds the rays. */
#ifndef PELT_RENDERER_SHELL_SORT_H
#define PELT_RENDERER_SHELL_SORT_H

#include <stdint.h>

#include "api/status.h"
#include "renderer/shell/project.h"
#include "renderer/shell/shell.h"

/* One shell to be sorted with others, and how this picture sees it. */
struct sort_shell {
    const struct shell *shell;
    const struct projection *projection;
};

/* A cycle: sort_result.order[first] to order[first + count - 1]. */
struct sort_cycle {
    uint64_t first, count;
};

struct sort_result {
    /* Back to front: shell << 32 | tetrahedron. count = all tetrahedra of all shells. */
    uint64_t *order;
    uint64_t count;
    uint64_t edges;           /* relations found by the A-buffer */
    uint64_t fragments;       /* of boundary faces */
    uint64_t overlaps;        /* samples on whose ray stretches within shells overlap */
    struct sort_cycle *cycle; /* strongly connected components of more than one tetrahedron, whose
                                 order is by shared faces and depth; NULL: none */
    uint64_t cycles, cycle_capacity;
};

enum { SORT_SHELLS_MAX = 64 };

/* Sorts `shell_count` shells together. All projections are of one sample grid. `met`: NULL, or set
 * to 1 for each sample, bottom row first, whose ray meets one of them. The caller calls
 * sort_result_finish(). STATUS_OUT_OF_MEMORY, STATUS_TOO_COMPLEX. */
enum status sort_tetrahedra(const struct sort_shell *shells, uint32_t shell_count, uint8_t *met,
                            struct sort_result *result, struct error *err);
void sort_result_finish(struct sort_result *result);

/* > 0 where the eye lies on the tetrahedron's own side of its face k (rays leave through it), < 0
 * where it lies beyond (rays enter), 0 where the face is seen edge-on or has no area. `eye` is
 * relative to the shell's centre; orthographic: the direction toward it. */
int sort_eye_side(const struct shell *shell, const double eye[3], bool orthographic, uint32_t tetra,
                  int k);

#endif
