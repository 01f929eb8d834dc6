/* What came of a render: timings, what was chosen, what was left out, what to be warned of.
 * report_write.c turns it into JSON; report.schema.json describes that. */
#ifndef PELT_API_REPORT_H
#define PELT_API_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/scene.h"

/* Stages of a request, in order. Times are in milliseconds and do not overlap; their sum is the
 * total within 5 % or 2 ms. */
#define REPORT_STAGES(X)                                                                           \
    X(queue)    /* waiting for a worker */                                                         \
    X(parse)    /* JSON to scene, validation */                                                    \
    X(assets)   /* finding, decoding and welding meshes and images; building the shell */          \
    X(bake)     /* what is computed once for each material */                                      \
    X(upload)   /* buffers and textures to the GL, shader variants */                              \
    X(sort)     /* visibility order */                                                             \
    X(shadow)   /* shadow maps */                                                                  \
    X(choose)   /* trials on a few pixels, and pictures thrown away, for a target */               \
    X(draw)     /* everything that makes the picture, until the GL has finished it */              \
    X(readback) /* pixels from the GL, and the box mean of the samples */                          \
    X(error)    /* measuring the picture's error */                                                \
    X(encode)   /* PNG, EXR, base64 */

enum report_stage {
#define REPORT_STAGE_ENUM(name) REPORT_STAGE_##name,
    REPORT_STAGES(REPORT_STAGE_ENUM)
#undef REPORT_STAGE_ENUM
        REPORT_STAGE_COUNT
};

const char *report_stage_name(enum report_stage stage);

enum report_clock { REPORT_CLOCK_FENCE, REPORT_CLOCK_QUERY };

struct report_warning {
    char code[32];     /* stable: "zero-area-triangles", ... */
    char pointer[128]; /* what it is about, in the scene */
    char message[256]; /* for people */
    uint64_t count;    /* how many */
    uint64_t first;    /* index of the first one */
};

struct report_pass {
    char name[32];
    char why[160]; /* left out: the reason; drawn: what for, may be empty */
};

enum { REPORT_PASSES_MAX = 48, REPORT_WARNINGS_MAX = 64, REPORT_LOADED_MAX = 16 };

/* What outlives pictures: each of these is found as an earlier picture left it, or made anew. */
#define REPORT_PARTS(X)                                                                            \
    X(meshes)   /* welded, with normals and adjacency */                                           \
    X(shells)   /* prisms and tetrahedra */                                                        \
    X(voxels)   /* of materials */                                                                 \
    X(textures) /* voxels and gradients in the GL */                                               \
    X(tables)   /* meshes and shells in the GL */                                                  \
    X(orders)   /* what lies before what, seen from this eye; always made anew */                  \
    X(programs) /* variants of shaders */

enum report_part {
#define REPORT_PART_ENUM(name) REPORT_PART_##name,
    REPORT_PARTS(REPORT_PART_ENUM)
#undef REPORT_PART_ENUM
        REPORT_PART_COUNT
};

const char *report_part_name(enum report_part part);

struct report_reuse {
    uint32_t kept, renewed;
};

struct report_work {
    uint64_t triangles, prisms, tetrahedra, slices, segments, fragments, samples;
    uint64_t draws, upload_bytes, cycles;
    uint64_t sort_nodes, sort_edges;
};

/* How far the picture is from the truth: DESIGN, 'Error'. Figures are RMSE in linear premultiplied
 * RGBA over the pixels that any object touches, unless said otherwise; NAN: not known. */
enum report_error_kind { REPORT_ERROR_NONE, REPORT_ERROR_ESTIMATE, REPORT_ERROR_REFERENCE };

struct report_error {
    enum report_error_kind kind;
    uint64_t pixels;  /* that were looked at */
    uint64_t touched; /* of those: touched by an object */
    double rmse;      /* against the truth; of an estimate: model and discretisation together */
    double rmse_standard_error;
    double max_abs, p99; /* largest difference of a channel; 99th percentile of pixels' RMS */
    double whole_rmse;   /* over the frame */
    double psnr_db;      /* of the frame, for a peak of 1 */
    double flip;         /* mean over the frame; where every pixel was compared */
    double coverage;     /* share of the frame's pixels whose silhouette differs */
    double model;        /* of the path's own limit */
    double model_standard_error;
    uint64_t model_pixels;
    double discretisation; /* of this picture against that limit */
    double discretisation_standard_error;
};

/* What came of scene.target. */
enum report_target_kind { REPORT_TARGET_NONE, REPORT_TARGET_MAX_ERROR, REPORT_TARGET_DEADLINE_MS };

struct report_target {
    enum report_target_kind kind;
    double asked;   /* RMSE, or milliseconds */
    double reached; /* the estimate and twice its standard error, or the total */
    double model;   /* max_error: the path's own error, as the trials tell it; NAN: not found */
    bool met;
    uint64_t trials;  /* draws of a few pixels */
    uint64_t redrawn; /* pictures that were thrown away and drawn again */
    char why[160];    /* what was chosen, or why nothing could be */
};

/* By which path the shells were drawn, where the scene leaves that open. */
enum report_choice_by {
    REPORT_CHOICE_NONE,   /* the scene says it, or there is no shell */
    REPORT_CHOICE_ONLY,   /* one path alone could */
    REPORT_CHOICE_MODEL,  /* what they are expected to cost */
    REPORT_CHOICE_TRIALS, /* what they took, or reached, in trials for the target */
    REPORT_CHOICE_PREPARE /* what only making ready could tell of the cheapest */
};

enum { REPORT_CHOICE_MAX = 4 };

/* Figures are NAN where they were not found. */
struct report_candidate {
    char path[16];
    bool able;                         /* it can draw the scene */
    bool exact;                        /* it draws the same at any quality: no steps, no error */
    double expected_ms;                /* by the cost model */
    double outlines, fragments, steps; /* that it is made of: renderer/cost.h */
    double measured_ms;                /* of the picture, as trials tell it */
    double error;                      /* RMSE, as trials for max_error tell it */
    char why[128];                     /* not able: the refusal */
};

struct report_choice {
    enum report_choice_by by;
    size_t count, chosen; /* index into among */
    struct report_candidate among[REPORT_CHOICE_MAX];
    char why[192];
};

struct report {
    double stage_ms[REPORT_STAGE_COUNT];
    double total_ms;
    enum report_clock clock;
    bool cold; /* a shader was compiled or a bake was made for this picture */

    struct scene resolved; /* arena-owned parts belong to the render result's arena */

    /* renderer; static or context-lifetime strings copied in */
    char backend[16], device[128], gl_renderer[128], gl_version[128], cpu[128];
    int threads;
    size_t loaded_count;
    char loaded[REPORT_LOADED_MAX][48]; /* libraries opened on demand in this process */

    size_t pass_count, left_out_count;
    struct report_pass passes[REPORT_PASSES_MAX], left_out[REPORT_PASSES_MAX];

    struct report_reuse reuse[REPORT_PART_COUNT];
    struct report_work work;
    struct report_error error;
    struct report_target target;
    struct report_choice choice;

    size_t warning_count;
    uint64_t warnings_left_out;
    struct report_warning warnings[REPORT_WARNINGS_MAX];
};

/* Appends a warning; past the limit it is only counted. */
void report_warn(struct report *report, const char *code, const char *pointer, uint64_t count,
                 uint64_t first, const char *format, ...) __attribute__((format(printf, 6, 7)));

/* Puts a row in passes, and takes it off left_out; or puts one in left_out. A row that is there has
 * its reason replaced. */
void report_pass(struct report *report, const char *name, const char *why);
void report_left_out(struct report *report, const char *name, const char *why);

/* What a draw tells of itself: kept and put back around draws that are not the picture's (trials,
 * estimates), so that the report tells of the picture alone. */
struct report_drawn {
    struct report_work work;
    size_t pass_count, left_out_count;
    struct report_pass passes[REPORT_PASSES_MAX], left_out[REPORT_PASSES_MAX];
};
void report_keep_drawn(const struct report *report, struct report_drawn *drawn);
void report_restore_drawn(struct report *report, const struct report_drawn *drawn);

/* Counts one part. */
void report_reuse(struct report *report, enum report_part part, bool kept);

/* Once total_ms is final: whether a deadline was met. */
void report_settle(struct report *report);

/* The report as JSON, malloc'ed (caller frees); NULL where memory ran out. */
char *report_write(const struct report *report);

#endif
