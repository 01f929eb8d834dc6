/* See light_view.h. In doubles, and from the world's centre, so that scenes far away and of any
 * size lose nothing; the light may come from anywhere, along the camera's up and along a surface
 * too. */
#include "renderer/path/light_view.h"

#include <math.h>
#include <string.h>

/* Around the objects, in texels: the four around any point exist. */
enum { MARGIN = 2 };

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void unit(double v[3]) {
    double length = sqrt(dot(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

/* How far every point of the objects goes along three axes, from `center`. */
static void extents(const struct picture *picture, const double axis[3][3], double low[3],
                    double high[3]) {
    for (int i = 0; i < 3; i++) {
        low[i] = INFINITY;
        high[i] = -INFINITY;
    }
    for (size_t n = 0; n < picture->object_count; n++) {
        const struct path_object *object = &picture->objects[n];
        const double *m = object->object->transform;
        uint32_t count = object->shell ? object->shell->vertex_count : object->mesh->vertex_count;
        for (uint32_t v = 0; v < count; v++) {
            double p[3];
            for (int r = 0; r < 3; r++) {
                p[r] = m[12 + r] - picture->world.center[r];
                for (int c = 0; c < 3; c++)
                    p[r] += m[4 * c + r] * (object->shell ? object->shell->position[v][c] +
                                                                object->shell->center[c]
                                                          : object->mesh->position[v][c]);
            }
            for (int i = 0; i < 3; i++) {
                low[i] = fmin(low[i], dot(p, axis[i]));
                high[i] = fmax(high[i], dot(p, axis[i]));
            }
        }
    }
}

/* Orthographic, square, with everything between the depths -0.25 and 0.25. */
void light_view_fit(const struct picture *picture, const double direction[3], int size,
                    struct view *view) {
    double axis[3][3], low[3], high[3], largest = 0, middle[3] = {0, 0, 0}, half[3];
    int least = 0;
    for (int i = 0; i < 3; i++)
        largest = fmax(largest, fabs(direction[i]));
    for (int i = 0; i < 3; i++) {
        axis[2][i] = direction[i] / largest;
        if (fabs(axis[2][i]) < fabs(axis[2][least]))
            least = i;
    }
    unit(axis[2]);
    double up[3] = {least == 0, least == 1, least == 2};
    cross(axis[2], up, axis[0]);
    unit(axis[0]);
    cross(axis[0], axis[2], axis[1]);
    extents(picture, (const double(*)[3])axis, low, high);
    for (int i = 0; i < 3; i++) {
        half[i] = (high[i] - low[i]) / 2;
        for (int c = 0; c < 3; c++)
            middle[c] += axis[i][c] * (low[i] + half[i]);
    }
    double side = fmax(half[0], half[1]), radius = sqrt(dot(half, half));
    side = (side > 0 ? side : 1) * size / (size - 2.0 * MARGIN);
    double depth = 4 * (radius > 0 ? radius : 1);
    *view = (struct view){.width = size, .height = size, .orthographic = true, .depth_scale = 1};
    memcpy(view->center, picture->world.center, sizeof view->center);
    for (int i = 0; i < 3; i++) {
        view->o0[i] = middle[i];
        view->ou[i] = side * axis[0][i];
        view->ov[i] = side * axis[1][i];
        view->d0[i] = depth * axis[2][i];
        view->x_row[i] = axis[0][i] / side;
        view->y_row[i] = axis[1][i] / side;
        view->h_row[i] = axis[2][i] / depth;
    }
    view->x_row[3] = -dot(view->x_row, middle);
    view->y_row[3] = -dot(view->y_row, middle);
    view->h_row[3] = 1 - dot(view->h_row, middle);
}
