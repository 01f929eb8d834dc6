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
                  const double bounds_max[3], struct scene_camera *camera) {
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

    const double margin = 0.92; /* of the picture that the bounds may fill */
    double tan_y = tan(camera->fov_y_deg * (M_PI / 360)) * margin;
    double tan_x = tan_y * image->width / image->height;
    double radius2 = 0, distance = 0, height = 0;
    for (int corner = 0; corner < 8; corner++) {
        double r[3];
        for (int i = 0; i < 3; i++)
            r[i] = (corner >> i & 1 ? 0.5 : -0.5) * (bounds_max[i] - bounds_min[i]);
        double x = fabs(dot(r, side)), y = fabs(dot(r, above)), z = dot(r, forward);
        radius2 = fmax(radius2, dot(r, r));
        distance = fmax(distance, fmax(x / tan_x, y / tan_y) - z);
        height = fmax(height, 2 * fmax(y, x * image->height / image->width) / margin);
    }
    double radius = radius2 > 0 ? sqrt(radius2) : 1;
    if (camera->orthographic || !(distance > radius))
        distance = 2 * radius;
    if (camera->orthographic)
        camera->ortho_height = height > 0 ? height : 2;
    for (int i = 0; i < 3; i++) {
        camera->target[i] = bounds_min[i] + (bounds_max[i] - bounds_min[i]) / 2;
        camera->eye[i] = camera->target[i] - distance * forward[i];
    }
    camera->given = true;
}
