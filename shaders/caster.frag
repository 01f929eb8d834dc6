/* One tetrahedron as a light sees it: what it throws of a shadow. */
#define CASTER
#include "tetra.frag"
