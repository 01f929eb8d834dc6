/* What slabs from the nearest on have gathered (radiance, what is let through), over what lies behind. */
layout(binding = BINDING_SAMPLES) uniform sampler2D samples;

layout(location = 0, index = 0) out vec4 picture;
layout(location = 0, index = 1) out vec4 through; /* a: transmittance, the blend factor */

void main() {
    vec4 gathered = texelFetch(samples, ivec2(gl_FragCoord.xy), 0);
    picture = vec4(gathered.rgb, -log(max(gathered.a, 1.0e-37)));
    through = vec4(gathered.a);
}
