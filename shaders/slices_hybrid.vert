/* Polygons in which planes cut prisms: the CPU says which edges are cut, here is where.
 * Lensch, Daubert & Seidel 2002, section 5. Their edges are attributes, ours are fetched, so that an
 * edge is named by one number. */
#include "common_frame.glsl"
#include "common_slice.glsl"

layout(location = 0) in uint item; /* prism << 4 | edge (renderer/shell/slice.h) */
layout(location = 1) in float plane;

void main() {
    int a, b;
    edge_ends(int(item & 15u), a, b);
    place_corner(int(item >> 4), a, b, plane);
}
