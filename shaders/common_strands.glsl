/* The strands that a medium is made of: where they run, and how much of one mind they are. After
 * common_prism.glsl, or for joint walks common_frame.glsl.
 *
 * A material keeps the mean T of its strands' unit tangents, in tile widths (struct volume, `strands`),
 * weighted by extinction as colours are. Filtered, it is the mean over what a sample covers, which strands that
 * run alike lose little by: no moments are kept of them as of normals. A tangent goes to the world by dP, of which what is at hand is
 * the inverse transpose: gradients G_u, G_v, G_w. dP/du is G_v x G_w times a factor that all three share,
 * and neither its size nor its sign matters to a strand.
 *
 * dP/dw, the height, turns evenly over a mesh; dP/du and dP/dv lie in the flat layers of each prism, and
 * strands that lean would show its facets. So what T has along the layers is laid into the plane
 * perpendicular to the height, as frames of bump maps are (Lengyel 2001). */
#if (VARIANT & FLAG_STRANDS) != 0

/* weight T, weight */
#ifndef SLOTS
#if (VARIANT & FLAG_FILTER_VIEW) != 0
layout(binding = BINDING_STRANDS) uniform sampler2DArray strands; /* coarser along u and v alone */
#else
layout(binding = BINDING_STRANDS) uniform sampler3D strands;
#endif
#endif

/* The unit tangent in the world, of a sample of that texture; G: gradients over (u, v, w), or all of them
 * a factor as large. `weight`: the length of T, 0 where the texture has no direction. */
vec3 strand_tangent(vec4 s, vec3 G_u, vec3 G_v, vec3 G_w, out float weight) {
    vec3 T = s.xyz / max(s.w, 1.0e-30);
    vec3 layer = T.x * cross(G_v, G_w) + T.y * cross(G_w, G_u), height = cross(G_u, G_v);
    /* Squares of thin shells' gradients would leave fp32. */
    vec3 up = height / max(max(max(abs(height.x), abs(height.y)), abs(height.z)), 1.0e-37);
    up *= inversesqrt(max(dot(up, up), 1.0e-37));
    vec3 t = layer - dot(layer, up) * up + (T.z / TILE_DEPTH) * height;
    float size = max(max(abs(t.x), abs(t.y)), abs(t.z));
    t /= max(size, 1.0e-37);
    weight = size > 0.0 ? min(length(T), 1.0) : 0.0;
    return t * inversesqrt(max(dot(t, t), 1.0e-37));
}

#ifndef SLOTS
vec4 strands_at(vec3 q) {
#if (VARIANT & FLAG_FILTER_VIEW) != 0
    float last = frame[FRAME_SIZE].z - 1.0, z = clamp(q.z * (last + 1.0) - 0.5, 0.0, last), below = floor(z);
    return mix(textureLod(strands, vec3(q.xy, below), seen.level),
               textureLod(strands, vec3(q.xy, min(below + 1.0, last)), seen.level), z - below);
#elif (VARIANT & FLAG_FILTER) != 0
    return textureLod(strands, q, filter_level);
#else
    return texture(strands, q);
#endif
}

vec3 strand_at(Way way, vec3 q, out float weight) {
    mat3 per_voxel = way_to_world(way);
    vec3 n = frame_size;
    return strand_tangent(strands_at(q), per_voxel[0] / n.x, per_voxel[1] / n.y,
                          per_voxel[2] / n.z, weight);
}
#endif
#endif
