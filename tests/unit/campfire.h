/* Three sticks that no order is right for. */
#ifndef PELT_TESTS_UNIT_CAMPFIRE_H
#define PELT_TESTS_UNIT_CAMPFIRE_H

#include <math.h>
#include <string.h>

#include "renderer/shell/shell.h"

struct campfire {
    struct shell shell;
    double position[12][3];
    uint32_t tetra[3][4], neighbour[3][4];
};

/* Three long tetrahedra, each lying over the next as the sticks of a campfire: no order exists.
 * Built by hand, unlinked, so that the A-buffer alone must find it. */
static void build_campfire(struct campfire *fire) {
    memset(fire, 0, sizeof *fire);
    memset(fire->neighbour, 0xff, sizeof fire->neighbour);
    for (uint32_t t = 0; t < 3; t++) {
        double a = t * 2 * M_PI / 3, c = cos(a), s = sin(a);
        /* A stick along x at y = -0.4, rising from z = 0 to 1, turned by a third each. */
        const double stick[4][3] = {{-1, -0.5, 0}, {-1, -0.3, 0}, {1, -0.4, 1}, {1, -0.4, 1.1}};
        for (uint32_t v = 0; v < 4; v++) {
            fire->tetra[t][v] = 4 * t + v;
            fire->position[4 * t + v][0] = c * stick[v][0] - s * stick[v][1];
            fire->position[4 * t + v][1] = s * stick[v][0] + c * stick[v][1];
            fire->position[4 * t + v][2] = stick[v][2];
        }
    }
    fire->shell = (struct shell){.vertex_count = 12,
                                 .tetra_count = 3,
                                 .position = fire->position,
                                 .tetra = fire->tetra,
                                 .neighbour = fire->neighbour};
    for (int i = 0; i < 3; i++) {
        fire->shell.bounds_min[i] = -1.2;
        fire->shell.bounds_max[i] = 1.2;
    }
}

#endif
