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
 * (Yuksel and Keyser: from the first one on): the nearest depth, and minus the farthest. A texel holds
 * four optical depths, of which the last is the first of the next layer's: one fetch brings both ends.
 *
 * Extinction with colours: where all media that throw shadows have the same, FLAG_SHADOW_TINT, the channels'
 * optical depths are shares of the one that the maps hold. Else, FLAG_SHADOW_CHANNELS, a texel holds the
 * three at a slice's end, before the first of which there is nothing: two fetches. */
#if (VARIANT & FLAG_POINT) != 0
#define SHADOW_VEC4S (SHADOW_VIEW + SHADOW_FACES * SHADOW_VIEWS * SHADOW_ROWS)
#else
#define SHADOW_VEC4S (SHADOW_VIEW + SHADOW_VIEWS * SHADOW_ROWS)
#endif
layout(std140, binding = BINDING_SHADOW) uniform Shadow {
    vec4 shadow[SHADOW_VEC4S];
#if (VARIANT & FLAG_SHADOW_TINT) != 0
    vec4 shadow_tint;
#endif
};
/* Casters, whose maps are not yet there, ask for nothing. */
#if (VARIANT & FLAGS_COLORED) != 0 && (VARIANT & FLAG_SHADOW_MEDIA) != 0
#define SHADOW_COLORED
#define ARRIVES vec3 /* by channels */
#else
#define ARRIVES float
#endif
#if (VARIANT & FLAG_SHADOW_CHANNELS) != 0
#define DEPTHS vec3
#else
#define DEPTHS float
#endif

#if (VARIANT & FLAG_SHADOW_OPAQUE) != 0
layout(binding = BINDING_SHADOW_PLANES) uniform sampler2DArray shadow_planes;
#endif
#if (VARIANT & FLAG_SHADOW_MEDIA) != 0
layout(binding = BINDING_SHADOW_DEPTHS) uniform sampler2DArray shadow_depths;
layout(binding = BINDING_SHADOW_RANGES) uniform sampler2DArray shadow_ranges;
#endif

/* How the depth of a plane with the normal n, in the world, changes from texel to texel; 0 where it
 * cannot be said: without a normal, or where it faces away from the light. `along`: the light's ray, in
 * perspective from the light to the point. There depths of planes are affine over the map as t / (1 + t):
 * n.(1 + t)(d0 + x du + y dv) = c, so d/dx of 1 - 1/(1 + t) is -n.du/c. */
vec2 shadow_slopes(int at, vec3 n, vec3 along) {
    float facing = dot(n, along);
    vec2 slopes = -vec2(dot(n, shadow[at + SHADOW_U].xyz), dot(n, shadow[at + SHADOW_V].xyz)) / facing;
    return facing < 0.0 ? slopes : vec2(0.0);
}

/* A light that stands on a triangle sees it from the edge: what its normal, a difference between pixels,
 * says of the side is rounding. */
const float SHADOW_EDGE_ON = 1.0e-4;

/* Nearer to a light than this it is not told where things lie. */
const float SHADOW_NEAREST = 1.0e-7;

#if (VARIANT & FLAG_SHADOW_OPAQUE) != 0
/* The share of the texels around (x, y) that hide a point of depth t. `slopes`: of the surface that it
 * lies on, where there is one; `texel_depth`: a texel's width in units of depth; `over`: rounding over
 * SHADOW_ROUNDING. */
float shadow_hidden(int layer, vec2 p, float t, vec2 slopes, float texel_depth, float over) {
    vec2 corner = floor(p - 0.5), f = p - 0.5 - corner;
    float last = shadow[0].x - 1.0, hidden = 0.0;
    float rounding = over * SHADOW_ROUNDING + dot(abs(slopes), vec2(shadow[0].w));
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
/* The optical depth in front of a texel's place s, in slices. */
#if (VARIANT & FLAG_SHADOW_CHANNELS) != 0
vec3 shadow_slice(int layer, vec2 texel, float s) {
    float slices = 3.0 * shadow[0].z, before = min(floor(s), slices - 1.0);
    vec2 at = clamp(texel, vec2(0.0), vec2(shadow[0].x - 1.0));
    int first = layer * int(slices), end = first + int(before);
    vec3 behind = texelFetch(shadow_depths, ivec3(at, max(end - 1, first)), 0).rgb;
    behind *= before > 0.0 ? 1.0 : 0.0;
    return mix(behind, texelFetch(shadow_depths, ivec3(at, end), 0).rgb, s - before);
}
#else
float shadow_slice(int layer, vec2 texel, float s) {
    float layers = shadow[0].z, group = min(floor(s / 3.0), layers - 1.0);
    vec2 at = clamp(texel, vec2(0.0), vec2(shadow[0].x - 1.0));
    vec4 depth = texelFetch(shadow_depths, ivec3(at, layer * int(layers) + int(group)), 0);
    vec3 part = clamp(s - 3.0 * group - vec3(0.0, 1.0, 2.0), 0.0, 1.0);
    return depth.x + dot(part, depth.yzw - depth.xyz);
}
#endif

/* The optical depth between the light and a point of depth t, from the four texels around it. Where
 * their ranges are pieces of the same layers they are laid upon one another, begin on begin and end
 * on end, so that layers run on between texels. Where one range begins at another thing, or goes on
 * past the limb of the base that the next one ends on, it is not: by more than half of the shortest.
 * Mixed by hand: filters of hardware have 8 bits of a fraction. */
DEPTHS shadow_depth(int layer, vec2 p, float t) {
    vec2 corner = floor(p - 0.5), f = p - 0.5 - corner;
    /* As textureGather gives them: from the upper left on, to the right. */
    vec4 share = vec4((1.0 - f.x) * f.y, f.x * f.y, f.x * (1.0 - f.y), (1.0 - f.x) * (1.0 - f.y));
    vec3 middle = vec3((corner + 1.0) * shadow[0].y, float(layer));
    vec4 begin = textureGather(shadow_ranges, middle, 0), way = -textureGather(shadow_ranges, middle, 1) - begin;
    bvec4 there = greaterThan(way, vec4(0.0));
    vec4 ways = mix(vec4(1.0e30), way, there), some = mix(vec4(0.0), share, there);
    float least = min(min(ways.x, ways.y), min(ways.z, ways.w));
    float first = min(min(begin.x, begin.y), min(begin.z, begin.w));
    vec4 as_one = mix(vec4(0.0), some, lessThan(begin, vec4(first + 0.5 * least)));
    vec4 to_end = mix(vec4(0.0), as_one, lessThan(way, vec4(1.5 * least)));
    vec4 from = mix(begin, vec4(dot(as_one, begin) / max(dot(as_one, vec4(1.0)), 1.0e-30)),
                    greaterThan(as_one, vec4(0.0)));
    vec4 over = mix(way, vec4(dot(to_end, way) / max(dot(to_end, vec4(1.0)), 1.0e-30)),
                    greaterThan(to_end, vec4(0.0)));
    vec4 s = clamp((t - from) / max(over, vec4(1.0e-30)), 0.0, 1.0) * 3.0 * shadow[0].z;
    return share.x * shadow_slice(layer, corner + vec2(0.0, 1.0), s.x) +
           share.y * shadow_slice(layer, corner + vec2(1.0, 1.0), s.y) +
           share.z * shadow_slice(layer, corner + vec2(1.0, 0.0), s.z) +
           share.w * shadow_slice(layer, corner, s.w);
}
#endif

#if (VARIANT & FLAG_POINT) != 0
/* The face of the cube around a light that `from`, from the light to a point, passes through. */
int shadow_face(vec3 from) {
    vec3 size = abs(from);
    float most = max(size.x, max(size.y, size.z));
    int axis = size.x == most ? 0 : size.y == most ? 1 : 2;
    float way = axis == 0 ? from.x : axis == 1 ? from.y : from.z;
    return 2 * axis + (way < 0.0 ? 1 : 0);
}
#endif

/* The share that arrives of light k at `place`, in the object's space; n: of the surface there, `from`: from the
 * light, where that stands at a point; both in the world. */
ARRIVES shadow_arrives(int k, vec3 place, vec3 n, vec3 from) {
    int face = 0;
    bool point = false;
#if (VARIANT & FLAG_POINT) != 0
    point = shadow[SHADOW_POINT + k].w > 0.0;
    face = point ? shadow_face(from) : 0;
#endif
    vec4 views = shadow[SHADOW_FACE + 2 * k + (face >> 2)];
    int layer = int(dot(views, vec4(equal(ivec4(0, 1, 2, 3), ivec4(face & 3)))));
    int at = SHADOW_VIEW + max(layer, 0) * SHADOW_ROWS;
    vec2 p = vec2(dot(shadow[at + SHADOW_X].xyz, place) + shadow[at + SHADOW_X].w,
                  dot(shadow[at + SHADOW_Y].xyz, place) + shadow[at + SHADOW_Y].w);
    float t = dot(shadow[at + SHADOW_T].xyz, place) + shadow[at + SHADOW_T].w;
    vec3 along = point ? from : shadow[at + SHADOW_D].xyz;
    float over = shadow[at + SHADOW_D].w, width = shadow[at + SHADOW_V].w, depth = t;
#if (VARIANT & FLAG_POINT) != 0
    float h = point ? max(1.0 + t, SHADOW_NEAREST) : 1.0;
    p = clamp(p / h, vec2(0.0), vec2(shadow[0].x));
    depth /= h;
    width /= h;
    over /= h * h;
#endif
    float arrives = 1.0;
#if (VARIANT & FLAG_SHADOW_OPAQUE) != 0
    arrives -= shadow_hidden(max(layer, 0), p, depth, shadow_slopes(at, n, along), width, over);
#endif
#ifdef SHADOW_COLORED
    vec3 depths = vec3(shadow_depth(max(layer, 0), p, t));
#if (VARIANT & FLAG_SHADOW_TINT) != 0
    depths *= shadow_tint.rgb;
#endif
#elif (VARIANT & FLAG_SHADOW_MEDIA) != 0
    arrives *= exp(-shadow_depth(max(layer, 0), p, t));
#endif
#ifdef SURFACE
    /* A triangle stops what falls on its other side. */
    float facing = dot(n, along);
    arrives = facing < 0.0 && (!point || facing < -SHADOW_EDGE_ON * length(along)) ? arrives : 0.0;
#endif
#ifdef SHADOW_COLORED
    return layer < 0 ? vec3(1.0) : arrives * exp(-depths);
#else
    return layer < 0 ? 1.0 : arrives;
#endif
}
