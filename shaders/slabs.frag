/* The part of a tetrahedron along a ray that lies within a slab between two planes: the slicing path's
 * default method. */
#define SLABS
#include "tetra.frag"
