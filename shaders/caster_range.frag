/* One tetrahedron as a light sees it: from where to where its ray lies in it. */
#define CASTER
#define RANGE
#include "tetra.frag"
