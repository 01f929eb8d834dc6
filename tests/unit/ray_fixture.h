/* The rays of a picture of a shell. */
#ifndef PELT_TESTS_UNIT_RAY_FIXTURE_H
#define PELT_TESTS_UNIT_RAY_FIXTURE_H

#include <math.h>
#include <string.h>

#include "renderer/shell/project.h"

static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

static void look_at(const struct shell *shell, const double eye[3], bool orthographic, int side,
                    struct projection *projection) {
    struct scene_camera camera = {.given = true,
                                  .orthographic = orthographic,
                                  .ortho_height = 3,
                                  .fov_y_deg = 40,
                                  .eye = {eye[0], eye[1], eye[2]},
                                  .up = {0, 0, 1}};
    struct scene_image image = {.width = side, .height = side, .samples = 1};
    struct view world, view;
    view_from_camera(&camera, &image, shell->bounds_min, shell->bounds_max, 1, &world);
    view_in_object(&world, identity, shell->center, &view);
    struct error err = {0};
    assert_int_equal(project_shell(shell, &view, projection, &err), STATUS_OK);
}

/* The interval of t in which a ray lies in a tetrahedron, in fp64, from its planes. */
static bool meet(const struct shell *shell, uint32_t t, const double o[3], const double d[3],
                 double *t_in, double *t_out) {
    *t_in = -1;
    *t_out = INFINITY;
    for (int k = 0; k < 4; k++) {
        const double *p = shell->position[shell->tetra[t][(k + 1) & 3]];
        const double *q = shell->position[shell->tetra[t][(k + 2) & 3]];
        const double *r = shell->position[shell->tetra[t][(k + 3) & 3]];
        const double *in = shell->position[shell->tetra[t][k]];
        double a[3], b[3], n[3], side = 0, distance = 0, speed = 0;
        for (int i = 0; i < 3; i++) {
            a[i] = q[i] - p[i];
            b[i] = r[i] - p[i];
        }
        for (int i = 0; i < 3; i++)
            n[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
        for (int i = 0; i < 3; i++) {
            side += n[i] * (in[i] - p[i]);
            distance += n[i] * (o[i] - p[i]);
            speed += n[i] * d[i];
        }
        if (side < 0) {
            distance = -distance;
            speed = -speed;
        }
        if (speed > 0)
            *t_in = fmax(*t_in, -distance / speed);
        else if (speed < 0)
            *t_out = fmin(*t_out, -distance / speed);
        else if (distance < 0)
            return false;
    }
    return *t_in < *t_out;
}

/* The ray of a sample. */
static void ray_at(const struct view *view, int x, int y, double o[3], double d[3]) {
    double px = (x + 0.5) * 2 / view->width - 1, py = (y + 0.5) * 2 / view->height - 1;
    for (int i = 0; i < 3; i++) {
        o[i] = view->o0[i] + px * view->ou[i] + py * view->ov[i];
        d[i] = view->d0[i] + px * view->du[i] + py * view->dv[i];
    }
}

#endif
