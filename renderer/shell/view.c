/* Rays and projection. The derivation is at the top of view.h. */
#include "renderer/shell/view.h"

#include <math.h>
#include <string.h>

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static void normalize(double v[3]) {
    /* Scaled first: lengths down to 1e-300 and up to 1e300 are legal. */
    double largest = fmax(fabs(v[0]), fmax(fabs(v[1]), fabs(v[2])));
    for (int i = 0; i < 3; i++)
        v[i] /= largest;
    double length = sqrt(dot(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
}

void view_from_camera(const struct scene_camera *camera, const struct scene_image *image,
                      const double bounds_min[3], const double bounds_max[3], int k,
                      struct view *view) {
    memset(view, 0, sizeof *view);
    view->width = image->width * k;
    view->height = image->height * k;
    view->orthographic = camera->orthographic;

    double forward[3], right[3], up[3], to_center[3], half[3];
    for (int i = 0; i < 3; i++) {
        view->center[i] = bounds_min[i] + (bounds_max[i] - bounds_min[i]) / 2;
        half[i] = (bounds_max[i] - bounds_min[i]) / 2;
        forward[i] = camera->target[i] - camera->eye[i];
        to_center[i] = view->center[i] - camera->eye[i];
    }
    normalize(forward);
    double up_hint[3] = {camera->up[0], camera->up[1], camera->up[2]};
    normalize(up_hint);
    cross(forward, up_hint, right);
    normalize(right);
    cross(right, forward, up);

    /* The plane t = 0 lies at the centre's depth, but never so near the eye that t loses its scale:
     * the eye may stand inside the shell or past the centre. */
    double radius = sqrt(dot(half, half));
    double depth = dot(to_center, forward);
    if (!(depth > 0.1 * radius))
        depth = fmax(sqrt(dot(to_center, to_center)), radius);
    if (!(depth > 0))
        depth = 1;
    view->depth_scale = radius > 0 ? fmax(1, depth / radius) : 1;

    double aspect = (double)image->width / image->height;
    double half_height = camera->orthographic ? camera->ortho_height / 2
                                              : depth * tan(camera->fov_y_deg * (M_PI / 360));
    double half_width = half_height * aspect;
    double offset[3]; /* of the eye from the centre */
    for (int i = 0; i < 3; i++) {
        offset[i] = -to_center[i];
        view->o0[i] = offset[i] + depth * forward[i];
        view->ou[i] = half_width * right[i];
        view->ov[i] = half_height * up[i];
        view->d0[i] = depth * forward[i];
        view->du[i] = camera->orthographic ? 0 : view->ou[i];
        view->dv[i] = camera->orthographic ? 0 : view->ov[i];
    }
    /* Perspective: X / H must be the plane's coordinate at depth, times the distance ratio:
     * X = (p - eye) . right / half_width, H = (p - eye) . forward / depth. */
    for (int i = 0; i < 3; i++) {
        view->x_row[i] = right[i] / half_width;
        view->y_row[i] = up[i] / half_height;
        view->h_row[i] = forward[i] / depth;
    }
    view->x_row[3] = -dot(view->x_row, offset);
    view->y_row[3] = -dot(view->y_row, offset);
    view->h_row[3] = -dot(view->h_row, offset);
}

/* Inverse of the linear part, row-major, through its adjugate. The largest element is taken out
 * first: scales of 1e-150 are legal and their determinant is not. */
static void invert_linear(const double m[16], double inverse[3][3]) {
    double largest = 0;
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            largest = fmax(largest, fabs(m[c * 4 + r]));
    double a[3][3];
    for (int c = 0; c < 3; c++)
        for (int r = 0; r < 3; r++)
            a[r][c] = m[c * 4 + r] / largest;
    double det = 0;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, l = (i + 2) % 3;
        for (int c = 0; c < 3; c++) {
            int d = (c + 1) % 3, e = (c + 2) % 3;
            inverse[c][i] = a[j][d] * a[l][e] - a[j][e] * a[l][d];
        }
        det += a[i][0] * inverse[0][i];
    }
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            inverse[r][c] /= det * largest;
}

static void apply(const double m[3][3], const double v[3], double out[3]) {
    for (int r = 0; r < 3; r++)
        out[r] = dot(m[r], v);
}

void view_in_object(const struct view *world, const double transform[16], const double center[3],
                    struct view *view) {
    double inverse[3][3], shift[3], moved[3];
    invert_linear(transform, inverse);
    /* shift: the object's reference point as seen from the world's. */
    for (int r = 0; r < 3; r++) {
        double mapped = transform[12 + r];
        for (int c = 0; c < 3; c++)
            mapped += transform[c * 4 + r] * center[c];
        shift[r] = mapped - world->center[r];
        moved[r] = world->o0[r] - shift[r];
    }
    *view = *world;
    memcpy(view->center, center, sizeof view->center);
    apply(inverse, moved, view->o0);
    apply(inverse, world->ou, view->ou);
    apply(inverse, world->ov, view->ov);
    apply(inverse, world->d0, view->d0);
    apply(inverse, world->du, view->du);
    apply(inverse, world->dv, view->dv);
    const double *from[3] = {world->x_row, world->y_row, world->h_row};
    double *to[3] = {view->x_row, view->y_row, view->h_row};
    for (int row = 0; row < 3; row++) {
        for (int c = 0; c < 3; c++)
            to[row][c] = from[row][0] * transform[c * 4] + from[row][1] * transform[c * 4 + 1] +
                         from[row][2] * transform[c * 4 + 2];
        to[row][3] = from[row][3] + dot(from[row], shift);
    }
}

void view_normal_matrix(const double transform[16], double rows[3][3]) {
    double inverse[3][3];
    invert_linear(transform, inverse);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            rows[r][c] = inverse[c][r];
}
