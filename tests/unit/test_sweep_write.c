/* What is written of a sweep: CSV by its rules, a page that nothing in a scene can break, colours
 * that are where the scale says. JSON is held to its schema by tests/property/test_documents.py. */
#include <math.h>
#include <stdlib.h>

#include "service/sweep_axis.h"
#include "service/sweep_page.h"
#include "service/sweep_picture.h"
#include "service/sweep_write.h"
#include "tests/support.h"
#include "tests/sweep_fixture.h"

static char *written(void (*write)(FILE *out, const char *text), const char *text) {
    char *result = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&result, &bytes);
    assert_non_null(out);
    write(out, text);
    assert_int_equal(fclose(out), 0);
    return result;
}

static void assert_written(void (*write)(FILE *out, const char *text), const char *text,
                           const char *expected) {
    char *result = written(write, text);
    assert_string_equal(result, expected);
    free(result);
}

static void csv_fields_are_quoted(void **state) {
    (void)state;
    assert_written(sweep_csv_field, "plain text", "plain text");
    assert_written(sweep_csv_field, "", "");
    assert_written(sweep_csv_field, "a,b", "\"a,b\"");
    assert_written(sweep_csv_field, "say \"no\"", "\"say \"\"no\"\"\"");
    assert_written(sweep_csv_field, "two\nlines", "\"two\nlines\"");
    assert_written(sweep_csv_field, " edge", "\" edge\"");
    assert_written(sweep_csv_field, "edge ", "\"edge \"");
}

static void html_is_escaped(void **state) {
    (void)state;
    assert_written(sweep_escape, "<a href=\"x\">&'</a>",
                   "&#60;a href=&#34;x&#34;&#62;&#38;&#39;&#60;/a&#62;");
    assert_written(sweep_escape, "fünf\tMücken\n", "fünf\tMücken\n");
    assert_written(sweep_escape, "\x01\x7f|\xff|\xc3",
                   "\xEF\xBF\xBD\xEF\xBF\xBD|\xEF\xBF\xBD|"
                   "\xEF\xBF\xBD");
}

static void put_figure(FILE *out, const char *text) {
    sweep_figure(out, strtod(text, NULL));
}

static void put_time(FILE *out, const char *text) {
    sweep_time(out, strtod(text, NULL));
}

static void figures_have_three_digits(void **state) {
    (void)state;
    assert_written(put_figure, "0", "0");
    assert_written(put_figure, "0.0583219", "5.83e-2");
    assert_written(put_figure, "0.13", "0.130");
    assert_written(put_figure, "9.999", "10.0");
    assert_written(put_figure, "123.4", "123");
    assert_written(put_figure, "999.7", "1000");
    assert_written(put_figure, "123456", "123456");
    assert_written(put_figure, "9.999e-5", "1.00e-4");
    assert_written(put_figure, "1e-9", "1.00e-9");
    assert_written(put_figure, "-2.5e7", "-2.50e7");
    assert_written(put_figure, "nan", "–");
    assert_written(put_figure, "inf", "–");
    assert_written(put_time, "0.0104", "0.010");
    assert_written(put_time, "9.996", "10.0");
    assert_written(put_time, "1664.5", "1664");
}

static size_t count_of(const char *text, const char *part) {
    size_t count = 0;
    for (const char *at = text; (at = strstr(at, part)) != NULL; at += strlen(part))
        count++;
    return count;
}

/* Fields of the line that begins at `at`, quotes understood; *next is the next line. */
static size_t count_fields(const char *at, const char **next) {
    size_t count = 1;
    bool quoted = false;
    for (; *at && (quoted || strncmp(at, "\r\n", 2) != 0); at++) {
        quoted ^= *at == '"';
        count += !quoted && *at == ',';
    }
    *next = *at ? at + 2 : at;
    return count;
}

static void csv_is_rectangular(void **state) {
    (void)state;
    static struct sweep_fixture fixture;
    for (int sampled = 0; sampled < 2; sampled++) {
        sweep_fixture_make(&fixture, sampled);
        char *csv = sweep_csv(&fixture.sweep);
        assert_non_null(csv);
        const char *line = csv;
        size_t columns = count_fields(line, &line), rows = 0;
        for (; *line; rows++)
            assert_int_equal(count_fields(line, &line), columns);
        assert_int_equal(rows, 6);
        assert_non_null(strstr(csv, "\ntetra-walk,tetra,samples,4,,20,18,25,10,8,12,200,1,0.04,"));
        assert_non_null(strstr(csv, "\ntetra-walk,tetra,samples,16,\"/image: too much, "
                                    "\"\"really\"\"\",,,"));
        assert_null(strstr(csv, "nan"));
        assert_null(strstr(csv, "inf"));
        free(csv);
    }
}

static void page_is_self_contained(void **state) {
    (void)state;
    static struct sweep_fixture fixture;
    for (int sampled = 0; sampled < 2; sampled++) {
        sweep_fixture_make(&fixture, sampled);
        char *page = sweep_html(&fixture.sweep, "<i>\"scene\"</i>.json");
        assert_non_null(page);
        static const char *const never[] = {"{{",    "}}",      "http:",     "https:",  "<script",
                                            "<link", "@import", "<b>&\\",    "</pre><", "<i>",
                                            "nan",   "inf\"",   "<several>", "<0>",     "/usr"};
        for (size_t i = 0; i < sizeof never / sizeof *never; i++)
            if (strstr(page, never[i]))
                fail_msg("the page holds %s: %.200s", never[i], strstr(page, never[i]));
        assert_int_equal(count_of(page, "<svg"), count_of(page, "</svg>"));
        assert_int_equal(count_of(page, "<g>"), count_of(page, "</g>"));
        assert_int_equal(count_of(page, "<tr"), count_of(page, "</tr>"));
        assert_int_equal(count_of(page, "<figure"), count_of(page, "</figure>"));
        /* The reference, and three views of each point; else the pictures alone. */
        assert_int_equal(count_of(page, "<img "), sampled ? 2 : 7);
        assert_int_equal(count_of(page, " src="), count_of(page, "src=\"data:image/png;base64,"));
        assert_non_null(strstr(
            page,
            "order of convergence <b>1.75 &plusmn; 0.11</b> (3 points; 1.90 by the finest two)"));
        assert_non_null(strstr(page, "not drawn: /objects/0/quality/order: cannot walk: "
                                     "&#60;several&#62;, &#38; more"));
        assert_true((strstr(page, "one at random in each") != NULL) == sampled);
        free(page);
    }
}

/* Nothing drawn but zeros, one point, a huge range: the axes survive. */
static void charts_survive_extremes(void **state) {
    (void)state;
    static struct sweep_fixture fixture;
    static const double extremes[][2] = {{0, 0}, {1e-30, 1e-30}, {1e30, 1e-30}, {1, 1}};
    for (size_t i = 0; i < sizeof extremes / sizeof *extremes; i++) {
        sweep_fixture_make(&fixture, false);
        for (int n = 0; n < 2; n++) {
            fixture.points[0][n].total_ms =
                (struct sweep_spread){extremes[i][n], extremes[i][n], extremes[i][n]};
            fixture.points[0][n].error.touched.rmse = extremes[i][n];
            fixture.points[0][n].discretisation.rmse = extremes[i][n];
        }
        fixture.series[0].model.rmse = extremes[i][0];
        fixture.series[0].limit_quality = 8; /* the fitted power ends there */
        char *text = NULL;
        size_t bytes = 0;
        FILE *out = open_memstream(&text, &bytes);
        assert_non_null(out);
        sweep_chart_time(out, &fixture.sweep);
        sweep_chart_order(out, &fixture.sweep);
        assert_int_equal(fclose(out), 0);
        assert_null(strstr(text, "nan"));
        assert_null(strstr(text, "inf"));
        assert_int_equal(count_of(text, "<g>"), 4);
        assert_true(count_of(text, "<text") < 60);
        free(text);
    }
}

/* A label that would touch the one before it is left out; none leaves the chart. */
static void labels_do_not_touch(void **state) {
    (void)state;
    char *text = NULL;
    size_t bytes = 0;
    double taken = 0;
    FILE *out = open_memstream(&text, &bytes);
    assert_non_null(out);
    axis_label_x(out, 100, "A", &taken);
    axis_label_x(out, 110, "B", &taken);
    axis_label_x(out, 200, "C", &taken);
    axis_label_x(out, CHART_WIDTH, "10000", &taken);
    assert_int_equal(fclose(out), 0);
    assert_int_equal(count_of(text, "<text"), 3);
    assert_null(strstr(text, ">B<"));
    assert_true(taken <= CHART_WIDTH);
    free(text);
}

static void colours_follow_the_scale(void **state) {
    (void)state;
    double low[3], high[3], before = -1;
    sweep_colour(0, low);
    sweep_colour(1, high);
    assert_true(low[0] == 0 && low[2] == 4 && high[0] == 252 && high[2] == 191);
    double out_of_range[3];
    sweep_colour(INFINITY, out_of_range);
    assert_memory_equal(out_of_range, high, sizeof high);
    sweep_colour(-INFINITY, out_of_range);
    assert_memory_equal(out_of_range, low, sizeof low);
    sweep_colour(NAN, out_of_range);
    assert_memory_equal(out_of_range, low, sizeof low);
    /* In grey it rises: luma of Rec. 709. */
    for (int i = 0; i <= 64; i++) {
        double c[3];
        sweep_colour(i / 64.0, c);
        double luma = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        assert_true(luma > before);
        before = luma;
    }
}

static void pictures_are_reduced(void **state) {
    (void)state;
    static struct sweep_fixture fixture;
    int width, height;
    sweep_fixture_make(&fixture, false);
    struct sweep_point *point = &fixture.points[0][1];
    for (int p = 0; p < SWEEP_FIXTURE_PIXELS; p++)
        point->pixels[4 * p] = (float)p;
    float *pixels = sweep_picture(&fixture.sweep, point, SWEEP_VIEW_PICTURE, 0, &width, &height);
    assert_true(width == 6 && height == 4);
    assert_memory_equal(pixels, point->pixels, sizeof fixture.pixels[1]);
    free(pixels);
    /* By 4: blocks of 4 x 4 and, at the edge, 2 x 4. */
    pixels = sweep_picture(&fixture.sweep, point, SWEEP_VIEW_PICTURE, 2, &width, &height);
    assert_true(width == 2 && height == 2);
    assert_float_equal(pixels[0], (0 + 1 + 2 + 6 + 7 + 8 + 12 + 13 + 14) / 9.0, 1e-5);
    free(pixels);
    /* Differences of 1e-4 and 1 in every channel are the ends of the scale, 1e-2 its middle. */
    static const double differences[] = {1e-4, 1e-2, 1};
    for (int i = 0; i < 3; i++) {
        double colour[3];
        for (int k = 0; k < 4 * SWEEP_FIXTURE_PIXELS; k++)
            point->pixels[k] = (float)differences[i];
        pixels = sweep_picture(&fixture.sweep, point, SWEEP_VIEW_DIFFERENCE, 0, &width, &height);
        sweep_colour(i / 2.0, colour);
        double code = colour[0] / 255;
        double linear = code <= 0.04045 ? code / 12.92 : pow((code + 0.055) / 1.055, 2.4);
        assert_float_equal(pixels[0], linear, 1e-5);
        assert_float_equal(pixels[3], 1, 0);
        free(pixels);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(csv_fields_are_quoted),     cmocka_unit_test(html_is_escaped),
        cmocka_unit_test(figures_have_three_digits), cmocka_unit_test(csv_is_rectangular),
        cmocka_unit_test(page_is_self_contained),    cmocka_unit_test(charts_survive_extremes),
        cmocka_unit_test(labels_do_not_touch),       cmocka_unit_test(colours_follow_the_scale),
        cmocka_unit_test(pictures_are_reduced),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
