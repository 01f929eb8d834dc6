/* What a group of slabs has gathered (radiance, optical depth), over what lies behind it. */
layout(binding = BINDING_SAMPLES) uniform sampler2D samples;

layout(location = 0, index = 0) out vec4 picture;
layout(location = 0, index = 1) out vec4 through; /* a: transmittance, the blend factor */

void main() {
    picture = texelFetch(samples, ivec2(gl_FragCoord.xy), 0);
    through = vec4(exp(-picture.a));
}
