/* Filters (`quality.filter`) where a sample covers many voxels: each picture of one sample a pixel
 * against the mean of 64 positions in each, which is what a filtered sample stands for. Fur whose
 * voxels are a quarter and a thirty-second of a pixel, solids as small, an eye within the shell,
 * and ten thousand tiles.
 *
 * What such a mean can be held to is what the filters promise, not a closed form: bounds are a
 * sixth or so above the errors measured, and each reason tells those, and what no filter has. */
#include "tests/stability/matrix_scenes.h"

#define WHOLE_PIXELS 64

#define FILTER "@" /* stands for it in a scene */
#define PLANE(camera, size, tiles, builtin, voxels, more)                                          \
    "{" IMAGE(12) camera LIGHTS "'objects': [{'shell': {'mesh': {'shape': 'plane', 'size': " size  \
                                ", 'divisions': [2, 2]}, 'thickness': 0.12, 'tiles': " tiles       \
                                ", 'material': {'builtin': '" builtin "', 'size': " voxels more    \
                                "}}, 'quality': {'samples': 32, 'filter': '" FILTER "'}}]}"

/* Parallel rays at 45 degrees; a pixel is 1 / 12 wide. */
#define ASLANT                                                                                     \
    "'camera': {'eye': [0, -3, 3], 'target': [0, 0, 0], 'up': [0, 0, 1], 'ortho_height': 1}, "
/* Among the clouds, looking along the shell and down. */
#define INSIDE "'camera': {'eye': [0.1, -0.4, 0.15], 'target': [0.1, 0.6, -0.1], 'fov_y_deg': 70}, "

/* Under FROM_ABOVE a pixel is 833 tiles wide, an odd number: 8 positions across it are as many
 * phases of the tile, evenly spread, where 10,000 tiles on 2 x 2 would give the mean of 64
 * positions but a part of one. */
#define ODD_TILES "[2.0008003201280512, 2.0008003201280512]"
#define UNLIT     ", 'lit': false"

/* Why, with the figures of mip and of view that were measured, and of no filter. */
#define WHY_MEAN(figures) "the mean of 64 positions; " figures
#define WHY_LIT(figures)                                                                           \
    "mip: light falls on the mean of normals; view: on all, by their moments; " figures
#define WHY_FAR_SOLID(figures) "a solid of voxels smaller than a sample, as a medium; " figures
#define WHY_NEAR(figures)                                                                          \
    "near the eye voxels are larger than a sample and stay as they are; " figures

static const struct {
    const char *name;
    bool quick;
    double most[2]; /* of the RMSE, by mip and by view */
    const char *why, *scene;
} rows[] = {
    {"fur, 4 voxels a sample, unlit",
     false,
     {8e-3, 5e-3},
     WHY_MEAN("measured 0.007 and 0.004, no filter 0.007"),
     PLANE(ASLANT, "[8, 8]", "[6, 6]", "fur", "[64, 64, 16]", UNLIT)},
    {"fur, 4 voxels a sample",
     false,
     {7.5e-2, 2.2e-2},
     WHY_LIT("measured 0.063 and 0.018, no filter 0.038"),
     PLANE(ASLANT, "[8, 8]", "[6, 6]", "fur", "[64, 64, 16]", "")},
    {"fur, 32 voxels a sample, unlit",
     true,
     {1.4e-2, 2.5e-3},
     WHY_MEAN("measured 0.012 and 0.002, no filter 0.015"),
     PLANE(ASLANT, "[8, 8]", "[48, 48]", "fur", "[64, 64, 16]", UNLIT)},
    {"fur, 32 voxels a sample",
     false,
     {0.1, 1e-2},
     WHY_LIT("measured 0.087 and 0.0086, no filter 0.10"),
     PLANE(ASLANT, "[8, 8]", "[48, 48]", "fur", "[64, 64, 16]", "")},
    {"chain, 4 voxels a sample, unlit",
     false,
     {0.17, 0.13},
     WHY_FAR_SOLID("measured 0.15 and 0.11, no filter 0.15"),
     PLANE(ASLANT, "[8, 8]", "[6, 6]", "chain", "[64, 64, 16]", UNLIT)},
    {"chain, 32 voxels a sample, unlit",
     true,
     {0.125, 5e-2},
     WHY_FAR_SOLID("measured 0.11 and 0.044, no filter 0.13"),
     PLANE(ASLANT, "[8, 8]", "[48, 48]", "chain", "[64, 64, 16]", UNLIT)},
    {"chain, 32 voxels a sample",
     false,
     {0.16, 7.5e-2},
     WHY_FAR_SOLID("measured 0.14 and 0.068, no filter 0.18"),
     PLANE(ASLANT, "[8, 8]", "[48, 48]", "chain", "[64, 64, 16]", "")},
    {"the eye in clouds",
     false,
     {0.105, 0.11},
     WHY_NEAR("measured 0.092 and 0.093, no filter 0.12"),
     PLANE(INSIDE, "[8, 8]", "[48, 48]", "clouds", "[32, 32, 8]", "")},
    {"10,000 tiles, above",
     true,
     {1.3e-2, 5e-2},
     WHY_MEAN("measured 0.011 and 0.042, no filter 0.40"),
     PLANE(FROM_ABOVE, ODD_TILES, "[10000, 10000]", "clouds", "[16, 16, 8]", UNLIT)},
    {"10,000 tiles, aslant",
     false,
     {0.23, 0.1},
     WHY_MEAN("measured 0.20 and 0.08, no filter 0.15"),
     PLANE(ASLANT, "[8, 8]", "[10000, 10000]", "clouds", "[16, 16, 8]", UNLIT)},
};

void matrix_filter(struct matrix *matrix) {
    static const char *const filters[2] = {"mip", "view"};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (int f = 0; f < 2; f++) {
            struct matrix_case made = {.group = "filter",
                                       .quick = rows[i].quick,
                                       .bound = BOUND_PICTURE,
                                       .most = rows[i].most[f],
                                       .why = rows[i].why,
                                       .truth_samples = WHOLE_PIXELS};
            snprintf(made.name, sizeof made.name, "%s, %s", rows[i].name, filters[f]);
            matrix_add(matrix, made, "%.*s%s%s",
                       (int)(strstr(rows[i].scene, FILTER) - rows[i].scene), rows[i].scene,
                       filters[f], strstr(rows[i].scene, FILTER) + strlen(FILTER));
        }
}
