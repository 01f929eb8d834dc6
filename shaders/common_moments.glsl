/* Light on many normals at once (FLAG_FILTER_VIEW): from the first two moments of those that are seen
 * (renderer/bake/view_source.h), taken to the place where they are. Before common_light.glsl.
 *
 * Moments m and M of unit normals n of the weight w, in the frame of a tile in the shell's mean
 * proportions, go to the world by D, the map of normals there: n' = D n / |D n|, of which |D n|^2 is put as
 * its own mean, tr(D M D^T) / tr M. A plane's D is a rotation, and nothing is lost.
 *
 * Lambert: the mean of max(x, 0) = (x + |x|) / 2 of x = n.l, of which the mean mu and the mean square q are
 * known. |x| lies between |mu| and sqrt(q). Where mu = 0 it is k sqrt(q), with k^2 = 1 where all normals
 * are +-n, 3/4 where they are spread over the sphere, 8 / pi^2 around a strand: 5/8 + 3/8 tr(M^2) / (tr M)^2 is
 * right for the first two and by 0.1 % for the third. Between, powers of 5/2 are added:
 * |x|^(5/2) = |mu|^(5/2) + (k s)^(5/2), s^2 = q - mu^2, right to 0.014 for the halves of strands and
 * spheres that are seen from one side, and for fur's and clouds' voxels (tests/unit/test_moments.c). */
vec3 moments_mean = vec3(0.0), moments_squares = vec3(0.0), moments_products = vec3(0.0);
mat3 moments_to_world = mat3(0.0);
float moments_over_mean, moments_over_square, moments_k2;

/* Of what light is to fall on next: m, the diagonal of M, its uv, uw, vw; D. Returns tr M, the weight. */
float moments_set(vec3 mean, vec3 squares, vec3 products, mat3 D) {
    moments_mean = mean;
    moments_squares = squares;
    moments_products = products;
    moments_to_world = D;
    float weight = squares.x + squares.y + squares.z, over = 1.0 / max(weight, 1.0e-30);
    vec3 a = squares * over, b = products * over;
    moments_k2 = 0.625 + 0.375 * min(dot(a, a) + 2.0 * dot(b, b), 1.0);
    float spread = dot(squares, vec3(dot(D[0], D[0]), dot(D[1], D[1]), dot(D[2], D[2]))) +
                   2.0 * dot(products, vec3(dot(D[0], D[1]), dot(D[0], D[2]), dot(D[1], D[2])));
    moments_over_square = 1.0 / max(spread, 1.0e-30);
    moments_over_mean = inversesqrt(max(spread * weight, 1.0e-37));
    return weight;
}

vec3 moments_times(vec3 l) {
    return moments_squares * l + vec3(dot(moments_products.xy, l.yz), dot(moments_products.xz, l.xz),
                                      dot(moments_products.yz, l.xy));
}

/* Means of x and of |x| along l, a unit vector in the world. */
vec2 moments_along(vec3 l) {
    vec3 to = l * moments_to_world;
    float mu = clamp(dot(moments_mean, to) * moments_over_mean, -1.0, 1.0);
    float q = clamp(dot(to, moments_times(to)) * moments_over_square, 0.0, 1.0), mu2 = mu * mu;
    float s2 = moments_k2 * max(q - mu2, 0.0);
    float sum = mu2 * sqrt(sqrt(mu2)) + s2 * sqrt(sqrt(s2));
    return vec2(mu, max(pow(max(sum, 1.0e-20), 0.4), abs(mu)));
}

float moments_lambert(vec3 l) {
    vec2 along = moments_along(l);
    return 0.5 * (along.x + along.y);
}

#if (VARIANT & FLAG_SPECULAR) != 0
/* The mean of max(n.h, 0)^p. Of normals as slopes about h, n across h over n.h, (n.h)^p =
 * (1 + |slope|^2)^(-p/2) is nearly exp(-p |slope|^2 / 2); its mean over a Gaussian with the mean b and the
 * covariance C is exp(-p b^T (1 + p C)^-1 b / 2) / sqrt(det(1 + p C)) (Olano & Baker 2010), of those in
 * front of h. Slopes weighted by (n.h)^2 have moments that are those of M: b = M_th / M_hh, and the mean square
 * M_tt / M_hh. Right for +-n, for normals in a narrow cone, and for those all over the sphere,
 * 1 / (2 (p + 1)). */
float moments_gloss(vec3 h, float p) {
    vec2 along = moments_along(h);
    vec3 across = abs(h.z) < 0.7 ? vec3(-h.y, h.x, 0.0) : vec3(0.0, -h.z, h.y);
    across *= inversesqrt(max(dot(across, across), 1.0e-20));
    vec3 to = h * moments_to_world, t = across * moments_to_world, s = cross(h, across) * moments_to_world;
    vec3 Mh = moments_times(to);
    float over_q = moments_over_square / max(dot(to, Mh) * moments_over_square, 1.0e-6);
    vec2 b = vec2(dot(t, Mh), dot(s, Mh)) * over_q;
    vec3 Ms = moments_times(s);
    float tt = 1.0 + p * max(dot(t, moments_times(t)) * over_q - b.x * b.x, 0.0);
    float ss = 1.0 + p * max(dot(s, Ms) * over_q - b.y * b.y, 0.0);
    float ts = p * (dot(t, Ms) * over_q - b.x * b.y), det = max(tt * ss - ts * ts, 1.0);
    float away = (ss * b.x * b.x - 2.0 * ts * b.x * b.y + tt * b.y * b.y) / det;
    float front = 0.5 + 0.5 * along.x / max(along.y, 1.0e-10);
    return front * exp(-0.5 * p * max(away, 0.0)) * inversesqrt(det);
}
#endif
