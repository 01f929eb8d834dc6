/* Terrain: fractal heights, the same for the same seed on every machine.
 *
 * Source: gradient noise after Perlin, "Improving Noise" (2002), with its quintic fade, summed over
 * octaves (fractional Brownian motion, lacunarity 2). Slopes are exact derivatives of the
 * same polynomial, so that the normals belong to the surface and not to its triangles.
 *
 * Octaves that the grid cannot carry are left out rather than aliased: a finer grid adds detail and
 * leaves the hills where they are. Erosion is left out on purpose. */
#include "renderer/asset/mesh_soup.h"

#include <math.h>

enum { OCTAVES_MAX = 9, HILLS = 3 }; /* hills along the shorter side, in the first octave */

static const double GAIN = 0.42; /* below 1/2: each octave is less steep than the one before */
static const double SPREAD = 3;  /* sums rarely pass 0.6: heights of 0.06 to 0.94 */

/* One of 2^32 gradients on the unit circle would need a cosine for each lattice point; 16
 * directions are enough to hide the lattice, and exact. */
static void gradient(int32_t x, int32_t y, uint32_t seed, double g[2]) {
    /* Integer hash after Wang/Mueller: multiply and fold, three rounds. */
    uint32_t h = (uint32_t)x * 0x8da6b343u ^ (uint32_t)y * 0xd8163841u ^ seed * 0xcb1ab31fu;
    h = (h ^ h >> 16) * 0x45d9f3bu;
    h = (h ^ h >> 16) * 0x45d9f3bu;
    h ^= h >> 16;
    mesh_circle_point((int)(h & 15), 16, &g[0], &g[1]);
}

/* A strip may be longer than the integers reach: the lattice repeats after 2^31 cells. */
static int32_t lattice(double floored) {
    return (int32_t)fmod(floored, 2147483648.0);
}

/* Perlin's noise at (x, y) with its derivatives; |noise| <= sqrt(1/2) for unit gradients. */
static double noise(double x, double y, uint32_t seed, double slope[2]) {
    double x0 = floor(x), y0 = floor(y);
    double fx = x - x0, fy = y - y0;
    int32_t ix = lattice(x0), iy = lattice(y0);
    double value[2][2], g[2][2][2];
    for (int j = 0; j < 2; j++)
        for (int i = 0; i < 2; i++) {
            gradient(ix + i, iy + j, seed, g[j][i]);
            value[j][i] = g[j][i][0] * (fx - i) + g[j][i][1] * (fy - j);
        }
    double sx = fx * fx * fx * (fx * (fx * 6 - 15) + 10),
           sy = fy * fy * fy * (fy * (fy * 6 - 15) + 10);
    double dx = 30 * fx * fx * (fx - 1) * (fx - 1), dy = 30 * fy * fy * (fy - 1) * (fy - 1);
    double low = value[0][0] + sx * (value[0][1] - value[0][0]);
    double high = value[1][0] + sx * (value[1][1] - value[1][0]);
    for (int k = 0; k < 2; k++) {
        double a = g[0][0][k] + sx * (g[0][1][k] - g[0][0][k]);
        double b = g[1][0][k] + sx * (g[1][1][k] - g[1][0][k]);
        slope[k] = a + sy * (b - a);
    }
    double across_low = value[0][1] - value[0][0], across_high = value[1][1] - value[1][0];
    slope[0] += dx * (across_low + sy * (across_high - across_low));
    slope[1] += dy * (high - low);
    return low + sy * (high - low);
}

double mesh_terrain_height(double x, double y, int cells, uint32_t seed, double slope[2]) {
    double sum = 0, amplitude = 1, frequency = HILLS;
    slope[0] = slope[1] = 0;
    for (int octave = 0; octave < OCTAVES_MAX; octave++) {
        if (octave > 0 && frequency * 4 > cells)
            break;
        double d[2];
        sum += amplitude *
               noise(x * frequency, y * frequency, seed + (uint32_t)octave * 0x9e3779b9u, d);
        slope[0] += amplitude * frequency * d[0];
        slope[1] += amplitude * frequency * d[1];
        amplitude *= GAIN;
        frequency *= 2;
    }
    /* Sums of noise crowd around 0. h = (1 + s / sqrt(1 + s^2)) / 2 spreads them over [0, 1], which
     * it cannot leave; dh/ds = (1 + s^2)^(-3/2) / 2. */
    double s = SPREAD * sum, root = sqrt(1 + s * s);
    double stretch = SPREAD / (2 * root * root * root);
    slope[0] *= stretch;
    slope[1] *= stretch;
    return 0.5 + 0.5 * s / root;
}
