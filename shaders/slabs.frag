/* The part of a tetrahedron along a ray that lies within a run of slabs between planes that face the
 * viewer: the slicing path's default method. It takes a step for each slab, or a share of one: as long
 * as that is along this very ray. */
#define SLABS
float slab_rate;
#define STEP_RATE slab_rate
#include "tetra.frag"
