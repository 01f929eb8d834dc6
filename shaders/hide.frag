/* Sets the depth to the nearest there is where what was gathered lets nothing more through. */
layout(binding = BINDING_SAMPLES) uniform sampler2D samples;
layout(location = 0) uniform float least;

void main() {
    if (texelFetch(samples, ivec2(gl_FragCoord.xy), 0).a > least)
        discard;
    gl_FragDepth = 1.0;
}
