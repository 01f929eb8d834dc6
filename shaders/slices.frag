/* One sample of a ray where a plane cuts a prism, as Lensch, Daubert & Seidel 2002 have it: texture
 * coordinates are interpolated over triangles of the polygon, and stand for the ray all the way to the
 * next plane; or they are found by the prism's own map (FLAG_EXACT). That way is measured along the ray, which the paper leaves out (in perspective it is
 * 1 / cos(theta) of the spacing), and it is the extinction that is taken to its power, not alpha. */
#include "common_frame.glsl"
#include "common_sample.glsl"
#if (VARIANT & FLAG_MEDIUM) != 0
#include "common_medium.glsl"
#elif (VARIANT & FLAG_SOLID) != 0
#include "common_solid.glsl"
#else
#include "common_math.glsl"
#include "common_through.glsl"
#endif

layout(location = 0) uniform float spacing; /* of the planes, in ray parameters */

in vec3 uvw;
#if (VARIANT & FLAG_EXACT) != 0
in vec2 tops;
flat in vec2 uv_origin;
flat in uint prism_cell;
#elif (VARIANT & FLAG_LIT) != 0
flat in mat3 to_world;
#endif

/* rgb: radiance, premultiplied; a: optical depth. */
layout(location = 0, index = 0) out vec4 picture;
#if (VARIANT & FLAG_SOLID) == 0
layout(location = 0, index = 1) out vec4 through; /* transmittance, the blend factor */
#endif

void main() {
    vec2 p = sample_position();
    float span = spacing * length(ray_direction(p));
#if (VARIANT & FLAG_LIT) != 0
    vec3 v = view_vector(p);
#else
    vec3 v = vec3(0.0);
#endif
#if (VARIANT & FLAG_EXACT) != 0
    Way way = way_at_point(prism_cell, uv_origin, uvw, tops);
#elif (VARIANT & FLAG_LIT) != 0
    Way way = Way(uvw, vec3(0.0), to_world);
#elif (VARIANT & FLAG_HOMOGENEOUS) == 0
    Way way = Way(uvw, vec3(0.0), mat3(0.0));
#endif
#if (VARIANT & FLAGS_PLACE) != 0
    /* Light is that of the plane, as all else is. */
    place_in = ray_origin(p) + (1.0 / gl_FragCoord.z - 2.0) / frame[FRAME_O0].w * ray_direction(p);
    place_on = vec3(0.0);
#endif
#if (VARIANT & FLAG_HOMOGENEOUS) != 0
    show_homogeneous(span, picture, through);
#elif (VARIANT & FLAG_MEDIUM) != 0
    Ray ray = RAY_BEGINS;
    march(ray, way, span, v);
    show(ray.color, ray.tau, picture, through);
#else
    vec3 q = way_at(way, 0.0);
    if (texture(solid, q).a < 0.5)
        discard;
    picture = vec4(shade_solid(q, 0.0, way_to_world(way), v, false, vec3(0.0)), OPAQUE_DEPTH);
#endif
}
