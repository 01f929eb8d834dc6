/* The sweep: one scene, drawn again and again by every path and variant that can, at a ladder of
 * qualities; each picture timed over repeats and compared with the reference. Error against run
 * time, in one record; service/sweep_*.c make JSON, CSV and a page of it.
 *
 * Repeats of different points are interleaved, round robin, every other round backwards, so that a
 * noisy moment of the machine does not fall on one point alone. A point's first drawing, which may
 * compile, bake and decode, is told apart.
 *
 * Three errors of each point, all over the same pixels (the reference's):
 *   error            against the reference
 *   discretisation   against the same series' own limit: its picture at four times the highest
 *                    quality of the ladder (or the largest quality there is)
 *   model            of the series: that limit against the reference
 * The series of filters are drawn where the scene asks for one, or they are asked for by name. A
 * filtered sample stands for its whole pixel, which none at one position does: beside such series
 * the reference of *all* of them is the mean of MEASURE_SAMPLES positions a pixel (measure.h), as
 * in report.error, and of unfiltered ones `error` and `model` hold what aliases.
 *
 * Of a path of order p the limit itself is off by a 4^-p-th of what the highest quality is: of a
 * first-order path its discretisation is told a quarter too small, of one of second order a
 * sixteenth. The fitted order corrects for that (sweep_stats.h). */
#ifndef PELT_RENDERER_SWEEP_H
#define PELT_RENDERER_SWEEP_H

#include <stdatomic.h>

#include "renderer/error/metrics.h"
#include "renderer/render.h"
#include "renderer/sweep_series.h"
#include "renderer/sweep_stats.h"

enum {
    SWEEP_SERIES_MAX = 32,
    SWEEP_QUALITIES_MAX = 32,
    SWEEP_REPEATS_MAX = 1000,
    SWEEP_REPEATS = 5,          /* by default */
    SWEEP_REFERENCE_S = 120,    /* by default: sweep_options.reference_s */
    SWEEP_SAMPLE_PIXELS = 4096, /* by default, where not all are drawn */

    /* Pictures are kept until the sweep is destroyed: points times pixels, 20 bytes each. */
    SWEEP_PIXELS_MAX = 48 * 1024 * 1024
};

enum sweep_pixels { SWEEP_PIXELS_AUTO, SWEEP_PIXELS_ALL, SWEEP_PIXELS_SOME };

struct sweep_options {
    const char *const *series; /* names of sweep_rows */
    size_t series_count;       /* 0: all */
    const int *qualities;      /* ascending */
    size_t quality_count;      /* 0: each series' own ladder */
    int repeats;               /* timed, besides the first; 0: SWEEP_REPEATS */
    /* What the reference draws. AUTO: all pixels where that is expected to take no longer than
     * reference_s (0: SWEEP_REFERENCE_S), measured on the first 1,024, else SWEEP_SAMPLE_PIXELS.
     * SOME: `pixel_count` (all, if the picture has no more), stratified. */
    enum sweep_pixels pixels;
    size_t pixel_count;
    double reference_s;
    int threads; /* of the reference; 0: one for each core */
    /* Called now and then by the calling thread: `done` of `total` drawings (or pixels) of the
     * stage that `what` names. May be NULL. */
    void (*progress)(void *user, size_t done, size_t total, const char *what);
    void *user;
    const atomic_bool *cancel; /* set by anyone; may be NULL */
};

/* What is wrong with the options, with pointers "/series/0", "/quality/3", "/repeats", "/pixels":
 * STATUS_BAD_REQUEST. sweep_run() asks it too. */
enum status sweep_check(const struct sweep_options *options, struct error *err);

/* Whether a series is among those that are asked for. */
bool sweep_wants(const struct sweep_options *options, const struct sweep_row *row);

enum { SWEEP_REASON_BYTES = 256 };

struct sweep_point {
    int quality;
    char refused[SWEEP_REASON_BYTES]; /* why it was not drawn, with the pointer; "": it was, and
                                         only then is there anything below */
    double cold_ms; /* total of the first drawing, which is in none of the following */
    bool cold;      /* in it something was compiled or baked */
    double stage_ms[REPORT_STAGE_COUNT];   /* medians */
    struct sweep_spread total_ms, draw_ms; /* total: from a scene in memory to its pixels */
    struct report_work work;
    struct error_metrics error;          /* flip is NAN where not all pixels were drawn */
    struct error_figures discretisation; /* NANs where the limit could not be drawn, or the quality
                                            is more than half of its */
    /* On the Pareto front of total_ms.median and error.touched.rmse over all series, to within the
     * largest noise floor (sweep_fit.floor). */
    bool front;
    float *pixels; /* width * height * 4, as renderer_render() gives them */
    float *flip;   /* width * height; NULL where not all pixels were drawn */
};

struct sweep_series {
    const struct sweep_row *row;
    char refused[SWEEP_REASON_BYTES]; /* why none of its points was drawn; "": some was */
    size_t point_count;
    struct sweep_point *points;
    int limit_quality;          /* 0 where it could not be drawn */
    struct error_figures model; /* NANs likewise */
    struct sweep_fit fit;
};

struct sweep {
    int width, height, repeats;
    char *scene; /* JSON: what was drawn, with the camera filled in; `path` and `quality` are as the
                    scene gave them, and were overridden */
    struct report report; /* of the last picture: what drew it. `resolved` is empty; `warnings` are
                             those of all pictures, each once, and of the reference */

    size_t series_count;
    struct sweep_series *series;

    /* The reference. `pixels` lists those that were drawn, NULL: all, in which case `reference` and
     * `touched` are in the picture's order. */
    uint32_t *pixels;
    size_t reference_count;
    int reference_samples; /* positions in each pixel */
    float *reference;      /* reference_count * 4 */
    uint8_t *touched;
    double reference_s;   /* what drawing it took */
    double background[4]; /* of the scene */
};

/* Runs one. `*sweep` owns all that it holds and depends on nothing else; NULL on failure.
 * What a series or a point is refused for is told in it; if all are refused, STATUS_NOT_IMPLEMENTED
 * with all the reasons. STATUS_INVALID_SCENE where the scene holds nothing to sweep,
 * STATUS_TOO_COMPLEX where its pictures would not fit, STATUS_CANCELLED, those of sweep_check(),
 * renderer_render(), truth_create(), truth_draw_pixels(). Thread: the renderer's. Blocks, for
 * minutes: `progress` tells. */
enum status sweep_run(struct renderer *renderer, const struct scene *scene,
                      const struct asset_source *assets, const struct sweep_options *options,
                      struct sweep **sweep, struct error *err);
void sweep_destroy(struct sweep *sweep); /* takes NULL */

#endif
