/* The simplified A-buffer of SXMPVO: at every sample of the picture, which boundary faces the ray
 * meets, in order; read out as "this tetrahedron is left before that one is entered". */
#ifndef PELT_RENDERER_SHELL_ABUFFER_H
#define PELT_RENDERER_SHELL_ABUFFER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "api/status.h"
#include "renderer/shell/project.h"

/* front[i] is left before back[i] is entered. Pairs may repeat. */
struct relations {
    uint32_t *front, *back;
    uint64_t count, capacity;
    uint64_t
        overlaps; /* samples on whose ray two stretches overlap, those behind opaque things too */
};
void relations_finish(struct relations *relations);

struct abuffer_fragment {
    double key;           /* grows away from the eye: -1 / H, or H where rays are parallel */
    uint32_t node_enters; /* node << 1 | enters */
    uint32_t next;        /* in the buffer: fragment index + 1; 0 ends */
};

/* The fragments of one sample, nearest first. Zeroed is empty; `fragment` is the caller's to free.
 */
struct abuffer_list {
    struct abuffer_fragment *fragment;
    size_t count, capacity;
};

struct abuffer; /* grows as it is drawn to */
struct abuffer *abuffer_create(int width, int height);
void abuffer_destroy(struct abuffer *buffer); /* takes NULL */

/* Draws a boundary face of node `node` (at most 2^31); `enters`: a ray through it enters the node.
 * STATUS_OUT_OF_MEMORY. */
enum status abuffer_draw(struct abuffer *buffer, const struct projection *projection,
                         const uint32_t vertex[3], uint32_t node, bool enters, struct error *err);

/* The rows of the buffer in ABUFFER_BANDS parts, each of which one thread at a time may draw to. */
enum { ABUFFER_BANDS = 2 };
enum status abuffer_draw_band(struct abuffer *buffer, int band, const struct projection *projection,
                              const uint32_t vertex[3], uint32_t node, bool enters,
                              struct error *err);
void abuffer_band_rows(const struct abuffer *buffer, int band, int *begin, int *end);
uint64_t abuffer_band_fragments(const struct abuffer *buffer, int band);

/* Calls work(user, band) for each band, those of large buffers at once on threads of their own, and
 * returns when all are done. */
void abuffer_for_bands(const struct abuffer *buffer, void (*work)(void *user, int band),
                       void *user);

/* From now on only samples with only[sample] != 0 are drawn to (bottom row first; NULL: all). The
 * array is read while drawing. */
void abuffer_restrict(struct abuffer *buffer, const uint8_t *only);

/* The fragments of a sample, sorted; false where memory ran out. */
bool abuffer_gather(const struct abuffer *buffer, size_t sample, struct abuffer_list *list);

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
