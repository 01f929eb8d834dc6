/* Where media lie along a light's rays, texel by texel: also beside them, so that what is mixed of
 * neighbouring texels is a range everywhere (common_shadow.glsl). A texel without takes its neighbours'
 * mean. */
layout(binding = BINDING_SAMPLES) uniform sampler2D raw; /* nearest; minus the farthest */
layout(location = 0) out vec4 range;

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy), last = textureSize(raw, 0) - 1;
    vec4 own = texelFetch(raw, here, 0);
    vec2 sum = vec2(0.0);
    float count = 0.0;
    int i = 0;
    do {
        vec4 other = texelFetch(raw, clamp(here + ivec2(i % 3 - 1, i / 3 - 1), ivec2(0), last), 0);
        bool there = other.x < -other.y;
        sum += there ? vec2(other.x, -other.y) : vec2(0.0);
        count += there ? 1.0 : 0.0;
    } while (++i < 9);
    range = vec4(own.x < -own.y ? vec2(own.x, -own.y) : sum / max(count, 1.0), 0.0, 0.0);
}
