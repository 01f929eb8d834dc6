/* Opaque, two-sided, lit. The outputs are those of every pass: radiance, and an optical depth that
 * lets nothing through. */
#include "common_frame.glsl"
#include "common_sample.glsl"
#if (VARIANT & FLAG_LIT) != 0
#include "common_light.glsl"
#endif

#if (VARIANT & FLAG_TEXTURED) != 0
layout(binding = BINDING_BASE_COLOR) uniform sampler2D base_color;
in vec2 uv;
#endif

#if (VARIANT & FLAG_LIT) != 0
in vec3 normal;
#endif
in float t;
layout(location = 0) out vec4 picture;

void main() {
    vec3 color = frame[FRAME_CONSTANT].rgb;
#if (VARIANT & FLAG_TEXTURED) != 0
    color *= texture(base_color, uv).rgb;
#endif
#if (VARIANT & FLAG_LIT) != 0
    bool front = gl_FrontFacing == (frame[FRAME_SIZE].w > 0.0);
    vec3 n = world_normal(normal);
    n *= (front ? 1.0 : -1.0) * inversesqrt(max(dot(n, n), 1.0e-30));
    color = lit(color, n, view_vector(sample_position()), 1.0);
#else
    color *= frame[FRAME_AMBIENT].rgb;
#endif
    picture = vec4(color, OPAQUE_DEPTH);
    /* In orthographic views what lies behind the eye's plane is not seen. */
    if (t < -1.0)
        discard;
    gl_FragDepth = DEPTH_OF_T(t, frame[FRAME_O0].w);
}
