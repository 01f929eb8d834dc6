/* What is read of a medium where a sample's footprint is larger than a voxel (FLAG_FILTER). For
 * common_medium.glsl, after common_prism.glsl.
 *
 * The footprint of a sample at the ray parameter t is the parallelogram of F_x = (ou + t du) 2 / width
 * and F_y, which the inverse of dP takes to the texture: its rows are the gradients of u, v and w, those
 * that take gradients to normals (common_prism.glsl). It is found once a segment: within a cell it
 * changes by the cell's share of the way to the eye.
 *
 * A level's cells of 2^l voxels are boxes with the variance 4^l / 12, and reading between their centres
 * adds f (1 - f) 4^l, 4^l / 6 in the mean: as much as a box three times as wide in its square. So a
 * footprint of rho voxels is read at the level log2(rho / sqrt(3)).
 *
 * FLAG_FILTER_VIEW: as it is seen (renderer/bake/view_pyramid.h). With cos_i the cosine of the ray to the
 * axis i of the texture, extinction is that of an ellipsoid, sigma^2 = sum (sigma_i cos_i)^2, as projected
 * areas are (Heitz et al. 2015, SGGX): strands along w, of which nothing is seen from above, have
 * sigma sin(theta) from elsewhere. Colours and normals are mixed by the parts of that sum. */
#if (VARIANT & FLAG_FILTER) == 0

vec4 medium_at(vec3 q) {
    return texture(medium, q);
}

#if (VARIANT & FLAG_LIT) != 0
vec3 gradient_at(vec3 q) {
    return texture(medium_gradient, q).xyz;
}
#endif

#else

#ifndef BIAS
#define BIAS 3.0
#endif
#define OVER_BOX (1.0 / BIAS) /* 1 / sqrt(3), squared */

/* log2 of a squared length of voxels, as a level; never below 0. */
float level_of(float voxels2) {
    return 0.5 * log2(clamp(voxels2 * OVER_BOX, 1.0, 1.0e30));
}

#if (VARIANT & FLAG_FILTER_VIEW) == 0

float filter_level;

/* For the segment of `way` about t; the way was asked for a place in it, or begun by way_walk(). */
void filter_begin(Way way, vec2 p, float t) {
    vec3 fx = (frame[FRAME_OU].xyz + t * frame[FRAME_DU].xyz) * frame[FRAME_SCREEN].x;
    vec3 fy = (frame[FRAME_OV].xyz + t * frame[FRAME_DV].xyz) * frame[FRAME_SCREEN].y;
    /* Along an axis of one voxel nothing changes. */
    vec3 n = frame[FRAME_SIZE].xyz;
    n = mix(n, vec3(0.0), lessThan(n, vec3(1.5))) * way.scale;
    vec3 gu = (way.X * way.du1.x + way.Y * way.du2.x) * n.x;
    vec3 gv = (way.X * way.du1.y + way.Y * way.du2.y) * n.y;
    vec3 gw = way.Z * n.z;
    vec3 qx = vec3(dot(gu, fx), dot(gv, fx), dot(gw, fx));
    vec3 qy = vec3(dot(gu, fy), dot(gv, fy), dot(gw, fy));
    filter_level = level_of(max(dot(qx, qx), dot(qy, qy)));
}

vec4 medium_at(vec3 q) {
    return textureLod(medium, q, filter_level);
}

#if (VARIANT & FLAG_LIT) != 0
vec3 gradient_at(vec3 q) {
    return textureLod(medium_gradient, q, filter_level).xyz;
}
#endif

#else

layout(binding = BINDING_VIEW) uniform sampler2DArray medium_views;
#if (VARIANT & FLAG_LIT) != 0
layout(binding = BINDING_VIEW_GRADIENT) uniform sampler2DArray gradient_views;
#endif

struct Seen {
    float level_w, level_side; /* 0: voxels; from 1 on: the array's own level, plus 1 */
    float first;               /* layer of what is seen along w: from above or from below */
    vec2 cos2;                 /* along w, along the surface; their sum is 1 */
    vec2 toward;               /* to the viewer, along the surface */
} seen;
vec2 seen_share; /* of the two at the last place that medium_at() was asked for */

void filter_begin(Way way, vec2 p, float t) {
    vec3 fx = (frame[FRAME_OU].xyz + t * frame[FRAME_DU].xyz) * frame[FRAME_SCREEN].x;
    vec3 fy = (frame[FRAME_OV].xyz + t * frame[FRAME_DV].xyz) * frame[FRAME_SCREEN].y;
    vec3 n = frame[FRAME_SIZE].xyz;
    vec2 m = mix(n.xy, vec2(0.0), lessThan(n.xy, vec2(1.5)));
    vec3 gu = (way.X * way.du1.x + way.Y * way.du2.x) * way.scale;
    vec3 gv = (way.X * way.du1.y + way.Y * way.du2.y) * way.scale;
    vec3 gw = way.Z * way.scale;
    vec3 d = normalize(ray_direction(p));
    vec3 along = vec3(dot(gu, d), dot(gv, d), dot(gw, d));
    vec3 steep = vec3(dot(gu, gu), dot(gv, gv), dot(gw, gw));
    vec3 cosines = along * inversesqrt(max(steep, 1.0e-37));
    vec3 squares = cosines * cosines;
    float sum = max(squares.x + squares.y + squares.z, 1.0e-37);
    seen.cos2 = vec2(squares.z, squares.x + squares.y) / sum;
    seen.first = (along.z < 0.0 ? float(VIEW_ABOVE) : float(VIEW_BELOW)) * n.z;
    seen.toward = -cosines.xy * inversesqrt(max(squares.x + squares.y, 1.0e-37));
    /* Along w the pixel's parallelogram is slid along the ray into the layer, where it covers
     * 1 / cos of what it does across the ray; not more than 4 times, where little is seen from there. */
    vec2 ax = vec2(dot(gu, fx), dot(gv, fx)), ay = vec2(dot(gu, fy), dot(gv, fy));
    float least = 0.25 * sqrt(steep.z);
    float over = sign(along.z) / max(abs(along.z), least);
    vec2 sx = (ax - along.xy * (dot(gw, fx) * over)) * m, sy = (ay - along.xy * (dot(gw, fy) * over)) * m;
    seen.level_w = level_of(max(dot(sx, sx), dot(sy, sy)));
    ax *= m;
    ay *= m;
    vec2 wide = m * sqrt(steep.xy);
    float across2 = max(dot(fx, fx), dot(fy, fy)) * max(wide.x * wide.x, wide.y * wide.y);
    seen.level_side = level_of(across2);
}

vec4 seen_at(sampler2DArray views, vec3 q, float first, float level) {
    float layers = frame[FRAME_SIZE].z, z = clamp(q.z * layers - 0.5, 0.0, layers - 1.0);
    float below = floor(z);
    return mix(textureLod(views, vec3(q.xy, first + below), level),
               textureLod(views, vec3(q.xy, first + min(below + 1.0, layers - 1.0)), level), z - below);
}

vec4 medium_at(vec3 q) {
    float layers = frame[FRAME_SIZE].z;
    vec4 w = seen_at(medium_views, q, seen.first, max(seen.level_w - 1.0, 0.0));
    vec4 side = seen_at(medium_views, q, float(VIEW_SIDE) * layers, max(seen.level_side - 1.0, 0.0));
    if (min(seen.level_w, seen.level_side) < 1.0) {
        vec4 voxel = texture(medium, q);
        w = mix(voxel, w, min(seen.level_w, 1.0));
        side = mix(voxel, side, min(seen.level_side, 1.0));
    }
    seen_share = vec2(w.a * w.a, side.a * side.a) * seen.cos2;
    float sigma2 = seen_share.x + seen_share.y;
    seen_share /= max(sigma2, 1.0e-37);
    float sigma = sqrt(sigma2);
    return vec4(sigma * (seen_share.x / max(w.a, 1.0e-30) * w.rgb +
                         seen_share.y / max(side.a, 1.0e-30) * side.rgb), sigma);
}

#if (VARIANT & FLAG_LIT) != 0
vec3 facing_of(vec3 gradient) {
    return gradient / (length(gradient) + 0.01);
}

/* After medium_at(q). */
vec3 gradient_at(vec3 q) {
    float layers = frame[FRAME_SIZE].z;
    vec4 w = seen_at(gradient_views, q, seen.first, max(seen.level_w - 1.0, 0.0));
    vec4 side = seen_at(gradient_views, q, float(VIEW_SIDE) * layers, max(seen.level_side - 1.0, 0.0));
    vec3 from_w = facing_of(w.xyz), from_side = facing_of(side.xyz) + vec3(side.w * seen.toward, 0.0);
    if (min(seen.level_w, seen.level_side) < 1.0) {
        vec3 voxel = facing_of(texture(medium_gradient, q).xyz);
        from_w = mix(voxel, from_w, min(seen.level_w, 1.0));
        from_side = mix(voxel, from_side, min(seen.level_side, 1.0));
    }
    vec3 facing = seen_share.x * from_w + seen_share.y * from_side;
    return 0.01 * facing / (1.0 - min(length(facing), 0.99));
}
#endif

#endif
#endif
