/* Opaque triangles as a light sees them (common_shadow.glsl): a plane in each texel. */
#include "common_frame.glsl"

in float t;
layout(location = 0) out vec4 plane; /* depth; slopes for each texel: exact, it being affine there */

void main() {
    float depth = frame[FRAME_MATERIAL].w != 0.0 ? t : t / (1.0 + t);
    plane = vec4(depth, dFdx(depth), dFdy(depth), 0.0);
    gl_FragDepth = DEPTH_OF_T(t, frame[FRAME_O0].w);
}
