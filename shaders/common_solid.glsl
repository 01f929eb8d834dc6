/* Solids: the first point along a segment of a ray where the solid field s reaches 1/2, and what it looks
 * like there. */
#include "common_prism.glsl"
#if (VARIANT & FLAG_LIT) != 0
#include "common_light.glsl"
#endif

#include "common_leap.glsl"

layout(binding = BINDING_SOLID) uniform sampler3D solid;
#if (VARIANT & FLAG_LIT) != 0
layout(binding = BINDING_SOLID_GRADIENT) uniform sampler3D solid_gradient;
#endif

/* Along one segment; `span` is its length in object units. True where the surface is met, `where` then
 * in [0, 1]: 0 if the segment begins inside. `whole` becomes false where the driver ended the search:
 * llvmpipe lets all loops of an invocation turn 65,535 times together, and then ends them without a
 * word. */
bool find_solid(inout Way way, float span, out float where, inout bool whole) {
    /* March to the first sample inside, entry included. The bounds on the loops are uniforms: a count
     * from interpolants can run away. [low, high] brackets the surface, s_out and s_in are there. */
    vec3 q = way_at(way, 0.0);
    float s_out = texture(solid, q).a, s_in = s_out, low = 0.0, high = 0.0, at = 0.0;
    bool found = s_in >= 0.5;
#if (VARIANT & FLAG_DDA) != 0
    /* Between planes of voxel centres s is a cubic along the ray. It is asked in the middle of each voxel and
     * at its end; where the parabola through three samples tells of a top between them that may reach 1/2, it is
     * asked there too. A cubic is off its parabola by 0.05 times its bend's change, of 4 at the most. */
    const float off = 0.2;
    float start = 0.0, middle = 0.0, end = 0.0, top_at = -1.0;
    float s_start = s_out, s_middle = s_out, s_last = s_out;
    do {
        bool tops = top_at >= 0.0, second = !tops && at < end, first = !tops && !second, empty;
        float on = leap_from(q, way_voxels(way), 1.0e30, at, empty);
        start = first ? at : start;
        s_start = first ? s_last : s_start;
        end = first ? at + on : end;
        float here = tops ? top_at : second || empty ? end : at + 0.5 * on;
        vec3 q_here = way_at(way, here);
        float s = texture(solid, q_here).a;
        bool enters = !found && s >= 0.5, later = second || (tops && top_at > middle);
        low = enters ? (later ? middle : start) : low;
        s_out = enters ? (later ? s_middle : s_start) : s_out;
        high = enters ? here : high;
        s_in = enters ? s : s_in;
        found = found || enters;
        float tilt = s_start - s, bend = min(s_start - 2.0 * s_middle + s, -1.0e-20);
        float top = s_middle - tilt * tilt / (8.0 * bend), aside = 0.5 * tilt / bend;
        top_at = second && abs(aside) < 1.0 && top >= 0.5 - off ? middle + aside * (here - middle) : -1.0;
        middle = first ? here : middle;
        s_middle = first ? s : s_middle;
        at = tops ? at : here;
        q = tops ? q : q_here;
        s_last = tops ? s_last : s;
    } while ((at < 1.0 || top_at >= 0.0) && !found);
#else
#if (VARIANT & FLAG_LEAP) == 0
    float steps = clamp(ceil(span * STEP_RATE), 1.0, frame[FRAME_STEP].z), i = 0.0;
#endif
    do {
#if (VARIANT & FLAG_LEAP) != 0
        bool empty;
        at += leap_from(q, way_voxels(way), frame[FRAME_OV].w, at, empty);
#else
        i += 1.0;
        at = i / steps;
#endif
        q = way_at(way, at);
        float s = texture(solid, q).a;
        bool enters = !found && s >= 0.5;
        low = found || enters ? low : at;
        s_out = found || enters ? s_out : s;
        high = enters ? at : high;
        s_in = enters ? s : s_in;
        found = found || enters;
    } while (at < 1.0 && !found);
#endif
    whole = whole && (found || at >= 1.0);
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
