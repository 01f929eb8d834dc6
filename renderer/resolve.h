/* From prepared objects and the path that their shells name to a plan, and to `resolved`: the scene
 * with every choice filled in. May be done again for another path (contest.h). */
#ifndef PELT_RENDERER_RESOLVE_H
#define PELT_RENDERER_RESOLVE_H

#include "renderer/plan.h"
#include "renderer/prepare.h"

/* Asks the path that the shells of report->resolved name for its qualities and plans everything.
 * `asked`: the scene as it came, whose qualities are held. `may_walk` as for plan_order(), `force`
 * of force.h. Statuses of path.choose() and plan_order(). */
enum status resolve_plan(const struct scene *asked, struct prepared *prepared,
                         const struct view *world, bool may_walk, uint32_t force,
                         struct report *report, struct plan *plan, struct error *err);

/* What only geometry, materials and targets could decide, told in a scene; after drawing it is told
 * again. */
void resolve_objects(struct scene *scene, const struct prepared *prepared);

#endif
