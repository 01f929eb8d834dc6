/* The reference against an estimator that has nothing in common with it: delta tracking (Woodcock,
 * Murphy, Hemmings, Longmore 1965), which is unbiased whatever the medium, over points found by
 * inverting P with Newton's method, with trilinear voxels and light written down once more.
 *
 * A free path ends with probability sigma / majorant at each tentative collision; what it brings is
 * the source colour there and an alpha of 1, or nothing where it leaves. Mean and variance over n
 * paths give a z for each pixel, and the sum of z^2 over the pixels is chi-square. Seeds are fixed.
 * PELT_PATHS and PELT_PIXELS set how many (make stability takes more). */
#include <math.h>
#include <stdlib.h>

#include "renderer/asset/mesh_thickness.h"
#include "tests/reference_fixture.h"

struct random {
    uint64_t state;
};

/* splitmix64 (Steele, Lea, Flood 2014), to (0, 1). */
static double uniform(struct random *random) {
    uint64_t z = random->state += 0x9e3779b97f4a7c15u;
    z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9u;
    z = (z ^ z >> 27) * 0x94d049bb133111ebu;
    return ((double)((z ^ z >> 31) >> 11) + 0.5) * 0x1p-53;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double normalize(double v[3]) {
    double length = sqrt(dot(v, v));
    for (int i = 0; i < 3; i++)
        v[i] /= length;
    return length;
}

/* ---- the scene once more ---- */

struct shape {
    const struct scene_object *spec;
    const struct mesh *mesh;
    const struct volume *volume;
    struct mesh_thickness thickness;
    double inverse[3][3]; /* object from world */
    double majorant;      /* extinction for each unit of object length */
};

struct setting {
    const struct scene *scene;
    size_t count;
    struct shape shape[4];
};

static void open_setting(struct truth_fixture *truth, struct setting *setting) {
    setting->scene = &truth->scene;
    setting->count = truth->scene.object_count;
    for (size_t k = 0; k < setting->count; k++) {
        struct shape *shape = &setting->shape[k];
        bool made;
        shape->spec = &truth->scene.objects[k];
        const struct scene_shell *shell = &shape->spec->shell;
        assert_int_equal(mesh_acquire(truth->sources.meshes, &shell->mesh, false, "",
                                      &truth->assets, &shape->mesh, NULL),
                         STATUS_OK);
        assert_int_equal(volume_acquire(truth->sources.volumes, &shell->material, shell->thickness,
                                        "", &truth->assets, &shape->volume, &made, NULL),
                         STATUS_OK);
        assert_int_equal(
            mesh_thickness_limit(shape->mesh, shell->thickness, &shape->thickness, NULL),
            STATUS_OK);
        const double *m = shape->spec->transform;
        double column[3][3], det;
        for (int c = 0; c < 3; c++)
            for (int r = 0; r < 3; r++)
                column[c][r] = m[4 * c + r];
        for (int c = 0; c < 3; c++)
            cross(column[(c + 1) % 3], column[(c + 2) % 3], shape->inverse[c]);
        det = dot(column[0], shape->inverse[0]);
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                shape->inverse[r][c] /= det;
        shape->majorant = shape->volume->homogeneous
                              ? shape->volume->extinction
                              : (double)shape->volume->medium_max / shell->thickness;
    }
}

static void close_setting(struct truth_fixture *truth, struct setting *setting) {
    for (size_t k = 0; k < setting->count; k++) {
        mesh_thickness_finish(&setting->shape[k].thickness);
        volume_release(truth->sources.volumes, setting->shape[k].volume);
        mesh_release(truth->sources.meshes, setting->shape[k].mesh);
    }
}

static void vertex_at(const struct shape *shape, uint32_t v, double w, double out[3]) {
    for (int i = 0; i < 3; i++)
        out[i] = shape->mesh->position[v][i] +
                 w * shape->thickness.height[v] * shape->mesh->normal[v][i];
}

/* (b, w) of an object-space point in one prism, and dP's columns there. */
static bool invert(const struct shape *shape, uint32_t f, const double x[3], double b[3], double *w,
                   double e1[3], double e2[3], double up[3]) {
    const uint32_t *v = shape->mesh->vertex[f];
    b[1] = b[2] = 1.0 / 3;
    *w = 0.5;
    for (int round = 0; round < 40; round++) {
        double p[3][3], top[3][3], r[3], c1[3], c2[3], c3[3];
        b[0] = 1 - b[1] - b[2];
        for (int k = 0; k < 3; k++) {
            vertex_at(shape, v[k], *w, p[k]);
            vertex_at(shape, v[k], 1, top[k]);
        }
        for (int i = 0; i < 3; i++) {
            r[i] = x[i] - b[0] * p[0][i] - b[1] * p[1][i] - b[2] * p[2][i];
            e1[i] = p[1][i] - p[0][i];
            e2[i] = p[2][i] - p[0][i];
            up[i] = 0;
            for (int k = 0; k < 3; k++)
                up[i] += b[k] * (top[k][i] - shape->mesh->position[v[k]][i]);
        }
        cross(e2, up, c1);
        cross(up, e1, c2);
        cross(e1, e2, c3);
        double det = dot(c3, up), step[3] = {dot(c1, r) / det, dot(c2, r) / det, dot(c3, r) / det};
        double most = fmax(fabs(step[0]), fmax(fabs(step[1]), fabs(step[2])));
        if (!isfinite(most))
            return false;
        double factor = most > 0.5 ? 0.5 / most : 1;
        b[1] += factor * step[0];
        b[2] += factor * step[1];
        *w += factor * step[2];
        if (most < 1e-12)
            return b[1] >= 0 && b[2] >= 0 && b[1] + b[2] <= 1 && *w >= 0 && *w <= 1;
    }
    return false;
}

static const float *voxel(const struct volume *volume, int x, int y, int z) {
    const int *n = volume->size;
    x = (x % n[0] + n[0]) % n[0];
    y = (y % n[1] + n[1]) % n[1];
    z = z < 0 ? 0 : z > n[2] - 1 ? n[2] - 1 : z;
    return volume->medium + 4 * ((size_t)(z * n[1] + y) * (size_t)n[0] + (size_t)x);
}

static double opacity(const struct volume *volume, int x, int y, int z) {
    return 1 - exp(-(double)voxel(volume, x, y, z)[3] / volume->size[2]);
}

/* Extinction for each unit of object length, and the source colour. */
static double material_at(const struct setting *setting, const struct shape *shape, uint32_t f,
                          const double b[3], double w, const double e1[3], const double e2[3],
                          const double up[3], const double view[3], double source[3]) {
    const struct volume *volume = shape->volume;
    const double *tiles = shape->spec->shell.tiles;
    if (volume->homogeneous) {
        memcpy(source, volume->radiance, 3 * sizeof *source);
        return volume->extinction;
    }
    double at[3] = {0, 0, w * volume->size[2] - 0.5}, uv[3][2], value[4] = {0}, g[3] = {0};
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 3; k++) {
            uv[k][i] = shape->mesh->corner_uv[f][k][i] * tiles[i] * volume->size[i];
            at[i] += b[k] * uv[k][i];
        }
        at[i] -= 0.5;
    }
    int base[3] = {(int)floor(at[0]), (int)floor(at[1]), (int)floor(at[2])};
    for (int c = 0; c < 8; c++) {
        int q[3];
        double weight = 1;
        for (int i = 0; i < 3; i++) {
            int bit = c >> i & 1;
            q[i] = base[i] + bit;
            weight *= bit ? at[i] - base[i] : 1 - (at[i] - base[i]);
        }
        q[2] = q[2] < 0 ? 0 : q[2] > volume->size[2] - 1 ? volume->size[2] - 1 : q[2];
        for (int i = 0; i < 4; i++)
            value[i] += weight * (double)voxel(volume, q[0], q[1], q[2])[i];
        for (int i = 0; i < 3; i++) {
            int lo[3] = {q[0], q[1], q[2]}, hi[3] = {q[0], q[1], q[2]};
            lo[i]--;
            hi[i]++;
            g[i] += weight *
                    (opacity(volume, lo[0], lo[1], lo[2]) - opacity(volume, hi[0], hi[1], hi[2])) /
                    2;
        }
    }
    if (!(value[3] > 0))
        return 0;
    double color[3] = {value[0] / value[3], value[1] / value[3], value[2] / value[3]};
    memcpy(source, color, sizeof color);
    if (volume->lit) {
        /* grad over (u, v, w) in voxels -> over (b1, b2, w) -> object -> world */
        double over[3] = {g[0] * (uv[1][0] - uv[0][0]) + g[1] * (uv[1][1] - uv[0][1]),
                          g[0] * (uv[2][0] - uv[0][0]) + g[1] * (uv[2][1] - uv[0][1]),
                          g[2] * volume->size[2]};
        double c1[3], c2[3], c3[3], n[3], local[3];
        cross(e2, up, c1);
        cross(up, e1, c2);
        cross(e1, e2, c3);
        double det = dot(c3, up);
        for (int i = 0; i < 3; i++)
            local[i] = (over[0] * c1[i] + over[1] * c2[i] + over[2] * c3[i]) / det;
        for (int i = 0; i < 3; i++)
            n[i] = shape->inverse[0][i] * local[0] + shape->inverse[1][i] * local[1] +
                   shape->inverse[2][i] * local[2];
        double length = sqrt(dot(g, g)), weight = length / (length + 0.01);
        if (!(dot(n, n) > 0))
            weight = 0;
        else
            normalize(n);
        const struct scene *scene = setting->scene;
        for (int i = 0; i < 3; i++)
            source[i] = color[i] * scene->ambient[i];
        for (size_t k = 0; k < scene->light_count; k++) {
            double l[3], h[3];
            for (int i = 0; i < 3; i++)
                l[i] = -scene->lights[k].direction[i];
            normalize(l);
            for (int i = 0; i < 3; i++)
                h[i] = l[i] + view[i];
            normalize(h);
            double shine = pow(fmax(0, dot(n, h)), (double)volume->shininess);
            for (int i = 0; i < 3; i++)
                source[i] += scene->lights[k].color[i] *
                             (color[i] * (weight * fmax(0, dot(n, l)) + (1 - weight) / 4) +
                              weight * (double)volume->specular * shine);
        }
    }
    return value[3] / shape->spec->shell.thickness;
}

/* ---- paths ---- */

enum { NEAR_MAX = 512 };

struct near_prism {
    uint32_t shape, prism;
    double t0, t1; /* of the ball around it */
};

struct path_ray {
    double o[3], d[3], local_o[4][3], local_d[4][3], speed[4];
    struct near_prism near[NEAR_MAX];
    size_t near_count;
    double t0, t1, majorant;
};

static void open_ray(const struct setting *setting, size_t pixel, struct path_ray *ray) {
    truth_pixel_ray(setting->scene, pixel, ray->o, ray->d);
    ray->near_count = 0;
    ray->t0 = INFINITY;
    ray->t1 = 0;
    ray->majorant = 0;
    for (size_t k = 0; k < setting->count; k++) {
        const struct shape *shape = &setting->shape[k];
        const double *m = shape->spec->transform;
        double moved[3] = {ray->o[0] - m[12], ray->o[1] - m[13], ray->o[2] - m[14]};
        for (int r = 0; r < 3; r++) {
            ray->local_o[k][r] = dot(shape->inverse[r], moved);
            ray->local_d[k][r] = dot(shape->inverse[r], ray->d);
        }
        const double *o = ray->local_o[k], *d = ray->local_d[k];
        double d2 = dot(d, d);
        ray->speed[k] = sqrt(d2);
        ray->majorant += shape->majorant * ray->speed[k];
        for (uint32_t f = 0; f < shape->mesh->triangle_count; f++) {
            double p[6][3], middle[3] = {0, 0, 0}, reach2 = 0, away[3];
            for (int c = 0; c < 6; c++) {
                vertex_at(shape, shape->mesh->vertex[f][c % 3], c / 3, p[c]);
                for (int i = 0; i < 3; i++)
                    middle[i] += p[c][i] / 6;
            }
            for (int c = 0; c < 6; c++) {
                double r[3] = {p[c][0] - middle[0], p[c][1] - middle[1], p[c][2] - middle[2]};
                reach2 = fmax(reach2, dot(r, r));
            }
            for (int i = 0; i < 3; i++)
                away[i] = middle[i] - o[i];
            double t = dot(away, d) / d2, gap2 = dot(away, away) - t * t * d2;
            if (gap2 > reach2)
                continue;
            double half = sqrt((reach2 - gap2) / d2) * (1 + 1e-9);
            if (t + half < 0)
                continue;
            assert_true(ray->near_count < NEAR_MAX);
            ray->near[ray->near_count++] = (struct near_prism){(uint32_t)k, f, t - half, t + half};
            ray->t0 = fmin(ray->t0, fmax(0, t - half));
            ray->t1 = fmax(ray->t1, t + half);
        }
    }
}

/* Follows one path; result is premultiplied RGBA. */
static void follow(const struct setting *setting, const struct path_ray *ray, struct random *random,
                   double result[4]) {
    const double view[3] = {-ray->d[0], -ray->d[1], -ray->d[2]};
    memset(result, 0, 4 * sizeof *result);
    double t = ray->t0;
    while ((t -= log(uniform(random)) / ray->majorant) < ray->t1) {
        double sigma = 0, emitted[3] = {0, 0, 0};
        for (size_t n = 0; n < ray->near_count; n++) {
            const struct near_prism *near = &ray->near[n];
            if (t < near->t0 || t > near->t1)
                continue;
            const struct shape *shape = &setting->shape[near->shape];
            double x[3], b[3], w, e1[3], e2[3], up[3], source[3] = {0, 0, 0};
            for (int i = 0; i < 3; i++)
                x[i] = ray->local_o[near->shape][i] + t * ray->local_d[near->shape][i];
            if (!invert(shape, near->prism, x, b, &w, e1, e2, up))
                continue;
            double s = ray->speed[near->shape] *
                       material_at(setting, shape, near->prism, b, w, e1, e2, up, view, source);
            sigma += s;
            for (int i = 0; i < 3; i++)
                emitted[i] += s * source[i];
        }
        assert_true(sigma <= ray->majorant * (1 + 1e-6));
        if (uniform(random) * ray->majorant < sigma) {
            for (int i = 0; i < 3; i++)
                result[i] = emitted[i] / sigma;
            result[3] = 1;
            return;
        }
    }
}

/* ---- chi-square ---- */

/* The value that chi-square of n degrees exceeds with probability 0.001: Wilson & Hilferty 1931. */
static double chi_square_limit(double n) {
    double c = 1 - 2 / (9 * n) + 3.0902 * sqrt(2 / (9 * n));
    return n * c * c * c;
}

static long setting_of(const char *name, long otherwise) {
    const char *text = getenv(name);
    return text ? atol(text) : otherwise;
}

static const struct {
    const char *name, *json;
} scenes[] = {
    {"a slab of clouds, aslant",
     "'camera': {'eye': [1, -3, 2], 'target': [0, 0, 0.2], 'fov_y_deg': 30}, 'objects': [{'shell': "
     "{'mesh': {'shape': 'plane', 'divisions': [2, 2]}, 'thickness': 0.4, 'tiles': [2, 2], "
     "'material': {'builtin': 'clouds', 'size': [24, 24, 8]}}}]"},
    {"clouds around a torus, with a highlight",
     "'camera': {'eye': [0, -3, 2], 'target': [0, 0, 0], 'fov_y_deg': 50}, 'objects': [{'shell': "
     "{'mesh': {'shape': 'torus', 'divisions': [12, 8]}, 'thickness': 0.25, 'tiles': [6, 3], "
     "'material': {'builtin': 'clouds', 'size': [24, 24, 8], 'specular': 0.5, 'shininess': 8}}}]"},
    {"clouds in clouds and in fog",
     "'camera': {'eye': [0.3, -3, 1.5], 'target': [0, 0, 0], 'fov_y_deg': 40}, 'objects': "
     "[{'shell': {'mesh': {'shape': 'sphere', 'radius': 0.6, 'divisions': [9, 6]}, 'thickness': "
     "0.3, 'material': {'builtin': 'clouds', 'size': [16, 16, 8]}}}, {'shell': {'mesh': {'shape': "
     "'plane', 'divisions': [2, 2]}, 'thickness': 0.5, 'tiles': [2, 2], 'material': {'builtin': "
     "'clouds', 'size': [16, 16, 8], 'seed': 4}}}, {'shell': {'mesh': {'shape': 'plane'}, "
     "'thickness': 1, 'material': {'builtin': 'homogeneous', 'extinction': 0.7}}, 'transform': "
     "{'translate': [0, 0, -0.3]}}]"},
    {"the eye inside the shell",
     "'camera': {'eye': [0.1, -1.25, 0.1], 'target': [0.8, 0, 0.6], 'fov_y_deg': 90}, 'objects': "
     "[{'shell': {'mesh': {'shape': 'sphere', 'divisions': [9, 6]}, 'thickness': 0.5, 'tiles': [6, "
     "3], 'material': {'builtin': 'clouds', 'size': [24, 24, 8]}}}]"},
    {"mirrored, stretched and turned",
     "'camera': {'eye': [0, -4, 2], 'target': [0, 0, 0], 'fov_y_deg': 40}, 'lights': "
     "[{'direction': [1, 2, -1]}, {'direction': [-1, 0.3, 0.2], 'color': [0, 1, 2]}], 'objects': "
     "[{'shell': {'mesh': {'shape': 'torus', 'divisions': [10, 7]}, 'thickness': 0.25, 'tiles': "
     "[5, 2], 'material': {'builtin': 'clouds', 'size': [24, 24, 8]}}, 'transform': {'rotate_deg': "
     "[40, 10, 70], 'scale': [-1.2, 0.7, 2]}}]"},
    {"clouds over a terrain",
     "'camera': {'eye': [0.4, -4, 1.2], 'target': [0, 0, 0.2], 'fov_y_deg': 30}, 'objects': "
     "[{'shell': {'mesh': {'shape': 'terrain', 'divisions': [8, 8]}, 'thickness': 0.3, 'tiles': "
     "[3, 3], 'material': {'builtin': 'clouds', 'size': [24, 24, 8]}}}]"},
    {"unlit, orthographic",
     "'camera': {'eye': [1, -3, 1], 'target': [0, 0, 0], 'ortho_height': 2.4}, 'objects': "
     "[{'shell': {'mesh': {'shape': 'sphere', 'divisions': [10, 6]}, 'thickness': 0.3, 'tiles': "
     "[7, 3], 'material': {'builtin': 'clouds', 'size': [24, 24, 8], 'lit': false}}}]"},
    {"fur",
     "'camera': {'eye': [0.5, -3, 2], 'target': [0, 0, 0], 'fov_y_deg': 40}, 'objects': [{'shell': "
     "{'mesh': {'shape': 'cylinder', 'divisions': [9, 3]}, 'thickness': 0.3, 'tiles': [3, 3], "
     "'material': {'builtin': 'fur', 'size': [24, 24, 8]}}}]"},
    {"few voxels, many tiles",
     "'camera': {'eye': [1, -3, 3], 'target': [0, 0, 0.1], 'fov_y_deg': 30}, 'objects': [{'shell': "
     "{'mesh': {'shape': 'plane', 'divisions': [3, 3]}, 'thickness': 0.3, 'tiles': [40, 0.3], "
     "'material': {'builtin': 'clouds', 'size': [4, 3, 3]}}}]"},
    {"thinned where it would fold",
     "'camera': {'eye': [0, -4, 3], 'target': [0, 0, 0], 'fov_y_deg': 40}, 'objects': [{'shell': "
     "{'mesh': {'shape': 'torus', 'radius': 0.8, 'tube': 0.5, 'divisions': [12, 8]}, 'thickness': "
     "0.6, 'tiles': [6, 3], 'material': {'builtin': 'clouds', 'size': [24, 24, 8]}}}]"},
};

static void test_agreement(void **state) {
    (void)state;
    long paths = setting_of("PELT_PATHS", 150), wanted = setting_of("PELT_PIXELS", 5);
    for (size_t s = 0; s < sizeof scenes / sizeof *scenes; s++) {
        struct truth_fixture truth;
        struct setting setting;
        assert_int_equal(truth_open(&truth,
                                    "{'image': {'width': 32, 'height': 32, 'samples': 1}, %s}",
                                    scenes[s].json),
                         STATUS_OK);
        truth_draw(&truth, 0, 0);
        open_setting(&truth, &setting);
        struct random random = {s + 1};
        double chi[4] = {0, 0, 0, 0};
        long used = 0;
        for (long tries = 0; used < wanted && tries < 100 * wanted; tries++) {
            size_t pixel = (size_t)(uniform(&random) * 1024);
            const double *expected = truth.result.pixels[pixel];
            /* Where alpha is all but 0 or 1 its estimate is far from normal. */
            if (expected[3] < 0.05 || expected[3] > 0.95)
                continue;
            struct path_ray ray;
            open_ray(&setting, pixel, &ray);
            double sum[4] = {0}, squares[4] = {0};
            for (long n = 0; n < paths; n++) {
                double result[4];
                follow(&setting, &ray, &random, result);
                for (int i = 0; i < 4; i++) {
                    sum[i] += result[i];
                    squares[i] += result[i] * result[i];
                }
            }
            double count = (double)paths;
            for (int i = 0; i < 4; i++) {
                double mean = sum[i] / count;
                double variance = i < 3 ? (squares[i] / count - mean * mean) / (count - 1)
                                        : expected[3] * (1 - expected[3]) / count;
                double off = mean - expected[i];
                chi[i] += off * off / variance;
            }
            used++;
        }
        print_message("%-40s %3ld pixels, chi-square %.1f %.1f %.1f %.1f, limit %.1f\n",
                      scenes[s].name, used, chi[0], chi[1], chi[2], chi[3],
                      chi_square_limit((double)used));
        assert_true(used >= wanted);
        for (int i = 0; i < 4; i++)
            if (!(chi[i] < chi_square_limit((double)used)))
                fail_msg("%s: channel %d", scenes[s].name, i);
        close_setting(&truth, &setting);
        truth_close(&truth);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_agreement),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
