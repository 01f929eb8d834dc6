/* The simplified A-buffer of SXMPVO: at every sample of the picture, which boundary faces the ray
 * meets, in order; read out as "this tetrahedron is left before that one is entered". */
#ifndef PELT_RENDERER_SHELL_ABUFFER_H
#define PELT_RENDERER_SHELL_ABUFFER_H

#include <stdint.h>

#include "api/status.h"
#include "renderer/shell/project.h"

/* front[i] is left before back[i] is entered. Pairs may repeat. */
struct relations {
    uint32_t *front, *back;
    uint64_t count, capacity;
};
void relations_finish(struct relations *relations);

struct abuffer; /* grows as it is drawn to */
struct abuffer *abuffer_create(int width, int height);
void abuffer_destroy(struct abuffer *buffer); /* takes NULL */

/* Draws a boundary face of node `node` (at most 2^31); `enters`: a ray through it enters the node.
 * STATUS_OUT_OF_MEMORY. */
enum status abuffer_draw(struct abuffer *buffer, const struct projection *projection,
                         const uint32_t vertex[3], uint32_t node, bool enters, struct error *err);

uint64_t abuffer_fragments(const struct abuffer *buffer);

/* Sets met[sample], bottom row first, to 1 where any face was drawn; leaves the others. */
void abuffer_mark(const struct abuffer *buffer, uint8_t *met);

enum status abuffer_relations(struct abuffer *buffer, struct relations *relations,
                              struct error *err);

/* For each sample, bottom row first, the nodes that its ray enters, nearest first: those of sample
 * i are entry[first[i]] to entry[first[i + 1] - 1]. Both malloc'ed, the caller's. Exits are left
 * out. STATUS_OUT_OF_MEMORY. */
enum status abuffer_entries(struct abuffer *buffer, uint32_t **first, uint32_t **entry,
                            struct error *err);

#endif
