/* Path auto: what it costs is counted right, the cheaper path is taken and the same one every time,
 * what `resolved` tells draws the same bytes, and what only drawing can tell overrules it: overlaps
 * that one path mixes wrongly, what a path cannot hold, trials for a target. */
#include "tests/support.h"

#include <math.h>
#include <stdlib.h>

#include "renderer/force.h"

static struct renderer *renderer;

static int set_up(void **state) {
    (void)state;
    renderer = support_renderer();
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    renderer_destroy(renderer);
    return 0;
}

/* What a test that fails had forced is not to fail the next one. */
static int tear_down_test(void **state) {
    (void)state;
    renderer_force(renderer, 0);
    return 0;
}

#define IMAGE(side) "{'image': {'width': " #side ", 'height': " #side ", 'samples': 1}, "
#define SHELL(mesh, material, more)                                                                \
    "{'shell': {'mesh': {" mesh "}, 'thickness': 0.15, 'material': {" material "}}" more "}"
#define MIST   "'builtin': 'homogeneous', 'extinction': 4"
#define CLOUDS "'builtin': 'clouds', 'size': [16, 16, 8]"
#define SPHERE "'shape': 'sphere', 'divisions': [24, 12]"
#define PRISM  "'shape': 'plane', 'divisions': [1, 1]"

static const char *path_of(const struct render_result *result) {
    return result->report.resolved.objects[0].path == SCENE_PATH_SLICING ? "slicing" : "tetra";
}

static const struct report_candidate *candidate(const struct report *report, const char *name) {
    for (size_t i = 0; i < report->choice.count; i++)
        if (strcmp(report->choice.among[i].path, name) == 0)
            return &report->choice.among[i];
    fail_msg("%s is not among what was chosen from", name);
    return NULL;
}

/* A picture, and what its report calls resolved, as JSON: that shares memory with the scene. */
struct drawn {
    struct render_result result;
    char *resolved;
};

static void draw(const char *text, struct drawn *drawn) {
    char *json = strdup(text);
    assert_non_null(json);
    support_quote(json);
    struct arena arena = {0};
    struct scene scene;
    struct error err = {0};
    struct asset_source assets = {.open = support_no_asset};
    enum status status = scene_read(json, strlen(json), &arena, &scene, &err);
    if (status == STATUS_OK)
        status = renderer_render(renderer, &scene, &assets, &drawn->result, &err);
    if (status != STATUS_OK)
        fail_msg("%s: %s", json, err.fault_count ? err.faults[0].message : "failed");
    drawn->resolved = scene_write(&drawn->result.report.resolved);
    assert_non_null(drawn->resolved);
    arena_free(&arena);
    error_clear(&err);
    free(json);
}

static void finish(struct drawn *drawn) {
    render_result_finish(&drawn->result);
    free(drawn->resolved);
}

static void assert_same(const struct drawn *a, const struct drawn *b) {
    assert_string_equal(a->resolved, b->resolved);
    size_t pixels = (size_t)a->result.width * (size_t)a->result.height;
    assert_memory_equal(a->result.pixels, b->result.pixels, 4 * sizeof(float) * pixels);
}

/* What `resolved` tells draws the same picture, and leaves nothing to choose. */
static void assert_resolved(const struct drawn *first) {
    struct drawn again;
    draw(first->resolved, &again);
    assert_same(first, &again);
    assert_int_equal(again.result.report.choice.by, REPORT_CHOICE_NONE);
    finish(&again);
}

/* Which path is the cheaper one, by far or nearly; and twice the same, by a renderer of its own. */
static void test_model(void **state) {
    (void)state;
    static const struct {
        const char *json, *path;
    } rows[] = {
        {IMAGE(64) "'objects': [{'shell': {'mesh': {'shape': 'sphere'}, 'material': {'builtin': "
                   "'fur'}}}]}",
         "tetra"},
        {IMAGE(48) "'objects': [" SHELL(SPHERE, CLOUDS, "") "]}", "tetra"},
        {IMAGE(48) "'objects': [" SHELL(SPHERE, MIST, "") "]}", "tetra"},
        {IMAGE(48) "'objects': [" SHELL(SPHERE, "'builtin': 'chain', 'size': [16, 16, 8]", "") "]}",
         "tetra"},
        /* A walk is made ready for every sample of the frame, slabs for a cell. */
        {IMAGE(256) "'objects': [" SHELL(PRISM, MIST, "") "]}", "slicing"},
        {IMAGE(48) "'camera': {'eye': [0, 0, 0.1], 'target': [1, 0, 0.1]}, 'objects': [" SHELL(
             SPHERE, CLOUDS, "") "]}",
         "tetra"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct drawn first, second;
        draw(rows[i].json, &first);
        const struct report_choice *choice = &first.result.report.choice;
        print_message("%s: %s\n", path_of(&first.result), choice->why);
        assert_string_equal(path_of(&first.result), rows[i].path);
        assert_int_equal(choice->by, REPORT_CHOICE_MODEL);
        assert_string_equal(choice->among[choice->chosen].path, rows[i].path);
        renderer_destroy(renderer); /* what it knows is not to matter */
        renderer = support_renderer();
        draw(rows[i].json, &second);
        assert_same(&first, &second);
        assert_resolved(&first);
        finish(&first);
        finish(&second);
    }
}

/* Nothing is chosen, and nothing costed, where the scene says it or nothing is there. */
static void test_said(void **state) {
    (void)state;
    static const struct {
        const char *json;
        enum report_choice_by by;
    } rows[] = {
        {IMAGE(16) "'objects': [" SHELL(SPHERE, CLOUDS, ", 'path': 'tetra'") "]}",
         REPORT_CHOICE_NONE},
        {IMAGE(16) "'objects': [" SHELL(SPHERE, CLOUDS, ", 'quality': {'samples': 2}") "]}",
         REPORT_CHOICE_NONE},
        {IMAGE(16) "'objects': [" SHELL(SPHERE, CLOUDS, "") ", " SHELL(
             SPHERE, CLOUDS, ", 'quality': {'slices': 5}") "]}",
         REPORT_CHOICE_NONE},
        {IMAGE(16) "'objects': [{'mesh': {" SPHERE "}}]}", REPORT_CHOICE_NONE},
        {IMAGE(16) "'objects': [" SHELL(SPHERE, "'builtin': 'homogeneous', 'extinction': 0",
                                        "") "]}",
         REPORT_CHOICE_ONLY},
        {IMAGE(16) "'objects': [" SHELL(SPHERE, CLOUDS, ", 'quality': {'map': 'affine'}") "]}",
         REPORT_CHOICE_MODEL}, /* of either path */
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct render_result result;
        assert_int_equal(support_draw(renderer, &result, "%s", rows[i].json), STATUS_OK);
        assert_int_equal(result.report.choice.by, rows[i].by);
        if (rows[i].by == REPORT_CHOICE_ONLY)
            assert_true(isnan(candidate(&result.report, "slicing")->expected_ms));
        render_result_finish(&result);
    }
}

/* What the model counts on 64 prisms, against what was drawn. Measured: outlines within 4 %,
 * fragments within 8 %. */
static void test_counts(void **state) {
    (void)state;
    static const char *const meshes[] = {SPHERE, "'shape': 'torus', 'divisions': [48, 24]",
                                         "'shape': 'terrain', 'divisions': [24, 24]", PRISM};
    renderer_force(renderer, FORCE_COST);
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        struct render_result result;
        assert_int_equal(
            support_draw(renderer, &result,
                         IMAGE(128) "'objects': [{'shell': {'mesh': {%s}, 'thickness': 0.15, "
                                    "'material': {" CLOUDS "}}, 'quality': {'slices': 100}}]}",
                         meshes[i]),
            STATUS_OK);
        const struct report_candidate *cost = &result.report.choice.among[0];
        const struct report_work *work = &result.report.work;
        double outlines = cost->outlines / (double)work->segments;
        double fragments = cost->fragments / (double)work->fragments;
        print_message("outlines %.3f, fragments %.3f of what was drawn\n", outlines, fragments);
        assert_true(fabs(outlines - 1) < 0.15 && fabs(fragments - 1) < 0.15);
        render_result_finish(&result);
    }
    renderer_force(renderer, 0);
}

/* `count` planes of mist over one another, each in a third of the last one's place. */
static void write_stack(char json[16384], int count, const char *more) {
    int at = snprintf(json, 16384, IMAGE(32) "%s'objects': [", more);
    for (int i = 0; i < count; i++)
        at += snprintf(json + at, 16384 - (size_t)at,
                       "%s{'shell': {'mesh': {'shape': 'plane', 'divisions': [2, 2]}, 'thickness': "
                       "0.3, 'material': {'builtin': 'homogeneous', 'extinction': 2, 'color': [%d, "
                       "%d, 0.5]}}, 'transform': {'translate': [0, 0, %g]}}",
                       i ? ", " : "", i % 2, i % 3 == 0, 0.04 * i);
    snprintf(json + at, 16384 - (size_t)at, "]}");
}

static void draw_stack(int count, const char *more, struct drawn *drawn) {
    char *json = malloc(16384);
    assert_non_null(json);
    write_stack(json, count, more);
    draw(json, drawn);
    free(json);
}

/* Seven shells lie over one another and five can be walked at once: sorted cells are off by 0.22,
 * slabs by 0.001 (measured). */
static void test_overlaps(void **state) {
    (void)state;
    struct drawn drawn;
    draw_stack(7, "'report': {'error': 'reference'}, ", &drawn);
    const struct report *report = &drawn.result.report;
    print_message("RMSE %.2g: %s\n", report->error.rmse, report->choice.why);
    assert_int_equal(report->choice.by, REPORT_CHOICE_PREPARE);
    assert_string_equal(path_of(&drawn.result), "slicing");
    assert_true(report->error.rmse < 0.01);
    assert_int_equal(report->warning_count, 0); /* none of the other path's */
    for (size_t i = 0; i < report->pass_count; i++)
        assert_string_not_equal(report->passes[i].name, "sort");
    assert_int_equal(report->work.sort_nodes, 0);
    assert_resolved(&drawn);
    finish(&drawn);
    /* Four can be walked, and that is exact; slabs of several colours are not, though cheaper. */
    draw_stack(4, "", &drawn);
    assert_string_equal(path_of(&drawn.result), "tetra");
    assert_int_equal(report->choice.by, REPORT_CHOICE_MODEL);
    assert_non_null(strstr(report->choice.why, "exact"));
    finish(&drawn);
}

/* What is said of shadows outlasts the path that was planned first: as many shells as above, and
 * one that is too thin for its shadow on itself. */
static void test_warnings_outlast_the_first_path(void **state) {
    (void)state;
    static const char thin[] = ", {'shell': {'mesh': {'shape': 'sphere'}, 'thickness': 1e-6, "
                               "'material': {'builtin': 'fur', 'size': [4, 4, 4]}}, 'transform': "
                               "{'translate': [9, 0, 0]}}]}";
    struct drawn drawn;
    char *json = malloc(16384);
    assert_non_null(json);
    write_stack(json, 7, "'lights': [{'shadow': true}], ");
    assert_true(strlen(json) + sizeof thin < 16384);
    memcpy(json + strlen(json) - 2, thin, sizeof thin);
    draw(json, &drawn);
    free(json);
    const struct report *report = &drawn.result.report;
    assert_int_equal(report->choice.by, REPORT_CHOICE_PREPARE);
    assert_int_equal(report->warning_count, 1);
    assert_string_equal(report->warnings[0].code, "shadow-coarse");
    assert_string_equal(report->warnings[0].pointer, "/objects/7");
    finish(&drawn);
}

/* More shells than can be sorted: the path that cannot draw them is told, the other one draws. */
static void test_refused(void **state) {
    (void)state;
    struct drawn drawn;
    draw_stack(66, "", &drawn);
    const struct report_choice *choice = &drawn.result.report.choice;
    const struct report_candidate *tetra = candidate(&drawn.result.report, "tetra");
    print_message("%s; %s\n", choice->why, tetra->why);
    assert_int_equal(choice->by, REPORT_CHOICE_PREPARE);
    assert_string_equal(path_of(&drawn.result), "slicing");
    assert_false(tetra->able);
    assert_non_null(strstr(tetra->why, "/objects"));
    assert_true(candidate(&drawn.result.report, "slicing")->able);
    finish(&drawn);
}

/* For an error that the cheaper path misses, since it mixes wrongly what overlaps; or does not
 * miss. */
static void test_trials_for_error(void **state) {
    (void)state;
    struct drawn drawn;
    draw_stack(7, "'target': {'max_error': 0.01}, ", &drawn);
    const struct report *report = &drawn.result.report;
    print_message("%s; %s\n", report->choice.why, report->target.why);
    assert_int_equal(report->choice.by, REPORT_CHOICE_TRIALS);
    assert_string_equal(path_of(&drawn.result), "slicing");
    assert_true(report->target.met);
    assert_true(candidate(report, "tetra")->error > 0.01);
    assert_true(candidate(report, "slicing")->error <= 0.01);
    assert_true(candidate(report, "slicing")->measured_ms > 0);
    assert_int_equal(report->warning_count, 0);
    assert_int_equal(report->work.sort_nodes, 0);
    finish(&drawn);

    draw_stack(7, "'target': {'max_error': 0.6}, ", &drawn);
    assert_string_equal(path_of(&drawn.result), "tetra");
    assert_true(report->target.met);
    assert_int_equal(report->warning_count, 1); /* overlap-approximate: what was drawn */
    finish(&drawn);

    /* Far apart by the model: no trial of the other. */
    draw(IMAGE(48) "'target': {'max_error': 0.05}, 'objects': [" SHELL(SPHERE, CLOUDS, "") "]}",
         &drawn);
    assert_int_equal(report->choice.by, REPORT_CHOICE_MODEL);
    assert_true(isnan(candidate(report, "slicing")->measured_ms));
    finish(&drawn);
}

/* What trials did at other qualities is not what the picture did: of a few slabs of fur trials draw
 * the nearest first, of as many as a long deadline allows the picture does not. */
static void test_trials_leave_no_rows(void **state) {
    (void)state;
    struct drawn drawn, again;
    draw(
        IMAGE(200) "'target': {'deadline_ms': 60000}, 'objects': [{'path': 'slicing', 'shell': "
                   "{'mesh': {" PRISM
                   "}, 'thickness': 0.02, 'material': {'builtin': 'fur', 'size': [32, 32, 16]}}}]}",
        &drawn);
    draw(drawn.resolved, &again);
    const struct report *report = &drawn.result.report, *other = &again.result.report;
    assert_true(report->target.trials > 0);
    assert_int_equal(report->pass_count, other->pass_count);
    for (size_t p = 0; p < other->pass_count; p++) {
        assert_string_equal(report->passes[p].name, other->passes[p].name);
        assert_string_not_equal(report->passes[p].name, "nearest-first");
    }
    finish(&drawn);
    finish(&again);
}

/* For a deadline where the model cannot tell. Which one wins is the machine's to say: here the
 * first of two scenes goes to the second path and the second to the first. Where one path alone is
 * tried, or the time is too short for trials, the model decides. */
static void test_trials_for_deadline(void **state) {
    (void)state;
    static const struct {
        const char *json;
        enum report_choice_by by;
    } rows[] = {
        {IMAGE(256) "'target': {'deadline_ms': 60000}, 'objects': [" SHELL(PRISM, MIST, "") "]}",
         REPORT_CHOICE_TRIALS},
        {IMAGE(
             200) "'target': {'deadline_ms': 60000}, 'objects': [{'shell': {'mesh': {" PRISM
                  "}, 'thickness': 0.02, 'material': {'builtin': 'fur', 'size': [32, 32, 16]}}}]}",
         REPORT_CHOICE_TRIALS},
        {IMAGE(256) "'target': {'deadline_ms': 1}, 'objects': [" SHELL(PRISM, MIST, "") "]}",
         REPORT_CHOICE_MODEL},
        {IMAGE(48) "'target': {'deadline_ms': 9000}, 'objects': [" SHELL(SPHERE, CLOUDS, "") "]}",
         REPORT_CHOICE_MODEL},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct drawn drawn, again;
        draw(rows[i].json, &drawn);
        const struct report *report = &drawn.result.report;
        print_message("%s: %s\n", path_of(&drawn.result), report->choice.why);
        assert_int_equal(report->choice.by, rows[i].by);
        bool tried = rows[i].by == REPORT_CHOICE_TRIALS;
        assert_true(isnan(candidate(report, "tetra")->measured_ms) != tried);
        assert_true(isnan(candidate(report, "slicing")->measured_ms) != tried);
        assert_string_equal(report->choice.among[report->choice.chosen].path,
                            path_of(&drawn.result));
        /* What is drawn and told is that path's alone. */
        draw(drawn.resolved, &again);
        assert_same(&drawn, &again);
        const struct report *other = &again.result.report;
        assert_int_equal(report->pass_count, other->pass_count);
        for (size_t p = 0; p < other->pass_count; p++)
            assert_string_equal(report->passes[p].name, other->passes[p].name);
        assert_int_equal(report->left_out_count, other->left_out_count);
        assert_int_equal(report->work.segments, other->work.segments);
        assert_int_equal(report->work.slices, other->work.slices);
        assert_int_equal(report->work.sort_nodes, other->work.sort_nodes);
        finish(&again);
        finish(&drawn);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(test_model, tear_down_test),
        cmocka_unit_test_teardown(test_said, tear_down_test),
        cmocka_unit_test_teardown(test_counts, tear_down_test),
        cmocka_unit_test_teardown(test_overlaps, tear_down_test),
        cmocka_unit_test_teardown(test_warnings_outlast_the_first_path, tear_down_test),
        cmocka_unit_test_teardown(test_refused, tear_down_test),
        cmocka_unit_test_teardown(test_trials_for_error, tear_down_test),
        cmocka_unit_test_teardown(test_trials_leave_no_rows, tear_down_test),
        cmocka_unit_test_teardown(test_trials_for_deadline, tear_down_test),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}
