/* Order: cells in a cycle, shells and folds that overlap, hundreds of layers behind one another. */
#include "tests/stability/matrix_scenes.h"

/* ---- a cycle ---- */

static void make_bar(struct blob *glb, const struct matrix_case *self) {
    (void)self;
    static const float position[3][3] = {{-1, 0.35f, -0.3f}, {1, 0.35f, 0.3f}, {1, 0.6f, 0.3f}};
    static const uint32_t triangle[1][3] = {{0, 1, 2}};
    matrix_write_glb(glb, position, NULL, 3, triangle, 1);
}

/* Three bars around a triangle, each over the next one's beginning. */
static void make_bars(struct blob *glb, const struct matrix_case *self) {
    (void)self;
    float position[9][3];
    static const float bar[3][3] = {{-1, 0.35f, -0.3f}, {1, 0.35f, 0.3f}, {1, 0.6f, 0.3f}};
    static const uint32_t triangle[3][3] = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
    for (int k = 0; k < 9; k++) {
        double angle = k / 3 * 2 * M_PI / 3;
        const float *p = bar[k % 3];
        position[k][0] = (float)(cos(angle) * (double)p[0] - sin(angle) * (double)p[1]);
        position[k][1] = (float)(sin(angle) * (double)p[0] + cos(angle) * (double)p[1]);
        position[k][2] = p[2];
    }
    matrix_write_glb(glb, (const float(*)[3])position, NULL, 9, triangle, 3);
}

static void cycles(struct matrix *matrix) {
    struct matrix_case made = {.group = "order",
                               .name = "three shells in a cycle",
                               .quick = true,
                               .mesh = make_bar,
                               .bound = BOUND_PICTURE,
                               .most = 1e-4,
                               .may_refuse = "walk",
                               .why =
                                   "parallel sides: exact, if the order is right in every pixel"};
    static const char bars[] =
        "{'shell': {'mesh': {'asset': 'mesh.glb'}, 'thickness': 0.1, 'material': {'builtin': "
        "'homogeneous', 'extinction': 20, 'color': [%s]}}, 'transform': {'rotate_deg': [0, 0, "
        "%d]}}";
    char objects[3][400];
    static const char *const colors[3] = {"1, 0.1, 0.1", "0.1, 1, 0.1", "0.1, 0.1, 1"};
    for (int k = 0; k < 3; k++)
        snprintf(objects[k], sizeof objects[k], bars, colors[k], 120 * k);
    static const char picture[] =
        IMAGE(48) "'camera': {'eye': [0, 0, 5], 'target': [0, 0, 0], 'up': [0, 1, 0], "
                  "'ortho_height': 2.4}, ";
    matrix_add(matrix, made, "{%s'objects': [%s, %s, %s]}", picture, objects[0], objects[1],
               objects[2]);
    /* The samples of the cycle are masked by depth, which must then be as it was. */
    snprintf(made.name, sizeof made.name, "three shells in a cycle, a square through them");
    matrix_add(matrix, made,
               "{%s'objects': [%s, %s, %s, {'mesh': {'shape': 'plane', 'size': [1.6, 1.6]}, "
               "'color': [0.2, 0.4, 0.6], 'transform': {'rotate_deg': [20, 15, 0]}}]}",
               picture, objects[0], objects[1], objects[2]);

    snprintf(made.name, sizeof made.name, "one shell in a cycle");
    made.mesh = make_bars;
    made.may_refuse = NULL;
    made.limit = 2048;
    made.most = 2e-3;
    made.why = "flat prisms: exact but for steps of 1/64 voxel, if the order is right";
    matrix_add(matrix, made,
               "{%s'objects': [{'shell': {'mesh': {'asset': "
               "'mesh.glb'}, 'thickness': 0.1, 'tiles': [1, 1], 'material': "
               "{'builtin': 'clouds', 'size': [4, 4, 4], 'lit': true}}, 'quality': "
               "{'samples': 256}}]}",
               picture);
}

/* ---- overlap ---- */

static void overlaps(struct matrix *matrix) {
    struct matrix_case made = {.group = "order",
                               .name = "two shells through one another",
                               .quick = true,
                               .bound = BOUND_PICTURE,
                               .most = 1e-4,
                               .may_refuse = "walk",
                               .may_warn = "overlap-approximate",
                               .most_warned = 0.3,
                               .why =
                                   "flat and homogeneous: exact where extinctions add and colours "
                                   "mix by extinction"};
    static const char pair[] = "{" IMAGE(48) FROM_THE_FRONT
        "'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [3, 3]}, 'thickness': 0.4, "
        "'material': {'builtin': 'homogeneous', 'extinction': 3, 'color': [1, 0, 0]}}}, {'shell': "
        "{'mesh': {'shape': 'plane', 'divisions': [3, 3]}, 'thickness': 0.4, 'material': "
        "{'builtin': 'homogeneous', 'extinction': 6, 'color': [0, 1, 0.5]}}, 'transform': {%s}}]}";
    matrix_add(matrix, made, pair, "'rotate_deg': [0, 20, 0]");
    snprintf(made.name, sizeof made.name, "two shells in the same place");
    matrix_add(matrix, made, pair, "'translate': [0, 0, 0]");
    snprintf(made.name, sizeof made.name, "two shells that touch");
    matrix_add(matrix, made, pair, "'translate': [0, 0, 0.4]");
    snprintf(made.name, sizeof made.name, "two shells that share a side");
    matrix_add(matrix, made, pair, "'translate': [2, 0, 0]");
}

/* ---- many layers ---- */

/* 500 squares over one another, alternately turned over. */
static void make_stack(struct blob *glb, const struct matrix_case *self) {
    uint32_t count = (uint32_t)self->arg[0];
    float(*position)[3] = malloc(4 * count * sizeof *position);
    uint32_t(*triangle)[3] = malloc(2 * count * sizeof *triangle);
    if (!position || !triangle)
        abort();
    for (uint32_t k = 0; k < count; k++) {
        float z = (float)k / (float)count;
        for (uint32_t c = 0; c < 4; c++) {
            position[4 * k + c][0] = c == 1 || c == 2 ? 1.0f : -1.0f;
            position[4 * k + c][1] = c > 1 ? 1.0f : -1.0f;
            position[4 * k + c][2] = z;
        }
        memcpy(triangle[2 * k], (uint32_t[3]){4 * k, 4 * k + 1, 4 * k + 2}, sizeof triangle[0]);
        memcpy(triangle[2 * k + 1], (uint32_t[3]){4 * k, 4 * k + 2, 4 * k + 3}, sizeof triangle[0]);
    }
    matrix_write_glb(glb, (const float(*)[3])position, NULL, 4 * count,
                     (const uint32_t(*)[3])triangle, 2 * count);
    free(position);
    free(triangle);
}

static void layers(struct matrix *matrix) {
    struct matrix_case made = {.group = "order",
                               .name = "500 layers in one pixel",
                               .quick = true,
                               .mesh = make_stack,
                               .arg = {500},
                               .bound = BOUND_DEPTH,
                               .most = BOUND_DEPTH_RELATIVE,
                               .why = WHY_CLOSED_FORM};
    matrix_add(matrix, made,
               "{" IMAGE(24) "'camera': {'eye': [0.3, -0.4, 5], 'target': [0, 0, 0.5], "
                             "'ortho_height': 1}, 'objects': [{'shell': {'mesh': {'asset': "
                             "'mesh.glb'}, 'thickness': 0.001, " HOMOGENEOUS "}}]}",
               16.0);
    snprintf(made.name, sizeof made.name, "500 voxel layers in one pixel");
    made.bound = BOUND_PICTURE;
    made.most = 5.4e-3;
    made.limit = 128;
    made.why = "flat; 16 steps a voxel: (1/16)^2 / 8 x 2 x 5.5 of optical depth at each voxel's "
               "centre, of which few are seen";
    matrix_add(matrix, made,
               "{" IMAGE(24) "'camera': {'eye': [0.3, -0.4, 5], 'target': [0, 0, 0.5], "
                             "'ortho_height': 1}, 'objects': [{'shell': {'mesh': {'asset': "
                             "'mesh.glb'}, 'thickness': 0.001, 'tiles': [3, 3], 'material': "
                             "{'builtin': 'clouds', 'size': [8, 8, 2], 'lit': false}}, 'quality': "
                             "{'samples': 32}}]}");
}

void matrix_order(struct matrix *matrix) {
    cycles(matrix);
    overlaps(matrix);
    layers(matrix);
}
