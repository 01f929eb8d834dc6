/* One triangle over the whole target, from no buffer; or, where only some blocks of pixels are drawn,
 * one point a block, as large as that (renderer/gl/blocks.h). */
layout(location = 0) in vec2 corner; /* of the block, in pixels */

/* Its side in samples, 0: no blocks; 2 / width and 2 / height of the picture; half its side in pixels. */
layout(location = LOCATION_BLOCK) uniform vec4 block;

void main() {
    vec2 whole = vec2((gl_VertexID & 1) * 4 - 1, (gl_VertexID & 2) * 2 - 1);
    gl_Position = vec4(block.x > 0.0 ? (corner + block.w) * block.yz - 1.0 : whole, 0.0, 1.0);
    gl_PointSize = block.x;
}
