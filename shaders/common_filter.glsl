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
#if (VARIANT & FLAG_FILTER) != 0

/* Gradients of u, v and w where the way was last asked, for a unit of the object's length. */
mat3 filter_rates(Way way) {
    return mat3((way.X * way.du1.x + way.Y * way.du2.x) * way.scale,
                (way.X * way.du1.y + way.Y * way.du2.y) * way.scale, way.Z * way.scale);
}

/* The sides of a sample's footprint at t; `at` is where the shell's frame begins. */
vec3 footprint_x(float t, int at) {
    return (frame[at + FRAME_OU].xyz + t * frame[at + FRAME_DU].xyz) * frame[at + FRAME_SCREEN].x;
}

vec3 footprint_y(float t, int at) {
    return (frame[at + FRAME_OV].xyz + t * frame[at + FRAME_DV].xyz) * frame[at + FRAME_SCREEN].y;
}

/* Voxels along each axis; none where there is one alone, since along it nothing changes. */
vec3 filter_voxels(int at) {
    vec3 n = frame[at + FRAME_SIZE].xyz;
    return mix(n, vec3(0.0), lessThan(n, vec3(1.5)));
}

/* log2 of a squared length of voxels, as a level; never below 0. */
float level_of(float voxels2) {
    return 0.5 * log2(clamp(voxels2 * (1.0 / 3.0), 1.0, 1.0e30));
}

/* Of cells that grow alike along all axes: by the axis and the side of the footprint that pass most
 * voxels. */
float mip_level(Way way, float t, int at) {
    mat3 rates = filter_rates(way);
    vec3 n = filter_voxels(at);
    vec3 qx = (footprint_x(t, at) * rates) * n, qy = (footprint_y(t, at) * rates) * n;
    return level_of(max(dot(qx, qx), dot(qy, qy)));
}

#endif

/* A joint walk reads by itself: overlap.frag. */
#ifndef SLOTS
#if (VARIANT & FLAG_FILTER) == 0

vec4 medium_at(vec3 q) {
    return texture(medium, q);
}

#if (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_STRANDS) == 0
vec3 gradient_at(vec3 q) {
    return texture(medium_gradient, q).xyz;
}
#endif

#else

#if (VARIANT & FLAG_FILTER_VIEW) == 0

float filter_level;

/* For the segment of `way` about t; the way was asked for a place in it. */
void filter_begin(Way way, vec2 p, float t) {
    filter_level = mip_level(way, t, 0);
}

vec4 medium_at(vec3 q) {
    return textureLod(medium, q, filter_level);
}

#if (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_STRANDS) == 0
vec3 gradient_at(vec3 q) {
    return textureLod(medium_gradient, q, filter_level).xyz;
}
#endif

#else

layout(binding = BINDING_VIEW) uniform sampler2DArray medium_views;
layout(binding = BINDING_VIEW_LEFT) uniform sampler2DArray left_views;
#if (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_STRANDS) == 0
layout(binding = BINDING_VIEW_MOMENTS) uniform sampler2DArray mean_views;
layout(binding = BINDING_VIEW_MOMENTS + 1) uniform sampler2DArray square_views;
layout(binding = BINDING_VIEW_MOMENTS + 2) uniform sampler2DArray product_views;
/* Of a tile along u, v and w, on the mean: in thicknesses. */
vec3 tile_size = vec3(frame[FRAME_NORMAL].w, frame[FRAME_NORMAL + 1].w, 1.0);
#endif

/* The two of the sides that lie next to the ray's own slant. */
struct Seen {
    float level; /* 0: voxels; from 1 on: the array's own level, plus 1 */
    vec2 first;  /* their first layers */
    vec2 finer;  /* layers of theirs that a thickness of way passes */
    vec2 share;  /* their parts of sigma^2; the sum is 1 */
    vec2 toward; /* to the viewer, along the surface */
} seen;
/* Of the two at the last place that medium_at() was asked for: their parts; 1 / what is lost there. */
vec2 seen_share, seen_over;

void filter_begin(Way way, vec2 p, float t) {
    mat3 rates = filter_rates(way);
    vec3 n = filter_voxels(0), fx = footprint_x(t, 0), fy = footprint_y(t, 0);
    vec3 along = normalize(ray_direction(p)) * rates;
    vec3 steep = vec3(dot(rates[0], rates[0]), dot(rates[1], rates[1]), dot(rates[2], rates[2]));
    vec3 cosines = along * inversesqrt(max(steep, 1.0e-37)), squares = cosines * cosines;
    float surface2 = squares.x + squares.y, cos2 = squares.z / max(surface2 + squares.z, 1.0e-37);
    seen.toward = -cosines.xy * inversesqrt(max(surface2, 1.0e-37));
    bool down = along.z < 0.0;
    float layers = frame[FRAME_SIZE].z, slant = cos2 > VIEW_COS2_1 ? 0.0 : cos2 > VIEW_COS2_2 ? 1.0 : 2.0;
    vec2 nodes = slant == 0.0 ? vec2(1.0, VIEW_COS2_1)
                 : slant == 1.0 ? vec2(VIEW_COS2_1, VIEW_COS2_2)
                                : vec2(VIEW_COS2_2, 0.0);
    seen.share.x = clamp((cos2 - nodes.y) / (nodes.x - nodes.y), 0.0, 1.0);
    seen.finer = vec2(sqrt(nodes.x), slant < 2.0 ? sqrt(nodes.y) : 1.0) * layers;
    float side = slant + (down ? float(VIEW_ABOVE) : float(VIEW_BELOW));
    seen.first = vec2(side, slant < 2.0 ? side + 1.0 : float(VIEW_SIDE)) * layers;
    /* Over a base nothing comes from below: what goes up has come in from the side. */
    bool grazes = !down && frame[FRAME_STEP].w != 0.0;
    seen.share.x = grazes ? 0.0 : seen.share.x;
    seen.share.y = 1.0 - seen.share.x;
    seen.finer.y = grazes ? layers : seen.finer.y;
    seen.first.y = grazes ? float(VIEW_SIDE) * layers : seen.first.y;
    /* What the footprint covers across the ray: along it, the ray itself gathers. */
    vec2 voxels2 = n.xy * n.xy * steep.xy;
    seen.level = level_of(max(dot(fx, fx), dot(fy, fy)) * max(voxels2.x, voxels2.y));
}

vec4 seen_at(sampler2DArray views, vec3 q, float first, float level) {
    float layers = frame[FRAME_SIZE].z, z = clamp(q.z * layers - 0.5, 0.0, layers - 1.0);
    float below = floor(z);
    return mix(textureLod(views, vec3(q.xy, first + below), level),
               textureLod(views, vec3(q.xy, first + min(below + 1.0, layers - 1.0)), level), z - below);
}

/* What is lost in a layer of what is left, as a medium. A layer that lets nothing through lets
 * 1e-6 through: more is not seen, and 1 - h has no more digits. */
vec4 medium_seen(vec3 q, float first, float level, float finer, out float over) {
    float layers = frame[FRAME_SIZE].z, z = clamp(q.z * layers - 0.5, 0.0, layers - 1.0);
    float below = floor(z), on = z - below;
    vec4 low = textureLod(medium_views, vec3(q.xy, first + below), level);
    vec4 high = textureLod(medium_views, vec3(q.xy, first + min(below + 1.0, layers - 1.0)), level);
    vec4 lost = mix(low, high, on);
    float left = seen_at(left_views, q, first, level).r;
    float sigma = depth_of(min(lost.a / max(left, 1.0e-37), 1.0 - 1.0e-6)) * finer;
    over = 1.0 / max(on < 0.5 ? low.a : high.a, 1.0e-37);
    return vec4(lost.rgb * (sigma / max(lost.a, 1.0e-37)), sigma);
}

vec4 medium_at(vec3 q) {
    float level = max(seen.level - 1.0, 0.0);
    vec4 a = medium_seen(q, seen.first.x, level, seen.finer.x, seen_over.x);
    vec4 b = medium_seen(q, seen.first.y, level, seen.finer.y, seen_over.y);
    if (seen.level < 1.0) {
        vec4 voxel = texture(medium, q);
        a = mix(voxel, a, seen.level);
        b = mix(voxel, b, seen.level);
    }
    seen_share = vec2(a.a * a.a, b.a * b.a) * seen.share;
    float sigma2 = seen_share.x + seen_share.y, sigma = sqrt(sigma2);
    seen_share /= max(sigma2, 1.0e-37);
    vec2 over = seen_share / max(vec2(a.a, b.a), 1.0e-30);
    return vec4(sigma * (over.x * a.rgb + over.y * b.rgb), sigma);
}

#if (VARIANT & FLAG_LIT) != 0 && (VARIANT & FLAG_STRANDS) == 0
/* What light falls on, after medium_at(q): normals as moments (common_moments.glsl). Returns their weight. */
float normals_at(Way way, vec3 q) {
    float level = max(seen.level - 1.0, 0.0);
    vec2 over = seen_share * seen_over;
    float layers = frame_size.z, layer = floor(clamp(q.z * layers - 0.5, 0.0, layers - 1.0) + 0.5);
    vec3 a = vec3(q.xy, seen.first.x + layer), b = vec3(q.xy, seen.first.y + layer);
    vec4 mean = over.x * textureLod(mean_views, a, level) + over.y * textureLod(mean_views, b, level);
    vec4 squares = over.x * textureLod(square_views, a, level) + over.y * textureLod(square_views, b, level);
    vec4 products = over.x * textureLod(product_views, a, level) + over.y * textureLod(product_views, b, level);
    float weight = squares.x + squares.y + squares.z, over_weight = 1.0 / max(weight, 1.0e-30);
    vec2 t = seen.toward, from = vec2(squares.w, products.w) * over_weight;
    mean.xy += (mean.w - dot(mean.xy, from)) * t;
    if (seen.level < 1.0) {
        vec3 gradient = texture(medium_gradient, q).xyz, n = gradient * (frame_size / tile_size);
        float g = length(gradient), w = g / (g + 0.01);
        n *= inversesqrt(max(dot(n, n), 1.0e-37));
        mean.xyz = mix(w * n, mean.xyz, seen.level);
        squares.xyz = mix(w * n * n, squares.xyz, seen.level);
        products.xyz = mix(w * n.xxy * n.yzz, products.xyz, seen.level);
    }
    mat3 D = way_to_world(way);
    vec3 unit = tile_size / frame_size;
    D = mat3(D[0] * unit.x, D[1] * unit.y, D[2] * unit.z);
    return moments_set(mean.xyz, squares.xyz, products.xyz, D);
}
#endif

#endif
#endif
#endif
