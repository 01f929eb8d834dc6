/* FLIP, after Andersson et al. 2020 (see flip.h); sections of the paper stand beside the steps.
 *
 *   colour   linear RGB -> YCxCz, filtered by the eye's contrast sensitivity (4.1.1), back to RGB,
 *            clamped, to L*a*b* with the Hunt effect (4.1.2), HyAB distance to the power 0.7, and
 *            most of the range given to the small differences (4.1.3)
 *   feature  edges and points of the luminance: first and second derivatives of a Gaussian (4.2)
 *   both     dE = dE_colour ^ (1 - dE_feature) (4.3)
 *
 * All filters are sums of products of one in x and one in y, so they are run along rows and then
 * along columns. Beyond the border the picture goes on with its last pixels. Left out on purpose:
 * the HDR version (exposures), which asks for a tone map that Pelt does not have. */
#include "renderer/error/flip.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    RADIUS_MAX = 16,
    TAPS = 2 * RADIUS_MAX + 1,
    BUFFERS = 15 /* five for work, five for each picture */
};

static const double PI = 3.14159265358979323846;
static const double PIXELS_PER_DEGREE = 67;
static const double QC = 0.7, PC = 0.4, PT = 0.95; /* 4.1.3 */
static const double QF = 0.5;                      /* 4.2 */
static const double EDGE_WIDTH_DEG = 0.082; /* 4.2: the width of what an edge detector sees */

/* The illuminant: XYZ of linear RGB (1, 1, 1). */
static const double white[3] = {0.950428545, 1.000000000, 1.088900371};

static const double xyz_from_rgb[3][3] = {
    {10135552.0 / 24577794, 8788810.0 / 24577794, 4435075.0 / 24577794},
    {2613072.0 / 12288897, 8788810.0 / 12288897, 887015.0 / 12288897},
    {1425312.0 / 73733382, 8788810.0 / 73733382, 70074185.0 / 73733382}};

/* The inverse of the above, to the last digit of a double. */
static const double rgb_from_xyz[3][3] = {
    {3.2410032329763587, -1.5373989694887855, -0.4986158819963629},
    {-0.9692242522025166, 1.875929983695176, 0.041554226340084724},
    {0.055639419851975444, -0.20401120612390997, 1.0571489771875335}};

static void multiply(const double m[3][3], const double v[3], double out[3]) {
    for (int r = 0; r < 3; r++)
        out[r] = m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2];
}

static void ycxcz_from_rgb(const double rgb[3], double ycc[3]) {
    double xyz[3];
    multiply(xyz_from_rgb, rgb, xyz);
    for (int i = 0; i < 3; i++)
        xyz[i] /= white[i];
    ycc[0] = 116 * xyz[1] - 16;
    ycc[1] = 500 * (xyz[0] - xyz[1]);
    ycc[2] = 200 * (xyz[1] - xyz[2]);
}

static void rgb_from_ycxcz(const double ycc[3], double rgb[3]) {
    double y = (ycc[0] + 16) / 116;
    double xyz[3] = {(y + ycc[1] / 500) * white[0], y * white[1], (y - ycc[2] / 200) * white[2]};
    multiply(rgb_from_xyz, xyz, rgb);
}

static double lab_curve(double t) {
    const double delta = 6.0 / 29;
    return t > delta * delta * delta ? cbrt(t) : t / (3 * delta * delta) + 4.0 / 29;
}

/* L*a*b* with the Hunt effect: colours look the more vivid the lighter they are. */
static void hunt_lab(const double rgb[3], double lab[3]) {
    double xyz[3];
    multiply(xyz_from_rgb, rgb, xyz);
    for (int i = 0; i < 3; i++)
        xyz[i] = lab_curve(xyz[i] / white[i]);
    lab[0] = 116 * xyz[1] - 16;
    lab[1] = 0.01 * lab[0] * 500 * (xyz[0] - xyz[1]);
    lab[2] = 0.01 * lab[0] * 200 * (xyz[1] - xyz[2]);
}

static double hyab(const double a[3], const double b[3]) {
    return fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]);
}

/* ---- filters ---- */

struct kernel {
    int radius;
    double tap[TAPS]; /* from -radius to radius */
};

/* A Gaussian of the contrast sensitivity, a sqrt(pi / b) exp(-pi^2 z / b), z in square degrees: its
 * square root, so that the product of rows and columns is it. */
static void sensitivity(double a, double b, int radius, struct kernel *kernel) {
    kernel->radius = radius;
    for (int k = -radius; k <= radius; k++) {
        double x = k / PIXELS_PER_DEGREE;
        kernel->tap[k + radius] = sqrt(a * sqrt(PI / b)) * exp(-PI * PI * x * x / b);
    }
}

static double sum_of(const struct kernel *kernel) {
    double sum = 0;
    for (int k = 0; k < 2 * kernel->radius + 1; k++)
        sum += kernel->tap[k];
    return sum;
}

static void scale(struct kernel *kernel, double factor) {
    for (int k = 0; k < 2 * kernel->radius + 1; k++)
        kernel->tap[k] *= factor;
}

/* One feature detector along x and the blur along y: the first derivative (edges) or the second
 * (points); positive and negative weights each add up to 1, which the blur, of one sign, keeps. */
static void detector(int derivative, struct kernel *along, struct kernel *blur) {
    double sd = 0.5 * EDGE_WIDTH_DEG * PIXELS_PER_DEGREE, above = 0, below = 0;
    along->radius = blur->radius = (int)ceil(3 * sd);
    for (int k = -along->radius; k <= along->radius; k++) {
        double g = exp(-k * k / (2 * sd * sd));
        double value = derivative == 1 ? -k * g : (k * k / (sd * sd) - 1) * g;
        along->tap[k + along->radius] = value;
        blur->tap[k + blur->radius] = g;
        *(value > 0 ? &above : &below) += fabs(value);
    }
    for (int k = 0; k < 2 * along->radius + 1; k++)
        along->tap[k] /= along->tap[k] > 0 ? above : below;
    scale(blur, 1 / sum_of(blur));
}

struct plane {
    int width, height;
};

static int clamp_to(int k, int count) {
    return k < 0 ? 0 : k >= count ? count - 1 : k;
}

/* out = in filtered by `rows` along x and by `columns` along y, added to what is there. */
static void filter(const struct plane *plane, const double *in, const struct kernel *rows,
                   const struct kernel *columns, double *spare, double *out) {
    int width = plane->width, height = plane->height;
    for (int y = 0; y < height; y++)
        for (int x = 0; x < width; x++) {
            double sum = 0;
            for (int k = -rows->radius; k <= rows->radius; k++)
                sum += rows->tap[k + rows->radius] *
                       in[(size_t)y * (size_t)width + (size_t)clamp_to(x + k, width)];
            spare[(size_t)y * (size_t)width + (size_t)x] = sum;
        }
    for (int y = 0; y < height; y++)
        for (int k = -columns->radius; k <= columns->radius; k++) {
            const double *row = spare + (size_t)clamp_to(y + k, height) * (size_t)width;
            double tap = columns->tap[k + columns->radius];
            double *to = out + (size_t)y * (size_t)width;
            for (int x = 0; x < width; x++)
                to[x] += tap * row[x];
        }
}

/* ---- one picture ---- */

/* Of one picture: after prepare(), `lab` holds the filtered colours, edge and point the features.
 */
struct look {
    double *lab[3], *edge, *point;
};

static double over_grey(const float *pixel, int i) {
    const double grey = 0.21404114048223255; /* sRGB 0.5 */
    double v = (double)pixel[i] + (1 - (double)pixel[3]) * grey;
    return v > 0 ? fmin(v, 1) : 0; /* no number: 0 */
}

static void filter_colors(const struct plane *plane, double *ycc[3], double *spare,
                          struct look *look) {
    /* 4.1.1, table 1: (a, b) of each channel's Gaussians. */
    static const double csf[3][2][2] = {
        {{1, 0.0047}, {0, 1e-5}}, {{1, 0.0053}, {0, 1e-5}}, {{34.1, 0.04}, {13.5, 0.025}}};
    int radius = (int)ceil(3 * sqrt(0.04 / (2 * PI * PI)) * PIXELS_PER_DEGREE);
    for (int channel = 0; channel < 3; channel++) {
        struct kernel kernel[2] = {{0}, {0}};
        double total = 0;
        for (int k = 0; k < 2; k++) {
            sensitivity(csf[channel][k][0], csf[channel][k][1], radius, &kernel[k]);
            total += sum_of(&kernel[k]) * sum_of(&kernel[k]);
        }
        for (int k = 0; k < 2; k++) {
            if (csf[channel][k][0] == 0)
                continue;
            scale(&kernel[k], 1 / sqrt(total));
            filter(plane, ycc[channel], &kernel[k], &kernel[k], spare, look->lab[channel]);
        }
    }
    size_t count = (size_t)plane->width * (size_t)plane->height;
    for (size_t p = 0; p < count; p++) {
        double v[3] = {look->lab[0][p], look->lab[1][p], look->lab[2][p]}, rgb[3], lab[3];
        rgb_from_ycxcz(v, rgb);
        for (int i = 0; i < 3; i++)
            rgb[i] = fmin(1, fmax(0, rgb[i]));
        hunt_lab(rgb, lab);
        for (int i = 0; i < 3; i++)
            look->lab[i][p] = lab[i];
    }
}

static void find_features(const struct plane *plane, const double *luminance, double *spare,
                          double *part, struct look *look) {
    size_t count = (size_t)plane->width * (size_t)plane->height;
    for (int derivative = 1; derivative <= 2; derivative++) {
        struct kernel along = {0}, blur = {0};
        double *out = derivative == 1 ? look->edge : look->point;
        detector(derivative, &along, &blur);
        for (int axis = 0; axis < 2; axis++) {
            memset(part, 0, count * sizeof *part);
            filter(plane, luminance, axis ? &blur : &along, axis ? &along : &blur, spare, part);
            for (size_t p = 0; p < count; p++)
                out[p] = axis ? sqrt(out[p] + part[p] * part[p]) : part[p] * part[p];
        }
    }
}

static void prepare(const float *pixels, const struct plane *plane, double *scratch[5],
                    struct look *look) {
    size_t count = (size_t)plane->width * (size_t)plane->height;
    for (size_t p = 0; p < count; p++) {
        double rgb[3], ycc[3];
        for (int i = 0; i < 3; i++)
            rgb[i] = over_grey(pixels + 4 * p, i);
        ycxcz_from_rgb(rgb, ycc);
        for (int i = 0; i < 3; i++)
            scratch[i][p] = ycc[i];
    }
    filter_colors(plane, scratch, scratch[3], look);
    for (size_t p = 0; p < count; p++)
        scratch[0][p] = (scratch[0][p] + 16) / 116;
    find_features(plane, scratch[0], scratch[3], scratch[4], look);
}

/* 4.1.3: errors below PC of the largest get PT of the range. */
static double redistribute(double power, double largest) {
    double limit = PC * largest;
    if (power < limit)
        return PT / limit * power;
    return PT + (power - limit) / (largest - limit) * (1 - PT);
}

enum status error_flip(const float *test, const float *reference, int width, int height, float *map,
                       double *mean, struct error *err) {
    size_t count = (size_t)width * (size_t)height;
    double *memory = calloc(BUFFERS * count + 1, sizeof *memory), *buffer[BUFFERS];
    if (!memory)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for FLIP");
    for (size_t i = 0; i < BUFFERS; i++)
        buffer[i] = memory + i * count;
    struct plane plane = {width, height};
    struct look look[2];
    const float *pixels[2] = {test, reference};
    for (int k = 0; k < 2; k++) {
        double **own = buffer + 5 + 5 * k;
        look[k] = (struct look){{own[0], own[1], own[2]}, own[3], own[4]};
        prepare(pixels[k], &plane, buffer, &look[k]);
    }
    double green[3], blue[3];
    hunt_lab((const double[3]){0, 1, 0}, green);
    hunt_lab((const double[3]){0, 0, 1}, blue);
    double largest = pow(hyab(green, blue), QC), sum = 0;
    for (size_t p = 0; p < count; p++) {
        double a[3] = {look[0].lab[0][p], look[0].lab[1][p], look[0].lab[2][p]};
        double b[3] = {look[1].lab[0][p], look[1].lab[1][p], look[1].lab[2][p]};
        double color = fmin(1, redistribute(pow(hyab(a, b), QC), largest));
        double feature = fmax(fabs(look[0].edge[p] - look[1].edge[p]),
                              fabs(look[0].point[p] - look[1].point[p]));
        feature = fmin(1, pow(feature / sqrt(2), QF));
        double flip = pow(color, 1 - feature);
        map[p] = (float)flip;
        sum += flip;
    }
    *mean = count ? sum / (double)count : 0;
    free(memory);
    return STATUS_OK;
}
