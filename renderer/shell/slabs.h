/* Slabs: the depth range of a picture's shells, cut by planes at equal distances that face the
 * viewer, and which cells each slab between two planes holds. After Lensch, Daubert & Seidel 2002,
 * section 3 (planes "in the whole range of the surface volume, from back to front"); there every
 * plane looks at every prism, and bounding spheres reject most. Here cells are sorted once by the
 * slab in which their depth ends; a list of those that the current slab holds takes cells in and
 * lets them go, so that no plane ever looks at another cell.
 *
 * Depth is H of view.h: affine over space, and the same for all objects. */
#ifndef PELT_RENDERER_SHELL_SLABS_H
#define PELT_RENDERER_SHELL_SLABS_H

#include "renderer/shell/project.h"

struct slabs {
    double low, high; /* in front of the eye; nothing is there unless low < high */
    uint32_t count;   /* from the front; at least 1 */
};

/* Empty; slabs_include() widens it by a shell. */
void slabs_init(struct slabs *slabs);
void slabs_include(struct slabs *slabs, const struct projection *projection, uint32_t vertex_count);

/* The plane before slab k; that behind the last one is slabs_plane(count). */
double slabs_plane(const struct slabs *slabs, uint32_t k);

/* The cells of one shell, or its prisms, as one set of slabs sees them. */
struct slab_cells {
    uint32_t *cell;         /* by their last slab, the farthest first; or by their first one */
    uint32_t *first, *last; /* of cell[i]: its slabs */
    uint32_t *active;       /* indices into cell[]: those of the current slab, in order of entry */
    uint32_t count, next, active_count;
    bool onward; /* cells by their first slab, the nearest first; slabs rise */
};

/* Finds the slabs of all cells, `group` tetrahedra each (1, or 3: prisms); those wholly behind the
 * eye are left out. `wanted`: NULL, or for each tetrahedron whether it takes part. `onward`: slabs
 * will be gone through from the nearest. STATUS_OUT_OF_MEMORY. */
enum status slab_cells_find(struct slab_cells *cells, const struct shell *shell,
                            const struct projection *projection, const struct slabs *slabs,
                            uint32_t group, const uint8_t *wanted, bool onward, struct error *err);
void slab_cells_finish(struct slab_cells *cells); /* takes zeroes */

/* The slabs of one cell of `group` tetrahedra; false where it is left out. */
bool slab_cell_find(const struct shell *shell, const struct projection *projection,
                    const struct slabs *slabs, uint32_t group, uint32_t cell, const uint8_t *wanted,
                    uint32_t *first, uint32_t *last);

/* For measuring alone: puts every cell into every slab, as if nothing were known of their depths.
 */
void slab_cells_everywhere(struct slab_cells *cells, const struct slabs *slabs);

/* Moves on to slab k, which must fall from call to call, or rise if `onward`: active[0 ..
 * active_count - 1] are then those that it holds. */
void slab_cells_move(struct slab_cells *cells, uint32_t k);

/* Sets met[sample], bottom row first, to 1 where a cell of the shell may be met: within its
 * outline, which is enlarged by OUTLINE_MARGIN. */
void slabs_mark(const struct shell *shell, const struct projection *projection, uint8_t *met);

/* wanted[t]: whether cell t may be met by a ray of the samples that `reduced` marks: a grid of
 * squares of `side` samples, `columns` wide, the bottom row first. */
void slabs_choose(const struct shell *shell, const struct projection *projection,
                  const uint8_t *reduced, int side, int columns, uint8_t *wanted);

#endif
