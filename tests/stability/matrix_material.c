/* Materials at the ends of their ranges: one voxel, one row of 512, nothing, solid throughout;
 * tiles a hundred times the surface and a ten-thousandth of it. */
#include "tests/stability/matrix_scenes.h"

static void fill_nothing(struct volume *volume, const struct matrix_case *self) {
    (void)self;
    static const double color[3] = {1, 1, 1};
    voxels_fill(volume, 0, color);
}

static void fill_value(struct volume *volume, const struct matrix_case *self) {
    static const double color[3] = {1, 0.5, 0.25};
    voxels_fill(volume, self->arg[0], color);
}

/* Optical depths across a thickness of 0 and arg[0] in turn along u. */
static void fill_stripes(struct volume *volume, const struct matrix_case *self) {
    static const double color[2][3] = {{1, 0.5, 0.25}, {0.2, 0.4, 1}};
    for (int z = 0; z < volume->size[2]; z++)
        for (int y = 0; y < volume->size[1]; y++)
            for (int x = 0; x < volume->size[0]; x++)
                voxel_set(volume, x, y, z, x & 1 ? self->arg[0] : 0.1, color[x & 1]);
}

#define PLANE(camera, size, tiles, builtin, voxels, samples)                                       \
    "{" IMAGE(48) camera LIGHTS "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': " size  \
                                ", 'divisions': [4, 4]}, 'thickness': 0.2, 'tiles': " tiles        \
                                ", 'material': {'builtin': '" builtin "', 'size': " voxels         \
                                ", 'lit': %s}}, 'quality': {'samples': " samples "}}]}"

void matrix_material(struct matrix *matrix) {
    struct matrix_case made = {.group = "material",
                               .quick = true,
                               .voxels = fill_value,
                               .arg = {1.7},
                               .bound = BOUND_DEPTH,
                               .most = BOUND_DEPTH_RELATIVE,
                               .why = WHY_CLOSED_FORM};
    snprintf(made.name, sizeof made.name, "1x1x1, unlit");
    matrix_add(matrix, made, PLANE(FROM_THE_FRONT, "[8, 8]", "[12, 6]", "clouds", "[1, 1, 1]", "1"),
               "false");
    snprintf(made.name, sizeof made.name, "1x1x1, lit");
    matrix_add(matrix, made, PLANE(FROM_THE_FRONT, "[8, 8]", "[12, 6]", "clouds", "[1, 1, 1]", "1"),
               "true");
    made.bound = BOUND_PICTURE;
    made.most = made.most_max = 1e-6;
    made.voxels = fill_nothing;
    made.why = "nothing: every pixel is empty";
    snprintf(made.name, sizeof made.name, "a medium of nothing");
    matrix_add(matrix, made, PLANE(FROM_THE_FRONT, "[8, 8]", "[12, 6]", "clouds", "[8, 8, 4]", "8"),
               "true");
    snprintf(made.name, sizeof made.name, "a solid of nothing");
    matrix_add(matrix, made, PLANE(FROM_THE_FRONT, "[8, 8]", "[12, 6]", "chain", "[8, 8, 4]", "8"),
               "true");
    made.voxels = fill_value;
    made.arg[0] = 1;
    made.most = made.most_max = 1e-5;
    made.why = "solid throughout: the shell's own faces, lit by their normals";
    snprintf(made.name, sizeof made.name, "solid throughout, lit");
    matrix_add(matrix, made, PLANE(FROM_THE_FRONT, "[8, 8]", "[12, 6]", "chain", "[8, 8, 4]", "8"),
               "true");

    made = (struct matrix_case){.group = "material",
                                .quick = true,
                                .voxels = fill_stripes,
                                .arg = {3},
                                .bound = BOUND_PICTURE,
                                .limit = 2048};
    snprintf(made.name, sizeof made.name, "512x1x1, above");
    made.most = 1e-4;
    made.why = "rays along w meet one value; fp32 places them to 512 x 2^-24 = 3e-5 of a voxel";
    matrix_add(matrix, made, PLANE(FROM_ABOVE, "[8, 8]", "[1, 1]", "clouds", "[512, 1, 1]", "8"),
               "false");
    snprintf(made.name, sizeof made.name, "512x1x1, aslant, 8 steps");
    made.most = (3.0 / 8) * (3.0 / 8) / 8 * 0.5;
    made.why = "midpoints of steps 3/8 deep, 1.6 voxels long: (3/8)^2 / 8 of a contrast of 0.5";
    matrix_add(matrix, made,
               PLANE(FROM_THE_FRONT, "[8, 8]", "[1, 1]", "clouds", "[512, 1, 1]", "8"), "false");
    snprintf(made.name, sizeof made.name, "512x1x1, aslant, 512 steps");
    made.most = 1e-4;
    made.why = "40 steps a voxel: (1/40)^2 / 8 x 2 x 3 / 40 for each of some ten kinks";
    matrix_add(matrix, made,
               PLANE(FROM_THE_FRONT, "[8, 8]", "[1, 1]", "clouds", "[512, 1, 1]", "512"), "false");

    made.voxels = NULL;
    snprintf(made.name, sizeof made.name, "tiles 0.01");
    made.most = 1e-4;
    made.why = "a plane is no approximation; 128 steps a voxel: (1/128)^2 / 8 x 2 x 5.5";
    matrix_add(matrix, made,
               PLANE(FROM_THE_FRONT, "[2, 2]", "[0.01, 0.01]", "clouds", "[16, 16, 8]", "1024"),
               "true");
    made.may_warn = "voxels-skipped";
    made.most_warned = 0.1;
    snprintf(made.name, sizeof made.name, "tiles 100");
    made.most = 1e-3;
    made.why = "1e-3 if no voxel is skipped; else the mean of 64 of many random values, 0.7 / 8";
    matrix_add(matrix, made,
               PLANE(FROM_THE_FRONT, "[2, 2]", "[100, 100]", "clouds", "[16, 16, 8]", "64"),
               "false");
    /* Few pixels: the truth reads all of the 8,000 voxels on each ray. */
    made.quick = false;
    snprintf(made.name, sizeof made.name, "tiles 10000, aslant");
    matrix_add(
        matrix, made,
        "{" IMAGE(12) FROM_THE_FRONT
        "'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [4, 4]}, 'thickness': "
        "0.2, 'tiles': [10000, 10000], 'material': {'builtin': 'clouds', 'size': [16, 16, 8], "
        "'lit': false}}, 'quality': {'samples': 64}}]}");
    made.quick = true;
    snprintf(made.name, sizeof made.name, "tiles 10000, above");
    made.most = 4e-3;
    made.may_warn = NULL;
    made.why =
        "rays along w meet one value, but fp32 places them in a cell of 40,000 voxels to 2^-24 "
        "of it, 0.0024, at either rounding, of a contrast of 1 a voxel";
    matrix_add(matrix, made,
               PLANE(FROM_ABOVE, "[2, 2]", "[10000, 10000]", "clouds", "[16, 16, 8]", "256"),
               "false");

    /* Every other built-in as it comes, a solid's thin parts and a medium between solids among
     * them. */
    static const char *const built_in[] = {"fog",   "trees",  "weave", "rocks",
                                           "grate", "scales", "bark"};
    for (size_t i = 0; i < sizeof built_in / sizeof *built_in; i++) {
        snprintf(made.name, sizeof made.name, "%s", built_in[i]);
        made.most = 1e-4;
        made.why = "a plane is no approximation; 128 steps a voxel; measured 3e-6 to 2.8e-5";
        matrix_add(
            matrix, made,
            "{" IMAGE(32) FROM_THE_FRONT LIGHTS
            "'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [4, 4]}, "
            "'thickness': 0.2, 'tiles': [2, 2], 'material': {'builtin': '%s', 'size': [16, 16, "
            "8]}}, 'quality': {'samples': 1024}}]}",
            built_in[i]);
    }

    snprintf(made.name, sizeof made.name, "more steps than a driver turns loops");
    made.quick = false;
    made.most = 1e-3;
    made.limit = 0;
    made.may_warn = "not-finite";
    made.why =
        "llvmpipe ends all loops after 65,535 turns: a walk must tell, and drawing cells must "
        "not come to it";
    matrix_add(matrix, made,
               PLANE("'camera': {'eye': [4, 0.1, 0.12], 'target': [0, 0, 0.1], 'fov_y_deg': 3}, ",
                     "[3, 3]", "[1, 1]", "clouds", "[16, 16, 8]", "4096"),
               "false");
}
