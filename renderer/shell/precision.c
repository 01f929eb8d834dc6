/* See precision.h, which derives the bound. */
#include "renderer/shell/precision.h"

#include <math.h>

static double length(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

bool precision_needs_fp64(const struct shell *shell, const struct projection *projection,
                          const struct view *world) {
    /* Samples' widths for each unit of X, Y and H. */
    double sample =
        fmin(2 * length(world->ou) / world->width, 2 * length(world->ov) / world->height);
    const double scale[3] = {length(world->ou) / sample, length(world->ov) / sample,
                             length(world->d0) / sample};
    const double at_center[3] = {0, 0, 1};
    uint32_t bottoms = shell->vertex_count / 2;
    double extent = 0, least = PRECISION_SAMPLES_SEEN;
    for (uint32_t v = 0; v < bottoms; v++) {
        const double *bottom = projection->clip[v], *top = projection->clip[bottoms + v];
        double offset[3];
        for (int i = 0; i < 3; i++) {
            double below = fabs(bottom[i] - at_center[i]), above = fabs(top[i] - at_center[i]);
            extent = fmax(extent, fmax(below, above) * scale[i]);
            offset[i] = (top[i] - bottom[i]) * scale[i];
        }
        least = fmin(least, length(offset));
    }
    return extent > PRECISION_FP32_MAX * least;
}

void precision_low(const double v[4][3], float low[LOW_TEXELS][4]) {
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < 3; i++) {
            int at = 3 * k + i;
            low[at / 4][at % 4] = (float)(v[k][i] - (double)(float)v[k][i]);
        }
}

void precision_cells_low(const struct shell *shell, float (*low)[LOW_TEXELS][4]) {
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        double v[4][3];
        for (int k = 0; k < 4; k++)
            for (int i = 0; i < 3; i++)
                v[k][i] = shell->position[shell->tetra[t][k]][i];
        precision_low(v, low[t]);
    }
}
