/* Outlines of parts of tetrahedra that lie within a slab, already on the sample grid
 * (renderer/shell/project.h), at the depth of their nearest point. */
layout(location = 0) in vec3 position;
layout(location = 1) in uint cell_in;
layout(location = 2) in vec2 slab_in;
flat out uint cell;
flat out vec2 slab;

void main() {
    cell = cell_in;
    slab = slab_in;
    gl_Position = vec4(position, 1.0);
}
