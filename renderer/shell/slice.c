/* See slice.h. */
#include "renderer/shell/slice.h"

#include "shaders/interface.h"

const uint8_t slice_edge[SLICE_EDGES][2] = {{0, 1}, {1, 2}, {0, 2}, {3, 4}, {4, 5},
                                            {3, 5}, {0, 3}, {1, 4}, {2, 5}};

enum { LOWER = 0, UPPER = 3, NORMAL = 6 };

static bool behind(unsigned sides, int vertex) {
    return sides >> vertex & 1;
}

bool slice_in_table(unsigned sides) {
    bool onward = false, back = false;
    for (int i = 0; i < 3; i++) {
        onward |= !behind(sides, i) && behind(sides, i + 3);
        back |= behind(sides, i) && !behind(sides, i + 3);
    }
    return !(onward && back);
}

static void add(struct slice_case *out, int edge) {
    out->edge[out->count++] = (uint8_t)edge;
}

/* Figure 4: each pair of neighbouring normal edges, around the triangle. The quadrilateral between
 * i and i + 1 has the lower and upper edges of number i. */
static void from_table(unsigned sides, struct slice_case *out) {
    for (int i = 0; i < 3; i++)
        if (behind(sides, i) && !behind(sides, i + 3))
            sides = ~sides; /* all that are cut go this way: see the plane from behind */
    char c[3];
    for (int i = 0; i < 3; i++)
        c[i] = !behind(sides, i + 3) ? 'a' : behind(sides, i) ? 'c' : 'b';
    for (int i = 0; i < 3; i++) {
        char here = c[i], next = c[(i + 1) % 3];
        if (here == 'b')
            add(out, NORMAL + i);
        if (here == 'c' && next != 'c')
            add(out, LOWER + i);
        if ((here == 'a') != (next == 'a'))
            add(out, UPPER + i);
        if (here != 'c' && next == 'c')
            add(out, LOWER + i);
    }
    /* Begins where the first corner of the hardware's six comes to lie
     * (shaders/slices_hardware.vert), so that all three ways cut the polygon into the same
     * triangles. */
    int last = out->count ? out->edge[out->count - 1] : 0;
    if (out->count && out->edge[0] != NORMAL && (last == LOWER + 2 || last == UPPER + 2)) {
        for (int i = out->count - 1; i > 0; i--)
            out->edge[i] = out->edge[i - 1];
        out->edge[0] = (uint8_t)last;
    }
    out->first = out->count;
}

/* Which two of a face's edges a cut joins: what is reached through face `face` from a cut edge; -1:
 * the edge is not of that face. Faces 0..2 are the sides, 3 the bottom, 4 the top. */
static int across(unsigned sides, int face, int edge) {
    int around[4], count = 0;
    if (face >= 3) {
        for (int i = 0; i < 3; i++)
            around[count++] = (face == 3 ? LOWER : UPPER) + i;
    } else {
        /* In the order around the side, from the normal edge of its lower-numbered vertex, whose
         * bottom the diagonal leaves; so a diagonal cuts off edges 0, 1 and 2, 3. */
        int low = face == 2 ? 0 : face, high = face == 2 ? 2 : face + 1;
        around[count++] = NORMAL + low;
        around[count++] = UPPER + face;
        around[count++] = NORMAL + high;
        around[count++] = LOWER + face;
    }
    int cut[4], cuts = 0, at = -1;
    for (int i = 0; i < count; i++) {
        const uint8_t *ends = slice_edge[around[i]];
        if (behind(sides, ends[0]) == behind(sides, ends[1]))
            continue;
        if (around[i] == edge)
            at = cuts;
        cut[cuts++] = around[i];
    }
    /* Two cuts make one pair; of four, neighbours on the same side of the diagonal do. */
    return at < 0 ? -1 : cut[at ^ 1];
}

static void trace(unsigned sides, struct slice_case *out) {
    bool done[SLICE_EDGES] = {false};
    for (int start = 0; start < SLICE_EDGES; start++) {
        if (done[start] ||
            behind(sides, slice_edge[start][0]) == behind(sides, slice_edge[start][1]))
            continue;
        if (out->count && !out->first)
            out->first = out->count;
        int edge = start, face = -1;
        do {
            done[edge] = true;
            add(out, edge);
            /* Every edge has two faces: leave by the one not come through. */
            int next = -1;
            for (int f = 0; f < 5 && next < 0; f++)
                if (f != face && (next = across(sides, f, edge)) >= 0)
                    face = f;
            edge = next;
        } while (edge >= 0 && !done[edge]);
    }
    if (!out->first)
        out->first = out->count;
}

static int add_fans(const uint8_t *edge, int corners, uint32_t *fan) {
    int fans = 0;
    for (int begin = 1; begin + 1 < corners; begin += CUT_CORNERS - 2) {
        uint32_t edges = edge[0];
        for (int i = 1; i < CUT_CORNERS; i++) {
            int at = begin + i - 1 < corners ? begin + i - 1 : corners - 1;
            edges |= (uint32_t)edge[at] << (4 * i);
        }
        fan[fans++] = edges;
    }
    return fans;
}

/* A plane that parts six vertices cuts at most seven of the nine edges, two of each triangle's
 * three: one polygon of up to seven corners, or two of up to four. */
int slice_make_fans(const struct slice_case *cut, uint32_t fan[SLICE_FANS]) {
    int fans = add_fans(cut->edge, cut->first, fan);
    return fans + add_fans(cut->edge + cut->first, cut->count - cut->first, fan + fans);
}

void slice_make_cases(struct slice_case cases[SLICE_CASES]) {
    for (unsigned sides = 0; sides < SLICE_CASES; sides++) {
        cases[sides] = (struct slice_case){.count = 0};
        if (slice_in_table(sides))
            from_table(sides, &cases[sides]);
        else
            trace(sides, &cases[sides]);
    }
}
