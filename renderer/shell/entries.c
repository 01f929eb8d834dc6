/* See entries.h. */
#include "renderer/shell/entries.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shell/abuffer.h"
#include "renderer/shell/sort.h"

/* A cell that holds the eye, or touches it: a ray that heads out of it is handed on at once.
 * SHELL_NONE. */
static uint32_t cell_of_eye(const struct shell *shell, const double eye[3]) {
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        bool inside = true;
        for (int k = 0; k < 4 && inside; k++)
            inside = sort_eye_side(shell, eye, false, t, k) >= 0;
        if (inside)
            return t;
    }
    return SHELL_NONE;
}

enum status entries_find(const struct shell *shell, const struct projection *projection,
                         uint8_t *met, struct entries *entries, struct error *err) {
    *entries = (struct entries){.start = LINK_NONE};
    const struct view *view = &projection->view;
    double eye[3]; /* orthographic: the direction toward it */
    for (int i = 0; i < 3; i++)
        eye[i] = view->orthographic ? -view->d0[i] : view->o0[i] - view->d0[i];
    struct abuffer *buffer = abuffer_create(view->width, view->height);
    if (!buffer)
        return error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the A-buffer");
    enum status status = STATUS_OK;
    for (uint32_t t = 0; t < shell->tetra_count && status == STATUS_OK; t++)
        for (uint32_t k = 0; k < 4 && status == STATUS_OK; k++) {
            if (shell->neighbour[t][k] != SHELL_NONE ||
                sort_eye_side(shell, eye, view->orthographic, t, (int)k) >= 0)
                continue;
            uint32_t face[3];
            for (uint32_t v = 0; v < 3; v++)
                face[v] = shell->tetra[t][(k + 1 + v) & 3];
            status = abuffer_draw(buffer, projection, face, t << 2 | k, true, err);
        }
    if (status == STATUS_OK)
        status = abuffer_entries(buffer, &entries->first, &entries->entry, err);
    entries->count = abuffer_fragments(buffer);
    if (met)
        abuffer_mark(buffer, met);
    abuffer_destroy(buffer);
    if (status == STATUS_OK && projection->behind && !view->orthographic) {
        uint32_t cell = cell_of_eye(shell, eye);
        entries->start = cell == SHELL_NONE ? LINK_NONE : cell << 2;
        if (met && cell != SHELL_NONE)
            memset(met, 1, (size_t)view->width * (size_t)view->height);
    }
    return status;
}

void entries_finish(struct entries *entries) {
    free(entries->first);
    free(entries->entry);
    *entries = (struct entries){.start = LINK_NONE};
}

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

void entries_walk_cells(const struct shell *shell, float (*cell)[WALK_TEXELS][4],
                        uint32_t (*link)[4]) {
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        const float(*c)[4] = (const float(*)[4])shell->cell[t];
        double edge[3][3], g[3][3];
        const double *v0 = shell->position[shell->tetra[t][0]];
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++)
                edge[k][i] = shell->position[shell->tetra[t][k + 1]][i] - v0[i];
        for (int k = 0; k < 3; k++)
            cross(edge[(k + 1) % 3], edge[(k + 2) % 3], g[k]);
        double volume = edge[0][0] * g[0][0] + edge[0][1] * g[0][1] + edge[0][2] * g[0][2];
        double largest = 0;
        float(*out)[4] = cell[t];
        memset(out, 0, sizeof cell[t]);
        for (int i = 0; i < 3; i++)
            out[0][i] = (float)v0[i];
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) {
                double value = g[k][i] / volume;
                bool good = volume != 0 && isfinite((float)value);
                out[1 + k][i] = good ? (float)value : 0;
                largest = good ? fmax(largest, fabs(value)) : largest;
            }
        out[0][3] = c[0][3];
        out[1][3] = c[1][3];
        out[2][3] = c[2][3];
        out[3][3] = c[3][3];
        out[4][0] = c[4][3];
        out[4][1] = c[5][3];
        out[4][2] = c[6][3];
        out[4][3] = c[7][0];
        for (int i = 0; i < 3; i++)
            out[5][i] = c[7][1 + i];
        out[5][3] = largest > 0 ? (float)(1 / largest) : 1;
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t other = shell->neighbour[t][k];
            link[t][k] =
                other == SHELL_NONE ? LINK_NONE : other << 2 | shell_face_across(shell, t, k);
        }
    }
}
