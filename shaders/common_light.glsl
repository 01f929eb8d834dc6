/* Light as the design defines it ("One truth", Light): colour x (ambient + sum L max(0, n.l))
 * + specular x sum L max(0, n.h)^shininess, without 1/pi. Blinn 1977 for the half vector.
 * `weight` is 1 on surfaces; a medium weighs the directional terms by it, and what is left over comes
 * evenly from all around: sum L / 4, the mean of max(0, n.l) over the sphere. `material`: specular,
 * shininess. `place` is the point, in the object's space: where nothing asks for it (place_at() below) it
 * is 0. L is what arrives there: common_shadow.glsl. */
#if (VARIANT & FLAGS_PLACE) != 0
#if (VARIANT & FLAG_SOLID) != 0 || defined(SURFACE)
#define SHADOW_ON_SURFACE
#endif
#include "common_shadow.glsl"

/* Along the segment that is being shaded: where it begins, and from there to its end; set by who knows. */
vec3 place_in = vec3(0.0), place_on = vec3(0.0);
vec3 place_at(float f) {
    return place_in + f * place_on;
}

/* The same in step i + 1/2 of a medium, which has the optical depth tau: where light that comes by as
 * much of the medium as the eye sees through is what all of the step gives, by its emission's weights:
 * int exp(-2 s) ds / int exp(-s) ds over [0, tau] = (1 + exp(-tau)) / 2 = exp(-f tau). Half way in thin
 * steps (f = 1/2 - tau / 8 + ...); in one that lets nothing through, half way would be in the dark. */
vec3 place_in_step(float i, float steps, float tau) {
    float f = tau > 1.0e-2 ? log(2.0 / (1.0 + exp(-tau))) / tau : 0.5 - tau / 8.0;
    return place_at((i - 0.5 + f) / steps);
}
#else
#define place_at(f) vec3(0.0)
#define place_in_step(i, steps, tau) vec3(0.0)
#endif

/* Strands (Kajiya & Kay 1989, section 5.1: a thin cylinder of Lambert's material): n is the tangent t,
 * and the cosine gives way to sin(t, l), the highlight's to cos(theta_v - theta_r), with theta_r the angle
 * to t of the cone onto which a cylinder reflects: that on the other side of its cross-section, so of
 * -l. In their formula, (t.l t.v + sin(t, l) sin(t, v))^p, l so points the way that light travels;
 * here it points toward the light, which is the minus below. What is left over is the mean of sin(t, l)
 * over the sphere, pi / 4. Sines by cross products: 1 - cos^2 has no digits along a strand. */
#if (VARIANT & FLAG_STRANDS) != 0
#ifdef SLOTS
bool by_strand = false; /* of the slot that is being shaded */
#else
const bool by_strand = true;
#endif
#endif

/* Read before all loops (common_frame.glsl). One light, without FLAG_LIGHTS, takes no loop of its own. */
vec3 ambient = frame[FRAME_AMBIENT].rgb;
#if (VARIANT & FLAGS_PLACE) == 0
vec3 light_sum = frame[FRAME_LIGHT_SUM].rgb;
#endif
#if (VARIANT & FLAG_LIGHTS) == 0
vec3 only_light = frame[FRAME_LIGHT_DIR].xyz, only_color = frame[FRAME_LIGHT_COLOR].rgb;
#endif

/* `flat_n`: the normal of the surface itself, where n is interpolated. */
vec3 lit_by(vec3 color, vec3 n, vec3 flat_n, vec3 v, float weight, vec2 material, vec3 place) {
    vec3 diffuse = vec3(0.0), gloss = vec3(0.0), even = vec3(0.0);
    int i = 0;
#if (VARIANT & FLAG_POINT) != 0
    vec3 here = vec3(dot(shadow[SHADOW_WORLD].xyz, place) + shadow[SHADOW_WORLD].w,
                     dot(shadow[SHADOW_WORLD + 1].xyz, place) + shadow[SHADOW_WORLD + 1].w,
                     dot(shadow[SHADOW_WORLD + 2].xyz, place) + shadow[SHADOW_WORLD + 2].w);
#endif
#if (VARIANT & FLAG_LIGHTS) != 0
    int count = int(frame[FRAME_AMBIENT].w);
    do {
        vec3 l = frame[FRAME_LIGHT_DIR + i].xyz, radiance = frame[FRAME_LIGHT_COLOR + i].rgb;
#else
    {
        vec3 l = only_light, radiance = only_color;
#endif
#if (VARIANT & FLAG_POINT) != 0
        vec4 point = shadow[SHADOW_POINT + i];
        vec3 to = point.xyz - here;
        float d2 = dot(to, to);
        l = point.w > 0.0 ? to * inversesqrt(max(d2, 1.0e-37)) : l;
        radiance *= point.w > 0.0 ? 1.0 / max(d2, point.w) : 1.0;
#endif
#if (VARIANT & FLAGS_SHADOW) != 0
#if (VARIANT & FLAG_POINT) != 0
        radiance *= shadow_arrives(i, place, flat_n, -to);
#else
        radiance *= shadow_arrives(i, place, flat_n, vec3(0.0));
#endif
#endif
#if (VARIANT & FLAGS_PLACE) != 0
        even += 0.25 * radiance;
#endif
        float facing = max(0.0, dot(n, l));
#if (VARIANT & FLAG_STRANDS) != 0
        float along = dot(n, l), aside = length(cross(n, l));
        facing = by_strand ? aside : facing;
#endif
#if (VARIANT & FLAG_FILTER_VIEW) != 0 && (VARIANT & FLAG_STRANDS) == 0
        facing = moments_lambert(l);
#endif
        diffuse += radiance * facing;
#if (VARIANT & FLAG_SPECULAR) != 0
        /* pow(0, 0) is undefined, and the half vector of opposite directions has no length. */
        vec3 h = l + v;
        float c = dot(n, h) * inversesqrt(max(dot(h, h), 1.0e-20));
#if (VARIANT & FLAG_STRANDS) != 0
        c = by_strand ? aside * length(cross(n, v)) - along * dot(n, v) : c;
#endif
#if (VARIANT & FLAG_FILTER_VIEW) != 0 && (VARIANT & FLAG_STRANDS) == 0
        gloss += radiance * moments_gloss(h * inversesqrt(max(dot(h, h), 1.0e-20)), material.y);
#else
        gloss += c > 0.0 ? radiance * pow(max(c, 1.0e-20), material.y) : vec3(0.0);
#endif
#endif
    }
#if (VARIANT & FLAG_LIGHTS) != 0
    while (++i < min(count, LIGHTS_MAX));
#endif
#if (VARIANT & FLAGS_PLACE) == 0
    even = light_sum;
#endif
#if (VARIANT & FLAG_STRANDS) != 0
    even *= by_strand ? 3.14159265 : 1.0;
#endif
    return color * (ambient + weight * diffuse + (1.0 - weight) * even) +
           weight * material.x * gloss;
}

vec3 lit(vec3 color, vec3 n, vec3 v, float weight, vec3 place) {
    return lit_by(color, n, n, v, weight, frame[FRAME_MATERIAL].xy, place);
}
