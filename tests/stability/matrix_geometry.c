/* Geometry: slivers, triangles without area, thin and thick shells, prisms that stand on their
 * heads, one triangle, a million, non-manifold and open meshes, transforms that mirror and stretch.
 */
#include "tests/stability/matrix_scenes.h"

#define EXACT(name_, quick_)                                                                       \
    (struct matrix_case) {                                                                         \
        .group = "geometry", .name = name_, .quick = quick_, .bound = BOUND_DEPTH,                 \
        .most = BOUND_DEPTH_RELATIVE, .why = WHY_CLOSED_FORM                                       \
    }

/* ---- slivers ---- */

/* The same sliver from above, aslant along it and across it. `%s` is the mesh. */
static void slivers(struct matrix *matrix) {
    static const struct {
        const char *name, *size, *eye, *up;
    } views[] = {
        {"above", "1e6, 1", "0, 0, 50", "0, 1, 0"},
        {"along", "1e6, 1", "40, 0, 30", "0, 1, 0"},
        {"across", "1e6, 1", "0, 40, 30", "1, 0, 0"},
        {"above, turned", "1, 1e6", "0, 0, 50", "0, 1, 0"},
        {"above, 1e-6 wide", "1, 1e-6", "0, 0, 50", "0, 1, 0"},
    };
    for (size_t v = 0; v < sizeof views / sizeof *views; v++)
        for (int n = 1; n <= 7; n += 6) {
            struct matrix_case made = EXACT("", n == 1);
            double height = v == 4 ? 0.9e-6 : 0.9, thickness = v == 4 ? 0.5e-6 : 0.5;
            snprintf(made.name, sizeof made.name, "sliver %s, %s, %dx%d", views[v].size,
                     views[v].name, n, n);
            made.may_refuse = v == 1 ? "walk" : NULL; /* the eye's plane cuts it */
            matrix_add(
                matrix, made,
                "{" IMAGE(32) "'camera': {'eye': [%s], 'target': [0, 0, 0], 'up': [%s], "
                              "'ortho_height': %g}, 'objects': [{'shell': {'mesh': {'shape': "
                              "'plane', 'size': [%s], 'divisions': [%d, %d]}, 'thickness': "
                              "%g, " HOMOGENEOUS "}}]}",
                views[v].eye, views[v].up, height, views[v].size, n, n, thickness, 1 / thickness);
        }
}

/* ---- meshes ---- */

static void make_single(struct blob *glb, const struct matrix_case *self) {
    (void)self;
    static const float position[3][3] = {{-1, -1, 0}, {1, -0.8f, 0.1f}, {-0.2f, 1, -0.1f}};
    static const uint32_t triangle[1][3] = {{0, 1, 2}};
    matrix_write_glb(glb, position, NULL, 3, triangle, 1);
}

/* A square of two triangles with slivers of no area along its edges and diagonal. */
static void make_zero_area(struct blob *glb, const struct matrix_case *self) {
    (void)self;
    static const float position[][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0},  {-1, 1, 0},
                                        {0, -1, 0},  {0, 0, 0},  {-1, -1, 0}};
    static const uint32_t triangle[][3] = {{0, 1, 2}, {0, 4, 1}, {0, 2, 3},
                                           {0, 5, 2}, {3, 3, 2}, {0, 6, 1}};
    matrix_write_glb(glb, position, NULL, 7, triangle, 6);
}

/* Three squares that share an edge, as the leaves of a book, all with their fronts up; arg[0] is
 * how far two of them part. */
static void make_book(struct blob *glb, const struct matrix_case *self) {
    const double angles[3] = {0.3, 0.3 + self->arg[0], 0.3 + M_PI};
    float position[8][3] = {{0, -1, 0}, {0, 1, 0}};
    uint32_t triangle[6][3];
    for (uint32_t k = 0; k < 3; k++) {
        for (uint32_t e = 0; e < 2; e++) {
            position[2 + 2 * k + e][0] = (float)cos(angles[k]);
            position[2 + 2 * k + e][1] = e ? 1.0f : -1.0f;
            position[2 + 2 * k + e][2] = (float)sin(angles[k]);
        }
        uint32_t a = 2 + 2 * k, b = a + 1, flip = k == 2;
        memcpy(triangle[2 * k], (uint32_t[3]){0, flip ? b : a, flip ? a : b}, sizeof triangle[0]);
        memcpy(triangle[2 * k + 1], (uint32_t[3]){0, flip ? 1 : b, flip ? b : 1},
               sizeof triangle[0]);
    }
    matrix_write_glb(glb, (const float(*)[3])position, NULL, 8, (const uint32_t(*)[3])triangle, 6);
}

/* A grid of 8 x 8 squares; the normal of one vertex in its middle points below it. */
static void make_inverted(struct blob *glb, const struct matrix_case *self) {
    (void)self;
    float position[81][3], normal[81][3];
    uint32_t triangle[128][3];
    for (uint32_t v = 0; v < 81; v++) {
        position[v][0] = (float)(v % 9) / 4 - 1;
        position[v][1] = (float)(v / 9) / 4 - 1;
        position[v][2] = 0;
        memcpy(normal[v], (float[3]){0, v == 40 ? 0.6f : 0, v == 40 ? -0.8f : 1}, sizeof normal[v]);
    }
    for (uint32_t q = 0; q < 64; q++) {
        uint32_t a = q / 8 * 9 + q % 8;
        memcpy(triangle[2 * q], (uint32_t[3]){a, a + 1, a + 10}, sizeof triangle[0]);
        memcpy(triangle[2 * q + 1], (uint32_t[3]){a, a + 10, a + 9}, sizeof triangle[0]);
    }
    matrix_write_glb(glb, (const float(*)[3])position, (const float(*)[3])normal, 81,
                     (const uint32_t(*)[3])triangle, 128);
}

/* A groove of two squares: normals converge, and a thick shell would fold. */
static void make_groove(struct blob *glb, const struct matrix_case *self) {
    (void)self;
    static const float position[6][3] = {{-1, -1, 1}, {-1, 1, 1}, {0, -1, 0},
                                         {0, 1, 0},   {1, -1, 1}, {1, 1, 1}};
    static const uint32_t triangle[4][3] = {{0, 2, 3}, {0, 3, 1}, {2, 4, 5}, {2, 5, 3}};
    matrix_write_glb(glb, position, NULL, 6, triangle, 4);
}

/* An octahedron with one vertex pulled to the middle of a face: a sliver beside each of its edges.
 */
static void make_sliver_solid(struct blob *glb, const struct matrix_case *self) {
    float at = (float)self->arg[0];
    float position[7][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0},       {0, -1, 0},
                            {0, 0, 1}, {0, 0, -1}, {0.5f, 0.5f, at}};
    static const uint32_t triangle[][3] = {{0, 2, 6}, {2, 4, 6}, {4, 0, 6}, {2, 1, 4}, {1, 3, 4},
                                           {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    matrix_write_glb(glb, (const float(*)[3])position, NULL, 7, triangle, 10);
}

#define MESH_SCENE(pixels, thickness)                                                              \
    "{" IMAGE(pixels) "'camera': {'eye': [1.3, -2.6, 3.1], 'target': [0, 0, 0.1], 'fov_y_deg': "   \
                      "42}, 'objects': [{'shell': {'mesh': {'asset': 'mesh.glb'}, "                \
                      "'thickness': " thickness ", " HOMOGENEOUS "}}]}"

static void meshes(struct matrix *matrix) {
    struct matrix_case made = EXACT("a single triangle", true);
    /* Rays that cut a corner off have no digits left of their chord; so the picture is judged. */
    made.bound = BOUND_PICTURE;
    made.most = 1e-5;
    made.why = "one prism with parallel sides: exact, but for fp32 along a ray of length 4";
    made.mesh = make_single;
    matrix_add(matrix, made, MESH_SCENE(48, "0.3"), 3.0);

    made.mesh = make_zero_area;
    snprintf(made.name, sizeof made.name, "triangles without area");
    matrix_add(matrix, made, MESH_SCENE(48, "0.3"), 3.0);

    made.mesh = make_sliver_solid;
    for (int k = 0; k < 3; k++) {
        made.arg[0] = k == 0 ? 1e-2 : k == 1 ? 1e-4 : 1e-6;
        made.most = 1e-4;
        made.quick = k == 2;
        made.why = WHY_SAME_SOLID;
        snprintf(made.name, sizeof made.name, "closed mesh with a sliver %g wide", made.arg[0]);
        matrix_add(matrix, made, MESH_SCENE(48, "0.1"), 3.0);
    }

    made.quick = true;
    made.most = 1e-5;
    made.mesh = make_groove;
    snprintf(made.name, sizeof made.name, "a groove in which prisms would fold");
    made.why = "the borders' sides are flat, so all is as for closed meshes";
    matrix_add(matrix, made, MESH_SCENE(48, "0.9"), 3.0);

    made.mesh = make_book;
    made.arg[0] = 0.5;
    snprintf(made.name, sizeof made.name, "three leaves at one edge");
    matrix_add(matrix, made, MESH_SCENE(48, "0.2"), 3.0);

    made.arg[0] = 2;
    snprintf(made.name, sizeof made.name, "three leaves at one edge, far apart");
    matrix_add(matrix, made, MESH_SCENE(48, "0.2"), 3.0);

    /* A fold's tetrahedra cross elsewhere than the sheets of its prism do. */
    made.may_warn = "inverted-prisms";
    made.mesh = make_inverted;
    snprintf(made.name, sizeof made.name, "six prisms of 128 on their heads");
    made.most_warned = 0.7 * sqrt(6.0 / 128);
    made.why =
        "wrong only where prisms stand on their heads, six of 128, and there by no more than "
        "the alpha of the shell, 0.7";
    matrix_add(matrix, made, MESH_SCENE(48, "0.2"), 3.0);

    made = EXACT("a million triangles", false);
    matrix_add(matrix, made,
               "{" IMAGE(32) FROM_ABOVE "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': "
                                        "[8, 8], 'divisions': [708, 708]}, 'thickness': "
                                        "0.2, " HOMOGENEOUS "}}]}",
               5.0);
    made = EXACT("an open tube", true);
    made.bound = BOUND_PICTURE;
    made.most = 1e-5;
    made.why = "the borders' sides are flat, so all is as for closed meshes";
    matrix_add(matrix, made,
               "{" IMAGE(48) FROM_THE_FRONT "'objects': [{'shell': {'mesh': {'shape': 'cylinder', "
                                            "'height': 1}, 'thickness': 0.2, " HOMOGENEOUS "}}]}",
               2.0);
}

/* ---- thickness ---- */

static void thicknesses(struct matrix *matrix) {
    static const double flat[] = {1e-7, 1e-5, 1e-3, 1, 10};
    for (size_t k = 0; k < sizeof flat / sizeof *flat; k++) {
        struct matrix_case made = EXACT("", true);
        snprintf(made.name, sizeof made.name, "plane, thickness %g of an edge", flat[k]);
        double far = 20 + flat[k];
        matrix_add(matrix, made,
                   "{" IMAGE(32) "'camera': {'eye': [%g, %g, %g], 'target': [0, 0, %g], "
                                 "'ortho_height': 4}, 'objects': [{'shell': {'mesh': {'shape': "
                                 "'plane', 'size': [32, 32], 'divisions': [32, 32]}, 'thickness': "
                                 "%g, " HOMOGENEOUS "}}]}",
                   far * 0.3, far * -0.4, far, flat[k] / 2, flat[k], 1 / flat[k]);
    }
    static const double round[] = {1e-7, 1e-6, 1e-5, 1e-4, 1e-2, 0.26, 2.6};
    for (size_t k = 0; k < sizeof round / sizeof *round; k++) {
        struct matrix_case made = EXACT("", true);
        made.bound = BOUND_PICTURE;
        made.most = 1e-4;
        made.why = WHY_SAME_SOLID;
        snprintf(made.name, sizeof made.name, "sphere, thickness %g", round[k]);
        matrix_add(matrix, made,
                   "{" IMAGE(48) "'camera': {'eye': [%.17g, %.17g, %.17g], 'target': [0, 0, 0], "
                                 "'fov_y_deg': 40}, 'objects': [{'shell': {'mesh': {'shape': "
                                 "'sphere', 'divisions': [24, 12]}, 'thickness': %g, " HOMOGENEOUS
                                 "}}]}",
                   0.7 * (1 + round[k]), -2.8 * (1 + round[k]), 2.1 * (1 + round[k]), round[k],
                   1 / round[k]);
    }
}

/* Over a base, which hides what is beyond it by depth. */
static void thin_over_bases(struct matrix *matrix) {
    static const double thin[] = {1e-2, 1e-4, 1e-6};
    for (size_t k = 0; k < sizeof thin / sizeof *thin; k++) {
        struct matrix_case made = {
            .group = "geometry",
            .quick = true,
            .bound = BOUND_PICTURE,
            .most = 1e-4,
            .outliers = 8,
            .why = "as for closed meshes, but for samples within 1/512 pixel of "
                   "the edges of the base's triangles, some 1,700 pixels long, "
                   "where a rasteriser shows the neighbour"};
        snprintf(made.name, sizeof made.name, "sphere over its base, thickness %g", thin[k]);
        matrix_add(matrix, made,
                   "{" IMAGE(48) FROM_THE_FRONT LIGHTS
                   "'objects': [{'shell': {'mesh': {'shape': 'sphere', 'divisions': [24, 12]}, "
                   "'thickness': %g, 'base': {'color': [0.5, 0.2, 0.1]}, " HOMOGENEOUS "}}]}",
                   thin[k], 1 / thin[k]);
    }
}

/* ---- transforms ---- */

static void transforms(struct matrix *matrix) {
    static const struct {
        const char *name, *transform;
        double eye[3], target[3], height;
    } slabs[] = {
        {"mirrored", "{'scale': [-1, 1, 1], 'rotate_deg': [10, 20, 30]}", {3, -4, 9}, {0}, 0.9},
        {"scaled by 1, 1, 1e3", "{'scale': [1, 1, 1000]}", {2000, -3000, 6000}, {0, 0, 250}, 1},
        {"scaled by 1e3, 1, 1", "{'scale': [1000, 1, 1]}", {3, -4, 9}, {0}, 0.9},
        {"scaled by 1e3, 1, 1e-3", "{'scale': [1000, 1, 0.001]}", {3, -4, 9}, {0}, 0.9},
        {"sheared",
         "{'matrix': [1, 0, 0, 0, 3, 1, 0, 0, -1, 2, 1, 0, 0, 0, 0, 1]}",
         {3, -4, 9},
         {0},
         0.9},
    };
    for (size_t k = 0; k < sizeof slabs / sizeof *slabs; k++) {
        struct matrix_case made = EXACT("", true);
        snprintf(made.name, sizeof made.name, "slab, %s", slabs[k].name);
        made.may_refuse = k == 2 || k == 3 ? "walk" : NULL; /* the eye's plane cuts it */
        const double *e = slabs[k].eye, *t = slabs[k].target;
        matrix_add(matrix, made,
                   "{" IMAGE(32) "'camera': {'eye': [%g, %g, %g], 'target': [%g, %g, %g], "
                                 "'ortho_height': %g}, 'objects': [{'shell': {'mesh': {'shape': "
                                 "'plane', 'size': [8, 8], 'divisions': [5, 7]}, 'thickness': "
                                 "0.5, " HOMOGENEOUS "}, 'transform': %s}]}",
                   e[0], e[1], e[2], t[0], t[1], t[2], slabs[k].height, 2.0, slabs[k].transform);
    }
    static const char *const stretched[] = {
        "{'scale': [-1, 0.7, 1.6], 'rotate_deg': [10, 20, 30]}",
        "{'scale': [1, 1, 1e-3]}",
        "{'scale': [1, 1, -1]}",
    };
    static const char *const materials[] = {"clouds", "chain"};
    for (int k = 0; k < 3; k++)
        for (int m = 0; m < 2; m++) {
            struct matrix_case made = {.group = "geometry",
                                       .quick = k == 0,
                                       .bound = BOUND_PICTURE,
                                       .most = 1e-3,
                                       .most_max = m ? 0.05 : 0,
                                       .outliers = m ? 2 : 0,
                                       .limit = 2048,
                                       .why =
                                           m ? "a plane is no approximation; normals are kept in "
                                               "11 bits, lit threefold; two silhouettes may be a "
                                               "step off"
                                             : "a plane is no approximation; 1024 steps in 8 "
                                               "voxels: (8/1024)^2 / 8 x 5.5 x 8 for each of "
                                               "some ten kinks, lit threefold"};
            /* Slabs are spread over the plane's width here, not over its depth: 8,192 take 630
             * steps across it. */
            made.slices = k == 1 ? 8192 : 0;
            snprintf(made.name, sizeof made.name, "%s on a plane, %s", materials[m],
                     k == 0   ? "mirrored, stretched, turned"
                     : k == 1 ? "flattened by 1e3"
                              : "turned over");
            matrix_add(matrix, made,
                       "{" IMAGE(48) FROM_THE_FRONT LIGHTS
                       "'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [3, 3]}, "
                       "'thickness': 0.2, 'tiles': [3, 2], 'material': {'builtin': '%s', 'size': "
                       "[16, 16, 8], 'specular': 0.5}}, 'quality': {'samples': 1024}, "
                       "'transform': %s}]}",
                       materials[m], stretched[k]);
        }
}

void matrix_geometry(struct matrix *matrix) {
    slivers(matrix);
    meshes(matrix);
    thicknesses(matrix);
    thin_over_bases(matrix);
    transforms(matrix);
}
