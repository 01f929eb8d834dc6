/* See slabs.h. */
#include "renderer/shell/slabs.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void slabs_init(struct slabs *slabs) {
    *slabs = (struct slabs){INFINITY, -INFINITY, 1};
}

void slabs_include(struct slabs *slabs, const struct projection *projection,
                   uint32_t vertex_count) {
    double low = INFINITY, high = -INFINITY;
    for (uint32_t v = 0; v < vertex_count; v++) {
        low = fmin(low, projection->clip[v][2]);
        high = fmax(high, projection->clip[v][2]);
    }
    if (!(high > 0)) /* behind the eye, or in its plane */
        return;
    slabs->low = fmin(slabs->low, fmax(low, 0));
    slabs->high = fmax(slabs->high, high);
}

double slabs_plane(const struct slabs *slabs, uint32_t k) {
    return k == slabs->count ? slabs->high
                             : slabs->low + (slabs->high - slabs->low) * k / slabs->count;
}

static uint32_t slab_of(const struct slabs *slabs, double h) {
    double k = floor((h - slabs->low) / (slabs->high - slabs->low) * slabs->count);
    return (uint32_t)fmin(fmax(k, 0), slabs->count - 1.0);
}

/* Of a cell of `group` tetrahedra; false where none of them takes part or lies in front of the eye.
 */
static bool depth_range(const struct shell *shell, const struct projection *projection,
                        const struct slabs *slabs, uint32_t group, uint32_t cell,
                        const uint8_t *wanted, double *low, double *high) {
    *low = INFINITY;
    *high = -INFINITY;
    bool takes_part = !wanted;
    for (uint32_t t = cell * group; t < (cell + 1) * group; t++) {
        takes_part = takes_part || wanted[t];
        for (int v = 0; v < 4; v++) {
            double h = projection->clip[shell->tetra[t][v]][2];
            *low = fmin(*low, h);
            *high = fmax(*high, h);
        }
    }
    return takes_part && *high > slabs->low;
}

bool slab_cell_find(const struct shell *shell, const struct projection *projection,
                    const struct slabs *slabs, uint32_t group, uint32_t cell, const uint8_t *wanted,
                    uint32_t *first, uint32_t *last) {
    double low, high;
    if (!depth_range(shell, projection, slabs, group, cell, wanted, &low, &high))
        return false;
    *first = slab_of(slabs, low);
    *last = slab_of(slabs, high);
    return true;
}

enum status slab_cells_find(struct slab_cells *cells, const struct shell *shell,
                            const struct projection *projection, const struct slabs *slabs,
                            uint32_t group, const uint8_t *wanted, bool onward, struct error *err) {
    *cells = (struct slab_cells){.onward = onward};
    uint32_t all = shell->tetra_count / group;
    size_t room = all + (size_t)1;
    uint32_t *end = calloc(slabs->count + (size_t)1, sizeof *end);
    cells->cell = malloc(room * sizeof *cells->cell);
    cells->first = malloc(room * sizeof *cells->first);
    cells->last = malloc(room * sizeof *cells->last);
    cells->active = malloc(room * sizeof *cells->active);
    if (!end || !cells->cell || !cells->first || !cells->last || !cells->active) {
        free(end);
        slab_cells_finish(cells);
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for %u cells in %u slabs",
                           all, slabs->count);
    }
    double low, high;
    /* A counting sort: end[k] becomes where the cells whose last slab is k begin. */
    for (uint32_t c = 0; c < all; c++)
        if (depth_range(shell, projection, slabs, group, c, wanted, &low, &high))
            end[onward ? slabs->count - 1 - slab_of(slabs, low) : slab_of(slabs, high)]++;
    for (uint32_t k = slabs->count; k-- > 0;) {
        uint32_t here = end[k];
        end[k] = cells->count;
        cells->count += here;
    }
    for (uint32_t c = 0; c < all; c++) {
        uint32_t first, last;
        if (!slab_cell_find(shell, projection, slabs, group, c, wanted, &first, &last))
            continue;
        uint32_t at = end[onward ? slabs->count - 1 - first : last]++;
        cells->cell[at] = c;
        cells->first[at] = first;
        cells->last[at] = last;
    }
    free(end);
    return STATUS_OK;
}

void slab_cells_finish(struct slab_cells *cells) {
    free(cells->cell);
    free(cells->first);
    free(cells->last);
    free(cells->active);
    *cells = (struct slab_cells){0};
}

void slab_cells_everywhere(struct slab_cells *cells, const struct slabs *slabs) {
    for (uint32_t i = 0; i < cells->count; i++) {
        cells->first[i] = 0;
        cells->last[i] = slabs->count - 1;
    }
}

/* Whether a cell's slabs have been left behind, and whether they have been reached. */
static bool left(const struct slab_cells *cells, uint32_t i, uint32_t k) {
    return cells->onward ? cells->last[i] < k : cells->first[i] > k;
}
static bool reached(const struct slab_cells *cells, uint32_t i, uint32_t k) {
    return cells->onward ? cells->first[i] <= k : cells->last[i] >= k;
}

void slab_cells_move(struct slab_cells *cells, uint32_t k) {
    uint32_t kept = 0;
    for (uint32_t i = 0; i < cells->active_count; i++)
        if (!left(cells, cells->active[i], k))
            cells->active[kept++] = cells->active[i];
    for (; cells->next < cells->count && reached(cells, cells->next, k); cells->next++)
        if (!left(cells, cells->next, k))
            cells->active[kept++] = cells->next;
    cells->active_count = kept;
}

/* The sample centres x + 1/2 that a convex polygon covers in the row y, as a closed range. */
static void scan_row(double outline[][2], int corners, double y, double *low, double *high) {
    *low = INFINITY;
    *high = -INFINITY;
    for (int i = 0; i < corners; i++) {
        const double *a = outline[i], *b = outline[(i + 1) % corners];
        if ((a[1] < y) == (b[1] < y))
            continue;
        double x = a[0] + (y - a[1]) * ((b[0] - a[0]) / (b[1] - a[1]));
        *low = fmin(*low, x);
        *high = fmax(*high, x);
    }
}

void slabs_mark(const struct shell *shell, const struct projection *projection, uint8_t *met) {
    const struct view *view = &projection->view;
    double outline[OUTLINE_MAX][2], low, high;
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        int corners = project_slab_outline(shell, projection, t, 0, INFINITY, outline);
        double bottom = INFINITY, top = -INFINITY;
        for (int i = 0; i < corners; i++) {
            bottom = fmin(bottom, outline[i][1]);
            top = fmax(top, outline[i][1]);
        }
        if (corners == 0)
            continue;
        int y_end = (int)fmin(view->height, ceil(top - 0.5));
        for (int y = (int)fmax(0, ceil(bottom - 0.5)); y < y_end; y++) {
            scan_row(outline, corners, y + 0.5, &low, &high);
            int x = (int)fmax(0, ceil(low - 0.5));
            int x_end = (int)fmin(view->width, floor(high - 0.5) + 1);
            if (low <= high && x < x_end)
                memset(met + (size_t)y * (size_t)view->width + x, 1, (size_t)(x_end - x));
        }
    }
}

void slabs_choose(const struct shell *shell, const struct projection *projection,
                  const uint8_t *reduced, int side, int columns, uint8_t *wanted) {
    const struct view *view = &projection->view;
    double outline[OUTLINE_MAX][2];
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        int corners = project_slab_outline(shell, projection, t, 0, INFINITY, outline);
        double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        for (int i = 0; i < corners; i++)
            for (int k = 0; k < 2; k++) {
                low[k] = fmin(low[k], outline[i][k]);
                high[k] = fmax(high[k], outline[i][k]);
            }
        wanted[t] = 0;
        if (corners == 0)
            continue;
        int x0 = (int)fmax(0, low[0]) / side, x1 = (int)fmin(view->width - 1, high[0]) / side;
        int y0 = (int)fmax(0, low[1]) / side, y1 = (int)fmin(view->height - 1, high[1]) / side;
        for (int y = y0; y <= y1 && !wanted[t]; y++)
            for (int x = x0; x <= x1 && !wanted[t]; x++)
                wanted[t] = reduced[(size_t)y * (size_t)columns + (size_t)x];
    }
}
