/* Solids: the first point along a segment of a ray where the solid field s reaches 1/2, and what it looks
 * like there. */
#include "common_prism.glsl"
#if (VARIANT & FLAG_LIT) != 0
#include "common_light.glsl"
#endif

layout(binding = BINDING_SOLID) uniform sampler3D solid;
#if (VARIANT & FLAG_LIT) != 0
layout(binding = BINDING_SOLID_GRADIENT) uniform sampler3D solid_gradient;
#endif

/* Along one segment; `span` is its length in object units. True where the surface is met, `where` then
 * in [0, 1]: 0 if the segment begins inside. `whole` becomes false where the driver ended the search:
 * llvmpipe lets all loops of an invocation turn 65,535 times together, and then ends them without a
 * word. */
bool find_solid(inout Way way, float span, out float where, inout bool whole) {
    /* March to the first sample inside, entry included. The bound on the loop is a uniform: a count
     * from interpolants can run away. */
    float steps = clamp(ceil(span * STEP_RATE), 1.0, frame[FRAME_STEP].z);
    float s_out = texture(solid, way_at(way, 0.0)).a, s_in = s_out;
    float low = 0.0, high = 0.0, i = 0.0;
    bool found = s_in >= 0.5;
    do {
        i += 1.0;
        float at = i / steps;
        float s = texture(solid, way_at(way, at)).a;
        bool enters = !found && s >= 0.5;
        low = found || enters ? low : at;
        s_out = found || enters ? s_out : s;
        high = enters ? at : high;
        s_in = enters ? s : s_in;
        found = found || enters;
    } while (i < steps && !found);
    whole = whole && (found || i >= steps);
    /* Close in: s is nearly linear within a voxel, so regula falsi with a bisection every other
     * step gains at least half of the bracket in two, and mostly far more. */
    int k = found && high > 0.0 ? 0 : 6;
    while (k < 6) {
        float by_value = low + (high - low) * (0.5 - s_out) / max(s_in - s_out, 1.0e-6);
        float middle = (k & 1) == 0 ? by_value : 0.5 * (low + high);
        middle = clamp(middle, low, high);
        float s = texture(solid, way_at(way, middle)).a;
        bool inside = s >= 0.5;
        high = inside ? middle : high;
        s_in = inside ? s : s_in;
        low = inside ? low : middle;
        s_out = inside ? s_out : s;
        k++;
    }
    /* The estimate between the ends, not the inner end: that one may not have moved for long. */
    where = low + (high - low) * clamp((0.5 - s_out) / max(s_in - s_out, 1.0e-6), 0.0, 1.0);
    return found;
}

/* The surface's colour at texture coordinates q, lit, `f` being the share of the segment there. `cut`, in the world, is the normal to use where
 * the shell's boundary cuts the solid open, since s need not change there at all. */
vec3 shade_solid(vec3 q, float f, mat3 to_world, vec3 v, bool at_boundary, vec3 cut) {
    vec4 m = texture(solid, q); /* s-weighted colour, s */
    vec3 source = m.rgb / max(m.a, 1.0e-30);
#if (VARIANT & FLAG_LIT) != 0
    vec3 n = to_world * texture(solid_gradient, q).xyz;
    n = at_boundary && !(dot(n, n) > 1.0e-12) ? (dot(cut, v) < 0.0 ? -cut : cut) : n;
    source = lit(source, n * inversesqrt(max(dot(n, n), 1.0e-37)), v, 1.0, place_at(f));
#elif (VARIANT & FLAG_AMBIENT) != 0
    source *= frame[FRAME_AMBIENT].rgb;
#endif
    return source;
}
