/* The stability matrix: cases x paths, each cell with its error against the reference.
 *
 * A case is a scene, what is put in its place where a scene cannot say it (voxels, triangles), and
 * the bound that its pictures are held to, with the reason for that bound. Cases lie in
 * matrix_GROUP.c, the paths in one table (matrix_cell.c), the drawing and the judging there too;
 * matrix.c prints. */
#ifndef PELT_TESTS_STABILITY_MATRIX_H
#define PELT_TESTS_STABILITY_MATRIX_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/scene.h"
#include "renderer/asset/volume.h"
#include "renderer/render.h"

/* What the error of a picture means. */
enum bound {
    /* Every pixel shows the optical depth of the truth, to `most` relative while that is at most
     * 10, beyond that its transmittance to BOUND_THROUGH; and its colour as exactly. */
    BOUND_DEPTH,
    /* The RMSE over the touched pixels is at most `most`, the largest difference at most
     * `most_max` (0: not asked); of `outliers` pixels, those that are off most, nothing is asked:
     * where a silhouette passes within rounding, or within a step, either side is right. */
    BOUND_PICTURE,
};

#define BOUND_DEPTH_RELATIVE 1e-4
#define BOUND_THROUGH        1e-6

struct blob {
    unsigned char *data;
    size_t size, capacity;
};

struct matrix_case {
    const char *group;
    char name[64];
    char *scene; /* JSON */
    bool quick;  /* part of `make test` */

    /* Overwrites the voxels that the scene's `clouds` (medium) or `chain` (solid) came with. */
    void (*voxels)(struct volume *volume, const struct matrix_case *self);
    /* Makes the .glb that the scene names "mesh.glb". */
    void (*mesh)(struct blob *glb, const struct matrix_case *self);
    double arg[2]; /* for these two */

    enum bound bound;
    double most, most_max;
    int outliers;
    const char *why; /* why the bound is what it is */

    /* Positions in each pixel of the truth, where a sample of the picture stands for its whole
     * pixel; 0: the picture's. */
    int truth_samples;

    /* Steps that stand for the path's limit, to tell model from discretisation; 0: not told. */
    int limit;
    int slices; /* slabs that do it justice; 0: as many as steps ask for, 4,096 at most */
    /* What a path may answer instead of a picture that is right: its name, '*' for all, else
     * NULL. Anything else that is refused, or wrong with a warning, is WRONG. */
    const char *may_refuse;
    const char *may_warn; /* a warning's code; its picture is held to `most_warned` */
    double most_warned;
};

struct matrix {
    struct matrix_case *cases;
    size_t count, capacity;
};

/* Appends a case; its scene is printf-formatted JSON with ' for ". */
void matrix_add(struct matrix *matrix, struct matrix_case made, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The groups: each appends its cases. */
void matrix_stiff(struct matrix *matrix);
void matrix_geometry(struct matrix *matrix);
void matrix_camera(struct matrix *matrix);
void matrix_order(struct matrix *matrix);
void matrix_material(struct matrix *matrix);
void matrix_light(struct matrix *matrix);
void matrix_filter(struct matrix *matrix);

/* A glTF binary of float positions (Pelt's Z-up), triangles, and, where not NULL, normals. */
void matrix_write_glb(struct blob *glb, const float (*position)[3], const float (*normal)[3],
                      uint32_t vertices, const uint32_t (*triangle)[3], uint32_t triangles);

/* ---- cells ---- */

struct matrix_path {
    const char *name;
    enum scene_path path;
    enum scene_order order;
};
extern const struct matrix_path matrix_paths[]; /* ends with a NULL name */

enum verdict { VERDICT_RIGHT, VERDICT_REFUSED, VERDICT_WARNED, VERDICT_WRONG };
extern const char *const matrix_verdicts[];

struct matrix_cell {
    enum verdict verdict;
    char reason[256]; /* of a refusal, a warning, or a fault */
    double figure;    /* what is bound: RMSE, or the largest relative error of an optical depth */
    double rmse, max, model, discretisation; /* NAN where not told */
    size_t pixels, coverage;
    double ms; /* of the first picture */
};

/* The truth about a case, and everything that its cells share. */
struct matrix_truth;
struct matrix_truth *matrix_truth_make(const struct matrix_case *of, char reason[256]);
void matrix_truth_free(struct matrix_truth *truth);
double matrix_truth_ms(const struct matrix_truth *truth);
uint64_t matrix_truth_unresolved(const struct matrix_truth *truth);

/* `limits`: model and discretisation are told apart where the case asks for it. */
void matrix_draw(struct renderer *renderer, const struct matrix_truth *truth,
                 const struct matrix_path *path, bool limits, struct matrix_cell *cell);

/* Writes truth, picture and ten times the difference side by side, CASE-PATH.ppm in `folder`. */
void matrix_set_pictures(const char *folder);

#endif
