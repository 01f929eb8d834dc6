/* A transform's matrix from its parts: T * R * S with R = Rz * Ry * Rx, column-major, in double.
 * Quarter turns are exact, so that a shape turned by 90 degrees lies where it is meant to. */
#include <math.h>
#include <string.h>

#include "api/scene_members.h"

static void sine_cosine(double angle_deg, double *sine, double *cosine) {
    double turn = fmod(angle_deg, 360); /* exact */
    if (fmod(turn, 90) == 0) {
        static const double quarter[] = {0, 1, 0, -1};
        int k = ((int)(turn / 90) + 4) % 4;
        *sine = quarter[k];
        *cosine = quarter[(k + 1) % 4];
        return;
    }
    double angle_rad = turn * (3.14159265358979323846 / 180);
    *sine = sin(angle_rad);
    *cosine = cos(angle_rad);
}

void scene_transform_compose(struct scene_transform *transform) {
    if (transform->is_matrix)
        return;
    double sx, cx, sy, cy, sz, cz;
    sine_cosine(transform->rotate_deg[0], &sx, &cx);
    sine_cosine(transform->rotate_deg[1], &sy, &cy);
    sine_cosine(transform->rotate_deg[2], &sz, &cz);
    const double rotation[3][3] = {
        /* column by column */
        {cz * cy, sz * cy, -sy},
        {cz * sy * sx - sz * cx, sz * sy * sx + cz * cx, cy * sx},
        {cz * sy * cx + sz * sx, sz * sy * cx - cz * sx, cy * cx},
    };
    double *m = transform->matrix;
    memset(m, 0, sizeof transform->matrix);
    for (int column = 0; column < 3; column++)
        for (int row = 0; row < 3; row++) /* + 0.0: no negative zeros in a report */
            m[column * 4 + row] = rotation[column][row] * transform->scale[column] + 0.0;
    for (int row = 0; row < 3; row++)
        m[12 + row] = transform->translate[row];
    m[15] = 1;
}
