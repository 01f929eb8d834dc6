/* One tetrahedron along one ray: entry and exit, and what lies between.
 * After Dufort, Leblanc & Poulin 2005, sections 4.2 and 4.3.
 *
 * Entry and exit. With X(v), Y(v) two affine functions that vanish on the ray, the edge function
 * E_ij = X_i Y_j - X_j Y_i tells on which side of the edge ij the ray passes (a Pluecker product),
 * and on a face that the ray meets the three of them are the point's barycentric coordinates. Cells
 * that share an edge compute it from the same bits in the same order, so no ray is lost between
 * them or counted twice; planes, as in the paper, disagree where the ray lies in a shared face.
 * Being of one sign, the coordinates make a convex combination: no division can throw the point
 * out of the face, however thin the cell. Depths are taken relative to the first vertex, so a
 * segment's length is as exact as the cell is small.
 *
 * Media go through common_medium.glsl. Optical depth is summed apart from colour (blended by adding;
 * what it lets through multiplies the colour behind), so that neither thin nor thick media lose
 * digits. */
#include "common_frame.glsl"
#include "common_sample.glsl"
#include "common_real.glsl"
#include "common_edges.glsl"
#if (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_EXACT) == 0
#include "common_normals.glsl"
#endif
#if (VARIANT & FLAG_MEDIUM) != 0
#include "common_medium.glsl"
#elif (VARIANT & FLAG_SOLID) != 0
#include "common_solid.glsl"
#else
#include "common_math.glsl"
#include "common_through.glsl"
#endif

layout(binding = BINDING_CELLS) uniform samplerBuffer cells;
#if (VARIANT & FLAG_OCCLUDED) != 0
layout(binding = BINDING_OCCLUDER) uniform sampler2D occluder;
#endif

#if (VARIANT & FLAG_SOLID) == 0
/* What lies wholly behind something opaque is dropped before it is shaded. */
layout(early_fragment_tests) in;
#endif

flat in uint cell;
#ifdef SLABS
flat in vec2 slab; /* where it begins and ends: depths, the shell's centre being at 0 */
#endif

#ifdef CASTER
#include "common_shadow.glsl"
#include "common_caster.glsl"
#else
/* rgb: radiance, premultiplied; a: optical depth. */
layout(location = 0, index = 0) out vec4 picture;
#endif
#if (VARIANT & FLAG_SOLID) == 0 && !defined(CASTER)
layout(location = 0, index = 1) out vec4 through; /* transmittance, the blend factor */
#endif

#if (VARIANT & FLAG_RULED) != 0
#define CORNERS     cells
#define CORNERS_LOW cells_low
#include "common_ruled.glsl"
#endif

struct Tetra {
    REAL3 v0, v1, v2, v3; /* vertices */
    vec3 e1, e2, e3;      /* v_k - v0 */
    vec3 uvw0;            /* texture coordinates at v0 */
    vec3 u1, u2, u3;      /* uvw_k - uvw0 */
};

Tetra fetch_tetra() {
    int at = int(cell) * CELL_TEXELS;
    vec4 a = texelFetch(cells, at), b = texelFetch(cells, at + 1), c = texelFetch(cells, at + 2);
    vec4 d = texelFetch(cells, at + 3), e = texelFetch(cells, at + 4), f = texelFetch(cells, at + 5);
    vec4 g = texelFetch(cells, at + 6);
#if (VARIANT & FLAG_HOMOGENEOUS) != 0
    vec4 h = vec4(0.0); /* texture coordinates alone */
#else
    vec4 h = texelFetch(cells, at + 7);
#endif
    Tetra t = Tetra(REAL3(a.xyz), REAL3(b.xyz), REAL3(c.xyz), REAL3(d.xyz), e.xyz, f.xyz, g.xyz,
                    vec3(a.w, b.w, 0.0), vec3(c.w, d.w, e.w), vec3(f.w, g.w, h.x), h.yzw);
#if (VARIANT & FLAG_FP64) != 0
    dvec3 low0, low1, low2, low3;
    fetch_low(cells_low, int(cell), low0, low1, low2, low3);
    t.v0 += low0;
    t.v1 += low1;
    t.v2 += low2;
    t.v3 += low3;
#endif
    return t;
}

/* Depths of v1 to v3 over v0. */
REAL3 rise(Tetra t, REAL3 h_row) {
#if (VARIANT & FLAG_FP64) != 0
    return REAL3(dot(h_row, t.v1 - t.v0), dot(h_row, t.v2 - t.v0), dot(h_row, t.v3 - t.v0));
#else
    return REAL3(dot(h_row, t.e1), dot(h_row, t.e2), dot(h_row, t.e3));
#endif
}

/* Where the ray enters and leaves: barycentric coordinates of v1..v3, depth relative to v0. */
struct Hits {
    REAL3 lambda_in, lambda_out;
    REAL h_in, h_out;
};

/* One face, its edge functions oriented around it: coordinates `weights` for v1..v3, `rest` for v0. */
void meet_face(bool pierced, REAL3 weights, REAL rest, REAL3 h, inout Hits hits) {
    weights = abs(weights);
    REAL3 lambda = weights / max(weights.x + weights.y + weights.z + abs(rest), REAL(1.0e-37));
    REAL depth = dot(lambda, h);
    bool first = pierced && depth < hits.h_in, last = pierced && depth > hits.h_out;
    hits.lambda_in = first ? lambda : hits.lambda_in;
    hits.h_in = first ? depth : hits.h_in;
    hits.lambda_out = last ? lambda : hits.lambda_out;
    hits.h_out = last ? depth : hits.h_out;
}

#if (VARIANT & FLAG_RULED) == 0
Hits meet_tetra(Tetra t, REAL2 p) {
    REAL4 rx, ry, rh = FRAME_REAL(FRAME_H_ROW, 8);
    across_ray(p, rx, ry);
    REAL2 q0 = REAL2(dot(rx.xyz, t.v0) + rx.w, dot(ry.xyz, t.v0) + ry.w);
    REAL2 q1 = REAL2(dot(rx.xyz, t.v1) + rx.w, dot(ry.xyz, t.v1) + ry.w);
    REAL2 q2 = REAL2(dot(rx.xyz, t.v2) + rx.w, dot(ry.xyz, t.v2) + ry.w);
    REAL2 q3 = REAL2(dot(rx.xyz, t.v3) + rx.w, dot(ry.xyz, t.v3) + ry.w);
    bool p01, p02, p03, p12, p13, p23;
    REAL e01 = edge_function(q0, q1, p01), e02 = edge_function(q0, q2, p02);
    REAL e03 = edge_function(q0, q3, p03), e12 = edge_function(q1, q2, p12);
    REAL e13 = edge_function(q1, q3, p13), e23 = edge_function(q2, q3, p23);
    REAL3 h = rise(t, rh.xyz);
    Hits hits = Hits(REAL3(0.0), REAL3(0.0), REAL(1.0e38), REAL(-1.0e38));
    /* Around the face ijk, i < j < k, run E_ij, E_jk and -E_ik. */
    meet_face(p12 == p23 && p12 != p13, REAL3(e23, e13, e12), REAL(0.0), h, hits);
    meet_face(p02 == p23 && p02 != p03, REAL3(0.0, e03, e02), e23, h, hits);
    meet_face(p01 == p13 && p01 != p03, REAL3(e03, 0.0, e01), e13, h, hits);
    meet_face(p01 == p12 && p01 != p02, REAL3(e02, e01, 0.0), e12, h, hits);
    return hits;
}
#endif

#if (VARIANT & FLAG_RULED) != 0 && (VARIANT & FLAG_SOLID) != 0
/* The normal, in the world, of the prism's face that (b1, b2, w) is nearest to, where a way was last
 * asked for. */
vec3 face_entered(Way way, vec3 at) {
    vec4 beside = abs(vec4(1.0 - at.x - at.y, at.x, at.y, min(abs(at.z), abs(1.0 - at.z))));
    float least = min(min(beside.x, beside.y), min(beside.z, beside.w));
    return world_normal(beside.w == least   ? way.Z
                        : beside.x == least ? way.X + way.Y
                        : beside.y == least ? way.X
                                            : way.Y);
}
#endif

vec3 texture_at(Tetra t, REAL3 at) {
    vec3 lambda = vec3(at);
    return t.uvw0 + lambda.x * t.u1 + lambda.y * t.u2 + lambda.z * t.u3;
}

void main() {
    vec2 p = sample_position();
#if (VARIANT & FLAG_RULED) != 0
    Prism tetra = fetch_prism(int(cell / 3u));
    End from, to;
    if (!meet_prism(int(cell / 3u), tetra, cell % 3u, sample_position_real(), from, to))
        discard;
    REAL h_in = from.h, h_out = to.h;
    bool by_bottom = from.a.z == 0.0;
#else
    Tetra tetra = fetch_tetra();
    Hits hits = meet_tetra(tetra, sample_position_real());
    REAL h_in = hits.h_in, h_out = hits.h_out;
    bool by_bottom = hits.lambda_in.z == 0.0;
#endif
    REAL begin = h_in, end = h_out;
#if defined(SLABS) || defined(CASTER) || (VARIANT & (FLAG_EYE_INSIDE | FLAG_OCCLUDED | FLAG_SOLID | FLAG_FILTER | FLAGS_PLACE)) != 0
    REAL t0 = dot(FRAME_REAL(FRAME_H_ROW, 8).xyz, tetra.v0) + frame[FRAME_OU].w; /* of v0 */
#endif
#if (VARIANT & FLAG_EYE_INSIDE) != 0
    begin = max(begin, -1.0 - t0);
#endif
#ifdef SLABS
    /* Neighbouring slabs hold the same plane, so a cell's parts add up to the cell, to the bit. */
    REAL g0 = dot(FRAME_REAL(FRAME_H_ROW, 8).xyz, tetra.v0);
    begin = max(begin, REAL(slab.x) - g0);
    end = min(end, REAL(slab.y) - g0);
#endif
#if (VARIANT & FLAG_OCCLUDED) != 0
    float z = texelFetch(occluder, ivec2(gl_FragCoord.xy), 0).r;
    end = z > 0.0 ? min(end, REAL(T_HIDDEN(z, frame[FRAME_O0].w)) - t0) : end;
#endif
    /* What is entered through the bottom lies behind the base there, unless that is where the eye is:
     * told by the face (3, on which lambda_3, or w, is 0), not by a depth. */
#ifdef SLABS
    bool entered = t0 + h_in >= -1.0;
#else
    bool entered = begin == h_in;
#endif
    bool below = frame[FRAME_STEP].w != 0.0 && IS_BOTTOM(cell, 3u) && by_bottom && entered;
    if (!(begin < end) || below)
        discard;
    float along = length(ray_direction(p)), span = float(end - begin) * along;
#ifdef SLABS
    /* Rays beside the middle are longer in the world, and so are their steps. */
    float slopes = p.x * p.x * frame[FRAME_VIEW_DU].w + p.y * p.y * frame[FRAME_VIEW_DV].w;
    slab_rate = max(frame[FRAME_STEP].x / along, frame[FRAME_VIEW_D0].w * inversesqrt(1.0 + slopes));
#endif

#ifdef RANGE
    range = vec4(float(t0 + begin), -float(t0 + end), 0.0, 0.0);
#elif defined(CASTER) && (VARIANT & FLAG_HOMOGENEOUS) != 0
    deposit(span, float(t0 + begin), float(end - begin));
#elif (VARIANT & FLAG_HOMOGENEOUS) != 0
    show_homogeneous(span, picture, through);
#else
#if (VARIANT & FLAG_LIT) != 0
    vec3 v = view_vector(p);
#else
    vec3 v = vec3(0.0);
#endif
#if (VARIANT & FLAG_EXACT) != 0
#if (VARIANT & FLAG_RULED) != 0
    Way way = way_between(cell, tetra.uv0, from.a, to.a - from.a, from.m, to.m - from.m);
#else
    Way way = way_begin(cell, tetra.uvw0.xy, vec3(hits.lambda_in),
                        vec3(hits.lambda_out - hits.lambda_in));
#endif
#if defined(SLABS) || (VARIANT & (FLAG_EYE_INSIDE | FLAG_OCCLUDED)) != 0
    REAL whole = h_out - h_in;
    way_cut(way, float((begin - h_in) / whole), float((end - h_in) / whole));
#endif
#ifdef SLABS
    /* A part has one sample, so none before it to guess from: a step of Newton more. */
    way_go(way, (VARIANT & FLAG_SOLID) != 0 ? 0.0 : 0.5);
#endif
#else
    vec3 at_in = texture_at(tetra, hits.lambda_in), at_out = texture_at(tetra, hits.lambda_out);
#if defined(SLABS) || (VARIANT & (FLAG_EYE_INSIDE | FLAG_OCCLUDED)) != 0
    REAL whole = h_out - h_in;
    vec3 all_along = at_out - at_in;
    at_out = at_in + all_along * float((end - h_in) / whole);
    at_in = at_in + all_along * float((begin - h_in) / whole);
#endif
#if (VARIANT & FLAG_LIT) != 0
    mat3 to_world = normal_map(tetra.e1, tetra.e2, tetra.e3, tetra.u1, tetra.u2, tetra.u3);
#else
    mat3 to_world = mat3(0.0);
#endif
    Way way = Way(at_in, at_out - at_in, to_world);
#endif

#if (VARIANT & FLAGS_PLACE) != 0
    place_in = ray_origin(p) + float(t0 + begin) * ray_direction(p);
    place_on = float(end - begin) * ray_direction(p);
#endif
#if (VARIANT & FLAG_FILTER) != 0
#ifndef SLABS
    way_go(way, 0.5);
#endif
    filter_begin(way, p, float(0.5 * (begin + end) + t0));
#endif
#if defined(CASTER) && (VARIANT & FLAG_MEDIUM) != 0
    deposit(way, span, float(t0 + begin), float(end - begin));
#elif (VARIANT & FLAG_MEDIUM) != 0
    Ray ray = RAY_BEGINS;
    march(ray, way, span, v);
    show(ray.color, ray.tau, picture, through);
#endif

#if (VARIANT & FLAG_SOLID) != 0
    float where;
    bool searched = true; /* a cell's steps are bounded (FRAME_STEP) far below what a driver allows */
    if (!find_solid(way, span, where, searched))
        discard;
    /* Cut open by the shell's boundary: the face entered, the one opposite the vertex whose
     * coordinate is 0 there. */
#if (VARIANT & FLAG_RULED) != 0
    vec3 cut = face_entered(way, from.a);
#else
    vec3 lambda = vec3(hits.lambda_in);
    float lambda_0 = 1.0 - lambda.x - lambda.y - lambda.z;
    float least = min(min(lambda.x, lambda.y), min(lambda.z, lambda_0));
    vec3 a = lambda_0 == least ? tetra.e2 - tetra.e1 : lambda.x == least ? tetra.e2 : tetra.e1;
    vec3 b = lambda_0 == least || lambda.z != least ? tetra.e3 : tetra.e2;
    b = lambda_0 == least ? tetra.e3 - tetra.e1 : b;
    vec3 cut = world_normal(cross(a, b));
#endif
    vec3 q = way_at(way, where);
#ifdef CASTER
    vec3 n = vec3(0.0);
#if (VARIANT & FLAG_LIT) != 0
    n = way_to_world(way) * texture(solid_gradient, q).xyz;
#endif
    plane = plane_at(float(t0 + begin + (end - begin) * where), n, p);
#else
    picture = vec4(shade_solid(q, where, way_to_world(way), v, where == 0.0, cut), OPAQUE_DEPTH);
#endif
    gl_FragDepth = float(DEPTH_OF_T(t0 + begin + (end - begin) * where, frame[FRAME_O0].w));
#endif
#endif
}
