/* What of a light arrives at a point (api/README.md, "The truth of shadow"), from two maps that the
 * light's own view was drawn into (renderer/path/shadow.h). After common_frame.glsl.
 *
 * Opaque things: a shadow map (Williams 1978) whose texels hold not a depth but a plane: depth at the
 * texel's centre and its slopes. Depths that are compared at another place than they were drawn at
 * are what makes surfaces hide themselves; so nothing is compared but at one place. A point is hidden
 * by a texel's surface where that lies nearer to the light twice: carried along its own plane to the
 * point, and at the texel's centre compared with the plane of the surface that the point lies on. On
 * flat ground both say "equal"; over a convex edge the second, in a concave one the first says that
 * nothing is hidden. What is left is rounding, SHADOW_ROUNDING and the raster's grid, and no bias; but
 * normals of solids are not those of their surfaces, to SHADOW_NORMALS, which a texel away is a depth.
 * A medium has no surface, and asks the first alone. The four texels around the point are mixed.
 *
 * Media: deep opacity maps (Yuksel & Keyser 2008), optical depth from the light to a number of depths
 * in each texel, evenly spread over where that texel's ray meets media in front of what is opaque
 * (Yuksel and Keyser: from the first one on). Range and optical depths are interpolated, so that the
 * slices run along a shell's layers between texels too. A texel holds four depths, of which the last
 * is the first of the next layer's: one fetch brings both ends. */
layout(std140, binding = BINDING_SHADOW) uniform Shadow {
    vec4 shadow[SHADOW_VEC4S];
};

#if (VARIANT & FLAG_SHADOW_OPAQUE) != 0
layout(binding = BINDING_SHADOW_PLANES) uniform sampler2DArray shadow_planes;
#endif
#if (VARIANT & FLAG_SHADOW_MEDIA) != 0
layout(binding = BINDING_SHADOW_DEPTHS) uniform sampler2DArray shadow_depths;
layout(binding = BINDING_SHADOW_RANGES) uniform sampler2DArray shadow_ranges;
#endif

/* How the depth of a plane with the normal n, in the world, changes from texel to texel; 0 where it
 * cannot be said: without a normal, or where it faces away from the light. */
vec2 shadow_slopes(int at, vec3 n) {
    float facing = dot(n, shadow[at + SHADOW_D].xyz);
    vec2 slopes = -vec2(dot(n, shadow[at + SHADOW_U].xyz), dot(n, shadow[at + SHADOW_V].xyz)) / facing;
    return facing < 0.0 ? slopes : vec2(0.0);
}

#if (VARIANT & FLAG_SHADOW_OPAQUE) != 0
/* The share of the texels around (x, y) that hide a point of depth t. `slopes`: of the surface that it
 * lies on, where there is one; `texel_depth`: a texel's width in units of depth. */
float shadow_hidden(int layer, vec2 p, float t, vec2 slopes, float texel_depth) {
    vec2 corner = floor(p - 0.5), f = p - 0.5 - corner;
    float last = shadow[0].x - 1.0, hidden = 0.0;
    float rounding = SHADOW_ROUNDING + dot(abs(slopes), vec2(shadow[0].w));
#if (VARIANT & FLAG_SOLID) != 0
    rounding += SHADOW_NORMALS * (texel_depth + dot(slopes, slopes) / texel_depth);
#endif
    int i = 0;
    do {
        vec2 step_to = vec2(float(i & 1), float(i >> 1));
        vec2 texel = clamp(corner + step_to, vec2(0.0), vec2(last)), from = p - texel - 0.5;
        vec4 plane = texelFetch(shadow_planes, ivec3(ivec2(texel), layer), 0);
        bool nearer = plane.x + dot(plane.yz, from) < t;
#ifdef SHADOW_ON_SURFACE
        nearer = plane.x + dot(plane.yz, from) < t - rounding &&
                 plane.x < t - dot(slopes, from) - rounding;
#endif
        vec2 share = mix(1.0 - f, f, step_to);
        hidden += nearer ? share.x * share.y : 0.0;
    } while (++i < 4);
    return hidden;
}
#endif

#if (VARIANT & FLAG_SHADOW_MEDIA) != 0
/* The optical depth between the light and a point of depth t. */
float shadow_depth(int layer, vec2 p, float t) {
    vec2 uv = p * shadow[0].y;
    float layers = shadow[0].z;
    vec2 range = texture(shadow_ranges, vec3(uv, float(layer))).xy;
    float way = range.y - range.x;
    float s = way > 0.0 ? clamp((t - range.x) / way, 0.0, 1.0) * 3.0 * layers : 0.0;
    float group = min(floor(s / 3.0), layers - 1.0);
    vec4 depth = texture(shadow_depths, vec3(uv, float(layer) * layers + group));
    vec3 part = clamp(s - 3.0 * group - vec3(0.0, 1.0, 2.0), 0.0, 1.0);
    return depth.x + dot(part, depth.yzw - depth.xyz);
}
#endif

/* What arrives of light k at `place`, in the object's space; n: of the surface there, in the world. */
float shadow_arrives(int k, vec3 place, vec3 n) {
    int at = 1 + k * SHADOW_ROWS, layer = int(shadow[at + SHADOW_U].w);
    vec2 p = vec2(dot(shadow[at + SHADOW_X].xyz, place) + shadow[at + SHADOW_X].w,
                  dot(shadow[at + SHADOW_Y].xyz, place) + shadow[at + SHADOW_Y].w);
    float t = dot(shadow[at + SHADOW_T].xyz, place) + shadow[at + SHADOW_T].w;
    float arrives = 1.0;
#if (VARIANT & FLAG_SHADOW_OPAQUE) != 0
    arrives -= shadow_hidden(max(layer, 0), p, t, shadow_slopes(at, n), shadow[at + SHADOW_V].w);
#endif
#if (VARIANT & FLAG_SHADOW_MEDIA) != 0
    arrives *= exp(-shadow_depth(max(layer, 0), p, t));
#endif
#ifdef SURFACE
    /* A triangle stops what falls on its other side. */
    arrives = dot(n, shadow[at + SHADOW_D].xyz) < 0.0 ? arrives : 0.0;
#endif
    return layer < 0 ? 1.0 : arrives;
}
