/* Outlines of tetrahedra, already on the sample grid (renderer/shell/project.h). */
layout(location = 0) in vec2 position;
layout(location = 1) in uint cell_in;
flat out uint cell;

void main() {
    cell = cell_in;
    gl_Position = vec4(position, 0.0, 1.0);
}
