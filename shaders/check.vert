/* One triangle over the whole target, at a depth of its own, without vertex data: the self-test of a
 * GL (renderer/gl/selftest.c) and the load of its clock check (renderer/gl/clock.c). */
layout(location = 0) uniform float ndc_depth; /* in [-1, 1] */

void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, ndc_depth, 1.0);
}
