/* A shell as one picture sees it: every vertex projected, every tetrahedron's outline on the sample
 * grid as a convex polygon.
 *
 * The outline is drawn once for each tetrahedron and enlarged by OUTLINE_MARGIN of a sample's
 * width, so that it covers every sample whose ray can meet the tetrahedron whatever grid the
 * rasteriser snaps to; whether the ray does meet it is decided in the shader, from the
 * tetrahedron's planes. Drawing front faces, as Dufort does, loses a whole tetrahedron where the
 * rasteriser's 1/256 pixel grid and the ray disagree at an edge, and all that the near plane cuts.
 */
#ifndef PELT_RENDERER_SHELL_PROJECT_H
#define PELT_RENDERER_SHELL_PROJECT_H

#include <stdbool.h>
#include <stdint.h>

#include "api/status.h"
#include "renderer/shell/shell.h"
#include "renderer/shell/view.h"

#define OUTLINE_MARGIN (1.0 / 64)

/* Vertices with a depth (1 + t) below this are behind the eye. */
#define PROJECT_DEPTH_MIN 1e-9

struct projection {
    struct view view;  /* in the shell's object space, relative to its center */
    double (*clip)[3]; /* X, Y, H of each vertex (view.h) */
    bool behind;       /* some vertex is not in front of the eye */
};

enum status project_shell(const struct shell *shell, const struct view *view,
                          struct projection *projection, struct error *err);
void projection_finish(struct projection *projection);

enum { OUTLINE_MAX = 24 };

/* The enlarged outline of a tetrahedron in samples from the grid's bottom left, counter-clockwise,
 * clipped to the grid. Returns the number of corners, 0 where it covers no sample. */
int project_outline(const struct shell *shell, const struct projection *projection, uint32_t tetra,
                    double outline[OUTLINE_MAX][2]);

/* The same of the part of a tetrahedron whose depth H lies in [low, high]; of what lies in front of
 * the eye. */
int project_slab_outline(const struct shell *shell, const struct projection *projection,
                         uint32_t tetra, double low, double high, double outline[OUTLINE_MAX][2]);

/* The polygon that a face (three vertices) makes on the grid, not enlarged, clipped at the eye,
 * with a depth key that is affine over the grid and grows away from the eye (-1/H in perspective, H
 * in orthographic views). Returns the number of corners: 0, 3 or 4. */
int project_face(const struct projection *projection, const uint32_t vertex[3],
                 double corner[4][3]);

#endif
