/* A cell that ends where its prism does: at ruled sides, not at the plane faces that cells have there.
 * After common_edges.glsl; X and Y vanish on the ray, h is the depth over the prism's first corner. CORNERS
 * (and CORNERS_LOW) is the table of cells that shell.h describes.
 *
 * The side over the edge i j (i < j: both neighbours know it in this order) is
 * P(s, w) = (1 - s) (b_i + w o_i) + s (b_j + w o_j). Corner along the ray, its corners in the layer w are
 * points q_i(w), q_j(w) of a plane, the ray its origin, which is on the side where q_i(w) x q_j(w) = 0: a
 * quadratic whose Bernstein coefficients are edge functions,
 *
 *   c_0 = b_i x b_j,   c_1 = (b_i x t_j + t_i x b_j) / 2,   c_2 = t_i x t_j.
 *
 * With u = c_0 - c_1, a = c_0 - 2 c_1 + c_2, r^2 = c_1^2 - c_0 c_2 it falls through 0 at
 * w = c_0 / (u + r) = (u - r) / a and rises at c_0 / (u - r) = (u + r) / a: one of each, and which of them a
 * ray takes is known beforehand.
 *
 * Which faces a ray meets, and in what order, plane faces say as ever: that is what cells are sorted
 * by, and what loses no ray. Only where it meets them is the side's. Both surfaces hang on the same four edges,
 * so a ray that meets one of the two faces of a side meets the side once, and in the same direction. One
 * that meets both meets the side twice, or not at all: then it touches the fold between them alone, and between
 * the two it stays in the prism that it came from. One that meets neither may still meet the side twice, which
 * is not seen: rays that graze a side within the angle of its twist.
 *
 * chi, the sign of det dP and of the view's handedness together, tells directions: w grows along the
 * ray through a triangle i j k of one layer whose edge functions have that sign, and a ray enters by a root
 * that rises where chi > 0, by one that falls where chi < 0; on the side 0 2, which the prism sees from its
 * end, the other way around.
 *
 * Where the cells of one prism are turned differently (the map's scale is negative: prism_map.h) there is no
 * such chi, nor a side; each of them has its own plane faces, and is entered where it is met first.
 *
 * A point of a side is known in the prism's own coordinates, and is a convex combination of its corners: so
 * ends are as exact as the prism is small. */

struct Prism {
    REAL3 v0, b1, b2, t0, t1, t2;      /* corners, v0 the bottom 0 */
    vec3 e_b1, e_b2, e_t0, e_t1, e_t2; /* relative to that */
    vec2 uv0;
};

/* From the records of its three cells. */
Prism fetch_prism(int prism) {
    int first = 3 * prism, at = first * CELL_TEXELS;
    int at_1 = at + CELL_TEXELS, at_2 = at_1 + CELL_TEXELS;
    vec4 a = texelFetch(CORNERS, at), b = texelFetch(CORNERS, at + 1);
    Prism p;
    p.v0 = REAL3(a.xyz);
    p.b1 = REAL3(b.xyz);
    p.b2 = REAL3(texelFetch(CORNERS, at + 2).xyz);
    p.t2 = REAL3(texelFetch(CORNERS, at + 3).xyz);
    p.t1 = REAL3(texelFetch(CORNERS, at_1 + 2).xyz);
    p.t0 = REAL3(texelFetch(CORNERS, at_2 + 1).xyz);
    p.e_b1 = texelFetch(CORNERS, at + 4).xyz;
    p.e_b2 = texelFetch(CORNERS, at + 5).xyz;
    p.e_t2 = texelFetch(CORNERS, at + 6).xyz;
    p.e_t1 = texelFetch(CORNERS, at_1 + 5).xyz;
    p.e_t0 = texelFetch(CORNERS, at_2 + 4).xyz;
    p.uv0 = vec2(a.w, b.w);
#if (VARIANT & FLAG_FP64) != 0
    dvec3 low0, low1, low2, low3;
    fetch_low(CORNERS_LOW, first, low0, low1, low2, low3);
    p.v0 += low0;
    p.b1 += low1;
    p.b2 += low2;
    p.t2 += low3;
    fetch_low(CORNERS_LOW, first + 1, low0, low1, low2, low3);
    p.t1 += low2;
    fetch_low(CORNERS_LOW, first + 2, low0, low1, low2, low3);
    p.t0 += low1;
#endif
    return p;
}

/* A corner as the ray sees it; an edge function, and whether it counts as positive. */
struct Corner {
    REAL2 q;
    REAL h;
};
struct Edge {
    REAL e;
    bool p;
};

Corner see(REAL4 rx, REAL4 ry, REAL3 rh, REAL3 v, REAL3 v0, vec3 e) {
#if (VARIANT & FLAG_FP64) != 0
    REAL h = dot(rh, v - v0);
#else
    REAL h = dot(rh, e);
#endif
    return Corner(REAL2(dot(rx.xyz, v) + rx.w, dot(ry.xyz, v) + ry.w), h);
}

Edge edge(Corner a, Corner b) {
    Edge edge;
    edge.e = edge_function(a.q, b.q, edge.p);
    return edge;
}

/* A point of the ray, from corners: depth, affine coordinates (b1, b2, w) and the weights of tops 1 and
 * 2 (common_prism.glsl). */
struct End {
    REAL h;
    vec3 a;
    vec2 m;
};

/* A face of a cell: whether the ray meets it, enters there, and where. */
struct Face {
    bool met, enters;
    End end;
};

/* Where the ray enters the prism, or leaves it, and how often. */
struct Crossing {
    End end;
    int count;
};

void choose(bool really, End other, inout End end) {
    end.h = really ? other.h : end.h;
    end.a = really ? other.a : end.a;
    end.m = really ? other.m : end.m;
}

void count_face(Face face, inout Crossing enter, inout Crossing leave) {
    bool enters = face.met && face.enters, leaves = face.met && !face.enters;
    choose(enters, face.end, enter.end);
    enter.count += enters ? 1 : 0;
    choose(leaves, face.end, leave.end);
    leave.count += leaves ? 1 : 0;
}

REAL over(REAL x, REAL y) {
    return x / (abs(y) < 1.0e-37 ? REAL(1.0e-37) : y);
}

/* A triangle of corners at heights h_k with coordinates a_k and weights m_k (m_0 = 0); its edge
 * functions e_jk in the order of the corners opposite. */
Face meet_triangle(Edge e12, Edge e02, Edge e01, REAL h0, REAL h1, REAL h2, vec3 a0, vec3 a1, vec3 a2,
                   vec2 m1, vec2 m2) {
    REAL3 l = abs(REAL3(e12.e, e02.e, e01.e));
    l /= max(l.x + l.y + l.z, REAL(1.0e-37));
    vec3 f = vec3(l);
    return Face(e01.p == e12.p && e01.p != e02.p, false,
                End(l.x * h0 + l.y * h1 + l.z * h2, f.x * a0 + f.y * a1 + f.z * a2, f.y * m1 + f.z * m2));
}

/* Where a side is met: where its quadratic falls (r > 0) or rises (r < 0); and whether that is a point of the
 * side, not beyond its ends. */
End side_end(Corner bi, Corner ti, Corner bj, Corner tj, REAL k0, REAL k1, REAL k2, REAL r, vec2 at_i, vec2 at_j,
             out bool within) {
    REAL u = k0 - k1, a = u - (k1 - k2);
    bool adds = r >= 0.0 ? u >= 0.0 : u <= 0.0; /* of two forms the one that does not cancel */
    REAL w = adds ? over(k0, u + r) : over(u - r, a);
    within = w >= 0.0 && w <= 1.0;
    w = clamp(w, REAL(0.0), REAL(1.0));
    REAL2 qi = bi.q + w * (ti.q - bi.q), d = bj.q + w * (tj.q - bj.q) - qi;
    REAL s = -dot(qi, d) / max(dot(d, d), REAL(1.0e-37));
    within = within && s >= 0.0 && s <= 1.0;
    s = clamp(s, REAL(0.0), REAL(1.0));
    REAL hi = bi.h + w * (ti.h - bi.h), hj = bj.h + w * (tj.h - bj.h);
    vec2 b = at_i + float(s) * (at_j - at_i);
    return End(hi + s * (hj - hi), vec3(b, w), float(w) * b);
}

/* The side between the corners i < j, which have (b1, b2) = at_i, at_j: its faces b_i b_j t_j and
 * b_i t_i t_j. */
void meet_side(Corner bi, Corner ti, Corner bj, Corner tj, Edge bottom, Edge top, Edge diagonal, Edge edge_i,
               Edge edge_j, vec2 at_i, vec2 at_j, bool enters_rising, bool ruled, out Face lower, out Face upper,
               inout Crossing enter, inout Crossing leave) {
    lower = meet_triangle(edge_j, diagonal, bottom, bi.h, bj.h, tj.h, vec3(at_i, 0.0), vec3(at_j, 0.0),
                          vec3(at_j, 1.0), vec2(0.0), at_j);
    lower.enters = bottom.p != enters_rising;
    upper = meet_triangle(top, diagonal, edge_i, bi.h, ti.h, tj.h, vec3(at_i, 0.0), vec3(at_i, 1.0),
                          vec3(at_j, 1.0), at_i, at_j);
    upper.enters = top.p == enters_rising;

    REAL c1 = 0.5 * (diagonal.e + edge(ti, bj).e);
    /* Squares of them shall neither vanish nor overflow. */
    REAL most = max(max(abs(bottom.e), abs(top.e)), max(abs(c1), REAL(1.0e-37)));
    REAL k0 = bottom.e / most, k1 = c1 / most, k2 = top.e / most;
    REAL r2 = k1 * k1 - k0 * k2, r = sqrt(max(r2, REAL(0.0)));
    bool falls = lower.met ? bottom.p : !top.p, twice = lower.met && upper.met;
    bool first_within, second_within;
    End first = side_end(bi, ti, bj, tj, k0, k1, k2, falls ? r : -r, at_i, at_j, first_within);
    End second = side_end(bi, ti, bj, tj, k0, k1, k2, falls ? -r : r, at_i, at_j, second_within);
    bool through = !twice || (r2 >= 0.0 && first_within && second_within);
    choose(ruled && through, first, lower.end);
    choose(ruled && !twice, first, upper.end);
    choose(ruled && twice && through, second, upper.end);
    End sooner = lower.end;
    choose(upper.end.h < lower.end.h, upper.end, sooner);
    choose(ruled && !through, sooner, lower.end);
    choose(ruled && !through, sooner, upper.end);
    count_face(lower, enter, leave);
    count_face(upper, enter, leave);
}

Face of_kind(uint kind, Face f0, Face f1, Face f2) {
    Face face = f2;
    face.met = kind == 0u ? f0.met : kind == 1u ? f1.met : f2.met;
    face.enters = kind == 0u ? f0.enters : kind == 1u ? f1.enters : f2.enters;
    choose(kind == 0u, f0.end, face.end);
    choose(kind == 1u, f1.end, face.end);
    return face;
}

/* Where a strip is wider than a cell the ray is out of the prism before it meets the face between two
 * cells, or not yet in it: then that is where they part, and one of them has nothing. */
void keep_within(bool once, End enter, End leave, inout End end) {
    choose(once && end.h < enter.h, enter, end);
    choose(once && end.h > leave.h, leave, end);
}

/* What the ray has in a cell that it meets: from where to where. Where that is nothing it does not end after
 * it begins. */
bool meet_corners(uint kind, Corner b0, Corner b1, Corner b2, Corner t0, Corner t1, Corner t2, bool upward,
                  bool ruled, out End from, out End to) {
    const End none = End(REAL(0.0), vec3(0.0), vec2(0.0));
    Crossing enter = Crossing(none, 0), leave = enter;
    Edge e01 = edge(b0, b1), e12 = edge(b1, b2), e02 = edge(b0, b2);
    Edge f01 = edge(t0, t1), f12 = edge(t1, t2), f02 = edge(t0, t2);
    Edge d01 = edge(b0, t1), d12 = edge(b1, t2), d02 = edge(b0, t2);
    Edge v0 = edge(b0, t0), v1 = edge(b1, t1), v2 = edge(b2, t2);
    const vec3 a_b0 = vec3(0.0), a_b1 = vec3(1.0, 0.0, 0.0), a_b2 = vec3(0.0, 1.0, 0.0);
    const vec3 a_t0 = vec3(0.0, 0.0, 1.0), a_t1 = vec3(1.0, 0.0, 1.0), a_t2 = vec3(0.0, 1.0, 1.0);
    const vec2 at_0 = vec2(0.0), at_1 = vec2(1.0, 0.0), at_2 = vec2(0.0, 1.0);
    Face l01, u01, l12, u12, l02, u02;
    meet_side(b0, t0, b1, t1, e01, f01, d01, v0, v1, at_0, at_1, upward, ruled, l01, u01, enter, leave);
    meet_side(b1, t1, b2, t2, e12, f12, d12, v1, v2, at_1, at_2, upward, ruled, l12, u12, enter, leave);
    meet_side(b0, t0, b2, t2, e02, f02, d02, v0, v2, at_0, at_2, !upward, ruled, l02, u02, enter, leave);
    Face bottom = meet_triangle(e12, e02, e01, b0.h, b1.h, b2.h, a_b0, a_b1, a_b2, at_0, at_0);
    Face top = meet_triangle(f12, f02, f01, t0.h, t1.h, t2.h, a_t0, a_t1, a_t2, at_1, at_2);
    bottom.enters = e01.p == upward;
    top.enters = f01.p != upward;
    count_face(bottom, enter, leave);
    count_face(top, enter, leave);
    /* Between the cells: b0 b1 t2 and b0 t1 t2. */
    Face in01 = meet_triangle(d12, d02, e01, b0.h, b1.h, t2.h, a_b0, a_b1, a_t2, at_0, at_2);
    Face in12 = meet_triangle(f12, d02, d01, b0.h, t1.h, t2.h, a_b0, a_t1, a_t2, at_1, at_2);
    in01.enters = (e01.p == upward) == (kind != 0u);
    in12.enters = (f12.p == upward) == (kind != 1u);
    bool once = ruled && enter.count == 1 && leave.count == 1;
    keep_within(once, enter.end, leave.end, in01.end);
    keep_within(once, enter.end, leave.end, in12.end);

    Face face[4];
    face[0] = of_kind(kind, l12, u12, u02);
    face[1] = of_kind(kind, l02, l01, u01);
    face[2] = of_kind(kind, bottom, in12, top);
    face[3] = of_kind(kind, in01, in01, in12);
    from = to = none;
    for (int k = 0; k < 4; k++) {
        choose(face[k].met && face[k].enters, face[k].end, from);
        choose(face[k].met && !face[k].enters, face[k].end, to);
    }
    End swap = from;
    bool turned = !ruled && from.h > to.h;
    choose(turned, to, from);
    choose(turned, swap, to);
    return face[0].met || face[1].met || face[2].met || face[3].met;
}

bool meet_prism(int prism, Prism p, uint kind, REAL2 at, out End from, out End to) {
    REAL4 rx, ry;
    across_ray(at, rx, ry);
    REAL3 rh = FRAME_REAL(FRAME_H_ROW, 8).xyz;
    /* (X, Y, H) are left-handed in views that do not mirror. Products of three shall neither vanish nor
     * overflow. */
    vec3 most = max(abs(p.e_b1), max(abs(p.e_b2), abs(p.e_t0)));
    float unit = 1.0 / max(max(most.x, most.y), max(most.z, 1.0e-37));
    float det = dot(cross(unit * p.e_b1, unit * p.e_b2), unit * p.e_t0);
    bool upward = det * frame[FRAME_SIZE].w < 0.0; /* chi > 0 */
    bool ruled = texelFetch(maps, (3 * prism + 1) * MAP_TEXELS - 1).w > 0.0;
    return meet_corners(kind, see(rx, ry, rh, p.v0, p.v0, vec3(0.0)), see(rx, ry, rh, p.b1, p.v0, p.e_b1),
                 see(rx, ry, rh, p.b2, p.v0, p.e_b2), see(rx, ry, rh, p.t0, p.v0, p.e_t0),
                 see(rx, ry, rh, p.t1, p.v0, p.e_t1), see(rx, ry, rh, p.t2, p.v0, p.e_t2), upward, ruled, from,
                 to);
}
