/* Light along a segment of a ray through voxels: dL/ds = -sigma L + sigma c, exact for a constant sigma
 * in each step (midpoint rule, second order). Dufort et al. 2005, section 4.3: their
 * alpha_i = 1 - (1 - alpha_t)^(dt |V|) is the same in terms of tau = -log(1 - alpha).
 *
 * FLAG_FILL: dL/ds = -(sigma + A) L + sigma c + g sigma c_voxel + Q, the shell's absorption and emission and
 * its voxels' glow (section 5.3: "light is added in the integral, resulting in a glow effect"), exact for
 * constants as the rest is: a step of the length h adds h (sigma c + ...) mean_exp((sigma + A) h). FLAG_TINT:
 * sigma and A are times a factor in each channel, in all terms but Q. */
#include "common_math.glsl"
#include "common_through.glsl"
#include "common_prism.glsl"
#if (VARIANT & FLAG_LIT) != 0
#if (VARIANT & FLAG_FILTER_VIEW) != 0 && (VARIANT & FLAG_STRANDS) == 0
#include "common_moments.glsl"
#endif
#include "common_light.glsl"
#endif

layout(binding = BINDING_MEDIUM) uniform sampler3D medium;
#if (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_STRANDS) == 0
layout(binding = BINDING_MEDIUM_GRADIENT) uniform sampler3D medium_gradient;
#endif

#include "common_filter.glsl"
#include "common_strands.glsl"
#include "common_leap.glsl"

/* What has been gathered, from the front: radiance, optical depth, what is let through; and whether
 * all of it was: llvmpipe lets all loops of an invocation turn 65,535 times together, and then ends
 * them without a word. */
#if (VARIANT & FLAG_TINT) != 0
#define CHANNELS vec3 /* of what is let through */
#else
#define CHANNELS float
#endif
struct Ray {
    vec3 color;
    CHANNELS tau, left;
    bool whole;
};
#define RAY_BEGINS Ray(vec3(0.0), CHANNELS(0.0), CHANNELS(1.0), true)

float most_left(Ray ray) {
#if (VARIANT & FLAG_TINT) != 0
    return most_of(ray.left);
#else
    return ray.left;
#endif
}

/* Along one segment; `span` is its length in object units, `v` points toward the viewer. */
void march(inout Ray ray, inout Way way, float span, vec3 v) {
    /* The bound on the loop is a uniform: a count from interpolants can run away. */
    float span_scaled = span * frame[FRAME_STEP].y;
#if (VARIANT & FLAG_TINT) != 0
    vec3 tint = frame[FRAME_GLOW].yzw;
    float tint_most = most_of(tint);
#endif
#if (VARIANT & FLAG_FILL) != 0
    vec3 emission = frame[FRAME_FILL].rgb;
    float glow = frame[FRAME_GLOW].x, absorption = frame[FRAME_FILL].w;
#endif
#if (VARIANT & FLAG_AMBIENT) != 0
    vec3 around = frame[FRAME_AMBIENT].rgb;
#endif
#if (VARIANT & FLAG_LEAP) != 0
    /* At where a step begins and how far it goes, as shares of the segment; the sample is in its middle. */
    float at = 0.0, most = frame[FRAME_OV].w, on;
    bool empty;
    vec3 begin = way_at(way, 0.0), voxels = way_voxels(way);
    do {
        on = leap_from(begin, voxels, most, at, empty);
        vec3 q = way_at(way, at + 0.5 * on);
        begin = q + 0.5 * on * way_rate(way);
        voxels = way_voxels(way);
        float length_scaled = on * span_scaled;
#define IN_STEP(tau) place_in_step(at / on + 0.5, 1.0 / on, tau)
#else
    float steps = clamp(ceil(span * STEP_RATE), 1.0, frame[FRAME_STEP].z), i = 0.5;
    float length_scaled = span_scaled / steps;
    do {
        vec3 q = way_at(way, i / steps);
#define IN_STEP(tau) place_in_step(i, steps, tau)
#endif
        vec4 m = medium_at(q); /* extinction-weighted colour, extinction */
        vec3 source = m.rgb * (1.0 / max(m.a, 1.0e-30));
        float tau_i = m.a * length_scaled;
#if (VARIANT & FLAG_FILL) != 0
        tau_i += absorption * length_scaled;
#endif
#if (VARIANT & FLAG_TINT) != 0
        /* Light is asked for at one place: where it is right for the channel that loses most. Another is
         * off by what it loses itself. */
#define TAU_LIT (tint_most * tau_i)
#else
#define TAU_LIT tau_i
#endif
#if (VARIANT & FLAG_STRANDS) != 0
        float weight;
        vec3 tangent = strand_at(way, q, weight);
        source = lit(source, tangent, v, weight, IN_STEP(TAU_LIT));
#elif (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_FILTER_VIEW) != 0
        float weight = normals_at(way, q);
        source = lit(source, vec3(0.0), v, weight, IN_STEP(TAU_LIT));
#elif (VARIANT & FLAG_LIT) != 0
        vec3 gradient = gradient_at(q);
        float g = length(gradient);
        vec3 n = way_normal(way, gradient);
        n *= inversesqrt(max(dot(n, n), 1.0e-37));
        source = lit(source, n, v, g / (g + 0.01), IN_STEP(TAU_LIT));
#elif (VARIANT & FLAG_AMBIENT) != 0
        source *= around;
#endif
#if (VARIANT & FLAG_TINT) != 0
        vec3 taus = tint * tau_i, lost = ray.left * one_minus_exp(taus);
#if (VARIANT & FLAG_FILL) != 0
        vec3 given = tint * (m.a * source + glow * m.rgb) + emission;
        ray.color += ray.left * length_scaled * mean_exp(taus) * given;
#else
        ray.color += lost * source;
#endif
        ray.left -= lost;
        ray.tau += taus;
#elif (VARIANT & FLAG_FILL) != 0
        vec3 given = m.a * source + glow * m.rgb + emission;
        ray.color += ray.left * length_scaled * mean_exp(tau_i) * given;
        ray.left -= ray.left * one_minus_exp(tau_i);
        ray.tau += tau_i;
#else
        float lost = ray.left * one_minus_exp(tau_i);
        ray.color += lost * source;
        ray.left -= lost;
        ray.tau += tau_i;
#endif
#if (VARIANT & FLAG_LEAP) != 0
    } while ((at += on) < 1.0);
    ray.whole = ray.whole && at >= 1.0;
#else
    } while ((i += 1.0) < steps);
    ray.whole = ray.whole && i >= steps;
#endif
}
