/* Opaque triangles as a light sees them (common_shadow.glsl): a plane in each texel. */
#include "common_frame.glsl"

in float t;
layout(location = 0) out vec4 plane; /* depth; slopes for each texel: exact, t being affine there */

void main() {
    plane = vec4(t, dFdx(t), dFdy(t), 0.0);
    gl_FragDepth = DEPTH_OF_T(t, frame[FRAME_O0].w);
}
