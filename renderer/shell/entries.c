/* See entries.h. */
#include "renderer/shell/entries.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "renderer/shell/abuffer.h"
#include "renderer/shell/grow.h"
#include "renderer/shell/precision.h"
#include "renderer/shell/sort.h"

static void cross(const double a[3], const double b[3], double out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool touch_cell(const struct shell *shell, const double eye[3], double reach, uint32_t t,
                       struct eye_cell *touched) {
    *touched = (struct eye_cell){.cell = t};
    for (uint32_t k = 0; k < 4; k++) {
        const double *v[4];
        for (uint32_t i = 0; i < 4; i++)
            v[i] = shell->position[shell->tetra[t][(k + i) & 3]];
        double a[3], b[3], to_inside[3], to_eye[3], n[3];
        for (int i = 0; i < 3; i++) {
            a[i] = v[2][i] - v[1][i];
            b[i] = v[3][i] - v[1][i];
            to_inside[i] = v[0][i] - v[1][i];
            to_eye[i] = eye[i] - v[1][i];
        }
        cross(a, b, n);
        double length = sqrt(dot(n, n)) * (dot(n, to_inside) < 0 ? -1 : 1);
        double distance = dot(n, to_eye) / length;
        if (!(distance >= -reach))
            return false;
        if (distance > reach)
            continue;
        for (int i = 0; i < 3; i++)
            touched->inward[touched->count][i] = n[i] / length;
        touched->face[touched->count++] = k;
    }
    return true;
}

static bool find_touched(const struct shell *shell, const double eye[3], double reach,
                         struct eye_cells *cells) {
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        void *list = cells->list;
        if (!list_grow(&list, cells->count, 1, &cells->capacity, sizeof *cells->list))
            return false;
        cells->list = list;
        cells->count += touch_cell(shell, eye, reach, t, &cells->list[cells->count]);
    }
    return true;
}

static bool is_touched(const struct eye_cells *cells, uint32_t t, uint32_t k) {
    for (size_t i = 0; i < cells->count; i++)
        for (int f = 0; f < cells->list[i].count && cells->list[i].cell == t; f++)
            if (cells->list[i].face[f] == k)
                return true;
    return false;
}

/* The face of a touched cell through which a ray along d enters it at the eye: the one that it
 * heads away from most. `*guess` is where the last ray was found. LINK_NONE: it heads out of the
 * shell. */
static uint32_t enter_at_eye(const struct eye_cells *cells, const double d[3], size_t *guess) {
    /* Normals of unit length err by less, so of two cells that share a face one takes a ray in it.
     */
    double rounding = -1e-14 * sqrt(dot(d, d));
    for (size_t i = 0; i < cells->count; i++) {
        size_t at = (*guess + i) % cells->count;
        const struct eye_cell *touched = &cells->list[at];
        double least = INFINITY, most = -INFINITY;
        int away = 0;
        for (int f = 0; f < touched->count; f++) {
            double inward = dot(touched->inward[f], d);
            least = fmin(least, inward);
            away = inward > most ? f : away;
            most = fmax(most, inward);
        }
        if (least >= rounding) {
            *guess = at;
            return touched->cell << 2 | touched->face[away];
        }
    }
    return LINK_NONE;
}

uint32_t entries_at_eye(const struct eye_cells *cells, const struct view *view, size_t sample,
                        size_t *guess) {
    double x = 2 * ((double)(sample % (size_t)view->width) + 0.5) / view->width - 1, d[3];
    double y = 2 * ((double)(sample / (size_t)view->width) + 0.5) / view->height - 1;
    for (int i = 0; i < 3; i++)
        d[i] = view->d0[i] + x * view->du[i] + y * view->dv[i];
    return enter_at_eye(cells, d, guess);
}

/* Puts an entry at the eye before those of each sample. */
static bool begin_at_eye(const struct eye_cells *cells, const struct view *view,
                         struct entries *entries) {
    size_t samples = (size_t)view->width * (size_t)view->height, used = 0, guess = 0;
    uint32_t *entry = malloc((entries->count + samples + 1) * sizeof *entry);
    if (!entry)
        return false;
    for (size_t s = 0; s < samples; s++) {
        uint32_t begin = entries->first[s], end = entries->first[s + 1];
        entries->first[s] = (uint32_t)used;
        uint32_t at_eye = entries_at_eye(cells, view, s, &guess);
        if (at_eye != LINK_NONE)
            entry[used++] = at_eye;
        memcpy(entry + used, entries->entry + begin, (end - begin) * sizeof *entry);
        used += end - begin;
    }
    free(entries->entry);
    entries->entry = entry;
    entries->first[samples] = (uint32_t)used;
    entries->count = used;
    return true;
}

/* Relative to the shell's centre; orthographic: the direction toward it. */
static void eye_of(const struct view *view, double eye[3]) {
    for (int i = 0; i < 3; i++)
        eye[i] = view->orthographic ? -view->d0[i] : view->o0[i] - view->d0[i];
}

/* What is nearer than PROJECT_DEPTH_MIN the A-buffer does not see, so faces up to four times as far
 * count as stood on. */
bool entries_find_eye(const struct shell *shell, const struct projection *projection,
                      struct eye_cells *cells) {
    const struct view *view = &projection->view;
    *cells = (struct eye_cells){0};
    if (!projection->behind || view->orthographic)
        return true;
    double eye[3];
    eye_of(view, eye);
    double reach = 4 * PROJECT_DEPTH_MIN *
                   (sqrt(dot(view->d0, view->d0)) + sqrt(dot(view->ou, view->ou)) +
                    sqrt(dot(view->ov, view->ov)));
    if (!find_touched(shell, eye, reach, cells))
        return false;
    size_t touched = 0;
    for (size_t i = 0; i < cells->count; i++) {
        if (cells->list[i].count > 0)
            cells->list[touched++] = cells->list[i];
        else if (cells->within_count++ < EYE_WITHIN_MAX)
            cells->within[cells->within_count - 1] = cells->list[i].cell;
    }
    cells->count = cells->within_count ? 0 : touched; /* well within one: none is begun elsewhere */
    return true;
}

struct drawing {
    const struct shell *shell;
    const struct projection *projection;
    const struct eye_cells *cells;
    uint32_t first_cell;
    bool enters;
    struct abuffer *buffer;
    enum status status[ABUFFER_BANDS];
};

static void draw_band(void *user, int band) {
    struct drawing *drawing = user;
    const struct shell *shell = drawing->shell;
    const struct view *view = &drawing->projection->view;
    bool enters = drawing->enters;
    double eye[3];
    eye_of(view, eye);
    enum status *status = &drawing->status[band];
    for (uint32_t t = 0; t < shell->tetra_count && *status == STATUS_OK; t++)
        for (uint32_t k = 0; k < 4 && *status == STATUS_OK; k++) {
            if (shell->neighbour[t][k] != SHELL_NONE)
                continue;
            int side = sort_eye_side(shell, eye, view->orthographic, t, (int)k);
            if ((enters ? side >= 0 : side <= 0) || (enters && is_touched(drawing->cells, t, k)))
                continue;
            uint32_t face[3];
            for (uint32_t v = 0; v < 3; v++)
                face[v] = shell->tetra[t][(k + 1 + v) & 3];
            *status = abuffer_draw_band(drawing->buffer, band, drawing->projection, face,
                                        (drawing->first_cell + t) << 2 | k, enters, NULL);
        }
}

enum status entries_draw(const struct shell *shell, const struct projection *projection,
                         const struct eye_cells *cells, uint32_t first_cell, bool enters,
                         struct abuffer *buffer, struct error *err) {
    struct drawing drawing = {shell, projection, cells, first_cell, enters, buffer, {STATUS_OK}};
    abuffer_for_bands(buffer, draw_band, &drawing);
    for (int b = 0; b < ABUFFER_BANDS; b++)
        if (drawing.status[b] != STATUS_OK)
            return error_fault(err, drawing.status[b], NULL,
                               "no memory for the A-buffer past %llu fragments",
                               (unsigned long long)abuffer_fragments(buffer));
    return STATUS_OK;
}

enum status entries_find(const struct shell *shell, const struct projection *projection,
                         uint8_t *met, struct entries *entries, struct error *err) {
    *entries = (struct entries){.start = LINK_NONE};
    const struct view *view = &projection->view;
    struct abuffer *buffer = abuffer_create(view->width, view->height);
    struct eye_cells cells = {0};
    enum status status = STATUS_OK;
    if (!buffer || !entries_find_eye(shell, projection, &cells))
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for the A-buffer");
    entries->starts = cells.within_count;
    if (cells.within_count)
        entries->start = cells.within[0] << 2;
    if (status == STATUS_OK)
        status = entries_draw(shell, projection, &cells, 0, true, buffer, err);
    if (status == STATUS_OK) {
        status = abuffer_entries(buffer, &entries->first, &entries->entry, err);
        entries->count = abuffer_fragments(buffer);
        if (met)
            abuffer_mark(buffer, met);
        if (met && (cells.count || entries->start != LINK_NONE))
            memset(met, 1, (size_t)view->width * (size_t)view->height);
    }
    if (status == STATUS_OK && cells.count && !begin_at_eye(&cells, view, entries)) {
        entries_finish(entries);
        status = error_fault(err, STATUS_OUT_OF_MEMORY, NULL, "no memory for where rays enter");
    }
    abuffer_destroy(buffer);
    free(cells.list);
    return status;
}

void entries_finish(struct entries *entries) {
    free(entries->first);
    free(entries->entry);
    *entries = (struct entries){.start = LINK_NONE};
}

void entries_walk_cells(const struct shell *shell, float (*cell)[WALK_TEXELS][4],
                        uint32_t (*link)[4], float (*low)[LOW_TEXELS][4]) {
    for (uint32_t t = 0; t < shell->tetra_count; t++) {
        const float(*c)[4] = (const float(*)[4])shell->cell[t];
        double edge[3][3], g[3][3], whole[4][3] = {{0}};
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
        for (int i = 0; i < 3; i++) {
            out[0][i] = (float)v0[i];
            whole[0][i] = v0[i];
        }
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) {
                double value = g[k][i] / volume;
                bool good = volume != 0 && isfinite((float)value);
                out[1 + k][i] = good ? (float)value : 0;
                whole[1 + k][i] = good ? value : 0;
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
        if (low)
            precision_low(whole, low[t]);
        for (uint32_t k = 0; k < 4; k++) {
            uint32_t other = shell->neighbour[t][k];
            link[t][k] =
                other == SHELL_NONE ? LINK_NONE : other << 2 | shell_face_across(shell, t, k);
        }
    }
}
