/* How the media of a picture are to be walked: which shells, and folds of one shell, overlap on any
 * sample's ray, how deep, and where. Counted exactly on the samples of the picture, so that what
 * does not overlap is drawn by the plain walk and pays nothing. */
#ifndef PELT_RENDERER_SHELL_OVERLAP_H
#define PELT_RENDERER_SHELL_OVERLAP_H

#include "renderer/shell/entries.h"

enum { OVERLAP_SHELLS_MAX = 64 };

/* One semi-transparent shell, as this picture sees it. */
struct overlap_shell {
    const struct shell *shell;
    const struct projection *projection;
    bool has_base; /* its bottom is opaque: nothing behind it counts */
    bool fp64;     /* its cells must be met in doubles, which no joint walk does */
    bool solid; /* its first surface is all that counts: one plain walk does, through all stretches
                 */
};

/* One draw: a plain walk through one shell, or a joint walk through the stretches of several. */
struct overlap_draw {
    bool joint;
    uint32_t shell_count, shell[SLOTS_MAX]; /* their numbers in the list given */
    uint32_t slots[SLOTS_MAX];              /* most stretches of each over one another */

    /* Plain: entries of the samples that it draws. Joint: `first` counts from `starts` on, `entry`
     * is NULL. */
    struct entries entries;
    /* Joint: {ENTRY_WORD(number in shell[], cell << 2 | face), the ray parameter's bits}. The first
     * `starts` are cells in which the eye stands and every ray begins. */
    uint32_t (*door)[2];
    uint32_t starts;
    /* Joint: rectangles {x0, y0, x1, y1} of samples, x1 and y1 excluded, apart from one another,
     * that hold all samples which it draws. */
    uint32_t (*area)[4];
    uint32_t area_count;
};

struct overlap {
    struct overlap_draw *draw; /* back to front */
    size_t draw_count;
    uint64_t fragments;   /* boundary faces at samples */
    uint64_t samples;     /* those on whose ray something overlaps */
    uint64_t approximate; /* of these, those past what a joint walk holds: a shell that folds over
                             itself more than SLOTS_MAX times, or needs fp64, is walked one stretch
                             after another */
    bool too_many;        /* several shells need more than SLOTS_MAX slots: `draw` is empty, and
                             their cells must be sorted instead */
    int deepest;          /* most stretches over one another */
};

/* `shells`: at most OVERLAP_SHELLS_MAX, all on one sample grid. `met`: as entries_find(). The
 * caller calls overlap_finish(), also on failure. STATUS_OUT_OF_MEMORY, STATUS_TOO_COMPLEX. */
enum status overlap_find(const struct overlap_shell *shells, uint32_t count, uint8_t *met,
                         struct overlap *overlap, struct error *err);
void overlap_finish(struct overlap *overlap);

#endif
