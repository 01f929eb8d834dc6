/* Walking from cell to cell: the tables, and how a ray leaves a cell. After common_frame.glsl.
 *
 * Faces are met as planes, lambda_k(t) = a_k + b_k t, and the walk leaves a cell by the first of those
 * that the ray is leaving (b_k < 0). A ray that has entered beside the face by rounding is at once
 * handed on across the face that it lies beyond: it is never lost; being in one cell at a time it
 * never counts a stretch twice; and as each stretch begins where the last ended, lengths add up. */
layout(binding = BINDING_CELLS) uniform samplerBuffer cells;
layout(binding = BINDING_LINKS) uniform usamplerBuffer links;  /* across each face */
layout(binding = BINDING_FIRST) uniform usamplerBuffer firsts; /* a sample's first entry */
#if (VARIANT & FLAG_OCCLUDED) != 0
layout(binding = BINDING_OCCLUDER) uniform sampler2D occluder;
#endif

/* t of what is opaque at this sample; far away where nothing is. */
float stop_at_occluder() {
    float t_stop = 1.0e38;
#if (VARIANT & FLAG_OCCLUDED) != 0
    float z = texelFetch(occluder, ivec2(gl_FragCoord.xy), 0).r;
    t_stop = z > 0.0 ? T_HIDDEN(z, frame[FRAME_O0].w) : t_stop;
#endif
    return t_stop;
}

/* A cell (renderer/shell/entries.h) and a ray through it: lambda_k(t) = a[k] + b[k] (t - near), `near`
 * being the ray's point nearest to the first vertex, so that t is as exact as the cell is small. */
struct Cell {
    vec4 c0, c1, c2, c3;
    vec4 a, b;
    float near;
};

Cell fetch_cell(int cell, vec3 origin, vec3 d) {
    int at = cell * WALK_TEXELS;
    Cell c;
    c.c0 = texelFetch(cells, at);
    c.c1 = texelFetch(cells, at + 1);
    c.c2 = texelFetch(cells, at + 2);
    c.c3 = texelFetch(cells, at + 3);
    vec3 o = origin - c.c0.xyz;
    c.near = -dot(o, d) / dot(d, d);
    o += c.near * d;
    float a1 = dot(c.c1.xyz, o), b1 = dot(c.c1.xyz, d);
    float a2 = dot(c.c2.xyz, o), b2 = dot(c.c2.xyz, d);
    float a3 = dot(c.c3.xyz, o), b3 = dot(c.c3.xyz, d);
    c.a = vec4(1.0 - a1 - a2 - a3, a1, a2, a3);
    c.b = vec4(-b1 - b2 - b3, b1, b2, b3);
    return c;
}

/* Texture coordinates at the first vertex, their changes to the others, the scale of normals. */
vec3 fetch_texture(Cell c, int cell, out vec3 u1, out vec3 u2, out vec3 u3, out float scale) {
    int at = cell * WALK_TEXELS;
    vec4 c4 = texelFetch(cells, at + 4), c5 = texelFetch(cells, at + 5);
    u1 = vec3(c.c2.w, c.c3.w, c4.x);
    u2 = c4.yzw;
    u3 = c5.xyz;
    scale = c5.w;
    return vec3(c.c0.w, c.c1.w, 0.0);
}

void leave(uint face, float a, float b, bool entered, inout float t_out, inout uint next_face) {
    float t = -a / b;
    bool first = b < 0.0 && !entered && t < t_out;
    t_out = first ? t : t_out;
    next_face = first ? face : next_face;
}

/* Where (relative to c.near) a ray that came in at t_in through `face` (4: through none) leaves, and
 * what it enters then. No face is left only where the cell has no volume: there it stays. */
float leave_cell(Cell c, int cell, int face, float t_in, out uint next) {
    uvec4 link = texelFetch(links, cell);
    float t_out = 1.0e38;
    uint next_face = 4u;
    leave(0u, c.a.x, c.b.x, face == 0, t_out, next_face);
    leave(1u, c.a.y, c.b.y, face == 1, t_out, next_face);
    leave(2u, c.a.z, c.b.z, face == 2, t_out, next_face);
    leave(3u, c.a.w, c.b.w, face == 3, t_out, next_face);
    next = next_face == 0u   ? link.x
           : next_face == 1u ? link.y
           : next_face == 2u ? link.z
           : next_face == 3u ? link.w
                             : LINK_NONE;
    return t_out < 1.0e37 ? max(t_out, t_in) : t_in;
}
