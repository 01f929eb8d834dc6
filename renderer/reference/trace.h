/* One ray of the picture: what it meets, in order, and what it brings to the eye. Internal to the
 * room; each thread has a struct tracer of its own. */
#ifndef PELT_RENDERER_REFERENCE_TRACE_H
#define PELT_RENDERER_REFERENCE_TRACE_H

#include "renderer/reference/prism.h"

/* A prism's interval with a material in it. */
struct segment {
    uint32_t prism; /* index into the tracer's prisms */
    struct prism_interval span;
};

/* A part of a segment between two crossings of voxel planes: the eight voxels around it are
 * (x, y, z) to (x + 1, y + 1, z + 1), before wrapping and clamping. */
struct cell {
    struct prism_interval span;
    uint32_t segment;
    int x, y, z;
};

/* Growing lists, kept from ray to ray. */
struct tracer {
    const struct world *world;
    double tolerance;
    enum status status; /* of the ray: STATUS_OUT_OF_MEMORY, STATUS_TOO_COMPLEX */

    double o[3], d[3];       /* the ray, relative to the world's centre */
    struct object_ray *rays; /* one for each object */
    struct tracer *light;    /* for rays toward lights; NULL: no light throws a shadow */
    struct prism_ray *prisms;
    size_t prism_count, prism_capacity;
    struct segment *segments;
    size_t segment_count, segment_capacity;
    struct cell *cells;
    size_t cell_count, cell_capacity;
    double *breaks;
    size_t break_count, break_capacity;
    struct active *active;
    size_t active_count, active_capacity;

    uint64_t segments_met, cells_met, evaluations, unresolved;
};

bool tracer_init(struct tracer *tracer, const struct world *world, double tolerance);
void tracer_finish(struct tracer *tracer);

/* Makes room for one more element of `size` bytes; false, and tracer->status, where there is none.
 */
bool tracer_grow(struct tracer *tracer, void **list, size_t count, size_t *capacity, size_t size);

/* Premultiplied linear RGBA over the background of the ray through (x, y), in pixels. Returns
 * whether any object lies on it. */
bool tracer_trace(struct tracer *tracer, double x, double y, double rgba[4]);

/* ---- parts ---- */

/* Everything semi-transparent and solid on tracer->rays between t_eye and t_end: prisms, segments,
 * and cells in order (trace.c). */
bool tracer_gather(struct tracer *tracer, double t_eye, double t_end);

/* What the point lies on, from which a ray toward a light begins. */
struct origin {
    const struct world_object *object; /* NULL: on nothing, within a medium */
    uint32_t triangle;                 /* of the object's, unless */
    bool solid;                        /* on a solid's surface */
    double flat[3];                    /* else the triangle's normal, toward the viewer */
};

/* What of each light arrives at the point of the ray at `t` (shadow.c). False, and tracer->status,
 * where memory ran out. */
bool tracer_incident(struct tracer *tracer, double t, const struct origin *origin,
                     struct reference_incident *incident);

/* Whether a triangle other than the origin's lies between t_from and t_to (surface.c). */
bool tracer_meets_surface(struct tracer *tracer, double t_from, double t_to,
                          const struct origin *origin);

/* Whether a solid does, the gathered cells being in order; a point on a solid's surface is the
 * limit of points just outside (solid.c). */
bool tracer_meets_solid(struct tracer *tracer, double t_from, const struct origin *origin);

/* Splits a segment into cells (cells.c). */
bool tracer_split(struct tracer *tracer, uint32_t segment);

/* What is opaque at the end of a ray. */
struct stop {
    double t; /* INFINITY: nothing */
    double color[3];
};

/* The nearest opaque triangle (surface.c). False as above. */
bool tracer_find_surface(struct tracer *tracer, double t_eye, const double view[3],
                         struct stop *stop);

/* The first solid surface, if it is nearer than the stop (solid.c). Cells are sorted. False
 * as above. */
bool tracer_find_solid(struct tracer *tracer, const double view[3], struct stop *stop);

/* The emission-absorption integral from t_eye to t_end over all cells (integrate.c): radiance, and
 * the transmittance that is left, of each channel. Cells are sorted. */
bool tracer_integrate(struct tracer *tracer, double t_eye, double t_end, const double view[3],
                      double radiance[3], double transmittance[3]);

#endif
