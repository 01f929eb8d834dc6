/* A light's view of what throws shadows (common_shadow.glsl says what the maps hold). Opaque things:
 * their plane. Media: a cell's part of the optical depth, shared out to the slices behind it; cells
 * come in any order, since optical depths add (and ranges are least and greatest). */
#if (VARIANT & FLAG_SOLID) != 0
layout(location = 0) out vec4 plane; /* depth; slopes for each texel */

/* At t of the ray through p, where the normal is n. */
vec4 plane_at(float t, vec3 n, vec2 p) {
    float h = frame[FRAME_MATERIAL].w != 0.0 ? 1.0 : max(1.0 + t, SHADOW_NEAREST);
    vec3 along = frame[FRAME_VIEW_D0].xyz + p.x * frame[FRAME_VIEW_DU].xyz + p.y * frame[FRAME_VIEW_DV].xyz;
    return vec4(t / h, shadow_slopes(SHADOW_VIEW, n, h * along), 0.0);
}
#elif defined(RANGE)
layout(location = 0) out vec4 range; /* the nearest depth, and minus the farthest */
#else
#if (VARIANT & FLAG_SHADOW_CHANNELS) != 0
layout(location = 0) out vec4 deep[SHADOW_CHANNEL_LAYERS];
#else
layout(location = 0) out vec4 deep[SHADOW_LAYERS];
#endif

layout(binding = BINDING_SHADOW_RANGES) uniform sampler2DArray ranges;
layout(location = 0) uniform ivec3 slices; /* of all: their number; of this pass: the first; the range's layer */

/* Slices are at whole numbers of s. The share of what lies evenly between two depths that each of the
 * slices of layer m has before it. */
#if (VARIANT & FLAG_SHADOW_CHANNELS) != 0
/* Of three slices, at their ends. */
vec3 share_of(int m, float s, float over) {
    return clamp((float(slices.y + 3 * m) + vec3(1.0, 2.0, 3.0) - s) * over, 0.0, 1.0);
}
#else
vec4 share_of(int m, float s, float over) {
    return clamp((float(slices.y + 3 * m) + vec4(0.0, 1.0, 2.0, 3.0) - s) * over, 0.0, 1.0);
}
#endif

/* `span`: the segment's length in object units, t_in and t_on its depth and how far on it goes. */
void deposit(
#if (VARIANT & FLAG_HOMOGENEOUS) == 0
    inout Way way,
#endif
    float span, float t_in, float t_on) {
    vec2 range = texelFetch(ranges, ivec3(ivec2(gl_FragCoord.xy), slices.z), 0).xy;
    float scale = float(slices.x) / max(-range.y - range.x, 1.0e-30);
#if (VARIANT & FLAG_HOMOGENEOUS) != 0
    float steps = 1.0, depth_scaled = span * frame[FRAME_CONSTANT].w, i = 0.5;
#else
    float steps = clamp(ceil(span * frame[FRAME_STEP].x), 1.0, frame[FRAME_STEP].z);
    float depth_scaled = span / steps * frame[FRAME_STEP].y, i = 0.5;
#endif
    float s_in = (t_in - range.x) * scale, s_step = t_on * scale / steps;
    float over = 1.0 / max(s_step, 1.0e-30);
#if (VARIANT & FLAG_SHADOW_CHANNELS) != 0
    vec3 d0 = vec3(0.0), d1 = vec3(0.0);
#else
    vec4 d0 = vec4(0.0), d1 = vec4(0.0), d2 = vec4(0.0), d3 = vec4(0.0);
#endif
    do {
#if (VARIANT & FLAG_HOMOGENEOUS) != 0
        float tau = depth_scaled;
#else
        float tau = texture(medium, way_at(way, i / steps)).a * depth_scaled;
#if (VARIANT & FLAG_FILL) != 0
        tau += frame[FRAME_FILL].w * depth_scaled;
#endif
#endif
        float s = s_in + (i - 0.5) * s_step;
        d0 += tau * share_of(0, s, over);
        d1 += tau * share_of(1, s, over);
#if (VARIANT & FLAG_SHADOW_CHANNELS) == 0
        d2 += tau * share_of(2, s, over);
        d3 += tau * share_of(3, s, over);
#endif
    } while ((i += 1.0) < steps);
#if (VARIANT & FLAG_SHADOW_CHANNELS) != 0
    vec4 tint = vec4(frame[FRAME_GLOW].yzw, 0.0);
    deep[0] = tint * d0.x;
    deep[1] = tint * d0.y;
    deep[2] = tint * d0.z;
    deep[3] = tint * d1.x;
    deep[4] = tint * d1.y;
    deep[5] = tint * d1.z;
#else
    deep[0] = d0;
    deep[1] = d1;
    deep[2] = d2;
    deep[3] = d3;
#endif
}
#endif
