/* Where a walk leaves a prism whose sides are ruled: the same places as common_ruled.glsl finds from all
 * of a prism's corners, from those of the one side that the walk passes (FLAG_RULED). After common_real.glsl.
 *
 * The side over the edge i j (i < j: both neighbours know it in this order) is P(s, w), from corners b and
 * offsets o of a prism's vertices. With vectors from the ray, across it, q_k(w) = b_k + w o_k, it is met
 * where
 *
 *   q_i(w) x q_j(w) = c_0 - 2 u w + a w^2 = 0,
 *   c_0 = b_i x b_j,   u = -(b_i x o_j + o_i x b_j) / 2,   a = o_i x o_j,
 *
 * which falls through 0 at w = c_0 / (u + r) = (u - r) / a and rises at c_0 / (u - r) = (u + r) / a,
 * r^2 = u^2 - a c_0. A ray leaves by the root that falls where det dP > 0, on the side 0 2, which the
 * prism sees from its end, by that which rises; and enters by the other.
 *
 * The walk itself goes by plane faces: which of them it passes says which side is asked for. A face between
 * two cells of a prism ends on diagonals of its sides, where these are farthest from plane: there
 * the ray may have left the prism before it meets the face. It then leaves by the nearer of the two
 * sides that the face hangs between, through the side itself and not beside it, and the cells that are
 * left of the prism have nothing of the ray. Where it enters by a side later than a face between
 * cells, the walk's t, which never falls, does the same.
 *
 * SIDE_TEXELS a prism: the bottoms, relative to the first (0, e_1, e_2; 0, 0, 0), the offsets (o_k; the sign of det dP, or 0
 * where its cells are turned differently: then it has plane faces), and what fp32 leaves off e_1 and e_2. */
layout(binding = BINDING_SIDES) uniform samplerBuffer sides;

/* What a face of a cell is to its prism. */
#define SIDE_01 0u
#define SIDE_12 1u
#define SIDE_02 2u
#define CAP     3u
#define IN_01   4u /* between the first two cells: b0 b1 t2 */
#define IN_12   5u /* b0 t1 t2 */

/* Of a cell by its place in the prism (shell.h); face 4: none. */
uint part_of(uint kind, uint face) {
    uint parts = kind == 0u ? 0x33421u : kind == 1u ? 0x30451u : 0x30253u;
    return parts >> (4u * face) & 15u;
}

/* Of the two sides that a face between cells hangs between, the one nearer to the point (b1, b2, w) of it, or the one
 * beyond which that lies. */
uint nearer_side(uint part, vec3 q) {
    return part == IN_01 ? (1.0 - q.x - q.y < q.x ? SIDE_12 : SIDE_02) : (q.y < q.x ? SIDE_01 : SIDE_02);
}

/* Where a ray passes a side. */
struct Passing {
    REAL t;
    vec2 at;     /* s and w, within [0, 1] */
    bool meets;  /* the ray goes through the side there */
    bool misses; /* it goes through both its plane faces, and not through the side */
    bool ruled;  /* the prism has such sides */
};

/* (b1, b2, w) of a point of a side. */
vec3 side_at(uint side, vec2 at) {
    float s = at.x;
    return vec3(side == SIDE_01 ? s : side == SIDE_12 ? 1.0 - s : 0.0, side == SIDE_01 ? 0.0 : s, at.y);
}

REAL cross_of(REAL2 a, REAL2 b) {
    return a.x * b.y - b.x * a.y;
}

REAL over(REAL x, REAL y) {
    return x / (abs(y) < 1.0e-37 ? REAL(1.0e-37) : y);
}

REAL3 bottom_of(int at, int k) {
    REAL3 b = REAL3(texelFetch(sides, at + k).xyz);
#if (VARIANT & FLAG_FP64) != 0
    b += dvec3(texelFetch(sides, at + SIDE_LOW + k).xyz);
#endif
    return b;
}

/* Where the quadratic falls (r > 0) or rises (r < 0), and whether that is a point of the side, not beyond its
 * ends. */
void side_root(REAL2 qi, REAL2 qj, REAL2 pi, REAL2 pj, REAL c, REAL u, REAL a, REAL r, out REAL s, out REAL w,
               out bool within) {
    bool adds = r >= 0.0 ? u >= 0.0 : u <= 0.0; /* of two forms the one that does not cancel */
    w = adds ? over(c, u + r) : over(u - r, a);
    within = w >= 0.0 && w <= 1.0;
    w = clamp(w, REAL(0.0), REAL(1.0));
    qi += w * pi;
    REAL2 on = qj + w * pj - qi;
    s = -dot(qi, on) / max(dot(on, on), REAL(1.0e-37));
    within = within && s >= 0.0 && s <= 1.0;
    s = clamp(s, REAL(0.0), REAL(1.0));
}

/* The ray o + t d, o relative to the prism's first corner; U, V and d are at right angles. */
Passing pass_side(int prism, uint side, bool leaves, REAL3 o, REAL3 d, REAL3 U, REAL3 V) {
    int at = prism * SIDE_TEXELS, i = side == SIDE_12 ? 1 : 0, j = side == SIDE_01 ? 1 : 2;
    REAL3 bi = bottom_of(at, i) - o, bj = bottom_of(at, j) - o;
    vec4 ti = texelFetch(sides, at + SIDE_OFFSETS + i), tj = texelFetch(sides, at + SIDE_OFFSETS + j);
    REAL3 oi = REAL3(ti.xyz), oj = REAL3(tj.xyz);
    REAL2 qi = REAL2(dot(U, bi), dot(V, bi)), qj = REAL2(dot(U, bj), dot(V, bj));
    REAL2 pi = REAL2(dot(U, oi), dot(V, oi)), pj = REAL2(dot(U, oj), dot(V, oj));
    REAL c = cross_of(qi, qj), ij = cross_of(qi, pj), ji = cross_of(pi, qj), a = cross_of(pi, pj);
    /* Which of the plane faces b_i b_j t_j and b_i t_i t_j are met (common_ruled.glsl). */
    bool bottom = c > 0.0, diagonal = c + ij > 0.0, top = c + ij + ji + a > 0.0;
    bool lower = bottom == cross_of(qj, pj) > 0.0 && bottom != diagonal;
    bool upper = top == cross_of(qi, pi) > 0.0 && top != diagonal;
    /* Squares shall neither vanish nor overflow. */
    REAL u = -0.5 * (ij + ji), most = max(max(abs(c), abs(a)), max(abs(u), REAL(1.0e-37)));
    c /= most;
    u /= most;
    a /= most;
    REAL r2 = u * u - a * c, r = sqrt(max(r2, REAL(0.0)));
    bool falls = ((ti.w > 0.0) == leaves) != (side == SIDE_02);
    bool within, other_within;
    REAL s, w;
    side_root(qi, qj, pi, pj, c, u, a, falls ? -r : r, s, w, other_within);
    side_root(qi, qj, pi, pj, c, u, a, falls ? r : -r, s, w, within);
    Passing passing;
    passing.at = vec2(s, w);
    bi += w * oi;
    bj += w * oj;
    passing.t = dot(bi + s * (bj - bi), d) / dot(d, d);
    passing.ruled = ti.w != 0.0;
    bool twice = lower && upper, through = r2 >= 0.0 && within && other_within;
    passing.meets = passing.ruled && (twice ? through : lower ? bottom == falls : upper && top != falls);
    passing.misses = passing.ruled && twice && !through;
    return passing;
}
