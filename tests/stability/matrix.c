/* Prints the stability matrix (matrix.h): progress to stderr, a Markdown table to stdout, JSON to a
 * file. Exits 1 where a cell is WRONG, and names it.
 *
 *   matrix [--quick] [--group NAME] [--case PART-OF-NAME] [--json FILE] [--pictures FOLDER] */
#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <jansson.h>

#include "renderer/gl/clock.h"
#include "tests/stability/matrix.h"

/* Longest time that one picture or its truth may take: far above what any takes (seconds), so that
 * only what hangs is stopped by it. */
enum { CELL_SECONDS_MAX = 240 };

static char now[160]; /* what is being drawn, for the signal handler */
static size_t now_length;

static void hang(int number) {
    (void)number;
    static const char text[] = "HANGS: ";
    ssize_t ignored = write(2, text, sizeof text - 1);
    ignored = write(2, now, now_length);
    (void)ignored;
    _exit(1);
}

static void watch(const struct matrix_case *of, const char *path) {
    now_length = (size_t)snprintf(now, sizeof now, "%s: %s: %s\n", of->group, of->name, path);
    alarm(CELL_SECONDS_MAX);
}

void matrix_add(struct matrix *matrix, struct matrix_case made, const char *format, ...) {
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    int length = vsnprintf(NULL, 0, format, args);
    va_end(args);
    made.scene = malloc((size_t)length + 1);
    if (matrix->count == matrix->capacity) {
        matrix->capacity = 2 * matrix->capacity + 64;
        matrix->cases = realloc(matrix->cases, matrix->capacity * sizeof *matrix->cases);
    }
    if (!made.scene || !matrix->cases)
        abort();
    vsnprintf(made.scene, (size_t)length + 1, format, again);
    va_end(again);
    for (char *c = made.scene; *c; c++)
        if (*c == '\'')
            *c = '"';
    matrix->cases[matrix->count++] = made;
}

struct options {
    bool quick;
    const char *group, *part, *json;
};

static bool wanted(const struct matrix_case *of, const struct options *options) {
    return (!options->quick || of->quick) &&
           (!options->group || strcmp(of->group, options->group) == 0) &&
           (!options->part || strstr(of->name, options->part));
}

static void number(json_t *object, const char *name, double value) {
    if (isfinite(value))
        json_object_set_new(object, name, json_real(value));
}

static json_t *cell_json(const struct matrix_path *path, const struct matrix_cell *cell) {
    json_t *object =
        json_pack("{s:s, s:s}", "path", path->name, "verdict", matrix_verdicts[cell->verdict]);
    if (*cell->reason)
        json_object_set_new(object, "reason", json_string(cell->reason));
    number(object, "figure", cell->figure);
    number(object, "rmse", cell->rmse);
    number(object, "max_abs", cell->max);
    number(object, "model", cell->model);
    number(object, "discretisation", cell->discretisation);
    if (isfinite(cell->rmse)) {
        json_object_set_new(object, "pixels", json_integer((json_int_t)cell->pixels));
        json_object_set_new(object, "coverage", json_integer((json_int_t)cell->coverage));
    }
    return object;
}

static json_t *case_json(const struct matrix_case *of, json_t *cells) {
    return json_pack("{s:s, s:s, s:{s:s, s:f, s:f, s:s}, s:o}", "group", of->group, "case",
                     of->name, "bound", "kind", of->bound == BOUND_DEPTH ? "optical depth" : "rmse",
                     "most", of->most, "most_max", of->most_max, "why", of->why, "cells", cells);
}

/* 3.1e-06, but nothing where there is no number. */
static void print_number(double value) {
    if (isfinite(value))
        printf("%.1e", value);
}

static void print_cell(const struct matrix_cell *cell) {
    printf(" %s%s%s |",
           cell->verdict == VERDICT_WRONG ? "**WRONG**" : matrix_verdicts[cell->verdict],
           *cell->reason ? ": " : "", cell->reason);
    printf(" ");
    print_number(cell->figure);
    printf(" | ");
    print_number(cell->max);
    printf(" | ");
    if (isfinite(cell->rmse))
        printf("%zu/%zu", cell->coverage, cell->pixels);
    printf(" | ");
    print_number(cell->model);
    printf(" | ");
    print_number(cell->discretisation);
    printf(" |\n");
}

/* Cells by path and verdict. */
static unsigned tally[8][4];

static void print_tally(void) {
    printf("\n| path | right | refused | warned | WRONG |\n|---|---|---|---|---|\n");
    for (size_t p = 0; matrix_paths[p].name; p++)
        printf("| %s | %u | %u | %u | %u |\n", matrix_paths[p].name, tally[p][VERDICT_RIGHT],
               tally[p][VERDICT_REFUSED], tally[p][VERDICT_WARNED], tally[p][VERDICT_WRONG]);
}

/* Draws one case by every path; counts what is wrong. */
static int draw_case(struct renderer *renderer, const struct matrix_case *of, bool quick,
                     json_t *rows) {
    char reason[256];
    int wrong = 0;
    double started = clock_now_ms();
    watch(of, "reference");
    struct matrix_truth *truth = matrix_truth_make(of, reason);
    json_t *cells = json_array();
    for (const struct matrix_path *path = matrix_paths; path->name; path++) {
        struct matrix_cell cell = {.verdict = VERDICT_WRONG,
                                   .figure = NAN,
                                   .rmse = NAN,
                                   .max = NAN,
                                   .model = NAN,
                                   .discretisation = NAN};
        /* What is chosen where both orders are possible is one of the two already drawn. */
        if (quick && path->path == SCENE_PATH_AUTO && !of->may_refuse)
            continue;
        watch(of, path->name);
        if (truth)
            matrix_draw(renderer, truth, path, !quick, &cell);
        else
            snprintf(cell.reason, sizeof cell.reason, "the reference: %.200s", reason);
        wrong += cell.verdict == VERDICT_WRONG;
        tally[path - matrix_paths][cell.verdict]++;
        if (cell.verdict == VERDICT_WRONG)
            fprintf(stderr, "WRONG: %s: %s: %s: %.3g > %.3g, %s\n", of->group, of->name, path->name,
                    cell.figure, of->most, cell.reason);
        printf("| %s | %s | %s%.1e | %s |", of->group, of->name,
               of->bound == BOUND_DEPTH ? "depth " : "", of->most, path->name);
        print_cell(&cell);
        json_array_append_new(cells, cell_json(path, &cell));
    }
    json_array_append_new(rows, case_json(of, cells));
    fprintf(stderr, "%-10s %-44s truth %5.0f ms, all %5.0f ms%s\n", of->group, of->name,
            truth ? matrix_truth_ms(truth) : 0.0, clock_now_ms() - started,
            truth && matrix_truth_unresolved(truth) ? ", truth unresolved in places" : "");
    matrix_truth_free(truth);
    fflush(stdout);
    return wrong;
}

static bool read_options(int argc, char **argv, struct options *options) {
    for (int i = 1; i < argc; i++) {
        const char *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (strcmp(argv[i], "--quick") == 0) {
            options->quick = true;
            continue;
        }
        if (!value)
            return false;
        if (strcmp(argv[i], "--group") == 0)
            options->group = value;
        else if (strcmp(argv[i], "--case") == 0)
            options->part = value;
        else if (strcmp(argv[i], "--json") == 0)
            options->json = value;
        else if (strcmp(argv[i], "--pictures") == 0)
            matrix_set_pictures(value);
        else
            return false;
        i++;
    }
    return true;
}

int main(int argc, char **argv) {
    struct options options = {0};
    if (!read_options(argc, argv, &options)) {
        fprintf(stderr, "usage: matrix [--quick] [--group NAME] [--case PART] [--json FILE] "
                        "[--pictures FOLDER]\n");
        return 2;
    }
    struct matrix matrix = {0};
    matrix_stiff(&matrix);
    matrix_geometry(&matrix);
    matrix_camera(&matrix);
    matrix_order(&matrix);
    matrix_material(&matrix);
    matrix_light(&matrix);
    matrix_filter(&matrix);
    struct renderer *renderer = NULL;
    struct error err = {0};
    struct renderer_options how = {.device = -1};
    if (renderer_create(&how, &renderer, &err) != STATUS_OK) {
        fprintf(stderr, "%s\n", err.fault_count ? err.faults[0].message : "no renderer");
        return 1;
    }
    signal(SIGALRM, hang);
    json_t *rows = json_array();
    int wrong = 0;
    size_t drawn = 0;
    printf("| group | case | held to | path | verdict | error | largest | coverage | model | "
           "discretisation |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (size_t i = 0; i < matrix.count; i++)
        if (wanted(&matrix.cases[i], &options)) {
            wrong += draw_case(renderer, &matrix.cases[i], options.quick, rows);
            drawn++;
        }
    alarm(0);
    print_tally();
    fprintf(stderr, "%zu cases, %d cells wrong\n", drawn, wrong);
    json_t *all = json_pack("{s:i, s:i, s:o}", "cases", (int)drawn, "wrong", wrong, "rows", rows);
    bool written = !options.json || json_dump_file(all, options.json, JSON_INDENT(1)) == 0;
    if (!written)
        fprintf(stderr, "cannot write %s\n", options.json);
    json_decref(all);
    renderer_destroy(renderer);
    for (size_t i = 0; i < matrix.count; i++)
        free(matrix.cases[i].scene);
    free(matrix.cases);
    return wrong || drawn == 0 || !written;
}
