/* From a gradient per voxel to a normal in the world, up to its length: the inverse transpose of an
 * affine map from texture space. A cell with the edges e_k from its first vertex, along which texture
 * coordinates grow by u_k. lambda_k has the gradient e_(k+1) x e_(k+2) / volume. For every stage, after
 * common_frame.glsl. */
mat3 normal_map(vec3 e1, vec3 e2, vec3 e3, vec3 u1, vec3 u2, vec3 u3) {
    vec3 g1 = cross(e2, e3), g2 = cross(e3, e1), g3 = cross(e1, e2);
    /* Only the volume's sign matters; scaled, so that cells of any size stay within range. */
    float size = max(max(dot(g1, g1), dot(g2, g2)), max(dot(g3, g3), 1.0e-37));
    float scale = (dot(e1, g1) < 0.0 ? -1.0 : 1.0) * inversesqrt(size);
    g1 = world_normal(g1 * scale);
    g2 = world_normal(g2 * scale);
    g3 = world_normal(g3 * scale);
    vec3 n = frame_size;
    u1 *= n;
    u2 *= n;
    u3 *= n;
    return mat3(g1 * u1.x + g2 * u2.x + g3 * u3.x, g1 * u1.y + g2 * u2.y + g3 * u3.y,
                g1 * u1.z + g2 * u2.z + g3 * u3.z);
}
