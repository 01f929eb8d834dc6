/* Another path than the one that choice.h took, once more is known than a model can tell:
 *
 *  - making the first ready may fail, or find that more of the picture's rays meet overlapping
 * cells than it can mix rightly (`prepare`; decided by counts, so the same every time);
 *  - where a target is asked for, both are tried on some pixels of the picture (`trials`) if the
 *    other, at a quality as many times its default, is expected to cost less than CHOICE_TIE times
 * as much, and for deadline_ms if trials fit in; for max_error also where the first misses it and
 *    mixes overlaps wrongly: elsewhere no path has less of a model error than a walk has.
 *
 * Time is measured on large tiles, not on the scattered blocks of the error's trials: slabs make
 * outlines of every cell that a block touches, so scattered ones would cost them nearly all. What a
 * path has made ready stays in its own state while the other is tried, so going back costs nothing.
 */
#ifndef PELT_RENDERER_CONTEST_H
#define PELT_RENDERER_CONTEST_H

#include "renderer/aim.h"
#include "renderer/choice.h"
#include "renderer/resolve.h"

struct contest {
    const struct scene *asked;
    struct prepared *prepared;
    struct plan *plan;
    struct drawing *drawing; /* its path_state goes with the plan */
    bool may_walk;
    uint32_t force;
    /* The state of a path, made when first asked for. */
    enum status (*state_of)(void *user, const struct path *path, void **state, struct error *err);
    void *user;
};

/* Makes the path of the plan ready, or where it cannot draw the picture rightly and the scene
 * leaves the path open, the other one. Statuses of path.create() and path.prepare(). */
enum status contest_prepare(const struct contest *contest, struct error *err);

/* Whether the first path mixes overlaps wrongly, and another is there that may not: then
 * aim_choose() is to find the error even where there is no quality to choose. */
bool contest_doubts(const struct contest *contest);

/* For max_error, after aim_choose() chose for the first path: leaves the better one in place, with
 * its quality. Statuses of contest_prepare(), aim_choose() and probe_draw(). */
enum status contest_error(const struct contest *contest, const struct aim *aim, struct error *err);

/* For deadline_ms, before aim_choose(); `left_ms` as of struct aim. */
enum status contest_deadline(const struct contest *contest, const struct measure *measure,
                             double left_ms, struct error *err);

#endif
