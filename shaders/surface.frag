/* Opaque, two-sided, lit. The outputs are those of every pass: radiance, and an optical depth that
 * lets nothing through. */
#include "common_frame.glsl"
#include "common_sample.glsl"
#define SURFACE
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

#if (VARIANT & FLAGS_SHADOW) != 0
/* The triangle's own normal in the world, toward the viewer: its neighbours in the quad lie on its plane,
 * covered or not. */
vec3 flat_normal(vec3 place, vec3 v) {
    vec3 n = world_normal(cross(dFdx(place), dFdy(place)));
    n *= inversesqrt(max(dot(n, n), 1.0e-37));
    return dot(n, v) < 0.0 ? -n : n;
}
#endif

void main() {
    vec3 color = frame[FRAME_CONSTANT].rgb;
#if (VARIANT & FLAG_TEXTURED) != 0
    color *= texture(base_color, uv).rgb;
#endif
#if (VARIANT & FLAG_LIT) != 0
    bool front = gl_FrontFacing == (frame[FRAME_SIZE].w > 0.0);
    vec3 n = world_normal(normal);
    n *= (front ? 1.0 : -1.0) * inversesqrt(max(dot(n, n), 1.0e-30));
    vec2 p = sample_position();
    vec3 flat_n = n, place = vec3(0.0);
#if (VARIANT & FLAGS_PLACE) != 0
    place = ray_origin(p) + t * ray_direction(p);
#endif
#if (VARIANT & FLAGS_SHADOW) != 0
    flat_n = flat_normal(place, view_vector(p));
#endif
    color = lit_by(color, n, flat_n, view_vector(p), 1.0, vec2(0.0), place);
#else
    color *= frame[FRAME_AMBIENT].rgb;
#endif
    picture = vec4(color, OPAQUE_DEPTH);
    /* In orthographic views what lies behind the eye's plane is not seen. */
    if (t < -1.0)
        discard;
    gl_FragDepth = DEPTH_OF_T(t, frame[FRAME_O0].w);
}
