/* Polygons in which planes cut prisms, all of it decided here: six corners for each prism, two to each
 * normal edge, one looking left and one right. Lensch, Daubert & Seidel 2002, section 6.1, figure 5.
 *
 * A corner sits on its normal edge if that is cut; else on the nearer cut of the two edges (lower and
 * upper) on its own side (the primary ones); else of the two on the other side; else outside of the
 * picture. Corners that fall together do no harm. Whether an edge is cut is told by the sides on which
 * its ends lie, not by 0 < lambda <= 1 as in the paper, so that all edges at a vertex agree. And the nearer
 * of two cuts is the upper one where the plane passes above the normal edge, the lower one where it passes
 * below, since that is what makes a polygon: distances say the same where normal edges go the same way,
 * and tie a knot where an uncut one does not (measured: 637 of 65,536 samples of a torus). Where normal
 * edges are cut both ways (slice.h) the polygon may fall in two, which six corners cannot say: there the
 * CPU names the edges. */
#include "common_frame.glsl"
#include "common_slice.glsl"

layout(binding = BINDING_CUTS) uniform usamplerBuffer cuts;

float d[6];

bool is_cut(int a, int b) {
    return (d[a] >= 0.0) != (d[b] >= 0.0);
}

void main() {
    uvec3 cut = texelFetch(cuts, gl_VertexID / CUT_CORNERS).xyz;
    int prism = int(cut.x), corner = gl_VertexID % CUT_CORNERS, here = corner >> 1;
    float plane = uintBitsToFloat(cut.y);
    int next = (here + 1) % 3, before = (here + 2) % 3;
    bool onward = (corner & 1) != 0; /* looks to the next normal edge */
    int primary = onward ? next : before, secondary = onward ? before : next;
    int i = 0;
    do {
        d[i] = distance_of(prism_vertex(prism, i), plane);
    } while (++i < 6);
    /* Edges that are cut the other way: the plane is seen from behind. */
    bool turned = (d[0] >= 0.0 && d[3] < 0.0) || (d[1] >= 0.0 && d[4] < 0.0) || (d[2] >= 0.0 && d[5] < 0.0);
    bool above = (d[here] < 0.0) != turned;
    int a = here, b = here + 3;
    bool placed = is_cut(a, b);
    int turn = 0;
    do {
        int other = turn == 0 ? primary : secondary;
        bool lower = is_cut(here, other), upper = is_cut(here + 3, other + 3);
        bool take = !placed && (lower || upper);
        int level = upper && (!lower || above) ? 3 : 0;
        a = take ? min(here, other) + level : a;
        b = take ? max(here, other) + level : b;
        placed = placed || take;
    } while (++turn < 2);
    int named_a, named_b;
    edge_ends(int(cut.z >> (4 * corner) & 15u), named_a, named_b);
    bool named = cut.z != CUT_UNDECIDED;
    place_corner(prism, named ? named_a : a, named ? named_b : b, plane);
    gl_Position = placed || named ? gl_Position : vec4(2.0, 2.0, 2.0, 1.0);
}
