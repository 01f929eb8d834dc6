/* The tetra path's second way through media: each ray walks from cell to cell. One shell at a time.
 */
#ifndef PELT_RENDERER_PATH_WALK_H
#define PELT_RENDERER_PATH_WALK_H

#include "renderer/path/path.h"

struct walk_pass; /* device tables that outlive pictures */
struct walk_pass *walk_pass_create(void);
void walk_pass_destroy(struct walk_pass *pass); /* takes NULL; the context must be current */

/* Whether the media of these objects can be walked: one semi-transparent shell, without cells of no
 * volume, and not cut by the eye's plane where rays are parallel. Otherwise `why` (static) says
 * what is in the way. */
bool walk_possible(const struct path_object *objects, size_t count, const char **why);

/* Finds where rays enter (stage sort) and brings the tables to the device (stage upload).
 * STATUS_TOO_COMPLEX, STATUS_OUT_OF_MEMORY, STATUS_GL_ERROR. */
enum status walk_pass_prepare(struct walk_pass *pass, struct picture *picture,
                              const struct path_object *object, struct error *err);

/* Draws over the whole target, which is bound; blending is set. */
enum status walk_pass_draw(struct walk_pass *pass, struct picture *picture,
                           const struct path_object *object, struct error *err);

#endif
