/* `path: "auto"`: by which path the shells are drawn where the scene leaves that open. The cheapest
 * of those that can draw it, as the cost model has it (cost.h): without a clock, so that the same
 * scene is drawn by the same path every time, and what `resolved` tells draws the same picture.
 * Where a target is asked for, trials may overrule it (contest.h).
 *
 * A path takes part if it has a row in the table of choice.c and neither its choose() nor
 * plan_order() refuses the scene. */
#ifndef PELT_RENDERER_CHOICE_H
#define PELT_RENDERER_CHOICE_H

#include "renderer/prepare.h"

/* Costs within this factor of one another are a tie, which the model cannot decide: its ratio
 * of slabs to walks is off by no more in 89 of 105 scenes of bench_choice.c (cost.c). */
#define CHOICE_TIE 2.0

/* Decides for the shells of a scene whose plan_paths() left the path open: sets it in each of them,
 * and fills report->choice. `scene` is the one to become `resolved`, whose views are made;
 * `may_walk` as for plan_order(). Where no shell holds anything, none is costed.
 * The refusal of the last path, where all refuse; STATUS_OUT_OF_MEMORY; else STATUS_OK. */
enum status choice_decide(struct prepared *prepared, struct scene *scene, const struct view *world,
                          bool may_walk, struct report *report, struct error *err);

/* Makes `path`, a candidate, that of all shells, and the chosen one of the report. */
void choice_set(struct scene *scene, struct report *report, const struct path *path);

/* For measuring alone (tests/bench/bench_choice.c): fills report->choice with what the path that
 * the scene names is expected to cost, once its order is planned. */
void choice_tell_cost(const struct prepared *prepared, const struct scene *scene,
                      const struct view *world, struct report *report);

/* The path that `report->choice` says is able besides the chosen one; NULL: none. */
const struct path *choice_other(const struct report *report);

#endif
