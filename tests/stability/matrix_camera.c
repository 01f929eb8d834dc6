/* The camera where cameras break things: inside, on, along and far from what it looks at. */
#include "tests/stability/matrix_scenes.h"

/* ---- slabs, with their closed form ---- */

static void slabs(struct matrix *matrix) {
    static const struct {
        const char *name, *camera, *rest, *may_refuse;
        double sigma;
    } views[] = {
        {"inside the shell",
         "'eye': [0.1, 0.2, 0.1], 'target': [0.1, 0.2, 1], 'up': [0, 1, 0], 'fov_y_deg': 90", "",
         NULL, 3},
        {"inside the shell, level", "'eye': [0.1, 0.2, 0.25], 'target': [1, 0.2, 0.24]", "", NULL,
         0.5},
        {"on the bottom, looking up",
         "'eye': [0.1, 0.2, 0], 'target': [0.1, 0.2, 1], 'up': [0, 1, 0], 'fov_y_deg': 90", "",
         NULL, 3},
        {"on the top, looking down",
         "'eye': [0.1, 0.2, 0.5], 'target': [0.1, 0.2, 0], 'up': [0, 1, 0], 'fov_y_deg': 90", "",
         NULL, 3},
        {"on the top, looking level", "'eye': [0.1, 0.2, 0.5], 'target': [1, 0.2, 0.3]", "", NULL,
         0.5},
        {"on a vertex of the bottom", "'eye': [0, 0, 0], 'target': [0.3, 0.2, 1], 'fov_y_deg': 60",
         "", NULL, 1},
        {"on a vertex of the top", "'eye': [0, 0, 0.5], 'target': [0.3, 0.2, 0], 'fov_y_deg': 60",
         "", NULL, 1},
        {"on a side's plane, outside",
         "'eye': [4, -9, 0.25], 'target': [3.9, -4, 0.25], 'fov_y_deg': 2", "", NULL, 0.1},
        {"on an inner side, inside",
         "'eye': [0, -0.5, 0.25], 'target': [0, 1, 0.3], 'fov_y_deg': 30", "", NULL, 0.5},
        {"grazing by 0.01 degrees, parallel",
         "'eye': [0, -2000, 0.599], 'target': [0, 0, 0.25], 'ortho_height': 0.4", "", NULL, 0.1},
        {"grazing by 0.01 degrees",
         "'eye': [0, -2000, 0.599], 'target': [0, 0, 0.25], 'fov_y_deg': 0.01", "", NULL, 0.1},
        {"field of view 0.01", "'eye': [100, -200, 300], 'target': [0, 0, 0.25], 'fov_y_deg': 0.01",
         "", NULL, 2},
        {"field of view 179",
         "'eye': [0.1, 0.2, 0.26], 'target': [0.1, 0.2, 1], 'up': [0, 1, 0], 'fov_y_deg': 179", "",
         NULL, 1},
        {"parallel rays from within",
         "'eye': [0.1, 0.2, 0.25], 'target': [0.15, 0.25, 0], 'up': [0, 1, 0], 'ortho_height': 2",
         "", "walk", 2},
        {"a million units away",
         "'eye': [3e5, -6e5, 7e5], 'target': [0, 0, 0.25], 'fov_y_deg': 0.001", "", NULL, 2},
        {"a million units away, parallel",
         "'eye': [3e5, -6e5, 7e5], 'target': [0, 0, 0.25], 'ortho_height': 2", "", NULL, 2},
        {"moved a million units",
         "'eye': [1000001, -1000003, 1000004], 'target': [1e6, -1e6, 1e6], 'fov_y_deg': 20",
         ", 'transform': {'translate': [1e6, -1e6, 1e6]}", NULL, 2},
        {"a millionth in size", "'eye': [1e-6, -3e-6, 4e-6], 'target': [0, 0, 0], 'fov_y_deg': 20",
         ", 'transform': {'scale': [1e-6, 1e-6, 1e-6]}", NULL, 2},
        {"a million in size", "'eye': [1e6, -3e6, 4e6], 'target': [0, 0, 0], 'fov_y_deg': 20",
         ", 'transform': {'scale': [1e6, 1e6, 1e6]}", NULL, 2},
    };
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        struct matrix_case made = {.group = "camera",
                                   .quick = true,
                                   .bound = BOUND_DEPTH,
                                   .most = BOUND_DEPTH_RELATIVE,
                                   .may_refuse = views[v].may_refuse,
                                   .why = WHY_CLOSED_FORM};
        snprintf(made.name, sizeof made.name, "slab, %s", views[v].name);
        matrix_add(matrix, made,
                   "{" IMAGE(32) "'camera': {%s}, 'objects': [{'shell': {'mesh': {'shape': "
                                 "'plane', 'size': [8, 8], 'divisions': [8, 8]}, 'thickness': "
                                 "0.5, " HOMOGENEOUS "}%s}]}",
                   views[v].camera, views[v].sigma, views[v].rest);
    }
}

/* ---- solids, and the sphere whose vertices the eye stands on ---- */

static void solids(struct matrix *matrix) {
    struct matrix_case made = {.group = "camera",
                               .name = "inside a solid",
                               .quick = true,
                               .voxels = voxels_solid,
                               .bound = BOUND_PICTURE,
                               .most = 1e-6,
                               .most_max = 1e-6,
                               .why = "every ray ends where it begins, on one unlit colour"};
    matrix_add(matrix, made,
               "{" IMAGE(32) "'camera': {'eye': [0.1, 0.2, 0.1], 'target': [1, 0.2, 0.2], "
                             "'fov_y_deg': 90}, 'objects': [{'shell': {'mesh': {'shape': 'plane', "
                             "'size': [8, 8]}, 'thickness': 0.5, 'material': {'builtin': 'chain', "
                             "'size': [4, 4, 4], 'lit': false}}}]}");
    made = (struct matrix_case){.group = "camera",
                                .quick = true,
                                .bound = BOUND_PICTURE,
                                .most = 1e-4,
                                .why = WHY_SAME_SOLID};
    static const struct {
        const char *name, *camera;
    } views[] = {
        {"on a base vertex, outward", "'eye': [1, 0, 0], 'target': [3, 0.3, 0.4], 'fov_y_deg': 60"},
        {"on a base vertex, along", "'eye': [1, 0, 0], 'target': [1.1, 2, 0.3], 'fov_y_deg': 60"},
        {"on a base vertex, inward", "'eye': [1, 0, 0], 'target': [0, 0.2, 0.1], 'fov_y_deg': 60"},
        {"on a top vertex, along", "'eye': [1.2, 0, 0], 'target': [1, 2, 0.3], 'fov_y_deg': 60"},
        {"at the centre", "'eye': [0, 0, 0], 'target': [0.3, 1, 0.2], 'fov_y_deg': 120"},
        {"inside the shell", "'eye': [0, 1.1, 0], 'target': [2, 1.3, 0.4], 'fov_y_deg': 100"},
        {"at the pole", "'eye': [0, 0, 1], 'target': [1, 0.2, 1.1], 'fov_y_deg': 70"},
    };
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        snprintf(made.name, sizeof made.name, "sphere, %s", views[v].name);
        matrix_add(matrix, made,
                   "{" IMAGE(48) "'camera': {%s}, 'objects': [{'shell': {'mesh': {'shape': "
                                 "'sphere', 'divisions': [24, 12]}, 'thickness': 0.2, " HOMOGENEOUS
                                 "}}]}",
                   views[v].camera, 2.0);
    }
    /* The sides part by h |n_i - n_j| / 4 = 0.2 x 0.262 / 4 = 0.013, a voxel is 0.025 thick or 0.07
     * wide: half a voxel at the most, over a density that may rise from 0 to its most within one.
     */
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        snprintf(made.name, sizeof made.name, "cloudy sphere, %s", views[v].name);
        made.most = 0.1 * 0.013 / 0.025;
        made.limit = 2048;
        made.why =
            "model, first order: the map is off by up to h |n_i - n_j| / 4 = 0.013, half a "
            "voxel, a third of it in the mean; a random field of contrast 0.3 that a shift of "
            "two voxels makes another changes by a tenth for a voxel";
        matrix_add(matrix, made,
                   "{" IMAGE(48) "'camera': {%s}, 'objects': [{'shell': {'mesh': {'shape': "
                                 "'sphere', 'divisions': [24, 12]}, 'thickness': 0.2, 'tiles': [8, "
                                 "4], 'material': {'builtin': 'clouds', 'size': [8, 8, 8], 'lit': "
                                 "false}}, 'quality': {'samples': 256}}]}",
                   views[v].camera);
    }
}

/* ---- far away, with something opaque: what hides what is decided by depth ---- */

static void occluded(struct matrix *matrix) {
    static const struct {
        const char *name, *camera, *rest;
    } views[] = {
        {"near", "'eye': [3, -6, 7], 'target': [0, 0, 0.1], 'fov_y_deg': 15", ""},
        {"a million units away",
         "'eye': [3e5, -6e5, 7e5], 'target': [0, 0, 0.1], 'fov_y_deg': 0.001", ""},
        {"a million units away, parallel",
         "'eye': [3e5, -6e5, 7e5], 'target': [0, 0, 0.1], 'ortho_height': 4", ""},
        {"a millionth in size",
         "'eye': [3e-6, -6e-6, 7e-6], 'target': [0, 0, 1e-7], 'fov_y_deg': 15",
         ", 'transform': {'scale': 1e-6}"},
        {"on its top", "'eye': [0.1, 0.2, 0.4], 'target': [0.5, 1, 0.1], 'fov_y_deg': 60", ""},
    };
    struct matrix_case made = {.group = "camera", .quick = true, .bound = BOUND_PICTURE};
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        made.most = 1e-4;
        made.most_max = 0;
        made.outliers = 0;
        made.why = "closed form over a flat base; depth in fp32 is 1e-7 of the distance: what is "
                   "cut off of 0.4 may not be more than 1e-4";
        snprintf(made.name, sizeof made.name, "mist over a base, %s", views[v].name);
        matrix_add(
            matrix, made,
            "{" IMAGE(32) "'camera': {%s}, 'objects': [{'shell': {'mesh': {'shape': 'plane', "
                          "'divisions': [4, 4]}, 'thickness': 0.4, 'base': {'color': [1, 0, "
                          "0]}, " HOMOGENEOUS "}%s}]}",
            views[v].camera, 2.0, views[v].rest);
        made.most = 1e-3;
        made.most_max = 0.05;
        made.outliers = 2;
        made.why = "a plane is no approximation; normals are kept in 11 bits, lit threefold; two "
                   "silhouettes may be a step off";
        snprintf(made.name, sizeof made.name, "chain over a base, %s", views[v].name);
        matrix_add(matrix, made,
                   "{" IMAGE(32) LIGHTS "'camera': {%s}, 'objects': [{'shell': {'mesh': {'shape': "
                                        "'plane', 'divisions': [4, 4]}, 'thickness': 0.4, 'tiles': "
                                        "[3, 2], 'base': {'color': [1, 0, 0]}, 'material': "
                                        "{'builtin': 'chain', 'size': [16, 16, 8]}}, 'quality': "
                                        "{'samples': 1024}%s}]}",
                   views[v].camera, views[v].rest);
    }
}

void matrix_camera(struct matrix *matrix) {
    slabs(matrix);
    solids(matrix);
    occluded(matrix);
}
