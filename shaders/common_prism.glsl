/* The way of a ray's segment through the texture: where it is at a share f of it, and what a gradient
 * there means in the world. After common_frame.glsl.
 *
 * Affine (Dufort et al. 2005, section 4.3): texture coordinates are linear between entry and exit.
 *
 * Exact (FLAG_EXACT): those of the shell's own map. With p_k(w) = p_k + w o_k the corners of a prism's
 * layer w, and everything relative to p_0,
 *
 *   P(b, w) = sum b_k p_k(w) = b1 e1 + b2 e2 + w o_0 + w b1 g1 + w b2 g2,
 *   e_k = p_k - p_0,   g_k = o_k - o_0,   (u, v) = uv_0 + b1 du_1 + b2 du_2,
 *
 * which is affine only where the g_k are 0. At the six corners both maps agree, so for the point x with
 * coordinates lambda in a tetrahedron, whose affine map says a = (b1, b2, w),
 *
 *   x = a_1 e1 + a_2 e2 + a_3 o_0 + m_1 g1 + m_2 g2,   m_k = sum of lambda over vertices with w b_k = 1,
 *
 * and P(a + z) = x asks of the correction z that
 *
 *   r(z) = (m_1 - w b1) g1 + (m_2 - w b2) g2 - (z_1 e1 + z_2 e2 + z_3 o_0) = 0,   (b1, b2, w) = a + z.
 *
 * Nothing in this is larger than the correction itself: neither the place nor the thickness of the prism
 * costs digits. Newton's step is (X, Y, Z) . r / det with dP/db_k = E_k = e_k + w g_k,
 * dP/dw = O = o_0 + b1 g1 + b2 g2 and
 *
 *   X = E2 x O,   Y = O x E1,   Z = E1 x E2,   det = Z . O.
 *
 * (X, Y, Z) / det is also the inverse transpose of dP that takes gradients to normals: three products
 * serve both. (The cubic for w alone, and then the triangle's barycentrics, as in renderer/reference,
 * cost as much and give no normals.)
 *
 * A step's error is the square of the guess's, times the prism's own unevenness. Where a segment begins
 * z = 0 is the guess, at a sample that of the one before: one step each, a fixed count, so that lanes
 * stay together. A second step, or a guess along z's slope, changes the model error of no example by a
 * tenth.
 *
 * Which prisms are even enough is decided on the CPU (renderer/shell/prism_map.h): for the others g = 0,
 * so that z stays 0. No branch is needed here. Lengths come in units near the prism's longest edge, so
 * that products of three neither vanish nor overflow in fp32. */
#if (VARIANT & FLAG_EXACT) != 0

layout(binding = BINDING_MAPS) uniform samplerBuffer maps;

struct Way {
    vec3 a, a_on; /* the affine map where the segment begins, and from there to its end */
    vec2 m, m_on;
    vec3 o0, e1, e2, g1, g2; /* the prism */
    vec2 uv0, du1, du2;
    float f;      /* share of the segment that the following hold for */
    vec3 z, z_on; /* the correction there; its derivative by f */
    vec3 X, Y, Z; /* over det, at the guess */
#if (VARIANT & FLAG_FILTER) != 0
    float scale; /* the prism's units in one of the object's */
#endif
};

/* Which corner of the prism v1..v3 of its three tetrahedra are: shell.h. */
vec3 affine_map(uint kind, vec3 lambda) {
    float l23 = lambda.y + lambda.z;
    return kind == 0u   ? vec3(lambda.x, l23, lambda.z)
           : kind == 1u ? vec3(lambda.x + lambda.y, lambda.z, l23)
                        : vec3(lambda.y, lambda.z, lambda.x + l23);
}

vec2 affine_products(uint kind, vec3 lambda) {
    return vec2(kind == 0u ? 0.0 : lambda.y, lambda.z);
}

vec3 way_solve(Way way, vec3 r) {
    return vec3(dot(way.X, r), dot(way.Y, r), dot(way.Z, r));
}

/* (b1, b2, w) */
vec3 way_here(Way way) {
    return way.a + way.f * way.a_on + way.z;
}

/* On to the share f, and one step of Newton there. It begins within the prism, or 1/4 of an edge beside
 * it where a cell reaches beyond its sides: far outside the map may fold. */
void way_go(inout Way way, float f) {
    way.f = f;
    vec3 beside = way_here(way), q = clamp(beside, vec3(-0.25, -0.25, 0.0), vec3(1.25, 1.25, 1.0));
    way.z += q - beside; /* exactly 0 within: z keeps its digits */
    vec3 E1 = way.e1 + q.z * way.g1, E2 = way.e2 + q.z * way.g2;
    vec3 O = way.o0 + q.x * way.g1 + q.y * way.g2;
    way.X = cross(E2, O);
    way.Y = cross(O, E1);
    way.Z = cross(E1, E2);
    float det = dot(way.Z, O);
    float over_det = det / max(det * det, 1.0e-37);
    way.X *= over_det;
    way.Y *= over_det;
    way.Z *= over_det;
    vec2 bends = way.m_on - q.z * way.a_on.xy - way.a_on.z * q.xy;
    way.z_on = way_solve(way, bends.x * way.g1 + bends.y * way.g2);
    vec2 bent = way.m + f * way.m_on - q.z * q.xy;
    way.z += way_solve(way, bent.x * way.g1 + bent.y * way.g2 -
                                (way.z.x * way.e1 + way.z.y * way.e2 + way.z.z * way.o0));
}

/* A segment of the ray through the prism of `cell`: affine coordinates and weights where it begins, and
 * from there to its end; uv_0. */
Way way_between(uint cell, vec2 uv0, vec3 a, vec3 a_on, vec2 m, vec2 m_on) {
    int at = int(cell) * MAP_TEXELS;
    vec4 m0 = texelFetch(maps, at), m1 = texelFetch(maps, at + 1), m2 = texelFetch(maps, at + 2);
    vec4 m3 = texelFetch(maps, at + 3), m4 = texelFetch(maps, at + 4);
    return Way(a, a_on, m, m_on, m0.xyz, m1.xyz, m2.xyz, m3.xyz, m4.xyz, uv0,
               vec2(m0.w, m1.w), vec2(m2.w, m3.w), 0.0, vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0),
               vec3(0.0)
#if (VARIANT & FLAG_FILTER) != 0
               , abs(m4.w)
#endif
               );
}

/* The same from the coordinates of v1..v3. */
Way way_begin(uint cell, vec2 uv0, vec3 lambda, vec3 lambda_on) {
    uint kind = cell % 3u;
    return way_between(cell, uv0, affine_map(kind, lambda), affine_map(kind, lambda_on),
                       affine_products(kind, lambda), affine_products(kind, lambda_on));
}

/* A single point of a prism, from its affine coordinates and the weights m_k of its tops 1 and 2; `cell`
 * any of the prism's. No sample comes before it to guess from: a step of Newton in advance. */
Way way_at_point(uint cell, vec2 uv0, vec3 a, vec2 m) {
    Way way = way_begin(cell, uv0, vec3(0.0), vec3(0.0));
    way.a = a;
    way.m = m;
    way_go(way, 0.0);
    return way;
}

/* Another segment through the same prism. */
void way_change(inout Way way, vec3 a, vec3 a_on, vec2 m, vec2 m_on) {
    way.a = a;
    way.a_on = a_on;
    way.m = m;
    way.m_on = m_on;
}

/* Makes [from, to] the way's [0, 1]. */
void way_cut(inout Way way, float from, float to) {
    way.a += from * way.a_on;
    way.m += from * way.m_on;
    way.a_on *= to - from;
    way.m_on *= to - from;
    way.z = vec3(0.0);
}

/* Texture coordinates at the share f; those of a sequence of calls should lie near one another. */
vec3 way_at(inout Way way, float f) {
    way_go(way, f);
    vec3 q = way_here(way);
    return vec3(way.uv0 + q.x * way.du1 + q.y * way.du2, q.z);
}

/* How these change with f where they were last asked for. */
vec3 way_rate(Way way) {
    vec3 on = way.a_on + way.z_on;
    return vec3(on.x * way.du1 + on.y * way.du2, on.z);
}

/* From gradients per voxel to world normals, up to their length, where way_at() was last asked. */
mat3 way_to_world(Way way) {
    vec3 x = world_normal(way.X), y = world_normal(way.Y), z = world_normal(way.Z);
    vec3 n = frame_size;
    return mat3(n.x * (x * way.du1.x + y * way.du2.x), n.y * (x * way.du1.y + y * way.du2.y), n.z * z);
}

vec3 way_normal(Way way, vec3 gradient) {
    vec3 g = gradient * frame_size;
    return world_normal(dot(g.xy, way.du1) * way.X +
                        dot(g.xy, way.du2) * way.Y + g.z * way.Z);
}

#else

struct Way {
    vec3 at_in, along; /* texture coordinates where the segment begins, and from there to its end */
    mat3 to_world;     /* from gradients per voxel to world normals, up to their length */
};

vec3 way_at(Way way, float f) {
    return way.at_in + way.along * f;
}

vec3 way_rate(Way way) {
    return way.along;
}

mat3 way_to_world(Way way) {
    return way.to_world;
}

vec3 way_normal(Way way, vec3 gradient) {
    return way.to_world * gradient;
}

#endif
