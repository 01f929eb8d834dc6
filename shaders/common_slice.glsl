/* Prisms for slicing, from the table of their tetrahedra (renderer/shell/shell.h): vertices 0..2 are the
 * bottoms, 3..5 the tops. For vertex stages, after common_frame.glsl. */
#if (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_EXACT) == 0
#include "common_normals.glsl"
#endif

layout(binding = BINDING_CELLS) uniform samplerBuffer cells;

/* Affine: texture coordinates, linear over triangles of a polygon as published. Exact: b1, b2 and w, as
 * linear, and the weights of the tops 1 and 2 in the point, of which common_prism.glsl makes them. */
out vec3 uvw;
#if (VARIANT & FLAG_EXACT) != 0
out vec2 tops;
flat out vec2 uv_origin;
flat out uint prism_cell;
#elif (VARIANT & FLAG_LIT) != 0
flat out mat3 to_world;
#endif

vec3 prism_vertex(int prism, int vertex) {
    /* Bottoms are the first cell's, tops the last one's 1..3. */
    int cell = 3 * prism + (vertex < 3 ? 0 : 2);
    return texelFetch(cells, cell * CELL_TEXELS + (vertex < 3 ? vertex : vertex - 2)).xyz;
}

/* u and v of the prism's three corners. */
void prism_uv(int prism, out vec2 uv0, out vec2 u1, out vec2 u2) {
    int at = 3 * prism * CELL_TEXELS;
    uv0 = vec2(texelFetch(cells, at).w, texelFetch(cells, at + 1).w);
    u1 = vec2(texelFetch(cells, at + 2).w, texelFetch(cells, at + 3).w);
    u2 = vec2(texelFetch(cells, at + 5).w, texelFetch(cells, at + 6).w);
}

/* What holds for all of a prism. One map for normals: that of its middle layer, with the mean of its
 * normal edges; the exact map gives each place its own. */
void set_prism(int prism) {
#if (VARIANT & FLAG_EXACT) != 0
    vec2 u1, u2;
    prism_uv(prism, uv_origin, u1, u2);
    prism_cell = 3u * uint(prism);
    tops = uvw.z * uvw.xy; /* at corners, which lie on edges; in between it is linear */
#elif (VARIANT & FLAG_LIT) != 0
    vec2 uv0, u1, u2;
    prism_uv(prism, uv0, u1, u2);
    vec3 b0 = prism_vertex(prism, 0), b1 = prism_vertex(prism, 1), b2 = prism_vertex(prism, 2);
    vec3 t0 = prism_vertex(prism, 3), t1 = prism_vertex(prism, 4), t2 = prism_vertex(prism, 5);
    vec3 up = ((t0 - b0) + (t1 - b1) + (t2 - b2)) / 3.0;
    vec3 e1 = ((b1 - b0) + (t1 - t0)) / 2.0, e2 = ((b2 - b0) + (t2 - t0)) / 2.0;
    to_world = normal_map(e1, e2, up, vec3(u1, 0.0), vec3(u2, 0.0), vec3(0.0, 0.0, 1.0));
#endif
}

/* The ends of an edge of slice.h, a < b: 0..2 lower (01 12 02), 3..5 upper, 6..8 normal. */
void edge_ends(int edge, out int a, out int b) {
    int side = edge % 3, low = side == 1 ? 1 : 0, high = side == 0 ? 1 : 2;
    a = edge < 3 ? low : edge < 6 ? low + 3 : edge - 6;
    b = edge < 3 ? high : edge < 6 ? high + 3 : edge - 3;
}

/* Distance of a vertex behind the plane, both relative to the shell's centre. */
float distance_of(vec3 vertex, float plane) {
    precise float d = dot(frame[FRAME_H_ROW].xyz, vertex) - plane;
    return d;
}

/* How far from a to b the plane cuts. Every prism goes along an edge from the same end (slice.h), so
 * neighbours get the same point, to the bit. */
float cut_at(float d_a, float d_b) {
    float whole = d_a - d_b;
    return whole != 0.0 ? clamp(d_a / whole, 0.0, 1.0) : 0.5;
}

/* The corner of a polygon where the plane cuts the edge from vertex a to b, a < b. */
void place_corner(int prism, int a, int b, float plane) {
    vec3 p_a = prism_vertex(prism, a), p_b = prism_vertex(prism, b);
    float s = cut_at(distance_of(p_a, plane), distance_of(p_b, plane));
    vec3 p = p_a + s * (p_b - p_a);
#if (VARIANT & FLAG_EXACT) != 0
    vec2 uv0 = vec2(0.0), u1 = vec2(1.0, 0.0), u2 = vec2(0.0, 1.0);
#else
    vec2 uv0, u1, u2;
    prism_uv(prism, uv0, u1, u2);
#endif
    int i = a % 3, j = b % 3;
    vec2 uv_a = i == 0 ? vec2(0.0) : i == 1 ? u1 : u2;
    vec2 uv_b = j == 0 ? vec2(0.0) : j == 1 ? u1 : u2;
    float w_a = a < 3 ? 0.0 : 1.0, w_b = b < 3 ? 0.0 : 1.0;
    uvw = vec3(uv0 + mix(uv_a, uv_b, s), mix(w_a, w_b, s));
    set_prism(prism);
    float h = plane + frame[FRAME_H_ROW].w; /* the same all over the polygon */
    float w = frame[FRAME_MATERIAL].w != 0.0 ? 1.0 : h;
    gl_Position = vec4((dot(frame[FRAME_X_ROW], vec4(p, 1.0))) / w,
                       (dot(frame[FRAME_Y_ROW], vec4(p, 1.0))) / w,
                       DEPTH_OF_T(plane + frame[FRAME_OU].w, frame[FRAME_O0].w), 1.0);
}
