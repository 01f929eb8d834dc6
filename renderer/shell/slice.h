/* The polygon in which a plane cuts a prism, as edges of the prism in order.
 * After Lensch, Daubert & Seidel 2002, sections 3 and 4 (figures 3 and 4).
 *
 * Vertices 0..2 are the prism's bottoms, 3..5 the tops above them (shell.h: in ascending order of
 * their welded vertices, which all prisms agree on). Edges, from the lower-numbered vertex to the
 * other: 0..2 lower: 01 12 02    3..5 upper: 34 45 35    6..8 normal: 03 14 25
 *
 * The paper classifies each normal edge by where the plane meets its prolongation: above (a),
 * within (b) or below (c), and reads the polygon off a table of neighbouring pairs (27 cases). That
 * supposes that all three edges pierce planes in the same direction, which is not so where normals
 * part at a silhouette: there "above" is before the plane for one edge and behind it for another,
 * and (a, a) cuts. Here classes come from the sides on which the two ends lie: a (before, before),
 * b (before, behind), c (behind, behind); where an edge goes the other way, (behind, before), sides
 * are swapped, which leaves the polygon what it is. Of the 64 combinations of sides the table
 * does 46. The 18 with edges both ways are traced from face to face; where a side of the prism is
 * cut twice, the cuts keep clear of the diagonal that splits it into tetrahedra, as the neighbour's
 * do. */
#ifndef PELT_RENDERER_SHELL_SLICE_H
#define PELT_RENDERER_SHELL_SLICE_H

#include <stdbool.h>
#include <stdint.h>

enum { SLICE_EDGES = 9, SLICE_CASES = 64 };

extern const uint8_t slice_edge[SLICE_EDGES][2]; /* the ends of each edge */

/* One case: the edges that are cut, in the order of the polygon. There may be two of them where
 * edges go both ways: [0, first) and [first, count). */
struct slice_case {
    uint8_t edge[SLICE_EDGES];
    uint8_t first, count;
};

/* cases[sides]: bit v of `sides` is set where vertex v lies behind the plane. */
void slice_make_cases(struct slice_case cases[SLICE_CASES]);

/* A case as the hardware method draws it where edges are named: fans of six corners around the
 * first of a polygon, four bits an edge; what is short of six repeats the last. How many: at most
 * SLICE_FANS. */
enum { SLICE_FANS = 2 };
int slice_make_fans(const struct slice_case *cut, uint32_t fan[SLICE_FANS]);

/* Whether the paper's table does a combination of sides: no two normal edges go opposite ways. */
bool slice_in_table(unsigned sides);

#endif
