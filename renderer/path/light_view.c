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

static void vertex(const struct path_object *object, uint32_t v, const double center[3],
                   double p[3]) {
    const double *m = object->object->transform;
    for (int r = 0; r < 3; r++) {
        p[r] = m[12 + r] - center[r];
        for (int c = 0; c < 3; c++)
            p[r] += m[4 * c + r] * (object->shell
                                        ? object->shell->position[v][c] + object->shell->center[c]
                                        : object->mesh->position[v][c]);
    }
}

/* How far every point of the objects goes along three axes, from `center`. */
static void extents(const struct path_object *objects, size_t object_count, const double center[3],
                    const double axis[3][3], double low[3], double high[3]) {
    for (int i = 0; i < 3; i++) {
        low[i] = INFINITY;
        high[i] = -INFINITY;
    }
    for (size_t n = 0; n < object_count; n++) {
        const struct path_object *object = &objects[n];
        uint32_t count = object->shell ? object->shell->vertex_count : object->mesh->vertex_count;
        for (uint32_t v = 0; v < count; v++) {
            double p[3];
            vertex(object, v, center, p);
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
    extents(picture->objects, picture->object_count, picture->world.center,
            (const double(*)[3])axis, low, high);
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

/* ---- the cube around a light ---- */

/* By as much a face is wider than a quarter of the sky: shaders choose by what fp32 holds. */
static const double WIDER = 1 + 1e-6;

void light_view_bounds(const struct path_object *objects, size_t count, const double center[3],
                       double low[3], double high[3]) {
    static const double axis[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    extents(objects, count, center, axis, low, high);
}

bool light_view_at_vertex(const struct path_object *objects, size_t count, const double position[3],
                          double within) {
    for (size_t n = 0; n < count; n++)
        for (uint32_t v = 0; objects[n].shell && v < objects[n].shell->vertex_count; v++) {
            double p[3];
            vertex(&objects[n], v, position, p);
            if (dot(p, p) <= within * within)
                return true;
        }
    return false;
}

/* The box as a face sees it: forward, right, up. right x up = -forward, as in every view. */
struct turned {
    int axis[3];
    double sign, low[3], high[3];
};

static struct turned turn(const double low[3], const double high[3], int face) {
    int i = face / 2;
    bool falls = face % 2;
    struct turned t = {.axis = {i, (i + (falls ? 1 : 2)) % 3, (i + (falls ? 2 : 1)) % 3},
                       .sign = falls ? -1 : 1};
    for (int n = 0; n < 3; n++) {
        bool turns = n == 0 && falls;
        t.low[n] = turns ? -high[t.axis[n]] : low[t.axis[n]];
        t.high[n] = turns ? -low[t.axis[n]] : high[t.axis[n]];
    }
    return t;
}

bool light_view_meets(const double low[3], const double high[3], int face) {
    struct turned t = turn(low, high, face);
    for (int n = 1; n < 3; n++)
        if (!(fmax(t.low[n], -t.high[n]) <= WIDER * t.high[0]))
            return false;
    return t.high[0] > 0;
}

void light_view_face(const struct picture *picture, const double position[3], int face, int size,
                     struct view *view) {
    double low[3], high[3], middle[2], half = 0, radius = 0, eye[3], depth = 0;
    light_view_bounds(picture->objects, picture->object_count, position, low, high);
    struct turned t = turn(low, high, face);
    for (int n = 0; n < 3; n++)
        radius += (high[n] - low[n]) * (high[n] - low[n]) / 4;
    radius = sqrt(radius);
    /* Between which tangents the box lies, of those that the face sees. */
    for (int n = 0; n < 2; n++) {
        double near = t.low[0] > 0 ? t.low[0] : 0;
        double least = t.low[n + 1] / (t.low[n + 1] < 0 ? near : t.high[0]);
        double most = t.high[n + 1] / (t.high[n + 1] > 0 ? near : t.high[0]);
        least = least > -WIDER ? least : -WIDER;
        most = most < WIDER ? most : WIDER;
        middle[n] = least + (most - least) / 2;
        half = fmax(half, (most - least) / 2);
    }
    half = fmax(half, 1e-12) * size / (size - 2.0 * MARGIN);
    for (int n = 0; n < 3; n++)
        eye[n] = position[n] - picture->world.center[n];
    depth = -t.sign * eye[t.axis[0]];
    if (!(depth > radius))
        depth = radius > 0 ? radius : 1;
    *view = (struct view){.width = size, .height = size};
    view->depth_scale = radius > 0 ? fmax(1, depth / radius) : 1;
    memcpy(view->center, picture->world.center, sizeof view->center);
    int forward = t.axis[0], right = t.axis[1], up = t.axis[2];
    view->d0[forward] = depth * t.sign;
    view->d0[right] = depth * middle[0];
    view->d0[up] = depth * middle[1];
    view->du[right] = view->ou[right] = depth * half;
    view->dv[up] = view->ov[up] = depth * half;
    for (int n = 0; n < 3; n++)
        view->o0[n] = eye[n] + view->d0[n];
    view->h_row[forward] = t.sign / depth;
    view->x_row[right] = view->y_row[up] = 1 / (depth * half);
    view->x_row[forward] = -middle[0] / half * view->h_row[forward];
    view->y_row[forward] = -middle[1] / half * view->h_row[forward];
    view->x_row[3] = -dot(view->x_row, eye);
    view->y_row[3] = -dot(view->y_row, eye);
    view->h_row[3] = -dot(view->h_row, eye);
}
