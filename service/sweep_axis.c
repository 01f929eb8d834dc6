/* Logarithmic axes: where a value lies, which lines are drawn, and which labels there is room for.
 */
#include "service/sweep_axis.h"

#include <math.h>
#include <stdlib.h>

double axis_place(const struct axis *axis, double value) {
    double at = (log10(value) - axis->low) / (axis->high - axis->low);
    return axis->from + fmin(fmax(at, 0), 1) * (axis->to - axis->from);
}

void axis_include(struct axis *axis, double value) {
    if (!(value > 0) || !isfinite(value))
        return;
    axis->low = fmin(axis->low, log10(value));
    axis->high = fmax(axis->high, log10(value));
}

void axis_widen(struct axis *axis) {
    if (!(axis->low <= axis->high))
        axis->low = axis->high = 0;
    double room = fmax(0.07 * (axis->high - axis->low), 0.08);
    axis->low -= room;
    axis->high += room;
}

/* "200", "0.02", "5·10⁻⁴". */
static void label_text(double digits, int exponent, char text[LABEL_BYTES]) {
    static const char *const superscripts[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    if (exponent >= -3 && exponent <= 4) {
        snprintf(text, LABEL_BYTES, "%.5g", digits * pow(10, exponent));
        return;
    }
    char factor[16] = "";
    if (digits > 1)
        snprintf(factor, sizeof factor, "%g·", digits);
    int size = abs(exponent);
    snprintf(text, LABEL_BYTES, "%s10%s%s%s%s", factor, exponent < 0 ? "⁻" : "",
             size >= 100 ? superscripts[size / 100 % 10] : "",
             size >= 10 ? superscripts[size / 10 % 10] : "", superscripts[size % 10]);
}

/* What may be labelled within each decade, from coarse to fine: the first that gives three labels
 * is taken. Ends with 0. */
static const double label_sets[][12] = {
    {1},
    {1, 2, 5},
    {1, 2, 3, 4, 6, 8},
    {1, 1.2, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 8},
    {1, 1.2, 1.4, 1.6, 1.8, 2, 2.2, 2.5, 2.8, 3.1, 3.5},
};
enum { LABEL_SETS = sizeof label_sets / sizeof *label_sets };

static bool on_axis(const struct axis *axis, double digits, int exponent) {
    double at = exponent + log10(digits);
    return at >= axis->low && at <= axis->high;
}

static const double *choose_labels(const struct axis *axis) {
    int first = (int)floor(axis->low), last = (int)ceil(axis->high);
    for (int set = 0; set < LABEL_SETS; set++) {
        int count = 0;
        for (int exponent = first; exponent <= last; exponent++)
            for (const double *digits = label_sets[set]; *digits > 0; digits++)
                count += on_axis(axis, *digits, exponent);
        if (count >= 3)
            return label_sets[set];
    }
    return label_sets[LABEL_SETS - 1];
}

static void draw_line_at(FILE *out, const struct axis *axis, double digits, int exponent,
                         bool horizontal) {
    double where = axis_place(axis, digits * pow(10, exponent));
    const char *kind = digits > 1 ? "grid" : "ten";
    if (horizontal)
        fprintf(out, "<path class=\"%s\" d=\"M%.1f %dV%d\"/>", kind, where, CHART_TOP,
                CHART_BOTTOM);
    else
        fprintf(out, "<path class=\"%s\" d=\"M%d %.1fH%d\"/>", kind, CHART_LEFT, where,
                CHART_RIGHT);
}

/* Half of what a label may take across, at the size of text on the smallest screens. */
static double half_width(const char *text) {
    enum { CHARACTER = 14 };
    double count = 0;
    for (; *text; text++)
        count += ((unsigned char)*text & 0xc0) != 0x80; /* bytes that begin a character */
    return count * CHARACTER / 2;
}

void axis_label_x(FILE *out, double where, const char *text, double *taken) {
    double half = half_width(text), at = fmin(where, CHART_WIDTH - 2 - half);
    if (at - half < *taken)
        return;
    *taken = at + half;
    fprintf(out, "<text x=\"%.1f\" y=\"%d\" text-anchor=\"middle\">%s</text>\n", at,
            CHART_BOTTOM + 24, text);
}

static void draw_label_y(FILE *out, double where, const char *text) {
    fprintf(out, "<text x=\"%d\" y=\"%.1f\" dy=\"0.35em\" text-anchor=\"end\">%s</text>\n",
            CHART_LEFT - 7, where, text);
}

void axis_grid(FILE *out, const struct axis *axis, bool horizontal) {
    int first = (int)floor(axis->low), last = (int)ceil(axis->high);
    int fine = axis->high - axis->low > 6 ? 1 : 9;
    for (int exponent = first; exponent <= last; exponent++)
        for (int digit = 1; digit <= fine; digit++)
            if (on_axis(axis, digit, exponent))
                draw_line_at(out, axis, digit, exponent, horizontal);
    fputc('\n', out);
}

void axis_labels(FILE *out, const struct axis *axis, bool horizontal) {
    int first = (int)floor(axis->low), last = (int)ceil(axis->high);
    const double *labels = choose_labels(axis);
    int every = last - first > 12 ? (last - first) / 6 : 1;
    double taken = 0;
    for (int exponent = first; exponent <= last; exponent++)
        for (const double *digits = labels; *digits > 0 && exponent % every == 0; digits++) {
            char text[LABEL_BYTES];
            if (!on_axis(axis, *digits, exponent))
                continue;
            double where = axis_place(axis, *digits * pow(10, exponent));
            label_text(*digits, exponent, text);
            if (horizontal)
                axis_label_x(out, where, text, &taken);
            else
                draw_label_y(out, where, text);
        }
}
