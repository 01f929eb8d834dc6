/* A whole ray through one shell: from cell to cell through shared faces, front to back, ending early
 * where nothing more can be seen. No order is needed but that of the boundary faces through which the
 * ray enters, which the A-buffer gives for each sample (renderer/shell/entries.h).
 *
 * Faces are met as planes, lambda_k(t) = a_k + b_k t, and the walk leaves a cell by the first of those
 * that the ray is leaving (b_k < 0). A ray that has entered beside the face by rounding is at once
 * handed on across the face that it lies beyond: it is never lost; being in one cell at a time it
 * never counts a stretch twice; and as each stretch begins where the last ended, lengths add up.
 *
 * FLAG_RULED: planes say only which cells are passed through. What a ray has in each ends where its prism
 * does (common_sides.glsl), as it does where cells are drawn one by one. A ray that comes in by a side,
 * through a border, takes a turn to find where. */
#include "common_frame.glsl"
#include "common_sample.glsl"
#include "common_real.glsl"
#if (VARIANT & FLAG_HOMOGENEOUS) != 0
#include "common_math.glsl"
#include "common_through.glsl"
#elif (VARIANT & FLAG_SOLID) != 0
#include "common_solid.glsl"
#else
#include "common_medium.glsl"
#endif

#if (VARIANT & FLAG_RULED) != 0
#include "common_sides.glsl"
#endif

layout(binding = BINDING_CELLS) uniform samplerBuffer cells;
layout(binding = BINDING_LINKS) uniform usamplerBuffer links;     /* across each face */
layout(binding = BINDING_ENTRIES) uniform usamplerBuffer entries; /* cell << 2 | face */
layout(binding = BINDING_FIRST) uniform usamplerBuffer firsts;    /* a sample's first entry */
#if (VARIANT & FLAG_OCCLUDED) != 0
layout(binding = BINDING_OCCLUDER) uniform sampler2D occluder;
#endif

layout(location = 0) uniform uint start;  /* cell << 2 that the eye stands in, or LINK_NONE */
layout(location = 1) uniform int width;   /* of the sample grid */
layout(location = 2) uniform int visits;  /* most cells that a ray may see */

layout(location = 0, index = 0) out vec4 picture; /* radiance; optical depth */
#if (VARIANT & FLAG_SOLID) == 0
layout(location = 0, index = 1) out vec4 through; /* transmittance, the blend factor */
#endif

void leave(uint face, REAL a, REAL b, bool entered, inout REAL t_out, inout uint next_face) {
    REAL t = -a / b;
    bool first = b < 0.0 && !entered && t < t_out;
    t_out = first ? t : t_out;
    next_face = first ? face : next_face;
}

void main() {
    vec2 p = sample_position();
    REAL2 p_real = sample_position_real();
    REAL3 origin = ray_origin_real(p_real), d = ray_direction_real(p_real);
    float speed = length(vec3(d));
    int sample_index = int(gl_FragCoord.y) * width + int(gl_FragCoord.x);
    int entry = int(texelFetch(firsts, sample_index).r);
    int last = int(texelFetch(firsts, sample_index + 1).r);
    REAL t_stop = REAL(1.0e38);
#if (VARIANT & FLAG_OCCLUDED) != 0
    float z = texelFetch(occluder, ivec2(gl_FragCoord.xy), 0).r;
    t_stop = z > 0.0 ? REAL(T_HIDDEN(z, frame[FRAME_O0].w)) : t_stop;
#endif
#if (VARIANT & FLAG_LIT) != 0
    vec3 v = view_vector(p);
#else
    vec3 v = vec3(0.0);
#endif
#if (VARIANT & FLAG_HOMOGENEOUS) != 0
    float total = 0.0;
#elif (VARIANT & FLAG_SOLID) != 0
    bool found = false;
#if (VARIANT & FLAG_FOLDS) != 0
    REAL t_found = REAL(0.0);
#endif
    bool at_boundary = false;
    vec3 q_found = vec3(0.0), cut = vec3(0.0);
    mat3 to_world_found = mat3(0.0);
#else
    Ray ray = RAY_BEGINS;
#endif

#if (VARIANT & FLAG_RULED) != 0
    REAL3 d_unit = normalize(d), d_size = abs(d_unit);
    REAL3 aside = d_size.x <= min(d_size.y, d_size.z) ? REAL3(1.0, 0.0, 0.0)
                  : d_size.y <= d_size.z            ? REAL3(0.0, 1.0, 0.0)
                                                    : REAL3(0.0, 0.0, 1.0);
    REAL3 U = normalize(cross(d_unit, aside)), V = cross(d_unit, U);
    /* Whether the last cell was left by a side: of which prism's corners it was, where, and its t, which
     * may lie before what has been passed. */
    bool by_side = false, arrived = false, beside = false, resumed = false;
    vec3 a_left = vec3(0.0);
    vec2 m_left = vec2(0.0);
    uint side = SIDE_01, via = SIDE_01, missed = LINK_NONE;
    vec2 at_side = vec2(0.0);
    REAL t_side = REAL(0.0);
#endif
    bool has_base = frame[FRAME_STEP].w != 0.0;
    uint here = start;
    bool walking = start != LINK_NONE;
    REAL t = REAL(-1.0);
    int visit = 0;
    bool complete = false; /* the loop ended by itself, not at a bound */
#if (VARIANT & FLAG_SOLID) != 0
    bool whole = true;
#endif
    if (!walking && entry >= last)
        discard;
    do {
        bool enters = !walking;
        here = enters ? texelFetch(entries, entry).r : here;
        entry += enters ? 1 : 0;
        int cell = int(here >> 2), face = visit == 0 && !enters ? 4 : int(here & 3u);
#if (VARIANT & FLAG_SOLID) != 0
        bool from_boundary = enters;
#if (VARIANT & FLAG_RULED) != 0
        from_boundary = enters || arrived;
#endif
#endif
        int at = cell * WALK_TEXELS;
        vec4 c0 = texelFetch(cells, at), c1 = texelFetch(cells, at + 1);
        vec4 c2 = texelFetch(cells, at + 2), c3 = texelFetch(cells, at + 3);
        uvec4 link = texelFetch(links, cell);

        /* From the ray's point nearest to the first vertex, so that t is as exact as the cell is
         * small. */
        REAL3 v0 = REAL3(c0.xyz), g1 = REAL3(c1.xyz), g2 = REAL3(c2.xyz), g3 = REAL3(c3.xyz);
#if (VARIANT & FLAG_FP64) != 0
        dvec3 low0, low1, low2, low3;
        fetch_low(cells_low, cell, low0, low1, low2, low3);
        v0 += low0;
        g1 += low1;
        g2 += low2;
        g3 += low3;
#endif
        REAL3 o = origin - v0;
        REAL near = -dot(o, d) / dot(d, d);
        o += near * d;
        REAL a1 = dot(g1, o), b1 = dot(g1, d);
        REAL a2 = dot(g2, o), b2 = dot(g2, d);
        REAL a3 = dot(g3, o), b3 = dot(g3, d);
        REAL a0 = 1.0 - a1 - a2 - a3, b0 = -b1 - b2 - b3;
        REAL af = face == 0 ? a0 : face == 1 ? a1 : face == 2 ? a2 : a3;
        REAL bf = face == 0 ? b0 : face == 1 ? b1 : face == 2 ? b2 : b3;
        REAL t_in = enters ? max(-af / bf, -1.0 - near) : t - near;
        REAL t_out = REAL(1.0e38);
        uint next_face = 4u;
        leave(0u, a0, b0, face == 0, t_out, next_face);
        leave(1u, a1, b1, face == 1, t_out, next_face);
        leave(2u, a2, b2, face == 2, t_out, next_face);
        leave(3u, a3, b3, face == 3, t_out, next_face);
        uint next = next_face == 0u   ? link.x
                    : next_face == 1u ? link.y
                    : next_face == 2u ? link.z
                    : next_face == 3u ? link.w
                                      : LINK_NONE;
#if (VARIANT & FLAG_RULED) != 0
        uint kind = uint(cell) % 3u, came = part_of(kind, uint(face)), goes = part_of(kind, next_face);
        via = came <= SIDE_02 ? came : via;
        bool comes = enters && came <= SIDE_02;
        vec3 l_out = vec3(a1 + t_out * b1, a2 + t_out * b2, a3 + t_out * b3);
        Way way = way_begin(uint(cell), vec2(c0.w, c1.w), l_out, vec3(0.0));
        way_go(way, 0.0);
        uint asked = comes ? came : goes <= SIDE_02 ? goes : nearer_side(goes, way_here(way));
        Passing passing = pass_side(cell / 3, asked, !comes, o, d, U, V);
        /* A side's plane faces are passed and the side is not: the ray comes back through the other of them, and
         * has all along been in the prism that it left. */
        bool arrives = comes && passing.ruled;
        bool back = arrives && missed == (uint(cell / 3) << 2 | came);
        bool skips = beside && passing.ruled && (goes >= IN_01 || goes == via);
        bool through_side = passing.meets && !skips && !back &&
                            (arrives || goes <= SIDE_02 || (goes >= IN_01 && passing.t < t_out));
        /* Where the ray came in, and where it leaves, on its way from the one to the other. */
        bool from_side = by_side && passing.ruled && !enters;
        t_in = back ? t - near : t_in;
        REAL t_from = from_side ? t_side - near : t_in;
        REAL t_to = through_side ? passing.t : arrives || skips || t_out > 1.0e37 ? t_in : t_out;
        vec3 l_from = vec3(a1 + t_from * b1, a2 + t_from * b2, a3 + t_from * b3);
        vec3 l_to = vec3(a1 + t_to * b1, a2 + t_to * b2, a3 + t_to * b3);
        vec3 a_from = affine_map(kind, l_from), a_to = affine_map(kind, l_to);
        vec2 m_from = affine_products(kind, l_from), m_to = affine_products(kind, l_to);
        vec3 q_from = side_at(came <= SIDE_02 ? came : side, at_side), q_to = side_at(asked, passing.at);
        a_from = from_side ? q_from : a_from;
        m_from = from_side ? q_from.z * q_from.xy : m_from;
        a_to = through_side ? q_to : a_to;
        m_to = through_side ? q_to.z * q_to.xy : m_to;
        a_from = resumed && !enters ? a_left : a_from;
        m_from = resumed && !enters ? m_left : m_from;
        t_out = max(t_to, -1.0 - near);
        t_in = arrives ? t_out : t_in;
        next = arrives ? here : next;
        next_face = arrives ? 4u : next_face;
        bool misses = goes <= SIDE_02 && passing.misses && !skips && !arrives;
        missed = misses ? uint(cell / 3) << 2 | goes : LINK_NONE;
        a_left = misses ? a_to : a_left;
        m_left = misses ? m_to : m_left;
        resumed = back || (skips && goes == via);
        beside = arrives ? passing.misses && !back : skips ? goes >= IN_01 : misses;
        /* What a cell has nothing of goes on to the next of the prism. */
        by_side = through_side || (from_side && t_to <= t_from);
        side = through_side ? asked : came <= SIDE_02 ? came : side;
        at_side = through_side ? passing.at : at_side;
        t_side = through_side ? passing.t + near : t_side;
        arrived = arrives;
#endif
        /* No face is left only where the cell has no volume: there the ray stays where it is. */
        t_out = t_out < 1.0e37 ? max(t_out, t_in) : t_in;
        /* Where a base lies in the bottom, the ray ends at it, from either side, unless it begins
         * there; the surface pass draws it. Told by the face, not by a depth. */
        bool at_base = has_base && enters && IS_BOTTOM(uint(cell), uint(face)) && t_in > -1.0 - near;
        bool leaves_by_base = has_base && IS_BOTTOM(uint(cell), next_face);
        REAL t_end = at_base ? t_in : max(min(t_out, t_stop - near), t_in);
#if (VARIANT & FLAG_RULED) != 0
        bool some = t_to > t_from && t_end > t_in && !arrives;
        t_end = some ? t_end : t_in;
        REAL over_extent = 1.0 / (some ? t_to - t_from : REAL(1.0));
#endif
        float span = float(t_end - t_in) * speed;

#if (VARIANT & FLAG_HOMOGENEOUS) != 0
        total += span;
        bool finished = t_out >= t_stop - near || at_base || leaves_by_base;
#else
#if (VARIANT & FLAG_EXACT) != 0
#if (VARIANT & FLAG_RULED) != 0
        way_change(way, a_from, a_to - a_from, m_from, m_to - m_from);
        way_cut(way, some ? float((t_in - t_from) * over_extent) : 0.0,
                some ? float((t_end - t_from) * over_extent) : 0.0);
#else
        Way way = way_begin(uint(cell), vec2(c0.w, c1.w),
                            vec3(a1 + t_in * b1, a2 + t_in * b2, a3 + t_in * b3),
                            vec3(b1, b2, b3) * float(t_end - t_in));
#endif
#if (VARIANT & FLAG_SOLID) != 0 && (VARIANT & FLAG_LIT) != 0
        float scale = texelFetch(cells, at + 5).w;
        vec3 n1 = world_normal(c1.xyz * scale), n2 = world_normal(c2.xyz * scale);
        vec3 n3 = world_normal(c3.xyz * scale);
#endif
#else
        vec4 c4 = texelFetch(cells, at + 4), c5 = texelFetch(cells, at + 5);
        vec3 u1 = vec3(c2.w, c3.w, c4.x), u2 = c4.yzw, u3 = c5.xyz;
        vec3 at_in = vec3(c0.w, c1.w, 0.0) + float(a1 + t_in * b1) * u1 + float(a2 + t_in * b2) * u2 +
                     float(a3 + t_in * b3) * u3;
        vec3 along = float((t_end - t_in) * b1) * u1 + float((t_end - t_in) * b2) * u2 +
                     float((t_end - t_in) * b3) * u3;
        mat3 to_world = mat3(0.0);
#if (VARIANT & FLAG_LIT) != 0
        vec3 n1 = world_normal(c1.xyz * c5.w), n2 = world_normal(c2.xyz * c5.w);
        vec3 n3 = world_normal(c3.xyz * c5.w), size = frame_size;
        u1 *= size;
        u2 *= size;
        u3 *= size;
        to_world = mat3(n1 * u1.x + n2 * u2.x + n3 * u3.x, n1 * u1.y + n2 * u2.y + n3 * u3.y,
                        n1 * u1.z + n2 * u2.z + n3 * u3.z);
#endif
        Way way = Way(at_in, along, to_world);
#endif
#if (VARIANT & FLAG_SOLID) != 0
        float where;
        bool meets = find_solid(way, span, where, whole) && !at_base;
#if (VARIANT & FLAG_RULED) != 0
        meets = meets && some; /* what the prism has not may lie in a solid all the same */
#endif
#if (VARIANT & FLAG_FOLDS) != 0
        /* The nearest surface so far, or a base, ends this stretch and those after it there; what
         * begins beyond it ends the ray. */
        bool behind = enters && t_in >= t_stop - near;
        meets = meets && !behind;
        REAL t_meet = meets ? t_in + (t_end - t_in) * where : at_base ? t_in : t_out;
        t_found = meets ? t_meet + near : t_found;
        bool ends = meets || at_base || leaves_by_base;
        t_stop = ends && !behind ? min(t_stop, t_meet + near) : t_stop;
#else
        t_out = meets ? t_in + (t_end - t_in) * where : t_out;
#endif
        /* Kept for shading after the walk. Each is chosen between its old and its new value: what a
         * loop overwrites in every turn and only code after it reads is, on llvmpipe 22.3, that of the
         * last lane to leave. */
        found = found || meets;
        vec3 q = way_at(way, where);
        q_found = meets ? q : q_found;
        mat3 to_world_here = way_to_world(way);
        to_world_found[0] = meets ? to_world_here[0] : to_world_found[0];
        to_world_found[1] = meets ? to_world_here[1] : to_world_found[1];
        to_world_found[2] = meets ? to_world_here[2] : to_world_found[2];
        at_boundary = meets ? from_boundary && where == 0.0 : at_boundary;
#if (VARIANT & FLAG_LIT) != 0
        vec3 n_face = face == 0 ? n1 + n2 + n3 : -(face == 1 ? n1 : face == 2 ? n2 : n3);
        cut = meets ? n_face : cut;
#endif
#if (VARIANT & FLAG_FOLDS) != 0
        bool finished = behind || at_base;
        next = ends || t_out >= t_stop - near ? LINK_NONE : next;
#else
        bool finished = found || at_base || leaves_by_base;
#endif
#else
#if (VARIANT & FLAGS_PLACE) != 0
        place_in = vec3(origin + (t_in + near) * d);
        place_on = vec3((t_end - t_in) * d);
#endif
#if (VARIANT & FLAG_FILTER) != 0
        way_go(way, 0.5);
        filter_begin(way, p, float(0.5 * (t_in + t_end) + near));
#endif
        march(ray, way, span, v);
        bool finished = t_out >= t_stop - near || at_base || leaves_by_base ||
                        most_left(ray) < frame[FRAME_SCREEN].z;
#endif
#endif
        t = t_out + near;
        here = next;
        walking = next != LINK_NONE && !finished;
        entry = finished ? last : entry;
        complete = complete || !(walking || entry < last);
    } while (!complete && ++visit < visits);

#if (VARIANT & FLAG_HOMOGENEOUS) != 0
    show_homogeneous(total, picture, through);
#elif (VARIANT & FLAG_SOLID) != 0
    complete = complete && whole;
    if (!found && complete)
        discard;
#if (VARIANT & FLAG_FOLDS) != 0
    t = t_found;
#endif
#if (VARIANT & FLAGS_PLACE) != 0
    place_in = vec3(origin + t * d);
#endif
    picture = vec4(shade_solid(q_found, 0.0, to_world_found, v, at_boundary, cut), OPAQUE_DEPTH);
    gl_FragDepth = float(DEPTH_OF_T(t, frame[FRAME_O0].w));
#else
    show(ray.color, ray.tau, picture, through);
    complete = complete && ray.whole;
#endif
    /* A ray that has seen too many cells, or whose loops the driver has ended (common_medium.glsl), is
     * no picture: told as such (renderer/render.c). */
    picture = complete ? picture : vec4(uintBitsToFloat(0x7fc00000u));
}
