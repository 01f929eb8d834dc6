/* One tetrahedron along one ray: entry and exit, and what lies between.
 * After Dufort, Leblanc & Poulin 2005, sections 4.2 and 4.3.
 *
 * Entry and exit come from the barycentric coordinates, which are affine along the ray:
 * lambda_k(t) = a_k + b_k t >= 0 bounds t from below where b_k > 0 and from above where b_k < 0.
 * The ray is moved to its point nearest to the tetrahedron's first vertex before anything is
 * subtracted, so that the length of a segment is as exact as the tetrahedron is small; what the
 * move rounds shifts the ray, for all faces alike.
 *
 * Media: dL/ds = -sigma L + sigma c, exact for a constant sigma in each step (midpoint rule, second
 * order). The paper's alpha_i = 1 - (1 - alpha_t)^(dt |V|) is the same in terms of
 * tau = -log(1 - alpha). Optical depth is summed apart from colour (OUT_DEPTH is blended by adding,
 * OUT_THROUGH multiplies what lies behind), so that neither thin nor thick media lose digits. */
#include "common_frame.glsl"
#include "common_sample.glsl"
#include "common_math.glsl"
#if (VARIANT & FLAG_LIT) != 0
#include "common_light.glsl"
#endif

layout(binding = BINDING_CELLS) uniform samplerBuffer cells;
#if (VARIANT & FLAG_MEDIUM) != 0
layout(binding = BINDING_MEDIUM) uniform sampler3D medium;
#if (VARIANT & FLAG_LIT) != 0
layout(binding = BINDING_MEDIUM_GRADIENT) uniform sampler3D medium_gradient;
#endif
#endif
#if (VARIANT & FLAG_SOLID) != 0
layout(binding = BINDING_SOLID) uniform sampler3D solid;
#if (VARIANT & FLAG_LIT) != 0
layout(binding = BINDING_SOLID_GRADIENT) uniform sampler3D solid_gradient;
#endif
#endif
#if (VARIANT & FLAG_OCCLUDED) != 0
layout(binding = BINDING_OCCLUDER) uniform sampler2D occluder;
#endif

#if (VARIANT & FLAG_SOLID) == 0
/* What lies wholly behind something opaque is dropped before it is shaded. */
layout(early_fragment_tests) in;
#endif

flat in uint cell;

/* rgb: radiance, premultiplied; a: optical depth. */
layout(location = 0, index = 0) out vec4 picture;
#if (VARIANT & FLAG_SOLID) == 0
layout(location = 0, index = 1) out vec4 through; /* a: transmittance, the blend factor */
#endif

struct Tetra {
    vec3 v0, g1, g2, g3;     /* first vertex; gradients of lambda_1..3 */
    vec3 uvw0, e1, e2, e3;   /* texture coordinates: at v0, and toward the others */
};

Tetra fetch_tetra() {
    int at = int(cell) * CELL_TEXELS;
    vec4 a = texelFetch(cells, at), b = texelFetch(cells, at + 1), c = texelFetch(cells, at + 2);
    vec4 d = texelFetch(cells, at + 3), e = texelFetch(cells, at + 4), f = texelFetch(cells, at + 5);
    return Tetra(a.xyz, b.xyz, c.xyz, d.xyz, vec3(a.w, b.w, c.w), vec3(d.w, e.xy), vec3(e.zw, f.x),
                 f.yzw);
}

void bound(float a, float b, inout float t_in, inout float t_out) {
    float t = -a / b;
    t_in = b > 0.0 ? max(t_in, t) : t_in;
    t_out = b < 0.0 ? min(t_out, t) : t_out;
    t_out = b == 0.0 && a < 0.0 ? -1.0e38 : t_out;
}

#if (VARIANT & FLAG_LIT) != 0
/* A covector from texture space to the world: the inverse transpose of the cell's map, which is the
 * transpose of its inverse, whose rows the gradients of lambda give. */
vec3 normal_from_texture(Tetra cell_data, vec3 per_voxel) {
    vec3 g = per_voxel * frame[FRAME_SIZE].xyz;
    return world_normal(cell_data.g1 * dot(cell_data.e1, g) + cell_data.g2 * dot(cell_data.e2, g) +
                        cell_data.g3 * dot(cell_data.e3, g));
}
#endif

void main() {
    vec2 p = sample_position();
    vec3 d = ray_direction(p);
    Tetra tetra = fetch_tetra();
    vec3 o = ray_origin(p) - tetra.v0;
    float t_near = -dot(o, d) / dot(d, d);
    o += t_near * d;

    float a1 = dot(tetra.g1, o), b1 = dot(tetra.g1, d);
    float a2 = dot(tetra.g2, o), b2 = dot(tetra.g2, d);
    float a3 = dot(tetra.g3, o), b3 = dot(tetra.g3, d);
    float t_in = -1.0e38, t_out = 1.0e38;
    bound(1.0 - a1 - a2 - a3, -b1 - b2 - b3, t_in, t_out);
    bound(a1, b1, t_in, t_out);
    bound(a2, b2, t_in, t_out);
    bound(a3, b3, t_in, t_out);
#if (VARIANT & FLAG_EYE_INSIDE) != 0
    t_in = max(t_in, -1.0 - t_near);
#endif
#if (VARIANT & FLAG_OCCLUDED) != 0
    float z = texelFetch(occluder, ivec2(gl_FragCoord.xy), 0).r;
    t_out = z > 0.0 ? min(t_out, T_OF_DEPTH(z) - t_near) : t_out;
#endif
    if (!(t_in < t_out))
        discard;
    float speed = length(d);
    float span = (t_out - t_in) * speed;

#if (VARIANT & FLAG_HOMOGENEOUS) != 0
    float tau = frame[FRAME_CONSTANT].w * span;
    picture = vec4(frame[FRAME_CONSTANT].rgb * one_minus_exp(tau), tau);
    through = vec4(exp(-tau));
#else
    vec3 at_in = tetra.uvw0 + (a1 + t_in * b1) * tetra.e1 + (a2 + t_in * b2) * tetra.e2 +
                 (a3 + t_in * b3) * tetra.e3;
    vec3 along = (t_out - t_in) * (b1 * tetra.e1 + b2 * tetra.e2 + b3 * tetra.e3);
    /* The bound on the loop is a uniform: a count from interpolants can run away. */
    float steps = clamp(ceil(span * frame[FRAME_STEP].x), 1.0, frame[FRAME_STEP].z);
#if (VARIANT & FLAG_LIT) != 0
    vec3 v = view_vector(p);
#endif

#if (VARIANT & FLAG_MEDIUM) != 0
    float length_scaled = span / steps * frame[FRAME_STEP].y;
    vec3 color = vec3(0.0);
    float tau = 0.0, left = 1.0, i = 0.5;
    do {
        vec3 q = at_in + along * (i / steps);
        vec4 m = texture(medium, q); /* extinction-weighted colour, extinction */
        vec3 source = m.rgb / max(m.a, 1.0e-30);
#if (VARIANT & FLAG_LIT) != 0
        vec3 gradient = texture(medium_gradient, q).xyz;
        float g = length(gradient);
        vec3 n = normal_from_texture(tetra, gradient);
        n *= inversesqrt(max(dot(n, n), 1.0e-30));
        source = lit(source, n, v, g / (g + 0.01));
#endif
        float tau_i = m.a * length_scaled;
        float lost = left * one_minus_exp(tau_i);
        color += lost * source;
        left -= lost;
        tau += tau_i;
    } while ((i += 1.0) < steps);
    picture = vec4(color, tau);
    through = vec4(exp(-tau));
#endif

#if (VARIANT & FLAG_SOLID) != 0
    /* March to the first sample inside (s >= 1/2), entry included. */
    float s_out = texture(solid, at_in).a, s_in = s_out;
    float low = 0.0, high = 0.0, i = 0.0;
    bool found = s_in >= 0.5;
    do {
        i += 1.0;
        float at = i / steps;
        float s = texture(solid, at_in + along * at).a;
        bool enters = !found && s >= 0.5;
        low = found || enters ? low : at;
        s_out = found || enters ? s_out : s;
        high = enters ? at : high;
        s_in = enters ? s : s_in;
        found = found || enters;
    } while (i < steps);
    if (!found)
        discard;
    bool at_boundary = high == 0.0;
    /* Close in: s is nearly linear within a voxel, so regula falsi with a bisection every other
     * step gains at least half of the bracket in two, and mostly far more. */
    int k = 0;
    do {
        float by_value = low + (high - low) * (0.5 - s_out) / max(s_in - s_out, 1.0e-6);
        float middle = (k & 1) == 0 ? by_value : 0.5 * (low + high);
        middle = clamp(middle, low, high);
        float s = texture(solid, at_in + along * middle).a;
        bool inside = s >= 0.5;
        high = inside ? middle : high;
        s_in = inside ? s : s_in;
        low = inside ? low : middle;
        s_out = inside ? s_out : s;
    } while (++k < 6);
    vec3 q = at_in + along * high;
    vec4 m = texture(solid, q); /* s-weighted colour, s */
    vec3 source = m.rgb / max(m.a, 1.0e-30);
#if (VARIANT & FLAG_LIT) != 0
    vec3 n = normal_from_texture(tetra, texture(solid_gradient, q).xyz);
    /* Cut open by the shell's boundary, where s need not change at all: the face entered. */
    float l0 = -(b1 + b2 + b3), l = 0.0;
    vec3 face = vec3(0.0);
    float t_face = -1.0e38;
    float t0 = l0 > 0.0 ? -(1.0 - a1 - a2 - a3) / l0 : -1.0e38;
    face = t0 > t_face ? tetra.g1 + tetra.g2 + tetra.g3 : face;
    t_face = max(t_face, t0);
    float t1 = b1 > 0.0 ? -a1 / b1 : -1.0e38;
    face = t1 > t_face ? -tetra.g1 : face;
    t_face = max(t_face, t1);
    float t2 = b2 > 0.0 ? -a2 / b2 : -1.0e38;
    face = t2 > t_face ? -tetra.g2 : face;
    t_face = max(t_face, t2);
    float t3 = b3 > 0.0 ? -a3 / b3 : -1.0e38;
    face = t3 > t_face ? -tetra.g3 : face;
    n = at_boundary && !(dot(n, v) > 0.0) ? world_normal(face) : n;
    n *= inversesqrt(max(dot(n, n), 1.0e-30));
    source = lit(source, n, v, 1.0);
#endif
    picture = vec4(source, OPAQUE_DEPTH);
    gl_FragDepth = DEPTH_OF_T(t_near + t_in + (t_out - t_in) * high);
#endif
#endif
}
