/* Two colours for dual-source blending, and as many rounds of arithmetic as are asked for.
 *
 * Each round is r' = r * r - 1 + y: it stays bounded, depends on the one before, and differs from
 * pixel to pixel, so that no compiler can take it away. 0 rounds leave the sources untouched. */
layout(location = 1) uniform vec4 source;
layout(location = 2) uniform vec4 factor;
layout(location = 3) uniform int rounds; /* up to 60,000: llvmpipe ends loops at 65,535 */

layout(location = 0, index = 0) out vec4 color;
layout(location = 0, index = 1) out vec4 blend_factor;

void main() {
    vec2 pixel = floor(gl_FragCoord.xy);
    float y = 0.001 * pixel.x, r = 0.002 * pixel.y;
    for (int i = 0; i < rounds; i++)
        r = clamp(r * r - 1.0 + y, -1.0, 1.0);
    if (rounds == 0)
        r = 0.0;
    color = vec4(source.xy + pixel, source.z + r, source.w);
    blend_factor = factor;
}
