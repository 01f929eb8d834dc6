/* The series of a sweep, one row of a table each: a path, a variant of it, and the member of its
 * quality that is moved. What a row names is looked up in the table of the scene's members
 * (api/scene_members.h), so ranges are said nowhere else. */
#ifndef PELT_RENDERER_SWEEP_SERIES_H
#define PELT_RENDERER_SWEEP_SERIES_H

#include "api/scene.h"

enum { SWEEP_LADDER_DEFAULT = 6, SWEEP_CHOICES_MAX = 3 };

struct sweep_row {
    const char *name, *text; /* "tetra-walk"; what it is, for people */
    enum scene_path path;
    enum scene_object_kind kind; /* the objects that such a path draws */
    const char *quality;         /* the member that is moved: an integer */
    bool shadow;                 /* it is one of the scene's `shadow`, not of an object's quality */
    bool filter;                 /* a sample stands for its whole pixel: see sweep.h */
    /* Members that tell the variant, each with its choice; NULL: no more. */
    struct {
        const char *member, *value;
    } choice[SWEEP_CHOICES_MAX];
    int ladder[SWEEP_LADDER_DEFAULT];
};

extern const struct sweep_row sweep_rows[]; /* ends with a row whose name is NULL */

const struct sweep_row *sweep_row_find(const char *name); /* NULL: no such series */

/* The largest and the smallest value that the member may have, and its unit ("per thickness"). */
int sweep_row_max(const struct sweep_row *row);
int sweep_row_min(const struct sweep_row *row);
const char *sweep_row_unit(const struct sweep_row *row);
const char *sweep_row_path_name(const struct sweep_row *row);

/* Whether an object of the scene can be drawn by this path at all, and the member matters to it. */
bool sweep_row_concerns(const struct sweep_row *row, const struct scene *scene);

/* Gives every object that the row concerns its path, its variant and this quality, and takes away
 * whatever else its quality said. `objects` is the caller's own copy. */
void sweep_row_apply(const struct sweep_row *row, int quality, struct scene_object *objects,
                     size_t count);

/* Whether a light of the scene throws a shadow; whether a shell of it asks for a filter. */
bool sweep_casts(const struct scene *scene);
bool sweep_filters(const struct scene *scene);

#endif
