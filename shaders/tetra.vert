/* Outlines of tetrahedra, already on the sample grid (renderer/shell/project.h), at the depth of
 * their nearest vertex. */
layout(location = 0) in vec3 position;
layout(location = 1) in uint cell_in;
flat out uint cell;

void main() {
    cell = cell_in;
    gl_Position = vec4(position, 1.0);
}
