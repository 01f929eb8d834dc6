/* The tetra path's second way through shells: each ray walks from cell to cell, through the media
 * of the shells, or to the first solid surface. Media that overlap nothing are drawn shell by
 * shell, others by a joint walk (joint.h). */
#ifndef PELT_RENDERER_PATH_WALK_H
#define PELT_RENDERER_PATH_WALK_H

#include "renderer/path/path.h"
#include "renderer/path/prism_maps.h"

struct walk_pass; /* device tables that outlive pictures */
struct walk_pass *walk_pass_create(struct prism_maps *maps); /* borrowed; prepared by the caller */
void walk_pass_destroy(struct walk_pass *pass); /* takes NULL; the context must be current */

/* Whether rays can walk through an object's shell: where they are parallel it does not reach behind
 * the eye. Otherwise `why` (static) says what is in the way. */
bool walk_possible(const struct path_object *object, const char **why);

/* Whether an object's medium can be walked through together with those of other objects, which
 * share its ray parameter. */
bool walk_possible_with_others(const struct path_object *object, const char **why);

/* Finds where rays enter each object that is walked, medium or solid (stage sort), and brings the
 * tables to the device (stage upload). Where more media overlap than can be walked at once, sets
 * their path_object.walk to false: their cells must be sorted. Tells of overlaps in the report.
 * STATUS_NOT_IMPLEMENTED (the scene asks for such a walk), STATUS_TOO_COMPLEX,
 * STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR.
 */
enum status walk_pass_prepare(struct walk_pass *pass, struct picture *picture, struct error *err);

/* Draws the media, or the solids, of all objects that are walked, over the whole target, which is
 * bound; blending and depth test are set. */
enum status walk_pass_draw(struct walk_pass *pass, struct picture *picture, bool solid,
                           struct error *err);

#endif
