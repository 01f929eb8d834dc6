/* Light and shadow at their ends: lights under the horizon, along a surface, along the camera's up,
 * eight of them, black ones; scenes a millionth and a million units wide, and far away; the eye in
 * the shell; media that let nothing through; transforms that mirror; shells in one another. */
#include <math.h>

#include "tests/stability/matrix_scenes.h"

#define CAST(direction)                                                                            \
    "'lights': [{'direction': " direction                                                          \
    ", 'color': [3, 2, 1], 'shadow': true}], 'ambient': [0.1, 0.2, 0.1], "
#define POINT_AT                                                                                   \
    "'lights': [{'position': [%.17g, %.17g, %.17g], 'radius': %.17g, 'color': [%.17g, %.17g, "     \
    "%.17g], 'shadow': true}], 'ambient': [0.1, 0.2, 0.1], "
#define SUN   CAST("[1, 0.5, -1.3]")
#define FINE  "'shadow': {'size': 512, 'slices': 24}, "
#define STEPS ", 'quality': {'samples': 32}"

/* Mist around a ball, over a plane: both throw shadows, on one another and on themselves. */
#define MIST(beside)                                                                               \
    "{'shell': {'mesh': {'shape': 'sphere', 'divisions': [12, 6]}, 'thickness': 0.4, 'tiles': "    \
    "[3, 2]"                                                                                       \
    ", 'base': {'color': [0.8, 0.6, 0.4]}, 'material': {'builtin': 'clouds', 'size': [8, 8, "      \
    "4]}}" beside "}"
#define GROUND(beside)                                                                             \
    "{'mesh': {'shape': 'plane', 'size': [6, 6]}, 'color': [0.5, 0.5, 0.5]" beside "}"
#define BELOW ", 'transform': {'translate': [0, 0, -1.5]}"
#define AWAY  "'camera': {'eye': [0.5, -4, 3], 'fov_y_deg': 50}, "

/* Hairs, lit by their direction. */
#define HAIR(beside)                                                                               \
    "{'shell': {'mesh': {'shape': 'torus', 'divisions': [48, 24]}, 'thickness': 0.2, 'tiles': "    \
    "[4, 2], 'base': {'color': [0.2, 0.1, 0.1]}, 'material': {'builtin': 'fur', 'size': [16, 16, " \
    "8], 'shading': 'kajiya-kay', 'specular': 0.4, 'shininess': 12}}" beside "}"

static const char why_strands[] =
    "strands turn from triangle to triangle, and cells read a neighbour's at their sides "
    "(renderer/path/README.md)";

static const char why_maps[] =
    "a shadow's edge is mixed over a texel of 512, and a pixel of 16 is lit or dark by one ray: "
    "measured 0.002 to 0.02, at first order in the texels";

static void fill_dense(struct volume *volume, const struct matrix_case *self) {
    static const double color[3] = {1, 0.5, 0.25};
    voxels_fill(volume, self->arg[0], color);
}

static void strands(struct matrix *matrix) {
    struct matrix_case made = {
        .group = "light", .bound = BOUND_PICTURE, .most = 0.012, .why = why_strands};
    static const struct {
        const char *name, *light, *transform;
    } rows[] = {
        {"strands", "'lights': [{'direction': [0.7, 1, -1.1], 'color': [2, 1.9, 1.8]}], ", ""},
        {"strands, light along them", "'lights': [{'direction': [0, 0, -1]}], ", ""},
        {"strands, mirrored and squeezed", "'lights': [{'direction': [0.7, 1, -1.1]}], ",
         ", 'transform': {'scale': [1, 0.5, -0.8], 'rotate_deg': [20, 30, 40]}"},
        {"strands, a lamp in the ring", "'lights': [{'position': [0, 0, 0.1]}], ", ""},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        made.quick = i == 0;
        snprintf(made.name, sizeof made.name, "%s", rows[i].name);
        matrix_add(matrix, made,
                   "{" IMAGE(16) AWAY "%s'objects': [" HAIR("%s, 'quality': {'samples': 64}") "]}",
                   rows[i].light, rows[i].transform);
    }
    snprintf(made.name, sizeof made.name, "strands in shadow");
    made.most = 0.05;
    made.why = why_maps;
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY SUN FINE "'objects': [" HAIR(STEPS) ", " GROUND(BELOW) "]}");
    snprintf(made.name, sizeof made.name, "strands beside mist");
    made.most = 0.02;
    made.why = why_strands;
    made.may_warn = "overlap-approximate"; /* sorted cells */
    made.most_warned = 0.1;
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY "'objects': [" HAIR(", 'quality': {'samples': 64}") ", " MIST(
                   ", 'quality': {'samples': 64}") "]}");
}

/* Absorption, emission and glow at their ends. */
static void filled(struct matrix *matrix) {
    static const char why_form[] =
        "closed form; slabs sum parts whose ends fp32 rounds (measured 5e-6, walks 1e-7)";
    struct matrix_case made = {.group = "light", .bound = BOUND_PICTURE};
    static const struct {
        const char *name, *material;
        double most;
        const char *why;
    } rows[] = {
        {"emission alone", "'builtin': 'homogeneous', 'extinction': 0, 'emission': [1, 1e-3, 0]",
         2e-5, why_form},
        {"absorption alone", "'builtin': 'homogeneous', 'extinction': 0, 'absorption': 1e6", 2e-5,
         why_form},
        {"emission, opaque", "'builtin': 'homogeneous', 'absorption': 1e9, 'emission': [1e6, 0, 1]",
         2e-5, why_form},
        {"empty voxels that emit",
         "'builtin': 'fur', 'size': [4, 4, 2], 'growth': 0, 'emission': [1, 1e-3, 0]", 2e-6,
         "constant in every step"},
        {"clouds in dark glass", "'builtin': 'clouds', 'size': [8, 8, 4], 'absorption': 1.5", 2e-3,
         "clouds by 32 steps"},
        {"clouds that glow",
         "'builtin': 'clouds', 'size': [8, 8, 4], 'glow': 2, 'emission': [0.1, 0.2, 0.4]", 4e-3,
         "clouds by 32 steps, three times as bright"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        made.quick = i == 3;
        made.most = rows[i].most;
        made.why = rows[i].why;
        snprintf(made.name, sizeof made.name, "fill: %s", rows[i].name);
        matrix_add(matrix, made,
                   "{" IMAGE(16) AWAY
                   "'objects': [{'shell': {'mesh': {'shape': 'sphere', 'divisions': [12, 6]}, "
                   "'thickness': 0.4, 'tiles': [3, 2], 'material': {%s}}" STEPS
                   "}, " GROUND(BELOW) "]}",
                   rows[i].material);
    }
    snprintf(made.name, sizeof made.name, "fill: shadow through it, beside mist");
    made.most = 0.03;
    made.why = why_maps;
    made.may_warn = "overlap-approximate"; /* sorted cells */
    made.most_warned = 0.2;
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY SUN FINE
               "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [4, 4]}, 'thickness': "
               "0.4, 'tiles': [2, 2], 'material': {'builtin': 'clouds', 'size': [8, 8, 4], "
               "'absorption': 1, 'glow': 0.5}}, 'transform': {'translate': [0, 0, 0.9]}" STEPS
               "}, " MIST(STEPS) ", " GROUND(BELOW) "]}");
}

/* Extinction with colours at its ends, and its shadows; what keeps one optical depth refuses it. */
static void tinted(struct matrix *matrix) {
    struct matrix_case made = {.group = "light", .bound = BOUND_PICTURE, .may_refuse = "*"};
    static const struct {
        const char *name, *background, *material;
        double most;
    } rows[] = {
        {"glass", "[0.2, 0.5, 0.9, 0.5]",
         "'builtin': 'homogeneous', 'extinction': 0, 'absorption': 2, 'extinction_color': [1, 0.3, "
         "0]",
         2e-5},
        {"glass, opaque to red", "[0.2, 0.5, 0.9, 1]",
         "'builtin': 'homogeneous', 'extinction': 1e9, 'extinction_color': [1, 1e-9, 0]", 2e-5},
        {"no channel at all", "[0.2, 0.5, 0.9, 1]",
         "'builtin': 'homogeneous', 'extinction': 1e9, 'extinction_color': [0, 0, 0]", 2e-5},
        {"clouds", "[0.2, 0.5, 0.9, 1]",
         "'builtin': 'clouds', 'size': [8, 8, 4], 'extinction_color': [0.1, 0.4, 1], 'glow': 0.2",
         4e-3},
        {"clouds over nothing", "[0, 0, 0, 0]",
         "'builtin': 'clouds', 'size': [8, 8, 4], 'extinction_color': [0.1, 0.4, 1], 'absorption': "
         "0.5",
         4e-3},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (int ground = 0; ground < 2; ground++) {
            made.quick = i == 0;
            made.most = rows[i].most;
            made.why = rows[i].most < 1e-3 ? "closed form" : "clouds by 32 steps";
            snprintf(made.name, sizeof made.name, "tint: %s%s", rows[i].name,
                     ground ? ", on a ground" : "");
            matrix_add(matrix, made,
                       "{'image': {'width': 16, 'height': 16, 'samples': 1, 'background': "
                       "%s}, " AWAY "'objects': [{'shell': {'mesh': {'shape': 'sphere', "
                       "'divisions': [12, 6]}, 'thickness': 0.4, 'tiles': [3, 2], 'material': "
                       "{%s}}" STEPS "}%s]}",
                       rows[i].background, rows[i].material, ground ? ", " GROUND(BELOW) : "");
        }
    snprintf(made.name, sizeof made.name, "tint: beside mist");
    made.most = 0.01;
    made.why = "clouds by 32 steps, normals once a cell";
    made.may_warn = "overlap-approximate"; /* sorted cells */
    made.most_warned = 0.2;
    matrix_add(matrix, made,
               "{'image': {'width': 16, 'height': 16, 'samples': 1, 'background': [0.2, 0.5, 0.9, "
               "1]}, " AWAY
               "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [4, 4]}, 'thickness': "
               "0.4, 'material': {'builtin': 'homogeneous', 'extinction': 0.5, "
               "'extinction_color': [0.2, 1, 0.4]}}, 'transform': {'translate': [0, 0, 0.9]}" STEPS
               "}, " MIST(STEPS) ", " GROUND(BELOW) "]}");
    made.most = 0.03;
    made.why = why_maps;
    made.may_refuse = NULL;
    made.may_warn = NULL;
    static const struct {
        const char *name, *light, *material, *beside;
    } shadows[] = {
        {"one colour", SUN, "'extinction_color': [0.1, 0.4, 1]", ""},
        {"two colours", SUN, "'extinction_color': [0.1, 0.4, 1]",
         ", {'shell': {'mesh': {'shape': 'plane', 'size': [2, 2]}, 'thickness': 0.4, 'material': "
         "{'builtin': 'homogeneous', 'extinction': 0, 'absorption': 2, 'extinction_color': [1, "
         "0.3, 0]}}, 'transform': {'translate': [1.5, 0.5, -1.2]}" STEPS "}"},
        {"no red at all, and opaque to blue", SUN,
         "'absorption': 1e6, 'extinction_color': [0, 1e-6, 1]", ""},
        {"two colours, a lamp in one",
         "'lights': [{'position': [0.75, -0.75, 0.6], 'radius': 0.3, 'color': [1, 1, 1], 'shadow': "
         "true}], 'ambient': [0.1, 0.2, 0.1], ",
         "'extinction_color': [0.1, 0.4, 1]",
         ", {'shell': {'mesh': {'shape': 'plane', 'size': [2, 2]}, 'thickness': 0.4, 'material': "
         "{'builtin': 'homogeneous', 'extinction': 0, 'absorption': 2, 'extinction_color': [1, "
         "0.3, 0]}}, 'transform': {'translate': [1.5, 0.5, -1.2]}" STEPS "}"},
    };
    for (size_t i = 0; i < sizeof shadows / sizeof *shadows; i++) {
        made.quick = i == 1;
        snprintf(made.name, sizeof made.name, "tint: shadow, %s", shadows[i].name);
        matrix_add(matrix, made,
                   "{'image': {'width': 16, 'height': 16, 'samples': 1, 'background': [0.2, 0.5, "
                   "0.9, 1]}, " AWAY "%s'shadow': {'size': %d, 'slices': 24}, "
                   "'objects': [{'shell': {'mesh': {'shape': 'sphere', "
                   "'divisions': [12, 6]}, 'thickness': 0.4, 'tiles': [3, 2], 'material': "
                   "{'builtin': 'clouds', 'size': [8, 8, 4], %s}}" STEPS "}%s, " GROUND(BELOW) "]}",
                   shadows[i].light, i == 3 ? 128 : 512, shadows[i].material, shadows[i].beside);
    }
}

/* Lights that stand at points: beside, in, on and far from what throws shadows. */
static void points(struct matrix *matrix) {
    struct matrix_case made = {
        .group = "light", .quick = true, .bound = BOUND_PICTURE, .most = 0.03, .why = why_maps};
    static const struct {
        const char *name;
        double place[3], color;
        bool quick;
    } lights[] = {
        {"point light beside", {1.5, -1.2, 1.5}, 6, true},
        {"point light in the shell", {0.75, -0.75, 0.6}, 1, true},
        {"point light in the base", {0.1, 0.2, 0.1}, 1, false},
        {"point light beside a vertex", {0, 0, 1.00001}, 1, false},
        {"point light on the ground", {1.1, -1.4, -1.5}, 1, false},
        {"point light just above the ground", {1.1, -1.4, -1.499999}, 1, false},
        {"point light behind the ground", {0.3, -0.2, -4}, 9, false},
        {"point light in a face's corner", {2, -2, 2}, 9, false},
        {"point light at 1e3", {-600, -300, 800}, 1e6, false},
    };
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        const double *at = lights[i].place;
        snprintf(made.name, sizeof made.name, "%s", lights[i].name);
        made.quick = lights[i].quick;
        matrix_add(
            matrix, made,
            "{" IMAGE(16) AWAY POINT_AT FINE "'objects': [" MIST(STEPS) ", " GROUND(BELOW) "]}",
            at[0], at[1], at[2], 0.3, lights[i].color, lights[i].color / 2, lights[i].color / 2);
    }
    static const double scales[] = {1e-6, 300}; /* a colour is 1e6 at most */
    made.quick = false;
    for (size_t i = 0; i < 2; i++) {
        double s = scales[i], color = fmin(1e6, 6 * s * s);
        snprintf(made.name, sizeof made.name, "point light, scale %g", s);
        matrix_add(
            matrix, made,
            "{" IMAGE(
                16) "'camera': {'eye': [%.17g, %.17g, %.17g], 'fov_y_deg': 50}, " POINT_AT FINE
                    "'objects': [" MIST(", 'transform': {'scale': %.17g}" STEPS) ", " GROUND(
                        ", 'transform': {'scale': %.17g, 'translate': [0, 0, %.17g]}") "]}",
            0.5 * s, -4 * s, 3 * s, 1.5 * s, -1.2 * s, 1.5 * s, 0.3 * s, color, color / 2,
            color / 2, s, s, -1.5 * s);
    }
    snprintf(made.name, sizeof made.name, "point light, three million units away");
    matrix_add(
        matrix, made,
        "{" IMAGE(16) "'camera': {'eye': [3000000.5, -2000004, 1000003], 'target': "
                      "[3000000, -2000000, 1000000], 'fov_y_deg': 50}, " POINT_AT FINE
                      "'objects': [" MIST(
                          ", 'transform': {'translate': [3000000, -2000000, "
                          "1000000]}" STEPS) ", " GROUND(", 'transform': {'translate': [3000000, "
                                                         "-2000000, 999998.5]}") "]}",
        3000001.5, -2000001.2, 1000001.5, 0.3, 6.0, 3.0, 3.0);
    snprintf(made.name, sizeof made.name, "eight point lights");
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY
               "'lights': [{'position': [2, 0, 1], 'color': [3, 0, 0], 'shadow': true}, "
               "{'position': [-2, 0, 1], 'color': [0, 3, 0], 'shadow': true}, {'position': [0, 2, "
               "1], 'color': [0, 0, 3], 'shadow': true}, {'position': [0, -2, 1], 'color': [2, 2, "
               "0], 'shadow': true}, {'position': [0, 0, 2], 'color': [0, 2, 2], 'shadow': true}, "
               "{'position': [0, 0, 1.2], 'color': [1, 0, 1], 'shadow': true}, {'position': [1.1, "
               "0, 0], 'color': [1, 1, 1], 'shadow': true}, {'position': [0, -1.2, -0.3], "
               "'color': [1, 1, 1], 'shadow': true}], 'objects': [{'mesh': {'shape': "
               "'sphere'}, 'color': [0.8, 0.6, 0.4]}, {'shell': {'mesh': {'shape': 'torus', "
               "'divisions': [12, 6]}, 'thickness': 0.2, 'material': {'builtin': 'homogeneous', "
               "'extinction': 2}}, 'transform': {'scale': 1.5}}, " GROUND(BELOW) "]}");
    made.most = 0.08;
    made.why = "rings a few texels wide: a pixel of 16 is lit or dark by one ray";
    static const struct {
        const char *name;
        double place[3];
    } in[] = {{"point light over columns", {0.4, -0.5, 1.4}},
              {"point light between columns", {0.4, -0.5, 0.4}},
              {"point light beside a column", {0.25, -0.25, 0.25}}};
    for (size_t i = 0; i < sizeof in / sizeof *in; i++) {
        snprintf(made.name, sizeof made.name, "%s", in[i].name);
        matrix_add(
            matrix, made,
            "{" IMAGE(16) AWAY POINT_AT FINE
            "'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [2, 2]}, "
            "'thickness': 0.5, 'tiles': [1, 1], 'material': {'builtin': 'chain', 'size': [32, "
            "32, 12]}}, 'quality': {'samples': 128}}, " GROUND(BELOW) "]}",
            in[i].place[0], in[i].place[1], in[i].place[2], 0.1, 1.0, 0.5, 0.5);
    }
    /* Nothing leaves what is solid all through, over the ground or cut by it. */
    made.most = 2e-6;
    made.why = "ambient light alone";
    made.voxels = voxels_solid;
    static const double heights[] = {0.5, -0.25};
    for (size_t i = 0; i < 2; i++) {
        snprintf(made.name, sizeof made.name, "point light in a solid%s",
                 i ? ", that the ground cuts" : "");
        matrix_add(matrix, made,
                   "{" IMAGE(16) AWAY POINT_AT FINE
                   "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [1.5, 1.5], "
                   "'divisions': [2, 2]}, 'thickness': 0.5, 'material': {'builtin': 'chain', "
                   "'size': [4, 4, 4]}}, 'transform': {'translate': [0, 0, %g]}}, " GROUND("") "]}",
                   0.31, -0.17, heights[i] + 0.27, 0.1, 1.0, 0.5, 0.5, heights[i]);
    }
}

void matrix_light(struct matrix *matrix) {
    tinted(matrix);
    filled(matrix);
    strands(matrix);
    struct matrix_case made = {
        .group = "light", .quick = true, .bound = BOUND_PICTURE, .most = 0.03, .why = why_maps};
    static const struct {
        const char *name, *direction;
    } lights[] = {
        {"from above and aside", "[1, 0.5, -1.3]"},
        {"straight down, along up", "[0, 0, -1]"},
        {"under the horizon", "[1, 0.5, 1.3]"},
        {"along the ground", "[1, 0.3, 0]"},
        {"a thousandth above the ground", "[1, 0.3, -0.001]"},
        {"toward the eye", "[0.1, -4, 2]"},
    };
    for (size_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        snprintf(made.name, sizeof made.name, "%s", lights[i].name);
        made.quick = i < 2;
        matrix_add(matrix, made,
                   "{" IMAGE(16) AWAY CAST("%s") FINE
                   "'objects': [" MIST(STEPS) ", " GROUND(BELOW) "]}",
                   lights[i].direction);
    }
    made.quick = false;
    snprintf(made.name, sizeof made.name, "eight lights");
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY
               "'lights': [{'direction': [1, 0.5, -1], 'color': [1, 0, 0], 'shadow': true}, "
               "{'direction': [-1, 0.5, -1], 'color': [0, 1, 0], 'shadow': true}, {'direction': "
               "[1, -0.5, -1], 'color': [0, 0, 1], 'shadow': true}, {'direction': [-1, -0.5, -1], "
               "'color': [1, 1, 0], 'shadow': true}, {'direction': [0, 0.5, -1], 'color': [0, 1, "
               "1], 'shadow': true}, {'direction': [0, -0.5, -1], 'color': [1, 0, 1], 'shadow': "
               "true}, {'direction': [0, 0, -1], 'color': [0.5, 0.5, 0.5], 'shadow': true}, "
               "{'direction': [0, 0, 1], 'color': [0.5, 0.5, 0.5], 'shadow': true}], 'objects': "
               "[" MIST(STEPS) ", " GROUND(BELOW) "]}");
    snprintf(made.name, sizeof made.name, "black light");
    made.most = 1e-3;
    made.why = "nothing of it arrives in any case: what mist by 32 steps errs by";
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY
               "'lights': [{'color': [0, 0, 0], 'shadow': true}], 'objects': [" MIST(
                   STEPS) ", " GROUND(BELOW) "]}");
    made.most = 0.03;
    made.why = why_maps;
    static const double scales[] = {1e-6, 1e6};
    for (size_t i = 0; i < 2; i++) {
        double s = scales[i];
        snprintf(made.name, sizeof made.name, "scale %g", s);
        made.quick = true;
        matrix_add(
            matrix, made,
            "{" IMAGE(16) "'camera': {'eye': [%.17g, %.17g, %.17g], 'fov_y_deg': 50}, " SUN FINE
                          "'objects': [" MIST(", 'transform': {'scale': %.17g}" STEPS) ", " GROUND(
                              ", 'transform': {'scale': %.17g, 'translate': [0, 0, %.17g]}") "]}",
            0.5 * s, -4 * s, 3 * s, s, s, -1.5 * s);
    }
    snprintf(made.name, sizeof made.name, "three million units away");
    matrix_add(
        matrix, made,
        "{" IMAGE(16) "'camera': {'eye': [3000000.5, -2000004, 1000003], 'target': "
                      "[3000000, -2000000, 1000000], 'fov_y_deg': 50}, " SUN FINE
                      "'objects': [" MIST(
                          ", 'transform': {'translate': [3000000, -2000000, "
                          "1000000]}" STEPS) ", " GROUND(", 'transform': {'translate': [3000000, "
                                                         "-2000000, 999998.5]}") "]}");
    made.quick = false;
    snprintf(made.name, sizeof made.name, "the eye in the shell");
    matrix_add(matrix, made,
               "{" IMAGE(16) "'camera': {'eye': [0.2, -1.1, 0.3], 'target': [0, 0, 1.2], "
                             "'fov_y_deg': 90}, " SUN FINE
                             "'objects': [" MIST(STEPS) ", " GROUND(BELOW) "]}");
    snprintf(made.name, sizeof made.name, "mirrored");
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY SUN FINE
               "'objects': [" MIST(", 'transform': {'scale': [-1, 1.2, 0.8], 'rotate_deg': [20, 0, "
                                   "40]}" STEPS) ", " GROUND(BELOW) "]}");
    snprintf(made.name, sizeof made.name, "no base");
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY SUN FINE
               "'objects': [{'shell': {'mesh': {'shape': 'torus', 'divisions': [12, 6]}, "
               "'thickness': 0.3, 'tiles': [3, 2], 'material': {'builtin': 'clouds', 'size': [8, "
               "8, 4]}}" STEPS "}, " GROUND(BELOW) "]}");
    snprintf(made.name, sizeof made.name, "columns of a solid");
    made.most = 0.08;
    made.why =
        "rings a few texels wide: a pixel of 16 is lit or dark by one ray (measured 0.054, and "
        "by slabs 0.082 as long as light took coarser steps through them)";
    matrix_add(matrix, made,
               "{" IMAGE(16) AWAY SUN FINE
               "'objects': [{'shell': {'mesh': {'shape': 'plane', 'divisions': [2, 2]}, "
               "'thickness': 0.5, 'tiles': [1, 1], 'material': {'builtin': 'chain', 'size': [32, "
               "32, 12]}}, 'quality': {'samples': 128}}, " GROUND(BELOW) "]}");
    static const double depths[] = {1e-4, 30, 1e6};
    made.voxels = fill_dense;
    for (size_t i = 0; i < 3; i++) {
        snprintf(made.name, sizeof made.name, "optical depth %g", depths[i]);
        made.arg[0] = depths[i];
        made.most = i == 2 ? 0.1 : 0.01;
        made.why = i == 2
                       ? "one step takes all light, and is lit as if light came by the eye's own "
                         "way: 1/2 of it arrives, where aslant 1 / (1 + ratio of the ways) does"
                       : "constant mist, no texel of whose shadow on itself is an edge";
        matrix_add(matrix, made,
                   "{" IMAGE(16) AWAY SUN FINE
                   "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': [3, 3], "
                   "'divisions': [2, 2]}, 'thickness': 0.5, 'base': {}, 'material': {'builtin': "
                   "'clouds', 'size': [4, 4, 4]}}, 'quality': {'samples': 256}}]}");
    }
    points(matrix);
}
