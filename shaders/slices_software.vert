/* Polygons in which planes cut prisms, all of it computed by the CPU: Lensch, Daubert & Seidel 2002,
 * section 4. */
#include "common_frame.glsl"
#include "common_slice.glsl"

layout(location = 0) in vec3 position; /* on the sample grid, and the plane's depth */
layout(location = 1) in vec3 uvw_in; /* or b1, b2, w: FLAG_EXACT */
layout(location = 2) in uint prism;

void main() {
    gl_Position = vec4(position, 1.0);
    uvw = uvw_in;
    set_prism(int(prism));
}
