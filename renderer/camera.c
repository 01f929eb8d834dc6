/* Framing: see camera.h. */
#include "renderer/camera.h"

#include <math.h>

void camera_add_bounds(const double transform[16], const double box_min[3], const double box_max[3],
                       double bounds_min[3], double bounds_max[3]) {
    for (int corner = 0; corner < 8; corner++) {
        double p[3];
        for (int i = 0; i < 3; i++)
            p[i] = corner >> i & 1 ? box_max[i] : box_min[i];
        for (int r = 0; r < 3; r++) {
            double mapped = transform[12 + r];
            for (int c = 0; c < 3; c++)
                mapped += transform[c * 4 + r] * p[c];
            bounds_min[r] = fmin(bounds_min[r], mapped);
            bounds_max[r] = fmax(bounds_max[r], mapped);
        }
    }
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross_unit(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
    double length = sqrt(dot(out, out));
    for (int i = 0; i < 3; i++)
        out[i] /= length;
}

void camera_frame(const struct scene_image *image, const double bounds_min[3],
                  const double bounds_max[3], camera_next_point *next, void (*restart)(void *),
                  void *user, struct scene_camera *camera) {
    /* Looking from the front right, 27 degrees from above: the view of a catalogue. Of unit
     * length. With an up vector other than z the same view of a turned world. */
    double up[3] = {camera->up[0], camera->up[1], camera->up[2]};
    double up_length = sqrt(dot(up, up));
    for (int i = 0; i < 3; i++)
        up[i] /= up_length;
    double front[3] = {0, -1, 0}, right[3], back[3];
    if (fabs(dot(front, up)) > 0.9)
        front[1] = 0, front[2] = 1;
    cross_unit(front, up, right);
    cross_unit(right, up, back); /* level, away from the viewer */
    double forward[3], side[3], above[3];
    for (int i = 0; i < 3; i++)
        forward[i] = -(0.455 * right[i] - 0.765 * back[i] + 0.455 * up[i]);
    double length = sqrt(dot(forward, forward));
    for (int i = 0; i < 3; i++)
        forward[i] /= length;
    cross_unit(forward, up, side);
    cross_unit(side, forward, above);

    const double margin = 0.92; /* of the picture that the points may fill */
    double tan_y = tan(camera->fov_y_deg * (M_PI / 360)) * margin;
    double tan_x = tan_y * image->width / image->height;
    double diagonal2 = 0, target[3];
    for (int i = 0; i < 3; i++) {
        double extent = bounds_max[i] - bounds_min[i];
        target[i] = bounds_min[i] + extent / 2;
        diagonal2 += extent * extent;
    }
    double radius = diagonal2 > 0 ? sqrt(diagonal2) / 2 : 1;
    double distance = 2 * radius, height = 2 * radius;
    /* The picture's middle moves to the points' middle, which moves what is seen: three rounds of
     * it leave a thousandth. */
    for (int round = 0; round < 4; round++) {
        double needed = 0, needed_height = 0, point[3];
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        restart(user);
        while (next(user, point)) {
            double r[3];
            for (int i = 0; i < 3; i++)
                r[i] = point[i] - target[i];
            double x = dot(r, side), y = dot(r, above), z = dot(r, forward);
            needed = fmax(needed, fmax(fabs(x) / tan_x, fabs(y) / tan_y) - z);
            needed_height =
                fmax(needed_height, 2 * fmax(fabs(y), fabs(x) * image->height / image->width));
            double shrink = camera->orthographic ? 1 : distance / fmax(distance + z, radius * 1e-3);
            low[0] = fmin(low[0], x * shrink), high[0] = fmax(high[0], x * shrink);
            low[1] = fmin(low[1], y * shrink), high[1] = fmax(high[1], y * shrink);
        }
        /* Never so near that a point is beside or behind the eye. */
        distance = camera->orthographic ? 2 * radius : fmax(needed, 1.05 * radius);
        height = needed_height > 0 ? needed_height / margin : 2;
        for (int i = 0; i < 3 && round < 3 && high[0] >= low[0]; i++)
            target[i] += side[i] * (low[0] + high[0]) / 2 + above[i] * (low[1] + high[1]) / 2;
    }
    if (camera->orthographic)
        camera->ortho_height = height;
    for (int i = 0; i < 3; i++) {
        camera->target[i] = target[i];
        camera->eye[i] = target[i] - distance * forward[i];
    }
    camera->given = true;
}
