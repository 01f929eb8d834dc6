/* The box mean of a pixel's k x k samples, in linear premultiplied RGBA, over the background.
 * A sample holds radiance and optical depth; alpha = 1 - exp(-depth). */
#include "common_math.glsl"

layout(binding = BINDING_SAMPLES) uniform sampler2D samples;
layout(location = 0) uniform int k;
layout(location = 1) uniform vec4 background; /* premultiplied */
#if (VARIANT & FLAG_BLOCKS) != 0
layout(binding = BINDING_BLOCKS) uniform samplerBuffer blocks; /* their lower left pixels */
layout(location = 2) uniform ivec3 layout_of; /* a block's side in pixels; the target's width; blocks */
#endif
layout(location = 0) out vec4 picture;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#if (VARIANT & FLAG_BLOCKS) != 0
    int n = pixel.y * layout_of.y + pixel.x, area = layout_of.x * layout_of.x;
    int block = min(n / area, layout_of.z - 1), within = n % area;
    pixel = ivec2(texelFetch(blocks, block).xy) + ivec2(within % layout_of.x, within / layout_of.x);
#endif
    ivec2 corner = pixel * k;
    vec4 sum = vec4(0.0);
    int i = 0;
    do {
        vec4 s = texelFetch(samples, corner + ivec2(i % k, i / k), 0);
        float alpha = one_minus_exp(s.a);
        sum += vec4(s.rgb, alpha) + background * exp(-s.a);
    } while (++i < min(k * k, 64));
    picture = sum / float(k * k);
}
