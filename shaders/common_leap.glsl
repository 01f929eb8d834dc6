/* Steps that know the voxels they pass (Dufort et al. 2005, section 5.1): over what is empty in one leap,
 * elsewhere by some voxels, and FLAG_DDA no further than the next plane of voxel centres (Amanatides and
 * Woo 1987), where trilinear interpolation bends. After common_prism.glsl. */
#if (VARIANT & FLAG_LEAP) != 0

layout(binding = BINDING_LEAP) uniform sampler3D leap;

float frame_least = 1.0 / frame[FRAME_STEP].z; /* of a segment, that a step takes */

/* Voxels passed along each axis in one unit of f; none where there is one voxel alone. */
vec3 way_voxels(Way way) {
    vec3 n = frame_size;
    return mix(way_rate(way) * n, vec3(0.0), lessThan(n, vec3(1.5)));
}

/* How much of the segment a step may take from its share f, at the texture coordinates q, where `voxels`
 * are passed in a unit of f and at most `most` in a step: not past the end, nor so little that a segment
 * takes more steps than FRAME_STEP allows. `empty`: nothing is met in all of it. */
float leap_from(vec3 q, vec3 voxels, float most, float f, out bool empty) {
    vec3 speed = abs(voxels);
    float fastest = max(max(speed.x, speed.y), max(speed.z, 1.0e-20));
    /* Chebyshev distance to the next full voxel, of which 3/2 are its reach and ours in this voxel
     * (renderer/bake/empty_space.h). */
    float open = (texture(leap, q).r * 255.0 - 1.5) / fastest, full = most / fastest;
#if (VARIANT & FLAG_DDA) != 0
    /* Planes nearer than a thousandth of a voxel are taken as passed, so that each step gets on. */
    const float passed = 1.0e-3;
    vec3 toward = mix(vec3(-1.0), vec3(1.0), greaterThan(voxels, vec3(0.0)));
    vec3 ahead = 1.0 - fract(toward * (q * frame_size - 0.5) + passed) + passed;
    vec3 crossing = ahead / max(speed, vec3(1.0e-20));
    full = min(full, min(min(crossing.x, crossing.y), crossing.z));
#endif
    empty = open >= full;
    return min(max(max(open, full), frame_least), 1.0 - f);
}

#endif
