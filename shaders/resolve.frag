/* The box mean of a pixel's k x k samples, in linear premultiplied RGBA, over the background.
 * A sample holds radiance and optical depth; alpha = 1 - exp(-depth), or FLAG_TINT the mean of that over
 * the channels, whose depths are shares of it. */
#include "common_math.glsl"

layout(binding = BINDING_SAMPLES) uniform sampler2D samples;
layout(location = 0) uniform int k;
layout(location = 1) uniform vec4 background; /* premultiplied */
#if (VARIANT & FLAG_BLOCKS) != 0
layout(binding = BINDING_BLOCKS) uniform samplerBuffer blocks; /* their lower left pixels */
layout(location = 2) uniform ivec3 layout_of; /* a block's side in pixels; the target's width; blocks */
#endif
#if (VARIANT & FLAG_TINT) != 0
layout(location = 3) uniform vec3 shares;
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
    /* Both what is lost and what is let through: of alpha near 0 one holds the digits, of alpha near 1
     * the other, and as many roundings as there are samples leave them there. */
    vec3 color = vec3(0.0);
    float lost = 0.0, through = 0.0;
    int i = 0;
    do {
        vec4 s = texelFetch(samples, corner + ivec2(i % k, i / k), 0);
        color += s.rgb;
#if (VARIANT & FLAG_TINT) != 0
        /* What is opaque is so to all. */
        vec3 depths = s.a < 0.5 * OPAQUE_DEPTH ? shares * s.a : vec3(s.a);
        lost += dot(one_minus_exp(depths), vec3(1.0 / 3.0));
        through += dot(exp(-depths), vec3(1.0 / 3.0));
#else
        lost += one_minus_exp(s.a);
        through += exp(-s.a);
#endif
    } while (++i < min(k * k, PIXEL_SAMPLES_MAX));
    float count = float(k * k);
    float alpha = through < lost ? 1.0 - (1.0 - background.a) * (through / count)
                                 : (lost + background.a * through) / count;
    picture = vec4((color + background.rgb * through) / count, alpha);
}
