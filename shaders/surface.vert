/* Opaque triangles: the base of a shell, plain meshes. No near plane: z is 0, inside the clip volume
 * wherever w > 0, and the depth is written by the fragment. */
#include "common_frame.glsl"

layout(location = 0) in vec3 position; /* relative to the mesh's centre */
#if (VARIANT & FLAG_LIT) != 0
layout(location = 1) in vec3 normal_in;
out vec3 normal;
#endif
#if (VARIANT & FLAG_TEXTURED) != 0
layout(location = 2) in vec2 uv_in;
out vec2 uv;
#endif

out float t; /* the ray's parameter: affine over the triangle */

void main() {
    vec4 p = vec4(position, 1.0);
    /* Without the 1 between it and H: from far away that would be all that fp32 holds. */
    t = dot(frame[FRAME_H_ROW].xyz, position) + frame[FRAME_OU].w;
    float w = frame[FRAME_MATERIAL].w != 0.0 ? 1.0 : 1.0 + t;
    gl_Position = vec4(dot(frame[FRAME_X_ROW], p), dot(frame[FRAME_Y_ROW], p), 0.0, w);
#if (VARIANT & FLAG_LIT) != 0
    normal = normal_in;
#endif
#if (VARIANT & FLAG_TEXTURED) != 0
    uv = uv_in;
#endif
}
