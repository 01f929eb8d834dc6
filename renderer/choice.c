/* See choice.h. */
#include "renderer/choice.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>

#include "renderer/cost.h"
#include "renderer/plan.h"
#include "renderer/tint.h"

/* Which paths are chosen from; of equals the first one. */
enum { CANDIDATES = 2 };
static const struct path *const candidates[CANDIDATES] = {&path_tetra, &path_slicing};

_Static_assert((int)CANDIDATES <= (int)REPORT_CHOICE_MAX, "the report has room for all candidates");

static void set_path(struct scene *scene, const struct path *path) {
    for (size_t i = 0; i < scene->object_count; i++)
        if (scene->objects[i].kind == SCENE_OBJECT_SHELL)
            scene->objects[i].path = path->id;
}

/* Whether a path can draw the shells, which then hold what it would draw them with. */
static enum status try_path(const struct path *path, struct prepared *prepared, struct scene *scene,
                            bool may_walk, struct error *err) {
    set_path(scene, path);
    enum status status = path->choose(prepared->objects, prepared->object_count, err);
    if (status == STATUS_OK)
        status = plan_order(prepared->objects, prepared->object_count, may_walk, err);
    return status == STATUS_OK ? tint_check(scene, prepared->objects, prepared->object_count, err)
                               : status;
}

static void tell_refused(struct report_candidate *candidate, const struct error *err) {
    if (err->fault_count) /* memory may have run out for it */
        snprintf(candidate->why, sizeof candidate->why, "%s: %s", err->faults[0].pointer,
                 err->faults[0].message);
}

/* All that are able were costed: the cheapest, and why. One that is exact wherever another has
 * steps is taken at any price that a model can tell: no number of steps would make the other as
 * good. */
static void decide(struct report_choice *choice) {
    const struct report_candidate *best = NULL, *next = NULL;
    size_t exact = 0, able = 0;
    for (size_t i = 0; i < CANDIDATES; i++) {
        able += choice->among[i].able;
        exact += choice->among[i].able && choice->among[i].exact;
    }
    bool only_exact = exact > 0 && exact < able;
    for (size_t i = 0; i < CANDIDATES; i++) {
        const struct report_candidate *candidate = &choice->among[i];
        if (!candidate->able)
            continue;
        bool better = !best || (only_exact && candidate->exact != best->exact
                                    ? candidate->exact
                                    : candidate->expected_ms < best->expected_ms);
        if (better)
            next = best;
        else if (!next || candidate->expected_ms < next->expected_ms)
            next = candidate;
        best = better ? candidate : best;
    }
    assert(best && next); /* two are able */
    choice->chosen = (size_t)(best - choice->among);
    const char *sure = next->expected_ms > CHOICE_TIE * best->expected_ms
                           ? ""
                           : ": too near to each other to be sure";
    if (only_exact)
        sure = ", but takes steps where the first is exact";
    snprintf(choice->why, sizeof choice->why, "%s is expected to take %.3g ms, %s %.3g ms%s",
             best->path, best->expected_ms, next->path, next->expected_ms, sure);
}

static void tell_cost(const struct prepared *prepared, const struct scene *scene,
                      const struct view *world, struct report_candidate *candidate) {
    struct cost cost;
    cost_find(prepared->objects, prepared->object_count, world, scene->light_count > 0, &cost);
    candidate->exact = true;
    for (size_t i = 0; i < prepared->object_count; i++)
        if (path_object_drawn(&prepared->objects[i]))
            candidate->exact = candidate->exact && prepared->objects[i].any_quality;
    candidate->expected_ms = cost.ms;
    candidate->outlines = cost.outlines;
    candidate->fragments = cost.fragments;
    candidate->steps = cost.steps;
}

void choice_tell_cost(const struct prepared *prepared, const struct scene *scene,
                      const struct view *world, struct report *report) {
    report->choice = (struct report_choice){.by = REPORT_CHOICE_MODEL, .count = 1};
    tell_cost(prepared, scene, world, &report->choice.among[0]);
}

/* Nothing was found out yet. */
static void begin(struct report_choice *choice) {
    static const struct report_candidate unknown = {
        .able = true,
        .expected_ms = NAN,
        .outlines = NAN,
        .fragments = NAN,
        .steps = NAN,
        .measured_ms = NAN,
        .error = NAN,
    };
    *choice = (struct report_choice){.by = REPORT_CHOICE_ONLY, .count = CANDIDATES};
    for (size_t i = 0; i < CANDIDATES; i++) {
        choice->among[i] = unknown;
        snprintf(choice->among[i].path, sizeof choice->among[i].path, "%s", candidates[i]->name);
    }
}

enum status choice_decide(struct prepared *prepared, struct scene *scene, const struct view *world,
                          bool may_walk, struct report *report, struct error *err) {
    struct report_choice *choice = &report->choice;
    bool drawn = false;
    for (size_t i = 0; i < prepared->object_count; i++)
        drawn |= path_object_drawn(&prepared->objects[i]);
    begin(choice);
    if (!drawn) {
        snprintf(choice->why, sizeof choice->why, "no shell holds anything");
        set_path(scene, candidates[0]);
        return STATUS_OK;
    }
    struct error refused = {0};
    size_t able = 0;
    enum status last = STATUS_OK;
    for (size_t i = 0; i < CANDIDATES; i++) {
        struct report_candidate *candidate = &choice->among[i];
        error_clear(&refused);
        enum status status = try_path(candidates[i], prepared, scene, may_walk, &refused);
        if (status == STATUS_OK) {
            tell_cost(prepared, scene, world, candidate);
            choice->chosen = i;
            able++;
            continue;
        }
        last = status;
        candidate->able = false;
        tell_refused(candidate, &refused);
        if (status == STATUS_OUT_OF_MEMORY)
            break;
    }
    if (able == 0 || last == STATUS_OUT_OF_MEMORY) {
        choice->by = REPORT_CHOICE_NONE;
        error_move(err, &refused);
        return last;
    }
    error_clear(&refused);
    if (able == 1) {
        snprintf(choice->why, sizeof choice->why, "no other path can draw this scene");
    } else {
        choice->by = REPORT_CHOICE_MODEL;
        decide(choice);
    }
    set_path(scene, candidates[choice->chosen]);
    return STATUS_OK;
}

void choice_set(struct scene *scene, struct report *report, const struct path *path) {
    for (size_t i = 0; i < CANDIDATES; i++)
        if (candidates[i] == path)
            report->choice.chosen = i;
    set_path(scene, path);
}

const struct path *choice_other(const struct report *report) {
    const struct report_choice *choice = &report->choice;
    for (size_t i = 0; i < CANDIDATES && choice->by != REPORT_CHOICE_NONE; i++)
        if (i != choice->chosen && choice->among[i].able)
            return candidates[i];
    return NULL;
}
