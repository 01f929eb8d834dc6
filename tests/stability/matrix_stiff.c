/* Stiff media: dL/ds = -sigma L + sigma c, from an optical depth of 1e-6 to 1e6, and where it jumps
 * from one voxel to the next. */
#include "tests/stability/matrix_scenes.h"

/* ---- homogeneous slabs: any depth, angle, number of samples ---- */

static void slabs(struct matrix *matrix) {
    static const double depths[] = {1e-6, 1e-3, 1, 10, 30, 1e3, 1e6};
    static const int angles[] = {0, 60, 85};
    for (size_t d = 0; d < sizeof depths / sizeof *depths; d++)
        for (size_t a = 0; a < sizeof angles / sizeof *angles; a++)
            for (int samples = 1; samples <= 256; samples *= 16) {
                double angle = angles[a] * M_PI / 180;
                struct matrix_case made = {.group = "stiff",
                                           .quick = (samples == 1 && angles[a] != 60) ||
                                                    (samples == 256 && d == 2 && a == 0),
                                           .bound = BOUND_DEPTH,
                                           .most = BOUND_DEPTH_RELATIVE,
                                           .why = WHY_CLOSED_FORM};
                snprintf(made.name, sizeof made.name, "slab, depth %g, %d deg, %d samples",
                         depths[d], angles[a], samples);
                matrix_add(
                    matrix, made,
                    "{'image': {'width': 12, 'height': 12, 'samples': %d}, 'camera': {'eye': "
                    "[%.17g, 0, %.17g], 'target': [0, 0, 0.1], 'up': [0, 1, 0], "
                    "'ortho_height': 0.4}, 'objects': [{'shell': {'mesh': {'shape': 'plane', "
                    "'size': [8, 8], 'divisions': [7, 5]}, 'thickness': 0.2, " HOMOGENEOUS "}}]}",
                    samples, 20 * sin(angle), 20 * cos(angle) + 0.1, depths[d] / 0.2 * cos(angle));
            }
}

/* The same in perspective, as voxels, with one step a thickness and with many: a constant field has
 * no discretisation. */
static void fill_alpha(struct volume *volume, const struct matrix_case *self) {
    static const double color[3] = {0.25, 0.5, 1};
    voxels_fill(volume, voxel_depth(volume, self->arg[0]), color);
}

static void uniform_voxels(struct matrix *matrix) {
    static const double alphas[] = {1e-6, 1.0 / 255, 0.5, 254.0 / 255};
    for (size_t a = 0; a < sizeof alphas / sizeof *alphas; a++)
        for (int steps = 1; steps <= 64; steps *= 64) {
            struct matrix_case made = {.group = "stiff",
                                       .quick = steps == 1,
                                       .voxels = fill_alpha,
                                       .arg = {alphas[a]},
                                       .bound = BOUND_DEPTH,
                                       .most = BOUND_DEPTH_RELATIVE,
                                       .why = WHY_CLOSED_FORM};
            if (a >= 2) {
                made.bound = BOUND_PICTURE;
                made.most = made.most_max = fmin(1e-4, 0.1 / (steps * steps)) + 1e-6;
                made.why = "a walk ends where less than 1e-4, or 0.1 / steps^2, is let through";
            }
            snprintf(made.name, sizeof made.name, "voxels of alpha %.3g, %d steps", alphas[a],
                     steps);
            matrix_add(matrix, made,
                       "{" IMAGE(32) FROM_THE_FRONT
                       "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [8, 8], "
                       "'divisions': [9, 9]}, 'thickness': 0.2, 'material': {'builtin': 'clouds', "
                       "'size': [4, 4, 4], 'lit': false}}, 'quality': {'samples': %d}}]}",
                       steps);
        }
}

/* ---- jumps ---- */

static void fill_one(struct volume *volume, const struct matrix_case *self) {
    static const double color[3] = {1, 0.5, 0.25};
    for (int z = 0; z < volume->size[2]; z++)
        for (int y = 0; y < volume->size[1]; y++)
            for (int x = 0; x < volume->size[0]; x++)
                voxel_set(volume, x, y, z, x == 3 && y == 4 && z == 4 ? self->arg[0] : 0, color);
}

static void fill_layers(struct volume *volume, const struct matrix_case *self) {
    static const double color[2][3] = {{0.2, 0.4, 1}, {1, 0.5, 0.25}};
    for (int z = 0; z < volume->size[2]; z++)
        for (int y = 0; y < volume->size[1]; y++)
            for (int x = 0; x < volume->size[0]; x++)
                voxel_set(volume, x, y, z, voxel_depth(volume, self->arg[z & 1]), color[z & 1]);
}

static void jumps(struct matrix *matrix) {
    static const char *const views[] = {FROM_ABOVE, FROM_THE_FRONT};
    static const char *const names[] = {"above", "aslant"};
    for (int v = 0; v < 2; v++) {
        struct matrix_case made = {.group = "stiff",
                                   .quick = true,
                                   .voxels = fill_one,
                                   .arg = {1e6},
                                   .bound = BOUND_PICTURE,
                                   .most = 1e-4,
                                   .outliers = v,
                                   .limit = 2048,
                                   .why =
                                       v ? "all or nothing; one ray may cut a corner of less than "
                                           "a step, 1/64 voxel"
                                         : "every ray within the voxel's reach crosses two "
                                           "voxels of it: all or nothing, and none is missed"};
        snprintf(made.name, sizeof made.name, "one voxel of depth 1e6, %s", names[v]);
        matrix_add(matrix, made,
                   "{" IMAGE(48) "%s'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': "
                                 "[3, 3]}, 'thickness': 0.4, 'tiles': [1, 1], 'material': "
                                 "{'builtin': 'clouds', 'size': [8, 8, 8], 'lit': false}}, "
                                 "'quality': {'samples': 512}}]}",
                   views[v]);
        made.arg[0] = 1;
        made.most = 1e-5;
        made.outliers = 1;
        made.why = "one unlit colour or nothing; one ray may graze the 1/2 level for less than a "
                   "step, 1/64 voxel";
        snprintf(made.name, sizeof made.name, "one solid voxel, %s", names[v]);
        matrix_add(matrix, made,
                   "{" IMAGE(48) "%s'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': "
                                 "[3, 3]}, 'thickness': 0.4, 'tiles': [1, 1], 'material': "
                                 "{'builtin': 'chain', 'size': [8, 8, 8], 'lit': false}}, "
                                 "'quality': {'samples': 512}}]}",
                   views[v]);
        static const double layers[][2] = {{0, 254.0 / 255}, {254.0 / 255, 0.2}, {1.0 / 255, 0.9}};
        for (int k = 0; k < 3; k++) {
            made.voxels = fill_layers;
            made.arg[0] = layers[k][0];
            made.arg[1] = layers[k][1];
            made.most = 1e-3;
            made.outliers = 0;
            made.quick = k == 0;
            made.why = "midpoints of steps s = 1/64 layer: s^2/8 of the jump in slope at each "
                       "layer's centre, 2 x 5.54 a layer, is 3.4e-4 in optical depth, and three "
                       "centres are seen";
            snprintf(made.name, sizeof made.name, "layers of alpha %.2g and %.2g, %s", layers[k][0],
                     layers[k][1], names[v]);
            matrix_add(matrix, made,
                       "{" IMAGE(32) "%s'objects': [{'shell': {'mesh': {'shape': 'plane', "
                                     "'divisions': [3, 3]}, 'thickness': 0.4, 'tiles': [1, 1], "
                                     "'material': {'builtin': 'clouds', 'size': [2, 2, 16], "
                                     "'lit': false}}, 'quality': {'samples': 1024}}]}",
                       views[v]);
        }
    }
}

/* ---- thousands of layers ---- */

static void many_layers(struct matrix *matrix) {
    struct matrix_case made = {.group = "stiff",
                               .name = "voxels of alpha 1",
                               .quick = true,
                               .voxels = voxels_solid,
                               .bound = BOUND_PICTURE,
                               .most = 1e-6,
                               .why = "every ray ends where it enters, on one unlit colour"};
    matrix_add(matrix, made,
               "{" IMAGE(32) FROM_THE_FRONT
               "'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [3, 3]}, "
               "'thickness': 0.2, 'material': {'builtin': 'chain', 'size': [4, 4, 4], "
               "'lit': false}}}]}");

    made = (struct matrix_case){.group = "stiff",
                                .name = "4,000 cells of alpha 1/255 in a row",
                                .quick = true,
                                .bound = BOUND_DEPTH,
                                .most = BOUND_DEPTH_RELATIVE,
                                .why = WHY_CLOSED_FORM};
    matrix_add(matrix, made,
               "{" IMAGE(12) "'camera': {'eye': [-9, 0.01, 0.013], 'target': [0, 0, 0.01], "
                             "'ortho_height': 0.01}, 'objects': [{'shell': {'mesh': {'shape': "
                             "'plane', 'size': [8, 0.1], 'divisions': [1334, 1]}, 'thickness': "
                             "0.02, " HOMOGENEOUS "}}]}",
               4000 * -log1p(-1.0 / 255) / 8);

    made.name[0] = 0;
    snprintf(made.name, sizeof made.name, "4,032 voxel layers of alpha 1/255 in 63 shells");
    made.voxels = fill_alpha;
    made.arg[0] = 1.0 / 255;
    made.quick = false;
    made.may_refuse = "walk";
    char *objects = malloc(63 * 400);
    if (!objects)
        abort();
    int used = 0;
    for (int i = 0; i < 63; i++)
        used += snprintf(objects + used, 400,
                         "%s{'shell': {'mesh': {'shape': 'plane', 'divisions': [1, 1]}, "
                         "'thickness': 0.01, 'material': {'builtin': 'clouds', 'size': [1, 1, 64], "
                         "'lit': false}}, 'quality': {'samples': 64}, 'transform': {'translate': "
                         "[0, 0, %.3f]}}",
                         i ? ", " : "", 0.011 * i);
    matrix_add(matrix, made, "{" IMAGE(12) FROM_ABOVE "'objects': [%s]}", objects);
    free(objects);
}

void matrix_stiff(struct matrix *matrix) {
    slabs(matrix);
    uniform_voxels(matrix);
    jumps(matrix);
    many_layers(matrix);
}
