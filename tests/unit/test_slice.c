/* The polygons in which planes cut prisms: all 27 cases of the paper, the same seen from behind,
 * and the 18 in which normal edges go both ways, against clipping every face of the prism by
 * itself. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "renderer/shell/slice.h"

struct point {
    double d; /* distance from the plane */
    int a, b; /* on the edge between these vertices; the same twice: a vertex */
};

/* Sutherland-Hodgman: what of a polygon lies behind the plane. Knows nothing of prisms. */
static int clip(const struct point *in, int count, struct point *out) {
    int used = 0;
    for (int i = 0; i < count; i++) {
        const struct point *p = &in[i], *q = &in[(i + 1) % count];
        if (p->d >= 0)
            out[used++] = *p;
        if ((p->d >= 0) != (q->d >= 0))
            out[used++] = (struct point){0, p->a < q->a ? p->a : q->a, p->a < q->a ? q->a : p->a};
    }
    return used;
}

/* Whether the plane's cut through one face joins two edges: they follow one another in what is left
 * of it. A side is clipped as its two triangles, split by the shell's diagonal, whose own cuts drop
 * out. */
static void joins_of_triangle(const double d[6], int a, int b, int c, int joins[15][15]) {
    struct point face[3] = {{d[a], a, a}, {d[b], b, b}, {d[c], c, c}}, left[8];
    int count = clip(face, 3, left), cut[2], cuts = 0;
    for (int i = 0; i < count; i++)
        if (left[i].a != left[i].b) {
            int low = left[i].a, high = left[i].b, e = -1;
            for (int k = 0; k < SLICE_EDGES; k++)
                if (slice_edge[k][0] == low && slice_edge[k][1] == high)
                    e = k;
            /* Diagonals get numbers past the edges. */
            cut[cuts++] = e >= 0 ? e : 9 + low * 2 + (high - 4);
        }
    assert_true(cuts == 0 || cuts == 2);
    if (cuts)
        joins[cut[0]][cut[1]] = joins[cut[1]][cut[0]] = 1;
}

static void joins_of_prism(const double d[6], int joins[15][15]) {
    memset(joins, 0, 15 * sizeof joins[0]);
    joins_of_triangle(d, 0, 1, 2, joins);
    joins_of_triangle(d, 3, 4, 5, joins);
    static const int sides[3][2] = {{0, 1}, {1, 2}, {0, 2}};
    for (int s = 0; s < 3; s++) {
        int i = sides[s][0], j = sides[s][1];
        joins_of_triangle(d, i, j, j + 3, joins);
        joins_of_triangle(d, i, i + 3, j + 3, joins);
    }
    /* A cut diagonal joins what its two triangles reach. */
    for (int g = 9; g < 15; g++) {
        int ends[2], found = 0;
        for (int e = 0; e < 9; e++)
            if (joins[g][e]) {
                assert_true(found < 2);
                ends[found++] = e;
            }
        if (found == 2)
            joins[ends[0]][ends[1]] = joins[ends[1]][ends[0]] = 1;
        else
            assert_int_equal(found, 0);
    }
}

static void check(const struct slice_case *cut, unsigned sides) {
    double d[6];
    int joins[15][15], cuts = 0;
    for (int v = 0; v < 6; v++)
        d[v] = sides >> v & 1 ? 1 : -1;
    joins_of_prism(d, joins);
    for (int e = 0; e < SLICE_EDGES; e++)
        cuts += d[slice_edge[e][0]] * d[slice_edge[e][1]] < 0;
    assert_int_equal(cut->count, cuts);
    int begin = 0, pairs = 0, expected = 0;
    for (int part = 0; part < 2; part++) {
        int end = part ? cut->count : cut->first;
        for (int i = begin; i < end; i++) {
            int a = cut->edge[i], b = cut->edge[i + 1 < end ? i + 1 : begin];
            if (!joins[a][b])
                fail_msg("sides %02x: edges %d and %d are not joined by any face", sides, a, b);
            pairs++;
        }
        assert_true(end == begin || end - begin >= 3);
        begin = end;
    }
    for (int a = 0; a < 9; a++)
        for (int b = 0; b < a; b++)
            expected += joins[a][b];
    assert_int_equal(pairs, expected);
}

static void test_all_cases(void **state) {
    (void)state;
    struct slice_case cases[SLICE_CASES];
    slice_make_cases(cases);
    int corners[10] = {0}, in_table = 0, both_ways = 0, two = 0;
    for (unsigned sides = 0; sides < SLICE_CASES; sides++) {
        check(&cases[sides], sides);
        if (slice_in_table(sides)) {
            in_table++;
            corners[cases[sides].count]++;
            assert_int_equal(cases[sides].first, cases[sides].count);
        } else {
            both_ways++;
            two += cases[sides].first < cases[sides].count;
        }
    }
    /* The paper's 27 and their 27 mirror images share the 8 that cut no normal edge. */
    assert_int_equal(in_table, 46);
    assert_int_equal(both_ways, 18);
    print_message(
        "no cut %d, triangles %d, quadrilaterals %d, pentagons %d; both ways %d, of which "
        "in two polygons %d\n",
        corners[0], corners[3], corners[4], corners[5], both_ways, two);
    assert_int_equal(corners[0] + corners[3] + corners[4] + corners[5], 46);
}

/* The paper's own figure 4, row by row: the nine pairs of classes. */
static void test_the_table(void **state) {
    (void)state;
    static const struct {
        char first, second;
        const char *edges; /* of the quadrilateral: Normal, Upper, Lower */
    } rows[] = {{'a', 'a', ""},   {'a', 'b', "U"}, {'a', 'c', "UL"},
                {'b', 'a', "NU"}, {'b', 'b', "N"}, {'b', 'c', "NL"},
                {'c', 'a', "LU"}, {'c', 'b', "L"}, {'c', 'c', ""}};
    struct slice_case cases[SLICE_CASES];
    slice_make_cases(cases);
    int seen = 0;
    for (int n = 0; n < 27; n++) {
        static const char classes[] = "abc";
        char c[3] = {classes[n % 3], classes[n / 3 % 3], classes[n / 9]};
        unsigned sides = 0;
        for (int i = 0; i < 3; i++)
            sides |= (c[i] == 'c' ? 9u : c[i] == 'b' ? 8u : 0u) << i;
        int order[9], at = 0, turn = 0;
        for (int i = 0; i < 3; i++)
            for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
                if (rows[r].first != c[i] || rows[r].second != c[(i + 1) % 3])
                    continue;
                for (const char *e = rows[r].edges; *e; e++)
                    order[at++] = (*e == 'N' ? 6 : *e == 'U' ? 3 : 0) + i;
            }
        /* The same, beginning anywhere. */
        assert_int_equal(cases[sides].count, at);
        while (turn < at && cases[sides].edge[0] != order[turn])
            turn++;
        for (int i = 0; i < at; i++)
            assert_int_equal(cases[sides].edge[i], order[(turn + i) % at]);
        seen++;
    }
    assert_int_equal(seen, 27);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_all_cases),
        cmocka_unit_test(test_the_table),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
