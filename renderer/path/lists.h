/* Lists of what planes cut, made on the device by compute shaders and drawn by indirect draws: the
 * processor looks at each prism once for a picture, and at no plane. After Lensch, Daubert & Seidel
 * 2002, section 7, where each plane looks at each prism's bounding sphere.
 *
 * A prism's entry is the first and the last plane that cut it. Programs of shaders/lists_*.comp, in
 * their order:
 *
 *   once     COUNT, SCAN, SCATTER   sort entries by their last plane (radix, stable)
 *   a group  BATCHES                cuts it into batches that fit the tables, planes being whole
 *   a batch  SUMS, SCAN, EXPAND     an entry for each plane of each prism
 *            COUNT, SCAN, SCATTER   sorts these by plane
 *            FINISH                 cuts as the hardware method draws them, and the draw's command
 *
 * What comes out is in the order that shell/slabs.h gives, to the last word, so both draw the same
 * picture bit for bit (tests/unit/test_lists.c). How many cuts there are is read by the device
 * alone; how many there are at most, which tells how many batches must be asked for, is summed up
 * from the prisms here. Cost: proportional to what is cut, and to the prisms once for each group of
 * planes.
 *
 * Of one object: where several share the planes each plane changes programs and tables, which no
 * indirect draw does. */
#ifndef PELT_RENDERER_PATH_LISTS_H
#define PELT_RENDERER_PATH_LISTS_H

#include "renderer/path/polygons.h"
#include "renderer/shell/slabs.h"

struct plane_lists;                                  /* a context must be current in all of these */
struct plane_lists *plane_lists_create(void);        /* NULL where memory ran out */
void plane_lists_destroy(struct plane_lists *lists); /* takes NULL */

/* Planes that are drawn at a time, from the farthest on; the last such group may be smaller. */
enum { PLANE_LISTS_GROUP = LIST_PLANES_MAX };

/* Takes in picture->objects[index] and its planes. `wanted`: as in slab_cells_find(). *fit: whether
 * this GL's tables hold what a plane may cut; where not, nothing may be drawn.
 * STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status plane_lists_open(struct plane_lists *lists, struct picture *picture, uint32_t index,
                             const struct slabs *slabs, const uint8_t *wanted, bool *fit,
                             struct error *err);

/* Draws the planes from `end` - 1 down to `begin`, one group. The rest as in polygon_pass_draw().
 */
enum status plane_lists_draw(struct plane_lists *lists, struct polygon_pass *pass,
                             struct cell_pass *tables, struct prism_maps *maps,
                             struct picture *picture, uint32_t begin, uint32_t end, bool solid,
                             struct error *err);

#endif
